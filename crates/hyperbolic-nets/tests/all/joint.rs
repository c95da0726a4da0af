//! The joint solver on jittered nets of every topology.

use fixtures::asymptotic_nets::{self, AsymptoticNet};
use geom_core::PolyMesh;
use gp_solver::Status;
use hyperbolic_nets::{
    Boundary, BoundaryPolygon, Input, Options, QuadNet, distances, solve, star_planarity,
};

fn quad_net(model: &AsymptoticNet) -> QuadNet {
    QuadNet::new(&PolyMesh::new(model.positions.clone(), &model.quads).unwrap()).unwrap()
}

/// Exact to rounding: the bounds are those of a manufacturer who would like to see nothing at all.
fn check(name: &str, model: AsymptoticNet) {
    check_near(name, model, 0.03, 0.1);
}

fn check_near(name: &str, model: AsymptoticNet, mean_distance: f64, max_distance: f64) {
    let model = model.jittered(0.05, 1);
    let net = quad_net(&model);
    let input = Input::near_surface(&net, &*model.surface);
    let solution = solve(&input, &Options::default(), &mut ()).unwrap();
    let (surface, report) = (solution.result, solution.report);
    let kinks = surface.kink_statistics();
    let planarity = star_planarity(surface.net());
    let (low, high) = surface
        .shape()
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
    let h = net.mesh().mean_edge_length();
    let far = distances(surface.net().positions(), &*model.surface);
    let far_max = far.iter().copied().fold(0.0, f64::max) / h;
    let far_mean = far.iter().sum::<f64>() / far.len() as f64 / h;
    eprintln!(
        "{name}: kink {:.1e} deg, star {planarity:.1e}, W {low:.4}..{high:.4}, distance {far_max:.3} (mean {far_mean:.4}), \
         {} steps, C {:?}",
        kinks.max.to_degrees(),
        report.iterations,
        solution.violation,
    );
    assert_eq!(report.status, Status::Converged, "{name}: {:?}", solution.violation);
    assert!(kinks.max.to_degrees() <= 1e-9, "{name}: kink {} deg", kinks.max.to_degrees());
    assert!(planarity <= 1e-12, "{name}: star planarity {planarity}");
    assert_eq!(kinks.folds, 0, "{name}");
    assert!(low >= 0.9 && high <= 1.1, "{name}: W from {low} to {high}");
    assert!(
        far_max <= max_distance && far_mean <= mean_distance,
        "{name}: distance {far_max} {far_mean}"
    );
}

#[test]
fn discs_become_exact() {
    check("helicoid", asymptotic_nets::helicoid());
    check("scherk", asymptotic_nets::scherk(12));
    check("enneper", asymptotic_nets::enneper());
    // Its surface ends where the net does, so that a vertex drawn back from its jitter at the
    // border may lie beyond it.
    check_near("mass spring", asymptotic_nets::mass_spring(), 0.03, 0.2);
}

#[test]
fn rings_become_exact() {
    check("even ring", asymptotic_nets::catenoid(44, 32));
    check("odd ring", asymptotic_nets::catenoid_odd());
    check("bumped ring", asymptotic_nets::bumped_catenoid(44, 32));
}

#[test]
fn flat_points_and_holes_become_exact() {
    check("P disc", asymptotic_nets::schwarz_p_disc(5));
    // Four cells from flat point to flat point are few: nearer than this, W would leave 0.9..1.1.
    check_near("P cell", asymptotic_nets::schwarz_p_cell(4), 0.034, 0.1);
    check("holes", asymptotic_nets::enneper_with_holes());
}

fn with_boundary(model: &AsymptoticNet, boundary: Boundary) -> (Status, f64, f64) {
    let net = quad_net(model);
    let options = Options { boundary, ..Options::default() };
    let solution = solve(&Input::new(&net), &options, &mut ()).unwrap();
    let surface = solution.result;
    let moved = BoundaryPolygon::deviation(&net, surface.net()) / net.mesh().mean_edge_length();
    (solution.report.status, surface.kink_statistics().max.to_degrees(), moved)
}

#[test]
fn boundaries_are_kept_or_slid_along() {
    // Where an exact net has the polygon it does not move at all.
    let exact = asymptotic_nets::enneper().jittered_inside(0.001, 1);
    let (status, kink, moved) = with_boundary(&exact, Boundary::Fixed);
    assert!(status == Status::Converged && kink <= 1e-9, "{status:?} {kink} {moved}");
    assert!(moved < 2e-3, "moved by {moved}");
    // The bulge pushes, noise on the boundary pushes: a few hundredths of an edge.
    let bulged = asymptotic_nets::bulged_enneper().jittered_inside(0.05, 1);
    let rough = asymptotic_nets::catenoid_odd().jittered(0.05, 1);
    for (model, boundary, most) in [
        (&bulged, Boundary::Fixed, 0.05),
        (&rough, Boundary::Fixed, 0.05),
        (&bulged, Boundary::Glide, 0.2),
        // Its tips have one face and are anchored, weakly.
        (&rough, Boundary::Glide, 0.2),
    ] {
        let (status, kink, moved) = with_boundary(model, boundary);
        eprintln!("{boundary:?}: {moved:.4} edges off the polygon");
        assert!(status == Status::Converged && kink <= 1e-9, "{boundary:?}: {status:?} {kink}");
        assert!(moved <= most, "{boundary:?}: moved by {moved}");
    }
}

/// `m × n` quads of the graph `z = 0.7 x y`.
fn small(m: u32, n: u32) -> QuadNet {
    let at = |k: u32| (0.4 * f64::from(k / (n + 1)), 0.4 * f64::from(k % (n + 1)));
    let points = (0..(m + 1) * (n + 1)).map(at);
    let points = points.map(|(x, y)| geom_core::DVec3::new(x, y, 0.7 * x * y)).collect();
    let cells = (0..m * n).map(|k| (n + 1) * (k / n) + k % n);
    let quads: Vec<[u32; 4]> = cells.map(|a| [a, a + n + 1, a + n + 2, a + 1]).collect();
    QuadNet::new(&PolyMesh::new(points, &quads).unwrap()).unwrap()
}

#[test]
fn nets_too_small_for_a_fit_of_curvatures_are_solved() {
    for (m, n) in [(1, 1), (1, 8), (2, 2)] {
        let net = small(m, n);
        let solution = solve(&Input::new(&net), &Options::default(), &mut ()).unwrap();
        let (report, metrics) = (solution.report, solution.metrics);
        assert_eq!(report.status, Status::Converged, "{m} × {n}");
        assert!(metrics.kink_max_deg < 1e-9 && metrics.folds == 0, "{m} × {n}: {metrics:?}");
    }
}
