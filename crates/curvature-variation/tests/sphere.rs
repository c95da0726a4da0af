//! What third-order energies keep of a sphere, which has none.

use curvature_variation::{Constraints, FairOptions, Functional, fair};
use geom_core::DVec3;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use subdiv_catmull_clark::Creases;

/// Bi-cubic patches reproduce a quadratic surface near a point only if they are parametrised by
/// bilinear maps; C² across an edge makes the two maps one affine map, and around a vertex of
/// valence 3 no affine map closes. So each of the eight keeps a share of the energy, whatever the
/// mesh size, because the energy does not depend on scale.
#[test]
fn a_sphere_keeps_an_eighth_of_mehlum_tarrou_energy_per_vertex_of_valence_3() {
    let mesh = fixtures::quad_graphs::ellipsoid(4, DVec3::new(1.0, 1.1, 1.2));
    let options = FairOptions { levels: 2, ..FairOptions::default() };
    let free = Constraints::default();
    let result =
        fair(&mesh, &Creases::none(), &free, &options, |_| ControlFlow::Continue(())).unwrap();
    let report = &result.report;
    let energies: Vec<f64> = report.levels.iter().map(|l| l.final_energy).collect();
    // 98, 386 and 1,538 vertices.
    assert!(energies[0] < 6.8 && energies[1] < 2.45 && energies[2] < 1.42, "{energies:?}");
    // What depends on the mesh size falls, the rest stays.
    let limit = report.extrapolated.unwrap();
    assert!((0.9..1.1).contains(&limit), "{limit}");
    let bending = report.after.get(Functional::Bending);
    assert!((bending / (8.0 * PI) - 1.0).abs() < 1e-5, "{bending}");
    assert!(report.gauss_bonnet_residual < 1e-6 && report.quadrature_gap < 0.01);
}
