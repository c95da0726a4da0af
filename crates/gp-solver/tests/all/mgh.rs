//! The 35 problems of Moré, Garbow and Hillstrom 1981, default options.

use crate::problems::mgh;
use crate::problems::minpack;

#[test]
fn standard_starts_reach_the_known_minima() {
    let mut failures = Vec::new();
    for m in mgh::all() {
        let mut x = m.start(1.0);
        let report = m.problem.solve(&mut x).unwrap();
        let sum = 2.0 * report.final_energy;
        if !m.is_known_minimum(sum) {
            failures.push(format!("{}: {sum:e}, known {:?}", m.problem.name, m.minima));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn far_starts_succeed_where_minpack_publishes_success() {
    let (mut failures, all) = (Vec::new(), mgh::all());
    for run in &mgh::PUBLISHED {
        let m = all.iter().find(|m| m.problem.name == run.name).unwrap();
        let mut x = m.start(run.factor);
        let report = m.problem.solve(&mut x).unwrap();
        let sum = 2.0 * report.final_energy;
        println!("{} {}: {sum:e}, MINPACK {:e}", run.name, run.factor, run.norm * run.norm);
        // Bard's has its local minimum at infinity, where MINPACK stops; lower is no failure.
        let lower = sum < run.norm * run.norm * (1.0 - 1e-6);
        if run.succeeds && !m.is_known_minimum(sum) && !lower {
            failures.push(format!("{} {} x0: {sum:e}, known {:?}", run.name, run.factor, m.minima));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn the_port_reproduces_the_published_norms() {
    // Shows that the problems are stated as MINPACK states them.
    let all = mgh::all();
    for run in mgh::PUBLISHED.iter().filter(|run| run.succeeds) {
        let m = all.iter().find(|m| m.problem.name == run.name).unwrap();
        let (sum, _) = minpack::run(&m.problem, &m.start(run.factor));
        let bound = (2e-6 * run.norm).max(1e-8);
        assert!((sum.sqrt() - run.norm).abs() < bound, "{} {}: {sum:e}", run.name, run.factor);
    }
}

#[test]
fn no_start_panics_or_returns_nan() {
    for m in mgh::all() {
        for factor in [1.0, 10.0, 100.0] {
            let mut x = m.start(factor);
            // A start the functions overflow at is refused with the row's name.
            if let Ok(report) = m.problem.solve(&mut x) {
                assert!(report.final_energy.is_finite() && x.iter().all(|v| v.is_finite()));
                let energies: Vec<f64> = report.history.iter().map(|h| h.energy).collect();
                assert!(energies.windows(2).all(|e| e[1] <= e[0]), "{}", m.problem.name);
            }
        }
    }
}

#[test]
fn standard_starts_agree_with_the_minpack_port() {
    let mut failures = Vec::new();
    for m in mgh::all() {
        let (port, ok) = minpack::run(&m.problem, &m.start(1.0));
        let mut x = m.start(1.0);
        let sum = 2.0 * m.problem.solve(&mut x).unwrap().final_energy;
        // Where the port fails or both are at rounding level there is nothing to compare.
        if ok && (sum - port).abs() > (1e-8 * port).max(1e-16) {
            failures.push(format!("{}: {sum:e}, port {port:e}", m.problem.name));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
