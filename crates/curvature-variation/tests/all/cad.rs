//! Surfaces for CAD: what is written of a faired surface, and the limit of a control mesh.

use bspline::BsplineSurface;
use curvature_variation::{
    EnergyTable, Functional, Input, LimitPatchError, Options, Quadrature, SurfaceEnergy, Warning,
    Workspace, limit_patches, solve, spline_patches,
};
use fixtures::quad_graphs;
use geom_core::{DVec3, PolyMesh, assert_close};
use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, limit_masks, refine};

/// Energies by the evaluator of the optimiser, and of the patches as they are written.
fn tables(mesh: &PolyMesh) -> [EnergyTable; 2] {
    let surface = SubdivisionSurface::new(mesh, &Creases::none(), Blend::Smooth).unwrap();
    let energy = SurfaceEnergy::new(&surface, mesh.vertex_count(), Quadrature::FINE);
    let flat: Vec<f64> = mesh.positions().iter().flat_map(|p| p.to_array()).collect();
    let reported = energy.table(&flat, &mut Workspace::default());
    let splines = spline_patches(mesh, &surface).unwrap();
    [reported, splines.energies(&|_| true)]
}

#[test]
fn exact_patches_have_the_energies_that_are_reported() {
    let [reported, written] = tables(&quad_graphs::torus(12, 8, 3.0, 1.0));
    for (functional, value) in reported.iter() {
        let share = (written.get(functional) - value).abs() / value.abs().max(1.0);
        // The root is not smooth where the harmonics vanish, which no quadrature likes.
        let bound = if functional == Functional::Sqrt { 1e-4 } else { 1e-6 };
        assert!(share < bound, "{functional}: {value} {}", written.get(functional));
    }
}

#[test]
fn fitted_patches_have_the_energies_that_are_reported() {
    // One ring of a blend and several, valences three, four and five.
    for (mesh, levels) in [
        (quad_graphs::theta_graph(3), 0),
        (quad_graphs::theta_graph(3), 1),
        (quad_graphs::theta_graph(5), 1),
    ] {
        let options = Options { levels, iterations: 0, ..Options::default() };
        let mut solution = solve(&Input::from(mesh), &options, &mut ()).unwrap();
        let splines = spline_patches(&solution.result, &solution.surface).unwrap();
        solution.add_splines(&splines);
        let written = solution.metrics.written_energies.clone().unwrap();
        for functional in Functional::ALL {
            let second = matches!(functional, Functional::Area | Functional::Bending);
            let bound = if second { 1e-4 } else { 0.01 };
            assert_close(written[functional.name()] / solution.after.get(functional), 1.0, bound);
        }
        let told = solution.warnings.iter().any(|w| matches!(w, Warning::WrittenEnergy { .. }));
        assert!(!told, "{:?}", solution.warnings);
    }
}

/// The vertices of a mesh refined a few times, where the limit surface has them.
fn limit_points(mesh: &PolyMesh, times: usize) -> Vec<DVec3> {
    let mut fine = mesh.clone();
    for _ in 0..times {
        fine = refine(&fine, &Creases::none()).unwrap().mesh;
    }
    let at = |v| {
        let masks = limit_masks(fine.valence(v)).position;
        let mut sum = masks[0] * fine.position(v);
        for h in fine.outgoing_half_edges(v) {
            // The weights of all neighbours of a kind are the same.
            let diagonal = fine.target(fine.next(h));
            sum += masks[1] * fine.position(fine.target(h)) + masks[2] * fine.position(diagonal);
        }
        sum
    };
    fine.vertices().map(at).collect()
}

/// Distance of a point to the nearest of some surfaces.
fn distance(surfaces: &[BsplineSurface], p: DVec3) -> f64 {
    let near = |s: &&BsplineSurface| {
        s.control_points().iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min)
    };
    let mut by_distance: Vec<(f64, &BsplineSurface)> =
        surfaces.iter().map(|s| (near(&s), s)).collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    let to = |s: &BsplineSurface| {
        // Newton's iteration on the foot point from the best of a grid.
        let grid = |k: usize| [(k / 9) as f64 / 8.0, (k % 9) as f64 / 8.0];
        let start = (0..81).map(grid).min_by(|a, b| {
            let d = |at: &[f64; 2]| s.point(at[0], at[1]).distance(p);
            d(a).total_cmp(&d(b))
        });
        let mut at = start.unwrap_or_default();
        for _ in 0..20 {
            let jet = s.jet(at[0], at[1], 1);
            let (du, dv, r) = (jet.d(1, 0), jet.d(0, 1), p - jet.position());
            let (e, f, g) = (du.dot(du), du.dot(dv), dv.dot(dv));
            let (a, b) = (du.dot(r), dv.dot(r));
            let determinant = e * g - f * f;
            at[0] = (at[0] + (a * g - b * f) / determinant).clamp(0.0, 1.0);
            at[1] = (at[1] + (b * e - a * f) / determinant).clamp(0.0, 1.0);
        }
        s.point(at[0], at[1]).distance(p)
    };
    by_distance.iter().take(6).map(|(_, s)| to(s)).fold(f64::INFINITY, f64::min)
}

fn cube() -> PolyMesh {
    let at = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    PolyMesh::new((0..8).map(at).collect(), &faces).unwrap()
}

#[test]
fn the_limit_of_a_cube_is_met_within_the_tolerance() {
    let cube = cube();
    let made = limit_patches(&cube, &Creases::none(), 1e-4).unwrap();
    // Eight corners of three sectors, each with a cap and two pieces of a ring.
    assert_eq!((made.caps, made.rings, made.surfaces.len()), (24, 1, 72));
    assert_eq!(made.fitted, 0);
    // An edge after one refinement is about a third of the cube's.
    assert!(made.max_deviation < 1e-4 * 0.5, "{}", made.max_deviation);
    for p in limit_points(&cube, 4).iter().step_by(7) {
        let off = distance(&made.surfaces, *p);
        assert!(off < 1e-4 * 0.5, "{off}");
    }
    let normals_out = made.surfaces.iter().map(|s| s.cone_volume(None, DVec3::splat(0.5)));
    let parts: Vec<f64> = normals_out.collect();
    assert!(parts.iter().all(|v| *v > 0.0));
    let finer = limit_patches(&cube, &Creases::none(), 1e-6).unwrap();
    assert!(finer.rings > made.rings && finer.max_deviation < 1e-6);
    let volume = |patches: &[BsplineSurface]| -> f64 {
        patches.iter().map(|s| s.cone_volume(None, DVec3::ZERO)).sum()
    };
    assert_close(volume(&made.surfaces), volume(&finer.surfaces), 1e-5);
}

#[test]
fn a_regular_mesh_is_exact_without_refinement_and_a_wild_vertex_is_refused() {
    let torus = quad_graphs::torus(12, 8, 3.0, 1.0);
    let made = limit_patches(&torus, &Creases::none(), 1e-4).unwrap();
    assert_eq!((made.surfaces.len(), made.caps, made.max_deviation), (96, 0, 0.0));
    for p in limit_points(&torus, 1).iter().step_by(5) {
        assert!(distance(&made.surfaces, *p) < 1e-9);
    }
    let refused = limit_patches(&cube(), &Creases::none(), 1e-14).unwrap_err();
    assert!(matches!(refused, LimitPatchError::TooFar { .. }), "{refused}");
    let refused = limit_patches(&cube(), &Creases::none(), 0.0).unwrap_err();
    assert_eq!(refused, LimitPatchError::Tolerance { value: 0.0 });
}
