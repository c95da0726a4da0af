//! Spline surfaces are remeshed with their own second forms.

use bspline::{BsplineSurface, Degree, KnotVector};
use geom_core::DVec3;
use quad_remesh::{Error, Options, Solution, Status, solve_surface};

/// The polynomial graph `z = (x² − y²) / 2` over the square of side 2 as one Bézier patch.
fn saddle() -> BsplineSurface {
    let degree = Degree::new(2).unwrap();
    let knots = KnotVector::clamped_uniform(degree, 3).unwrap();
    // Blossoms of x² over −1..1 are 1, −1, 1.
    let square = [1.0, -1.0, 1.0];
    let at = |k: usize| k as f64 - 1.0;
    let points = (0..9)
        .map(|k| DVec3::new(at(k / 3), at(k % 3), 0.5 * (square[k / 3] - square[k % 3])))
        .collect();
    BsplineSurface::new(knots.clone(), knots, points, None).unwrap()
}

/// A waist that closes: periodic around, a parabola along.
fn waist() -> BsplineSurface {
    let (around, along) = (Degree::new(3).unwrap(), Degree::new(2).unwrap());
    let (n, m) = (16, 3);
    let knots_u = KnotVector::periodic_uniform(around, n).unwrap();
    let knots_v = KnotVector::clamped_uniform(along, m).unwrap();
    let radius = [1.6, 0.6, 1.6];
    let points = (0..n * m)
        .map(|k| {
            let angle = std::f64::consts::TAU * (k / m) as f64 / n as f64;
            let r = radius[k % m];
            DVec3::new(r * angle.cos(), r * angle.sin(), (k % m) as f64 - 1.0)
        })
        .collect();
    BsplineSurface::new(knots_u, knots_v, points, None).unwrap()
}

fn remeshed(surface: &BsplineSurface, edge: f64) -> Solution {
    let options = Options { edge_length: Some(edge), ..Options::default() };
    solve_surface(surface, &options, &mut ()).unwrap()
}

#[test]
fn a_saddle_gets_its_straight_lines() {
    let solution = remeshed(&saddle(), 0.2);
    let (net, m) = (&solution.result, &solution.metrics);
    assert_eq!((solution.status, m.irregular_vertices), (Status::Converged, 0));
    // Its asymptotic lines run along x ± y = constant.
    for h in net.edges() {
        let d = net.position(net.target(h)) - net.position(net.origin(h));
        let off = (d.x.abs() - d.y.abs()).abs() / d.truncate().length();
        assert!(off < 0.01, "{off}");
    }
    assert!(m.negative_share > 0.999 && m.asymptotic_deviation_mean_deg < 0.3, "{m:?}");
}

#[test]
fn a_surface_that_closes_becomes_a_ring() {
    let solution = remeshed(&waist(), 0.25);
    let m = &solution.metrics;
    assert_eq!((m.euler_characteristic, m.surface_euler_characteristic), (0, 0));
    assert_eq!((m.irregular_vertices, m.odd_valence_vertices), (0, 0));
    assert!(m.asymptotic_deviation_mean_deg < 1.0 && m.covered_share > 0.8, "{m:?}");
}

#[test]
fn a_bowl_is_refused() {
    let surface = saddle();
    let bowl: Vec<DVec3> = surface
        .control_points()
        .iter()
        .enumerate()
        .map(|(k, p)| {
            let square = [1.0, -1.0, 1.0];
            DVec3::new(p.x, p.y, square[k / 3] + square[k % 3])
        })
        .collect();
    let bowl = surface.with_control_points(bowl).unwrap();
    let error = solve_surface(&bowl, &Options::default(), &mut ()).unwrap_err();
    assert!(matches!(error, Error::NotNegativelyCurved { percent, .. } if percent == 0.0));
}
