//! What holds for any surface and any setting: random nets, similarities, relations, loci.

use bspline::{BsplineSurface, Degree, KnotVector};
use geom_core::{DMat3, DVec3};
use gp_solver::OptionValue;
use proptest::collection::vec;
use proptest::prelude::*;
use std::f64::consts::TAU;
use weingarten::{Border, Metrics, Options, Relation, RelationLocus, Solution, solve};

/// Control points of a random net in u and v.
const NET: [usize; 2] = [7, 6];

/// A net of degree four over a rectangle, its heights a paraboloid or a saddle, each a bit off.
fn surfaces() -> impl Strategy<Value = BsplineSurface> {
    let heights = vec(-0.05..0.05_f64, NET[0] * NET[1]);
    (heights, -0.6..0.6_f64, -0.6..0.6_f64).prop_map(|(heights, a, b)| {
        let degree = Degree::new(4).expect("a degree");
        let [u, v] = NET.map(|n| KnotVector::clamped_uniform(degree, n).expect("enough points"));
        let (x, y) = (u.greville_points(), v.greville_points());
        let pairs = x.iter().flat_map(|&x| y.iter().map(move |&y| (2.0 * x - 1.0, 2.0 * y - 1.0)));
        let point = |((x, y), z): ((f64, f64), f64)| DVec3::new(x, y, a * x * x + b * y * y + z);
        let points = pairs.zip(heights).map(point).collect();
        BsplineSurface::new(u, v, points, None).expect("a net")
    })
}

fn rotation() -> impl Strategy<Value = DMat3> {
    (0.0..TAU, 0.0..TAU, 0.0..TAU).prop_map(|(a, b, c)| {
        DMat3::from_rotation_x(a) * DMat3::from_rotation_y(b) * DMat3::from_rotation_z(c)
    })
}

fn relations() -> impl Strategy<Value = Relation> {
    let x = || -5.0..5.0_f64;
    prop_oneof![
        Just(Relation::Free),
        Just(Relation::LinearFit),
        Just(Relation::Minimal),
        Just(Relation::ConstantMeanFit),
        Just(Relation::Developable),
        Just(Relation::CurveFit),
        (x(), x(), x()).prop_map(|(a, b, c)| Relation::Linear(a, b, c)),
        x().prop_map(Relation::ConstantMean),
        x().prop_map(Relation::ConstantGauss),
        x().prop_map(Relation::Ratio),
        vec([x(), x()], 2..6).prop_map(Relation::Curve),
    ]
}

fn few(iterations: usize) -> Options {
    Options { iterations, ..Default::default() }
}

fn run(surface: &BsplineSurface, options: &Options) -> Solution {
    solve(surface, options, &mut ()).expect("a surface to optimise")
}

fn measured(surface: &BsplineSurface) -> Metrics {
    run(surface, &few(0)).before
}

fn mapped(surface: &BsplineSurface, map: impl Fn(DVec3) -> DVec3) -> BsplineSurface {
    let points = surface.control_points().iter().map(|p| map(*p)).collect();
    surface.with_control_points(points).expect("finite points")
}

/// That two numbers agree to this share of `size`.
fn near(got: f64, want: f64, size: f64) -> Result<(), TestCaseError> {
    prop_assert!((got - want).abs() <= 1e-9 * size, "got {got:e}, wanted {want:e} of {size:e}");
    Ok(())
}

/// The largest size of the mean curvature, with the square of which Gaussian curvature compares.
fn size(m: &Metrics) -> f64 {
    let k = m.gaussian_curvature_min.abs().max(m.gaussian_curvature_max.abs());
    m.mean_curvature_min.abs().max(m.mean_curvature_max.abs()).max(k.sqrt())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn measures_follow_a_similarity(
        surface in surfaces(), turn in rotation(), power in -3.0..3.0_f64, shift in -9.0..9.0_f64,
    ) {
        let scale = 10.0_f64.powf(power);
        let moved = mapped(&surface, |p| scale * (turn * (p + shift)));
        let (here, there) = (measured(&surface), measured(&moved));
        near(there.alignment_rms, here.alignment_rms, 1.0)?;
        near(there.diagram_area, here.diagram_area, 1.0)?;
        let size = size(&here);
        near(there.mean_curvature_min * scale, here.mean_curvature_min, size)?;
        near(there.mean_curvature_max * scale, here.mean_curvature_max, size)?;
        let area = scale * scale;
        near(there.gaussian_curvature_min * area, here.gaussian_curvature_min, size * size)?;
        near(there.gaussian_curvature_max * area, here.gaussian_curvature_max, size * size)?;
    }

    #[test]
    fn a_reflection_changes_the_sign_of_mean_curvature_only(surface in surfaces()) {
        let (here, there) = (measured(&surface), measured(&mapped(&surface, |p| -p)));
        let size = size(&here);
        near(there.mean_curvature_min, -here.mean_curvature_max, size)?;
        near(there.mean_curvature_max, -here.mean_curvature_min, size)?;
        near(there.gaussian_curvature_min, here.gaussian_curvature_min, size * size)?;
        near(there.alignment_rms, here.alignment_rms, 1.0)?;
        near(there.diagram_area, here.diagram_area, 1.0)?;
    }

    #[test]
    fn exchanged_parameters_turn_the_normal_around(surface in surfaces()) {
        let [n_u, n_v] = NET;
        let points = (0..n_u * n_v).map(|k| surface.control_point(k % n_u, k / n_u)).collect();
        let (u, v) = (surface.knots_u().clone(), surface.knots_v().clone());
        let turned = BsplineSurface::new(v, u, points, None).expect("a net");
        let (here, there) = (measured(&surface), measured(&turned));
        near(there.mean_curvature_max, -here.mean_curvature_min, size(&here))?;
        near(there.alignment_rms, here.alignment_rms, 1.0)?;
        near(there.diagram_area, here.diagram_area, 1.0)?;
    }

    #[test]
    fn no_steps_leave_the_surface_as_it_is(surface in surfaces()) {
        let solution = run(&surface, &few(0));
        prop_assert_eq!(&solution.result, &surface);
        prop_assert_eq!(solution.before, solution.metrics);
        // Tables of basis functions on one side, single points on the other: equal to rounding.
        prop_assert!(solution.metrics.deviation_max_percent < 1e-13);
    }

    #[test]
    fn a_step_is_taken_only_if_it_lowers_the_energy(surface in surfaces()) {
        let solution = run(&surface, &few(4));
        let history = &solution.report.stages[0].solver.history;
        // Judged by what the step was taken for; where discriminants follow the iterate, the energy
        // that is recorded may be larger.
        prop_assert!(history.iter().all(|record| record.decrease >= 0.0), "{history:?}");
        for record in history {
            let sum: f64 = record.terms.iter().sum();
            near(sum, record.energy, record.energy)?;
        }
    }

    #[test]
    fn scaling_by_a_power_of_two_scales_the_result_to_the_bit(
        surface in surfaces(), power in -8..8_i32,
    ) {
        let scale = 2.0_f64.powi(power);
        let here = run(&surface, &few(3));
        let there = run(&mapped(&surface, |p| scale * p), &few(3));
        prop_assert_eq!(mapped(&here.result, |p| scale * p), there.result);
        prop_assert_eq!(here.metrics.deviation_max_percent, there.metrics.deviation_max_percent);
    }

    #[test]
    fn a_fixed_border_does_not_move(surface in surfaces()) {
        let solution = run(&surface, &Options { border: Border::Fixed, ..few(3) });
        let [n_u, n_v] = NET;
        let border = |k: &usize| {
            [0, n_u - 1].contains(&(k / n_v)) || [0, n_v - 1].contains(&(k % n_v))
        };
        let (before, after) = (surface.control_points(), solution.result.control_points());
        for k in (0..n_u * n_v).filter(border) {
            prop_assert!(before[k].distance(after[k]) <= 1e-14 * before[k].length());
        }
    }

    #[test]
    fn the_deviation_is_the_largest_distance_on_the_check_grid(surface in surfaces()) {
        let solution = run(&surface, &few(2));
        // Cell midpoints of twice the samples, and the diagonal of the control points.
        let [m_u, m_v] = solution.samples.map(|m| 2 * m);
        let points = surface.control_points().iter();
        let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(*p), high.max(*p))
        });
        let mut largest = 0.0_f64;
        for k in 0..m_u * m_v {
            let middle = |k: usize, m: usize| (k as f64 + 0.5) / m as f64;
            let (u, v) = (middle(k / m_v, m_u), middle(k % m_v, m_v));
            largest = largest.max(surface.point(u, v).distance(solution.result.point(u, v)));
        }
        let percent = 100.0 * largest / low.distance(high);
        near(solution.metrics.deviation_max_percent_box, percent, percent)?;
    }
}

proptest! {
    #[test]
    fn relations_are_read_as_they_are_printed(relation in relations()) {
        let text = relation.print().expect("every relation has a text");
        prop_assert_eq!(Relation::read(&text), Ok(relation));
    }

    #[test]
    fn points_of_a_line_obey_its_equation(
        a in -3.0..3.0_f64, b in -3.0..3.0_f64, c in -3.0..3.0_f64,
        h in [-2.0..0.0_f64, 0.1..2.0_f64], k in [-2.0..0.0_f64, 0.1..2.0_f64],
    ) {
        prop_assume!(a.abs().max(b.abs()) > 1e-3);
        for [x, y] in (RelationLocus::Line { a, b, c }).points(h, k) {
            let largest = (a * x).abs().max((b * y).abs()).max(c.abs());
            prop_assert!((a * x + b * y + c).abs() <= 1e-12 * largest, "{x}, {y}");
        }
    }

    #[test]
    fn points_of_a_ratio_are_those_of_real_curvatures(
        ratio in -3.0..3.0_f64, h in [-2.0..0.0_f64, 0.1..2.0_f64],
        k in [-2.0..0.0_f64, 0.1..2.0_f64],
    ) {
        for [x, y] in RelationLocus::Ratio(ratio).points(h, k) {
            // H² − K is the square of half the difference of the principal curvatures.
            prop_assert!(x * x - y >= -1e-12 * (x * x + y.abs()), "{x}, {y}");
        }
    }
}
