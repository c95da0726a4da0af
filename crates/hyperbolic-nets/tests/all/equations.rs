//! Equations of a caller's own hold in the result, together with smooth joins.

#[allow(dead_code, reason = "an example has a main function")]
#[path = "../../examples/equal_edges.rs"]
mod equal_edges;

use equal_edges::{range, scene};
use geom_core::DVec3;
use gp_solver::{Closeness, Problem, Stage, Status, Variables};
use hyperbolic_nets::{Input, Options, POLISH, POSITIONS, QuadNet, solve, solve_with};

/// Largest relative difference of lengths along the curve.
fn spread(net: &QuadNet, curve: &[usize]) -> f64 {
    let [low, high] = range(net, curve);
    (high - low) / low
}

#[test]
fn edges_that_are_to_be_equal_are_equal_and_the_skin_stays_smooth() {
    let (net, curve) = scene().unwrap();
    let free = solve(&Input::new(&net), &Options::default(), &mut ()).unwrap();
    assert!(spread(free.result.net(), &curve) > 1e-2, "the constraint has something to do");
    let mut results = Vec::new();
    for by_dual in [false, true] {
        let solution = equal_edges::solve(&net, &curve, by_dual).unwrap();
        assert_eq!(solution.report.status, Status::Converged, "{:?}", solution.violation);
        assert!(spread(solution.result.net(), &curve) < 1e-11);
        assert!(solution.metrics.kink_max_deg < 1e-9 && solution.metrics.folds == 0);
        assert!(solution.metrics.deviation_max_edges < 0.3, "{:?}", solution.metrics);
        results.push(solution.result);
    }
    // Both derivatives are right, so both lead to the same net.
    for (a, b) in results[0].net().positions().iter().zip(results[1].net().positions()) {
        assert!(a.distance(*b) < 1e-9);
    }
}

#[test]
fn a_wish_is_left_out_of_the_polishing_and_the_net_is_exact() {
    let (net, curve) = scene().unwrap();
    let middle = curve[curve.len() / 2];
    let lifted = net.positions()[middle] + DVec3::Z * 0.5 * net.mesh().mean_edge_length();
    let mut stages = Vec::new();
    let mut wish = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        stages.push(stage.name.clone());
        if stage.name != POLISH {
            let positions = variables.group(POSITIONS)?;
            let (mut target, mut weights) =
                (vec![0.0; variables.len()], vec![0.0; variables.len()]);
            positions.set(&mut target, middle, stage.place(lifted.to_array()));
            let edge = stage.length(net.mesh().mean_edge_length());
            positions.set(&mut weights, middle, [10.0 / edge; 3]);
            problem.add(Closeness::new("lift", target, weights));
        }
        Ok(())
    };
    let solution = solve_with(&Input::new(&net), &Options::default(), &mut wish, &mut ()).unwrap();
    assert_eq!(stages, ["weight 10", POLISH]);
    assert_eq!(solution.report.status, Status::Converged);
    let at = |n: &QuadNet| n.positions()[middle].distance(lifted);
    assert!(at(solution.result.net()) < 0.5 * at(&net), "{}", at(solution.result.net()));
    assert!(solution.metrics.kink_max_deg < 1e-9);
}
