//! What must hold for any surface: invariance, exact surfaces, relations, resuming, threads.

use std::ops::ControlFlow;

use bspline::{BsplineSurface, KnotVector};
use fixtures::surfaces::{Shape, plane, sphere_cap, torus_patch};
use geom_core::{DVec3, assert_close};
use glam::DQuat;
use gp_solver::{Checkpoint, Counts, Observer, Progress, SolverError};
use weingarten::{
    Border, Error, Formulation, Metrics, Move, Options, Relation, RelationLocus, Solution, Status,
    solve,
};

fn few(iterations: usize) -> Options {
    Options { iterations, ..Default::default() }
}

fn run(surface: &BsplineSurface, options: &Options) -> Solution {
    solve(surface, options, &mut ()).expect("a surface to optimise")
}

fn mapped(surface: &BsplineSurface, f: impl Fn(DVec3) -> DVec3) -> BsplineSurface {
    let points = surface.control_points().iter().map(|p| f(*p)).collect();
    surface.with_control_points(points).expect("finite points")
}

fn distance(a: &BsplineSurface, b: &BsplineSurface) -> f64 {
    let pairs = a.control_points().iter().zip(b.control_points());
    pairs.map(|(p, q)| p.distance(*q)).fold(0.0, f64::max)
}

#[test]
fn energy_and_metrics_do_not_change_under_rigid_motions() {
    let saddle = Shape::Saddle.surface(9, 8, 4, 4);
    let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let motion = |p: DVec3| 1000.0 * (rotation * p) + DVec3::new(30.0, -5.0, 12.0);
    let (here, there) = (run(&saddle, &few(0)), run(&mapped(&saddle, motion), &few(0)));
    let energy = |r: &Solution| r.report.stages[0].solver.initial_energy;
    assert_close(energy(&there) / energy(&here), 1.0, 1e-9);
    assert_close(there.before.alignment_rms / here.before.alignment_rms, 1.0, 1e-9);
    assert_close(there.before.diagram_area / here.before.diagram_area, 1.0, 1e-9);
    let curvature = |r: &Solution| r.before.gaussian_curvature_min;
    assert_close(curvature(&there) * 1e6 / curvature(&here), 1.0, 1e-9);
}

/// Damping by the diagonal of the normal matrix knows the axes, so that the steps follow only
/// motions that take axes to axes.
#[test]
fn the_result_follows_motions_of_the_axes_and_scaling() {
    let saddle = Shape::Saddle.surface(9, 8, 4, 4);
    let motion = |p: DVec3| 1000.0 * DVec3::new(-p.y, p.z, -p.x) + DVec3::new(30.0, -5.0, 12.0);
    let here = run(&saddle, &few(4));
    let there = run(&mapped(&saddle, motion), &few(4));
    assert_close(distance(&mapped(&here.result, motion), &there.result) / 1000.0, 0.0, 1e-6);
    assert_close(there.metrics.alignment_rms / here.metrics.alignment_rms, 1.0, 1e-4);
    assert_close(there.metrics.diagram_area / here.metrics.diagram_area, 1.0, 1e-4);
    let curvature = |r: &Solution| r.metrics.mean_curvature_max;
    assert_close(curvature(&there) * 1000.0 / curvature(&here), 1.0, 1e-5);
}

#[test]
fn the_result_does_not_depend_on_the_parametrisation_of_the_domain() {
    let saddle = Shape::Saddle.surface(8, 7, 4, 4);
    let stretched = |k: &KnotVector, scale: f64| {
        let knots = k.knots().iter().map(|t| 3.0 + scale * t).collect();
        KnotVector::new(k.degree(), knots).expect("sorted knots")
    };
    let (u, v) = (stretched(saddle.knots_u(), 40.0), stretched(saddle.knots_v(), 0.01));
    let same = BsplineSurface::new(u, v, saddle.control_points().to_vec(), None).expect("a net");
    let (here, there) = (run(&saddle, &few(4)), run(&same, &few(4)));
    assert_close(distance(&here.result, &there.result), 0.0, 1e-6);
    assert_close(there.metrics.diagram_area / here.metrics.diagram_area, 1.0, 1e-5);
    assert_close(there.before.alignment_rms / here.before.alignment_rms, 1.0, 1e-9);
}

#[test]
fn swapping_the_parameters_swaps_the_result() {
    let saddle = Shape::Saddle.surface(9, 7, 4, 4);
    let swapped = |s: &BsplineSurface| {
        let points = (0..63).map(|k| s.control_point(k % s.n_u(), k / s.n_u())).collect();
        BsplineSurface::new(s.knots_v().clone(), s.knots_u().clone(), points, None).expect("a net")
    };
    let (here, there) = (run(&saddle, &few(4)), run(&swapped(&saddle), &few(4)));
    assert_close(distance(&swapped(&here.result), &there.result), 0.0, 1e-6);
    // The normal turns around, and mean curvature with it.
    let turned = there.metrics.mean_curvature_min + here.metrics.mean_curvature_max;
    assert_close(turned, 0.0, 1e-5);
}

#[test]
fn exact_surfaces_stay_where_they_are() {
    for (name, surface) in
        [("plane", plane(8, 7, 4)), ("sphere", sphere_cap(4, 3)), ("torus", torus_patch(2, 3))]
    {
        let result = run(&surface, &few(10));
        assert_eq!(result.report.status, Status::Converged, "{name}");
        assert!(result.metrics.deviation_max_percent < 1e-4, "{name}");
        assert_eq!(result.result.weights(), surface.weights(), "{name}");
        let m = result.metrics;
        assert!(m.alignment_rms.is_finite() && m.diagram_area < 1e-9, "{name}: {m:?}");
    }
}

#[test]
fn a_rational_surface_keeps_its_weights_and_improves() {
    let roof = Shape::Roof.surface(8, 8, 4, 4);
    let weights: Vec<f64> = (0..64).map(|k| 1.0 + 0.2 * (f64::from(k) * 0.7).sin()).collect();
    let points = roof.control_points().to_vec();
    let (u, v) = (roof.knots_u().clone(), roof.knots_v().clone());
    let rational = BsplineSurface::new(u, v, points, Some(weights)).expect("a rational net");
    let result = run(&rational, &few(8));
    assert_eq!(result.result.weights(), rational.weights());
    assert!(result.metrics.diagram_area < 0.5 * result.before.diagram_area);
}

#[test]
fn the_seam_of_a_tube_is_as_smooth_as_the_rest() {
    let result = run(&Shape::Tube.surface(14, 12, 4, 4), &few(6));
    assert!(result.result.knots_u().is_periodic());
    let (start, end) = result.result.knots_u().domain();
    for v in [0.1, 0.5, 0.8] {
        let (a, b) = (result.result.jet(start, v, 3), result.result.jet(end - 1e-12, v, 3));
        for k in 0..10 {
            let size = a.derivatives[k].length().max(1.0);
            assert_close((a.derivatives[k] - b.derivatives[k]).length() / size, 0.0, 1e-7);
        }
    }
}

#[test]
fn relations_are_approached() {
    let vault = Shape::Vault.surface(10, 10, 4, 4);
    let with = |relation: Relation, closeness: f64, iterations: usize| {
        let options = Options { relation, closeness, ..few(iterations) };
        let result = run(&vault, &options);
        (result.before.relation_rms, result.metrics.relation_rms, result)
    };
    let (before, after, _) = with(Relation::Minimal, 1e-3, 20);
    assert!(after < 0.05 * before, "minimal: {before} -> {after}");
    let (before, after, _) = with(Relation::ConstantMeanFit, 1e-3, 20);
    assert!(after < 0.1 * before, "cmc: {before} -> {after}");
    let (before, after, _) = with(Relation::Developable, 1e-3, 30);
    assert!(after < 0.1 * before, "developable: {before} -> {after}");
    let (before, after, result) = with(Relation::LinearFit, 1e-2, 20);
    assert!(after < 0.1 * before, "linear: {before} -> {after}");
    assert!(result.metrics.diagram_area < 0.2 * result.before.diagram_area);
    let (before, after, _) = with(Relation::CurveFit, 1e-2, 20);
    assert!(after < 0.3 * before, "curve: {before} -> {after}");
    let (before, after, _) = with(Relation::Ratio(-1.0), 1e-3, 20);
    assert!(after < 0.05 * before, "ratio: {before} -> {after}");
    let (before, after, _) = with(Relation::ConstantGauss(-0.05), 1e-3, 20);
    assert!(after < 0.2 * before, "gauss: {before} -> {after}");
}

#[test]
fn the_locus_of_a_relation_is_told_in_the_model_s_units() {
    let vault = Shape::Vault.surface(10, 10, 4, 4);
    let locus = |relation: Relation| {
        let result = run(&vault, &Options { relation, ..few(1) });
        let Metrics { mean_curvature_min: low, mean_curvature_max: high, .. } = result.metrics;
        (result.relation, [low, high])
    };
    assert_eq!(locus(Relation::Free).0, None);
    let given = [
        (Relation::Minimal, "H = 0"),
        (Relation::ConstantMean(-0.125), "H = -0.125"),
        (Relation::Developable, "K = 0"),
        (Relation::ConstantGauss(-0.05), "K = -0.05"),
        (Relation::Linear(0.5, 2.0, -0.25), "K = -0.25 H + 0.125"),
        (Relation::Ratio(-1.5), "κ₁ = -1.5 κ₂"),
    ];
    for (relation, want) in given {
        assert_eq!(locus(relation).0.unwrap().to_string(), want);
    }
    // The fitted value is the mean over the input; the line passes through the cloud.
    let (fitted, [low, high]) = locus(Relation::ConstantMeanFit);
    assert!(
        fitted.unwrap().points([low, high], [0.0, 0.1]).iter().all(|p| p[0] > low && p[0] < high)
    );
    // A curve starts and ends at its first and last control point.
    let control = vec![[-0.2, 0.0], [0.0, 0.3], [0.1, -0.1], [0.2, 0.05]];
    let Some(RelationLocus::Curve { points, .. }) = locus(Relation::Curve(control.clone())).0
    else {
        panic!("a curve stays a curve");
    };
    for (got, want) in [(points[0], control[0]), (points[points.len() - 1], control[3])] {
        assert_close(got[0], want[0], 1e-12);
        assert_close(got[1], want[1], 1e-12);
    }
    // Its control polygon is wider than the curve itself.
    let highest = points.iter().map(|p| p[1]).fold(f64::MIN, f64::max);
    assert!(highest > 0.05 && highest < 0.2, "{highest}");
}

#[test]
fn borders_are_held_as_asked() {
    let roof = Shape::Roof.surface(9, 9, 4, 4);
    let with = |border| run(&roof, &Options { border, ..few(8) }).metrics;
    let (free, glide, fixed) = (with(Border::Free), with(Border::Glide), with(Border::Fixed));
    assert!(free.boundary_deviation_max_percent > 0.3);
    assert!(glide.boundary_deviation_max_percent < free.boundary_deviation_max_percent);
    assert_close(fixed.boundary_deviation_max_percent, 0.0, 1e-10);
    assert!(fixed.diagram_area < 0.7 && glide.diagram_area < 0.5);
}

#[test]
fn geodesic_parallels_make_a_near_helical_surface_more_helical() {
    let surface = Shape::Helical.surface(16, 10, 5, 5);
    let options = Options { parallel: 0.2, closeness: 1e-3, fairness: 1e-2, ..few(10) };
    let result = run(&surface, &options);
    let history = &result.report.stages[0].solver.history;
    let names: Vec<&str> =
        result.report.stages[0].solver.terms.iter().map(|t| t.name.as_str()).collect();
    for name in ["parallel_h", "parallel_k"] {
        let k = names.iter().position(|n| *n == name).expect("the term");
        let last = history[history.len() - 1].terms[k];
        assert!(last < 0.1 * history[0].terms[k], "{name}: {last}");
    }
}

#[test]
fn a_moved_control_point_makes_a_new_reference() {
    let saddle = Shape::Saddle.surface(8, 8, 4, 4);
    let moves = vec![Move { i: 3, j: 4, by: [0.0, 0.0, 0.2] }];
    let result = run(&saddle, &Options { moves: moves.clone().into(), ..few(0) });
    let moved = result.result.control_point(3, 4) - saddle.control_point(3, 4);
    assert_close(moved.z, 0.2, 1e-12);
    assert!(result.metrics.deviation_max_percent > 1.0);
    let bad = Options { moves: vec![Move { i: 8, ..moves[0] }].into(), ..few(0) };
    let error = solve(&saddle, &bad, &mut ()).expect_err("no such point");
    assert!(error.to_string().contains("(8, 4) cannot be moved"), "{error}");
}

/// Stops after so many observations and keeps the last state, or goes on from one.
struct Interrupter {
    left: usize,
    state: Option<Checkpoint>,
    resume: Option<Checkpoint>,
}

impl Interrupter {
    fn new(left: usize, resume: Option<Checkpoint>) -> Self {
        Self { left, state: None, resume }
    }
}

impl Observer for Interrupter {
    fn step(&mut self, _: &Progress<'_>) -> ControlFlow<()> {
        if self.left == 0 {
            return ControlFlow::Break(());
        }
        self.left -= 1;
        ControlFlow::Continue(())
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.state = Some(state());
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resume.take()
    }
}

#[test]
fn a_resumed_run_ends_with_the_same_bytes() {
    let saddle = Shape::Saddle.surface(8, 8, 4, 4);
    let levels = vec![Counts { u: 7, v: 7 }, Counts { u: 9, v: 8 }];
    let plain = Options { levels: levels.into(), ..few(4) };
    let lifted = Options { formulation: Formulation::Lifted, ..plain.clone() };
    // What follows the iterate: feet on the border, coefficients of the relation.
    let glide = Options { border: Border::Glide, relation: Relation::LinearFit, ..plain.clone() };
    let curve = Relation::Curve(vec![[-0.4, -0.3], [0.0, -0.2], [0.3, -0.1]]);
    let curve = Options { relation: curve, ..plain.clone() };
    for options in [plain, lifted, glide, curve] {
        let whole = run(&saddle, &options);
        for left in 0..10 {
            let case = format!("{options:?} stopped after {left}");
            let mut first = Interrupter::new(left, None);
            let part = solve(&saddle, &options, &mut first).expect("a run");
            assert_eq!(part.report.status, Status::Interrupted, "{case}");
            let text = serde_json::to_string(&first.state.expect("a state")).expect("numbers");
            let state: Checkpoint = serde_json::from_str(&text).expect("the same numbers");
            let mut second = Interrupter::new(usize::MAX, Some(state.clone()));
            let rest = solve(&saddle, &options, &mut second).expect("the rest");
            assert_eq!(rest.result, whole.result, "{case}");
            assert_eq!(rest.metrics, whole.metrics, "{case}");
            assert_eq!(rest.report.status, whole.report.status, "{case}");
            assert_eq!(rest.report.iterations, whole.report.iterations, "{case}");
            let other = Options { closeness: 0.7, ..options.clone() };
            let error = solve(&saddle, &other, &mut Interrupter::new(0, Some(state)));
            let is_foreign =
                matches!(error, Err(Error::Solver(SolverError::ForeignCheckpoint { .. })));
            assert!(is_foreign, "{error:?}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let roof = Shape::Roof.surface(10, 9, 4, 4);
    let with = |threads: usize, formulation: Formulation| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| run(&roof, &Options { formulation, ..few(3) }).result)
    };
    for formulation in [Formulation::Reduced, Formulation::Lifted] {
        let one = with(1, formulation);
        for threads in [2, 4] {
            assert_eq!(one, with(threads, formulation));
        }
    }
}

#[test]
fn what_cannot_be_attempted_is_refused_with_a_sentence() {
    let roof = Shape::Roof.surface(8, 8, 4, 4);
    let message = |surface: &BsplineSurface, options: &Options| {
        solve(surface, options, &mut ()).expect_err("an error").to_string()
    };
    let nothing = mapped(&roof, |_| DVec3::ONE);
    assert!(message(&nothing, &few(1)).contains("equal ("));
    // A pole: the first row of the net in one point.
    let points = roof.control_points().iter().enumerate();
    let pinched = points.map(|(k, p)| if k < 8 { DVec3::ZERO } else { *p }).collect();
    let pinched = roof.with_control_points(pinched).expect("finite");
    assert!(message(&pinched, &few(1)).contains("pinched at u = 0"));
    let line = mapped(&roof, |p| DVec3::new(p.x, 0.0, 0.0));
    assert!(message(&line, &few(1)).contains("pinched"));
    let levels = |n| Options { levels: vec![n].into(), ..few(1) };
    assert!(message(&roof, &levels(Counts { u: 3, v: 9 })).contains("level 3x9"));
    assert!(message(&roof, &levels(Counts { u: 9, v: 99_999 })).contains("99999 control points"));
    let samples = Options { samples: Some(Counts { u: 1, v: 9 }), ..few(1) };
    assert!(message(&roof, &samples).contains("too few"));
    let closeness = f64::NAN;
    assert!(message(&roof, &Options { closeness, ..few(1) }).contains("`closeness` is NaN"));
    let relation = Relation::Linear(0.0, 0.0, 1.0);
    assert!(message(&roof, &Options { relation, ..few(1) }).contains("`relation` is 0"));
    let short = Options { relation: Relation::Curve(vec![[0.0, 0.0]]), ..few(1) };
    assert!(message(&roof, &short).contains("at least 2"));
    let lifted =
        Options { relation: Relation::Minimal, formulation: Formulation::Lifted, ..few(1) };
    assert!(message(&roof, &lifted).contains("reduced formulation"));
}
