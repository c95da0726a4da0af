//! Blocks of the caller's in every stage.

use crate::common::{catenoid, enneper, exact_net, noisy, reference_set, sampled_net};
use asymptotic_bezier::{
    CONTROL_POINTS, CurveForm, Error, Input, Interior, Joins, Options, Phase, TORSIONS, problem,
    solve, solve_with,
};
use gp_solver::{Closeness, Problem, QuadraticBuilder, QuadraticForm, Stage, Variables};

type Added = Result<(), Error>;

fn patch() -> Input {
    reference_set("B").data.into()
}

fn net() -> Input {
    exact_net(catenoid, [0.2, 1.4, -0.1, 0.9], [2, 2]).into()
}

#[test]
fn every_stage_is_shown_to_the_caller() {
    let stages = |input: &Input, options: &Options| {
        let mut names: Vec<String> = Vec::new();
        let mut note = |stage: &Stage, variables: &Variables, _: &mut Problem<'_>| -> Added {
            assert!(!variables.is_empty());
            names.push(stage.name.clone());
            Ok(())
        };
        let solution = solve_with(input, options, &mut note, &mut ()).unwrap();
        names.dedup();
        (names, solution)
    };
    let (names, looked_at) = stages(&patch(), &Options::default());
    assert_eq!(names, ["boundary", "patch 0"]);
    // Looking changes nothing, not a bit.
    let alone = solve(&patch(), &Options::default(), &mut ()).unwrap();
    assert_eq!(alone.result.patches, looked_at.result.patches);
    let noisy: Input = noisy(&reference_set("B").data, 0.01, 5).into();
    let relaxed = Options { relaxed: true, ..Options::default() };
    let (names, _) = stages(&noisy, &relaxed);
    assert_eq!(names, ["relaxation", "boundary", "patch 0"]);
    let (names, _) = stages(&net(), &Options { joins: Joins::C1, ..Options::default() });
    assert_eq!(names, ["boundary", "joint"]);
}

#[test]
fn torsions_take_equations_and_squares() {
    let free = solve(&patch(), &Options::default(), &mut ()).unwrap().result.boundary.torsions;
    let mut equal = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "boundary" {
            let torsions = variables.group(TORSIONS)?;
            let mut rows = QuadraticBuilder::new("mean");
            let row = rows.equation(1.0).constant(-2.0);
            (0..4).for_each(|c| _ = row.linear(torsions.column(c, 0), 1.0));
            problem.add(rows.build_exact());
        }
        Ok(())
    };
    let solution = solve_with(&patch(), &Options::default(), &mut equal, &mut ()).unwrap();
    let torsions = &solution.result.boundary.torsions;
    assert!((torsions.iter().sum::<f64>() - 2.0).abs() < 1e-11, "{torsions:?}");
    assert!((free.iter().sum::<f64>() - 2.0).abs() > 1e-3);
    assert!(solution.metrics.torsion_defect_max < 1e-8);
    // A large weight on closeness is nearly an equation.
    let mut near = |stage: &Stage, _: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "boundary" {
            problem.add(Closeness::new("near", vec![1.0; 4], vec![1e4; 4]));
        }
        Ok(())
    };
    let solution = solve_with(&patch(), &Options::default(), &mut near, &mut ()).unwrap();
    assert!(solution.result.boundary.torsions.iter().all(|t| (t - 1.0).abs() < 1e-5));
}

#[test]
fn fixed_torsions_stay_and_contradictions_are_told() {
    let free = solve(&patch(), &Options::default(), &mut ()).unwrap().result.boundary.torsions;
    let mut fix = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "boundary" {
            problem.variables_mut().fix(variables.group(TORSIONS)?, 0);
            problem.add(Closeness::new("pull", vec![3.0; 4], vec![10.0; 4]));
        }
        Ok(())
    };
    let fixed = solve_with(&patch(), &Options::default(), &mut fix, &mut ()).unwrap();
    assert_eq!(fixed.result.boundary.torsions[0], free[0]);
    assert!((fixed.result.boundary.torsions[1] - free[1]).abs() > 0.1);
    let mut contradict = |stage: &Stage, _: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "boundary" {
            let mut rows = QuadraticBuilder::new("both");
            rows.equation(1.0).linear(0, 1.0).constant(-1.0);
            rows.equation(1.0).linear(0, 1.0).constant(-2.0);
            problem.add(rows.build_exact());
        }
        Ok(())
    };
    let error = solve_with(&patch(), &Options::default(), &mut contradict, &mut ()).unwrap_err();
    assert!(matches!(error, Error::Infeasible { .. }), "{error}");
}

#[test]
fn what_is_not_quadratic_is_refused_by_exact_stages_only() {
    let mut curved = |_: &Stage, _: &Variables, problem: &mut Problem<'_>| -> Added {
        let mut rows = QuadraticBuilder::new("product");
        rows.equation(1e-6).product(0, 1, 1.0);
        problem.add(rows.build());
        Ok(())
    };
    let error = solve_with(&patch(), &Options::default(), &mut curved, &mut ()).unwrap_err();
    assert!(error.to_string().contains("block `product` is not quadratic"), "{error}");
    // Curves from normals are least squares and take anything.
    let input: Input = sampled_net(enneper, [-0.5, 0.6, -0.7, 0.5], [3, 3]).into();
    let options = Options { curves: CurveForm::Normals, ..Options::default() };
    let mut curved = |stage: &Stage, _: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "boundary" {
            let mut rows = QuadraticBuilder::new("product");
            rows.equation(1e-6).product(0, 1, 1.0);
            problem.add(rows.build());
        }
        Ok(())
    };
    assert!(solve_with(&input, &options, &mut curved, &mut ()).is_ok());
}

/// A control point inside is to be where it is told, patch by patch and jointly.
#[test]
fn control_points_go_where_equations_put_them() {
    for joins in [Joins::G1, Joins::C1, Joins::G2] {
        let options = Options { joins, degree: Some(7), ..Options::default() };
        let plain = solve(&net(), &options, &mut ()).unwrap();
        let lifted = plain.result.patches[0].patch.point(3, 4) + geom_core::DVec3::Z * 0.01;
        let mut lift = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| -> Added {
            if stage.name == "patch 0" || stage.name == "joint" {
                let points = variables.group(CONTROL_POINTS)?;
                let mut rows = QuadraticBuilder::new("lift");
                for (axis, goal) in stage.place(lifted.to_array()).into_iter().enumerate() {
                    let unknown = points.column(8 * 3 + 4, axis);
                    rows.equation(1.0).linear(unknown, 1.0).constant(-goal);
                }
                problem.add(rows.build_exact());
            }
            Ok(())
        };
        let moved = solve_with(&net(), &options, &mut lift, &mut ()).unwrap();
        let point = moved.result.patches[0].patch.point(3, 4);
        assert!((point - lifted).length() < 1e-8, "{joins:?}: {}", (point - lifted).length());
        assert!(moved.metrics.thin_plate_energy > plain.metrics.thin_plate_energy, "{joins:?}");
        // The boundaries are asymptotic all the same, and the joins smooth.
        assert!(moved.metrics.normal_curvature_max < 1e-9, "{joins:?}");
        assert!(moved.metrics.kink_max_deg < 1e-7, "{joins:?}");
    }
}

#[test]
fn masks_take_no_blocks() {
    let options = Options { interior: Interior::Coons, ..Options::default() };
    let mut pull = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| -> Added {
        if stage.name == "patch 0" {
            let points = variables.group(CONTROL_POINTS)?;
            problem.variables_mut().fix(points, 27);
        }
        Ok(())
    };
    let error = solve_with(&patch(), &options, &mut pull, &mut ()).unwrap_err();
    assert_eq!(error, Error::ExtendedMask);
}

/// The problem of a stage, solved by a general quadratic program, gives what the stage gives.
#[test]
fn problems_are_those_that_the_stages_solve() {
    let options = Options { degree: Some(7), ..Options::default() };
    let solution = solve(&patch(), &options, &mut ()).unwrap();
    let boundary = problem(&patch(), &options, Phase::Boundary).unwrap();
    let torsions = QuadraticForm::of(&boundary).unwrap().dense(4).solve().unwrap().x;
    for (a, b) in torsions.iter().zip(&solution.result.boundary.torsions) {
        assert!((a - b).abs() < 1e-9);
    }
    let filling = problem(&patch(), &options, Phase::Patch).unwrap();
    let points = filling.variables().group(CONTROL_POINTS).unwrap();
    let patch = &solution.result.patches[0].patch;
    let mut program = QuadraticForm::of(&filling).unwrap().dense(filling.unknowns());
    for (k, fixed) in filling.variables().fixed().iter().enumerate() {
        if *fixed {
            let place = k - points.column(0, 0);
            let mut row = vec![0.0; filling.unknowns()];
            row[k] = 1.0;
            let start = patch.points()[place / 3] - patch.points()[0];
            program.equal(&row, start[place % 3]);
        }
    }
    let x = program.solve().unwrap().x;
    for (k, point) in patch.points().iter().enumerate() {
        let found = geom_core::DVec3::from_array(points.get(&x, k)) + patch.points()[0];
        assert!((found - *point).length() < 1e-5, "{k}: {}", (found - *point).length());
    }
    assert!(problem(&net(), &options, Phase::Joint).is_ok());
    assert!(problem(&net(), &options, Phase::Relaxation).is_ok());
}
