//! The public blocks: derivatives, and what `solve_with` makes of blocks of one's own.

#![allow(clippy::unwrap_used, reason = "a test stops at the first fault")]

use fixtures::surfaces::Shape;
use gp_solver::{
    Closeness, Problem, Stage, Status, System, Variables, check_jacobian, solve as minimise,
};
use paneling::blocks::{Assembly, DesignRows, GapRows, KinkRows, MOLDS, POSES, ReachRows};
use paneling::{Counts, Error, MoldType, Options, Solution, problem, solve, solve_with};
use std::sync::Arc;

fn options(kind: MoldType) -> Options {
    Options {
        panels: Some(Counts { u: 4, v: 3 }),
        compare_grid: false,
        ..Options::with_molds(3, kind)
    }
}

fn solved(kind: MoldType) -> Solution {
    let surface = Shape::Saddle.surface(8, 8, 4, 4);
    solve(&surface, &options(kind), &mut ()).unwrap()
}

/// Numbers without a pattern in −1..1.
fn noise(k: usize) -> f64 {
    (12.9898 * (k as f64 + 1.0)).sin()
}

#[test]
fn derivatives_match_differences() {
    for kind in MoldType::ALL {
        let Solution { result, panels, .. } = solved(kind);
        let assembly =
            Arc::new(Assembly::new(&panels, &result.molds, &result.labels, &result.poses));
        let weights: Vec<f64> = (0..panels.seams().len()).map(|s| 1.5 + noise(s)).collect();
        let mut x = assembly.start();
        let poses = assembly.variables().group(POSES).unwrap();
        // Far from the bases, so that the rotations count.
        for p in 0..poses.len() {
            let size = if kind == MoldType::Torus { 0.01 } else { 0.04 };
            let step = std::array::from_fn(|i| size * noise(6 * p + i));
            poses.set::<6>(&mut x, p, step);
        }
        let shared = || Arc::clone(&assembly);
        for worst in [
            check_jacobian(&GapRows::new(shared(), &weights), &x).unwrap(),
            check_jacobian(&KinkRows::new(shared(), &weights), &x).unwrap(),
            check_jacobian(&DesignRows::new(shared(), 0.7), &x).unwrap(),
        ] {
            let worst = worst.unwrap();
            assert!(worst.error < 1e-6, "{kind:?}: {worst:?}");
        }
        // Beyond the reach, and turned far.
        for p in 0..poses.len() {
            let step = [2.5, -1.5, 0.2, 0.7 * noise(p), -0.9, 1.1].map(|v| v + 0.1 * noise(p));
            poses.set::<6>(&mut x, p, step);
        }
        let reach = ReachRows::new(shared());
        let worst = check_jacobian(&reach, &x).unwrap().unwrap();
        assert!(worst.error < 1e-6, "{kind:?}: {worst:?}");
    }
}

#[test]
fn the_problem_begins_where_the_seam_step_does() {
    let surface = Shape::Saddle.surface(8, 8, 4, 4);
    let options = options(MoldType::Cubic);
    let (problem, mut x) = problem(&surface, &options).unwrap();
    let names: Vec<_> = problem.blocks().map(|(_, name)| name.to_owned()).collect();
    assert_eq!(names, ["gaps", "kinks", "design", "reach"]);
    let history = solve(&surface, &options, &mut ()).unwrap().result.seam_history;
    let report = minimise(problem, &mut x, &gp_solver::Options::default()).unwrap();
    assert!((2.0 * report.initial_energy - history[0]).abs() < 1e-9 * history[0]);
    // The matrix-free steps end at 3 %: the minimum is below.
    assert!(2.0 * report.final_energy <= history[history.len() - 1]);
}

#[test]
fn an_extra_that_changes_nothing_changes_nothing() {
    let surface = Shape::Saddle.surface(8, 8, 4, 4);
    let options = options(MoldType::Cubic);
    let mut stages = Vec::new();
    let mut look = |stage: &Stage, variables: &Variables, _: &mut Problem<'_>| {
        stages.push((stage.name.clone(), variables.len()));
        Ok(())
    };
    let with = solve_with(&surface, &options, &mut look, &mut ()).unwrap();
    let without = solve(&surface, &options, &mut ()).unwrap();
    assert_eq!(with.result, without.result);
    assert_eq!(stages, [("seams".to_owned(), 6 * 12 + 7 * 3)]);
}

#[test]
fn blocks_of_ones_own_are_obeyed() {
    let surface = Shape::Saddle.surface(8, 8, 4, 4);
    let options = options(MoldType::Cubic);
    // All molds get the same coefficient of x².
    let mut same = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        let molds = variables.group(MOLDS)?;
        let (mut weights, mut wanted) = (vec![0.0; variables.len()], vec![0.0; variables.len()]);
        for m in 0..molds.len() {
            weights[molds.column(m, 0)] = 1e4;
            wanted[molds.column(m, 0)] = 0.02;
        }
        problem.add(Closeness::new("same", wanted, weights));
        Ok(())
    };
    let solution = solve_with(&surface, &options, &mut same, &mut ()).unwrap();
    assert_ne!(solution.report.status, Status::Interrupted);
    // The stage counts in panel sizes; the ratio of two molds has no unit.
    let first: Vec<f64> = solution.result.molds.iter().map(|m| m.parameters[0]).collect();
    // The seam step ends once a step gains less than 3 %, so that soft rows are met about as well.
    assert!(first.iter().all(|a| (a / first[0] - 1.0).abs() < 1e-2), "{first:?}");
    let plain = solve(&surface, &options, &mut ()).unwrap().result;
    assert!((plain.molds[1].parameters[0] / plain.molds[0].parameters[0] - 1.0).abs() > 1e-1);
    let mut refuse = |_: &Stage, variables: &Variables, _: &mut Problem<'_>| {
        variables.group("normals").map(|_| ()).map_err(Error::from)
    };
    let error = solve_with(&surface, &options, &mut refuse, &mut ()).unwrap_err();
    assert!(error.to_string().contains("poses, molds"), "{error}");
}

#[test]
fn the_problem_can_be_planned() {
    let surface = Shape::Saddle.surface(8, 8, 4, 4);
    let (problem, x) = problem(&surface, &options(MoldType::Sphere)).unwrap();
    let mut system = System::new(problem, gp_solver::Factorization::Auto).unwrap();
    assert!(system.linearize(&x).unwrap() > 0.0);
    // Spheres have one parameter of seven.
    assert_eq!(system.variables(), 6 * 12 + 3);
}
