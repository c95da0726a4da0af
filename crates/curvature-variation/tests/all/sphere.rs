//! What third-order energies keep of a sphere, which has none.

use curvature_variation::{Functional, Input, Options, Rings, Solution, solve};
use geom_core::DVec3;
use std::f64::consts::PI;

/// A cube's mesh at 98, 386 and 1,538 vertices.
fn sphere(blend_rings: Rings) -> Solution {
    let mesh = fixtures::quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.1, 1.2));
    let options = Options { levels: 2, blend_rings, ..Options::default() };
    let result = solve(&Input::from(mesh), &options, &mut ()).expect("a sphere can be faired");
    let bending = result.after.get(Functional::Bending);
    assert!((bending / (8.0 * PI) - 1.0).abs() < 1e-5, "{bending}");
    assert!(result.metrics.gauss_bonnet_residual.expect("a closed surface") < 1e-6);
    result
}

fn energies(result: &Solution) -> Vec<f64> {
    result.report.stages.iter().map(|stage| stage.solver.final_energy).collect()
}

/// Bi-cubic patches reproduce a quadratic surface near a point only if they are parametrised by
/// bilinear maps; C² across an edge makes the two maps one affine map, and around a vertex of
/// valence 3 no affine map closes. So with blends of one ring each of the eight keeps a share of the
/// energy, whatever the mesh size, because the energy does not depend on scale.
#[test]
fn blends_of_one_ring_keep_an_eighth_of_mehlum_tarrou_energy_per_vertex_of_valence_3() {
    let report = sphere(Rings::Count(1));
    let energies = energies(&report);
    assert!(energies[0] < 6.8 && energies[1] < 2.45 && energies[2] < 1.42, "{energies:?}");
    // What depends on the mesh size falls, the rest stays.
    let limit = report.extrapolated.unwrap();
    assert!((0.9..1.1).contains(&limit), "{limit}");
    assert!(report.metrics.quadrature_gap < 0.01);
}

/// `k` rings from the vertex a share of `1/k³` is left, so that blends of `r` rings leave `1/r²`;
/// blends that cover half the way to the next vertex double their rings with each refinement. Both
/// that and the error of regular patches then fall to a quarter.
#[test]
fn third_order_energies_of_a_sphere_fall_to_a_quarter_when_blends_grow_with_the_mesh() {
    let report = sphere(Rings::Count(usize::MAX));
    let energies = energies(&report);
    for pair in energies.windows(2) {
        assert!(pair[0] / pair[1] > 3.5, "{energies:?}");
    }
    let limit = report.extrapolated.unwrap();
    assert!(limit.abs() < 0.1 * energies[2], "{limit} of {energies:?}");
    assert!(report.metrics.quadrature_gap < 1e-5);
}

#[test]
fn the_rings_chosen_by_themselves_get_below_what_one_ring_reaches_on_any_mesh() {
    let report = sphere(Rings::Auto);
    let energies = energies(&report);
    let limit = sphere(Rings::Count(1)).extrapolated.unwrap();
    assert!(energies[2] < limit, "{energies:?}, with one ring {limit}");
}
