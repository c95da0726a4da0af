//! NIST StRD nonlinear regression: all 27 problems, both starts, default options.
//!
//! Passed if every certified parameter is met to 4 digits, on lower and average difficulty to 6.

use crate::problems::minpack;
use crate::problems::nist::{self, Level};

#[test]
fn certified_parameters_are_met_from_both_starts() {
    let mut failures = Vec::new();
    for (name, _) in nist::MODELS {
        let set = nist::read(name);
        for start in 0..2 {
            let mut x = set.starts[start].clone();
            let report = set.problem(start).solve(&mut x).unwrap();
            let digits = nist::digits(&x, &set.certified);
            let wanted = if set.level == Level::Higher { 4.0 } else { 6.0 };
            println!("{name} {start} {digits:.2} {} {}", report.iterations, report.status);
            for pair in report.history.windows(2) {
                assert!(pair[1].energy <= pair[0].energy, "{name}: the energy rose");
            }
            if digits < wanted {
                failures.push(format!("{name} start {start}: {digits:.1} digits"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn sums_of_squares_are_those_of_the_minpack_port() {
    let mut compared = 0;
    for (name, _) in nist::MODELS {
        let set = nist::read(name);
        for start in 0..2 {
            let problem = set.problem(start);
            let (port, ok) = minpack::run(&problem, &set.starts[start]);
            let mut x = set.starts[start].clone();
            let sum = 2.0 * problem.solve(&mut x).unwrap().final_energy;
            // Where the port gives up or ends in another minimum there is nothing to compare; sums
            // below 1e-16 are rounding (Lanczos1).
            if ok && port < 1.1 * set.sum_of_squares.max(1e-16) {
                compared += 1;
                assert!((sum - port).abs() <= (1e-8 * port).max(1e-16), "{name}: {sum:e} {port:e}");
            }
        }
    }
    assert!(compared >= 48, "{compared} of 54 runs of the port succeed");
}
