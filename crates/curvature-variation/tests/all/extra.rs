//! Blocks of the caller's in every level.

use curvature_variation::blocks::PulledPoints;
use curvature_variation::{
    CONTROL_POINTS, Constraints, Error, Input, Options, Symmetry, solve, solve_with,
};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh};
use gp_solver::{Problem, Stage, Variables};
use subdiv_catmull_clark::limit_frames;

fn options(energy: &str, levels: usize) -> Options {
    Options { energy: energy.parse().expect("an energy"), levels, ..Options::default() }
}

fn bits(mesh: &PolyMesh) -> Vec<[u64; 3]> {
    mesh.positions().iter().map(|p| p.to_array().map(f64::to_bits)).collect()
}

#[test]
fn nothing_added_changes_no_bit() {
    let input = Input::from(quad_graphs::theta_graph(3));
    let options = Options { iterations: 30, ..options("mehlum_tarrou", 1) };
    let mut stages = Vec::new();
    let mut look = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        let points = variables.group(CONTROL_POINTS)?;
        let names: Vec<String> = problem.blocks().map(|(_, name)| name.to_owned()).collect();
        stages.push((stage.name.clone(), points.len(), names));
        Ok(())
    };
    let seen = solve_with(&input, &options, &mut look, &mut ()).expect("a theta graph");
    let plain = solve(&input, &options, &mut ()).expect("a theta graph");
    assert_eq!(bits(&seen.result), bits(&plain.result));
    assert_eq!(seen.levels, plain.levels);
    assert_eq!(stages.len(), 2);
    for (name, len, blocks) in stages {
        assert_eq!(name, len.to_string());
        assert_eq!(blocks, ["surface energy"]);
    }
}

#[test]
fn added_pulls_are_those_of_the_constraints() {
    let mesh = quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.4, 2.0));
    // Down to the minimum itself: where the default tolerance stops depends on the path.
    let options = Options { symmetry: Symmetry::None, tolerance: 1e-10, ..options("bending", 0) };
    let weights = vec![(0, 30.0), (11, 500.0)];
    let constraints = Constraints { weights: weights.clone(), ..Constraints::default() };
    let pulled = Input { constraints, ..Input::from(mesh.clone()) };
    let own = solve(&pulled, &options, &mut ()).expect("an ellipsoid");
    let frames = limit_frames(&own.initial, &own.initial_surface);
    let area = own.before.get(curvature_variation::Functional::Area);
    let mut pull = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        let mut block = PulledPoints::new(variables.group(CONTROL_POINTS)?);
        for &(v, weight) in &weights {
            let frame = frames[v as usize].as_ref().expect("a used vertex");
            block.pull(&frame.position, frame.point(own.initial.positions()), weight / area);
        }
        problem.add(block);
        Ok(())
    };
    let free = Input::from(mesh);
    let added = solve_with(&free, &options, &mut pull, &mut ()).expect("an ellipsoid");
    let (own, added) = (&own.report.stages[0].solver, &added.report.stages[0].solver);
    assert_eq!(own.factorizations > 0, added.factorizations > 0);
    let (want, got) = (own.final_energy, added.final_energy);
    // The same terms, but not the same path: rounds end where little is left to gain.
    assert!((got / want - 1.0).abs() < 1e-3, "{got} against {want}");
}

#[test]
fn a_caller_may_fix_weigh_and_take_out() {
    let mesh = quad_graphs::ellipsoid(3, DVec3::new(1.0, 1.3, 2.0));
    let input = Input::from(mesh.clone());
    // Area shrinks to nothing unless something holds it.
    let area = Options { iterations: 40, ..options("area", 0) };
    assert!(matches!(solve(&input, &area, &mut ()), Err(Error::ScaleFree { .. })));
    let mut hold = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
        let points = variables.group(CONTROL_POINTS)?;
        for v in points.select(|v, _| v % 3 != 0) {
            problem.variables_mut().fix(points, v);
        }
        // One coordinate of a vertex.
        problem.variables_mut().fix_unknown(points.column(0, 2));
        Ok(())
    };
    let held = solve_with(&input, &area, &mut hold, &mut ()).expect("it is held");
    assert!(held.metrics.energy_final < held.metrics.energy_initial);
    for (v, (p, q)) in mesh.positions().iter().zip(held.result.positions()).enumerate() {
        assert!(v % 3 == 0 || p.distance(*q) < 1e-12, "vertex {v}");
    }
    assert!((mesh.positions()[0].z - held.result.positions()[0].z).abs() < 1e-12);
    // Pulls that are taken out pull no longer.
    let weights = (0..mesh.vertex_count() as u32).map(|v| (v, 1e4)).collect();
    let constraints = Constraints { weights, ..Constraints::default() };
    let pulled = Input { constraints, ..input };
    let bending = options("bending", 0);
    let mut drop = |_: &Stage, _: &Variables, problem: &mut Problem<'_>| {
        let pulls = problem.blocks().find(|(_, name)| *name == "pulled limit points");
        let (pulls, _) = pulls.expect("there are pulls");
        problem.remove(pulls)?;
        Ok(())
    };
    let with = solve(&pulled, &bending, &mut ()).expect("an ellipsoid");
    let without = solve_with(&pulled, &bending, &mut drop, &mut ()).expect("an ellipsoid");
    assert!(without.metrics.energy_final < 0.99 * with.metrics.energy_final);
}
