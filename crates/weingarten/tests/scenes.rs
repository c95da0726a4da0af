//! The five scenes of the reference program: how Weingarten they become in how many steps.

use fixtures::surfaces::Shape;
use gp_solver::Counts;
use weingarten::{Options, Solution, solve};

const LEVELS: [(usize, usize); 4] = [(10, 8), (14, 10), (18, 14), (25, 18)];

fn counts((u, v): (usize, usize)) -> Counts {
    Counts { u, v }
}

fn steps(name: &str, iterations: usize) -> Solution {
    let scene = fixtures::reference::scene(name);
    let options =
        Options { iterations, samples: Some(counts(scene.samples)), ..Default::default() };
    report(name, solve(&scene.surface(), &options, &mut ()).expect("a surface to optimise"))
}

fn levels(shape: Shape) -> Solution {
    let options =
        Options { levels: LEVELS.into_iter().map(counts).collect(), ..Default::default() };
    report(
        shape.name(),
        solve(&shape.surface(10, 8, 4, 4), &options, &mut ()).expect("a surface to optimise"),
    )
}

/// No accepted step raises the energy it was judged by.
fn report(name: &str, result: Solution) -> Solution {
    for level in &result.report.stages {
        for record in &level.solver.history {
            assert!(record.decrease >= 0.0, "{name}: {record:?}");
        }
    }
    eprintln!(
        "{name}: {} steps, {} factorisations, {:.2} ms a step, {:?} -> {:?}",
        result.report.iterations,
        result.report.factorizations(),
        result.report.ms_per_iteration(),
        result.before,
        result.metrics,
    );
    result
}

#[test]
fn roof_in_10_and_20_steps() {
    let (ten, twenty) = (steps("roof", 10), steps("roof", 20));
    assert!(ten.metrics.diagram_area <= 0.07);
    assert!(twenty.metrics.diagram_area <= 0.045);
    assert!(ten.metrics.deviation_mean_percent <= 0.4);
}

#[test]
fn near_helical_in_10_steps() {
    assert!(steps("helical", 10).metrics.diagram_area <= 0.0065);
}

#[test]
fn tube_in_10_and_20_steps() {
    assert!(steps("tube", 10).metrics.diagram_area <= 0.11);
    assert!(steps("tube", 20).metrics.diagram_area <= 0.10);
}

#[test]
fn roof_over_four_levels() {
    let after = levels(Shape::Roof).metrics;
    assert!(after.diagram_area <= 0.002);
    assert!(after.deviation_mean_percent <= 0.8);
}

#[test]
fn saddle_over_four_levels() {
    let after = levels(Shape::Saddle).metrics;
    assert!(after.diagram_area <= 0.0005);
    assert!(after.deviation_mean_percent <= 0.65);
}

#[test]
fn eggbox_over_four_levels() {
    assert!(levels(Shape::Eggbox).metrics.diagram_area <= 0.01);
}
