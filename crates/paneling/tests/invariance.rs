//! What panelings keep: moved, scaled, mirrored and renumbered inputs, and identities of the
//! numbers, on random surfaces.

#![allow(clippy::unwrap_used, reason = "a test stops at the first fault")]

use bspline::{BsplineSurface, Degree, KnotVector};
use geom_core::DVec3;
use gp_solver::{Counts, OptionValue, Status};
use paneling::{
    Clustering, Input, Layout, List, MoldType, Options, PanelSet, Pattern, Pose, Price, PriceList,
    Solution, mold_count, solve,
};
use proptest::prelude::*;

/// A bicubic patch over the unit square with heights of about a tenth.
fn patch(heights: &[f64]) -> BsplineSurface {
    let knots = KnotVector::clamped_uniform(Degree::new(3).unwrap(), 5).unwrap();
    let point = |k: usize| {
        let (x, y) = ((k / 5) as f64 / 4.0, (k % 5) as f64 / 4.0);
        DVec3::new(x, y, 0.25 * x * x - 0.15 * y * y + 0.05 * heights[k])
    };
    BsplineSurface::new(knots.clone(), knots, (0..25).map(point).collect(), None).unwrap()
}

fn surfaces() -> impl Strategy<Value = BsplineSurface> {
    prop::collection::vec(-1.0..1.0_f64, 25).prop_map(|heights| patch(&heights))
}

fn mapped(surface: &BsplineSurface, map: impl Fn(DVec3) -> DVec3) -> BsplineSurface {
    let points = surface.control_points().iter().map(|p| map(*p)).collect();
    surface.with_control_points(points).unwrap()
}

fn options(molds: usize) -> Options {
    Options {
        panels: Some(Counts { u: 4, v: 4 }),
        compare_grid: false,
        ..Options::with_molds(molds, MoldType::Cubic)
    }
}

fn solved<'a>(input: impl Into<Input<'a>>, options: &Options) -> Solution {
    solve(input, options, &mut ()).unwrap()
}

fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs()) + 1e-13
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn a_rigid_motion_moves_the_result_along(
        surface in surfaces(),
        axis in [-1.0..1.0_f64, -1.0..1.0_f64, 0.2..1.0_f64],
        angle in -3.0..3.0_f64,
        shift in [-2.0..2.0_f64, -2.0..2.0_f64, -2.0..2.0_f64],
    ) {
        let turn = glam::DQuat::from_axis_angle(DVec3::from_array(axis).normalize(), angle);
        let there = mapped(&surface, |p| turn * p + DVec3::from_array(shift));
        let (a, b) = (solved(&surface, &options(3)), solved(&there, &options(3)));
        let (a, b) = (a.metrics.quality, b.metrics.quality);
        prop_assert!(is_near(a.kink_median_deg, b.kink_median_deg, 1e-4), "{a:?} {b:?}");
        prop_assert!(is_near(a.kink_max_deg, b.kink_max_deg, 1e-4), "{a:?} {b:?}");
        prop_assert!(is_near(a.gap_max, b.gap_max, 1e-4), "{a:?} {b:?}");
    }

    #[test]
    fn a_scaling_by_a_power_of_two_scales_to_the_bit(surface in surfaces(), power in -6..7_i32) {
        let factor = 2.0_f64.powi(power);
        let there = mapped(&surface, |p| factor * p);
        let (a, b) = (solved(&surface, &options(3)), solved(&there, &options(3)));
        prop_assert_eq!(&a.result.labels, &b.result.labels);
        for (a, b) in a.result.molds.iter().zip(&b.result.molds) {
            prop_assert_eq!(a.scaled(factor), *b);
        }
        for (a, b) in a.result.poses.iter().zip(&b.result.poses) {
            prop_assert_eq!((factor * a.origin, a.rotation), (b.origin, b.rotation));
        }
        let (a, b) = (a.metrics.quality, b.metrics.quality);
        prop_assert!(is_near(a.kink_max_deg, b.kink_max_deg, 1e-6));
        prop_assert!(is_near(factor * a.gap_max, b.gap_max, 1e-6));
    }

    #[test]
    fn any_scaling_leaves_kinks_and_percentages(surface in surfaces(), factor in 0.01..100.0_f64) {
        let there = mapped(&surface, |p| factor * p);
        let (a, b) = (solved(&surface, &options(2)), solved(&there, &options(2)));
        let (a, b) = (a.metrics.quality, b.metrics.quality);
        prop_assert!(is_near(a.kink_median_deg, b.kink_median_deg, 1e-4));
        prop_assert!(is_near(a.gap_median_percent, b.gap_median_percent, 1e-4));
        prop_assert!(is_near(a.deviation_max_percent, b.deviation_max_percent, 1e-4));
    }

    #[test]
    fn a_mirrored_surface_is_panelled_as_well(surface in surfaces()) {
        let there = mapped(&surface, |p| DVec3::new(p.x, p.y, -p.z));
        let (a, b) = (solved(&surface, &options(1)), solved(&there, &options(1)));
        let (a, b) = (a.metrics.quality, b.metrics.quality);
        prop_assert!(is_near(a.kink_median_deg, b.kink_median_deg, 1e-2), "{a:?} {b:?}");
        prop_assert!(is_near(a.gap_median, b.gap_median, 1e-2), "{a:?} {b:?}");
    }

    #[test]
    fn energies_never_rise(surface in surfaces(), molds in 1..8_usize, of in 0..6_usize) {
        let kind = MoldType::ALL[of];
        let options = Options { mold_types: List(vec![kind]), ..options(molds) };
        let result = solved(&surface, &options).result;
        for history in [&result.fit_history, &result.seam_history] {
            let falls = history.windows(2).all(|e| e[1] <= e[0] * (1.0 + 1e-12));
            prop_assert!(falls, "{kind:?}: {history:?}");
        }
    }

    #[test]
    fn every_mold_is_used_and_no_more_than_asked_for(
        surface in surfaces(),
        molds in 1..17_usize,
        of in 0..3_usize,
    ) {
        let clustering = [Clustering::Own, Clustering::Grid, Clustering::Cover][of];
        let result = solved(&surface, &Options { clustering, ..options(molds) }).result;
        prop_assert!(result.molds.len() <= molds);
        prop_assert!(clustering != Clustering::Own || result.molds.len() == molds);
        for m in 0..result.molds.len() {
            prop_assert!(result.labels.contains(&m), "mold {m} is not used");
        }
    }

    #[test]
    fn the_cost_is_that_of_molds_and_panels(
        surface in surfaces(),
        mold in 0.0..100.0_f64,
        panel in 0.0..10.0_f64,
    ) {
        let prices = PriceList::new([(MoldType::Cubic, Price { mold, panel, area: 0.0 })]);
        let solution = solved(Input::from(&surface).with_prices(prices), &options(4));
        prop_assert!(is_near(solution.metrics.cost, 4.0 * mold + 16.0 * panel, 1e-14));
    }

    #[test]
    fn converged_means_within_the_bounds(surface in surfaces(), degrees in 0.2..8.0_f64) {
        let options =
            Options { max_kink_deg: Some(degrees), molds: None, max_deviation: Some(9.0), ..options(1) };
        let solution = solved(&surface, &options);
        let excess = solution.metrics.worst_excess.unwrap();
        let largest = solution.metrics.quality.kink_max_deg;
        prop_assert!(is_near(excess, largest / degrees, 1e-6));
        let is_within = solution.report.status == Status::Converged;
        prop_assert_eq!(is_within, excess <= 1.0);
        prop_assert!(is_within || solution.report.status == Status::Infeasible);
    }

    #[test]
    fn cut_panels_are_panelled_as_their_surface(surface in surfaces(), molds in 1..6_usize) {
        let layout = Layout::generate(Pattern::Quad, 4, 4, [false, false]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        let (a, b) = (solved(&surface, &options(molds)), solved(&set, &options(molds)));
        prop_assert_eq!(a.result, b.result);
        prop_assert_eq!(a.metrics, b.metrics);
    }

    #[test]
    fn spreads_rise_and_percentages_are_of_the_diagonal(surface in surfaces()) {
        let solution = solved(&surface, &options(3));
        let q = solution.metrics.quality;
        prop_assert!(q.kink_median_deg <= q.kink_p95_deg && q.kink_p95_deg <= q.kink_max_deg);
        prop_assert!(q.gap_median <= q.gap_p95 && q.gap_p95 <= q.gap_max);
        let percent = 100.0 * q.gap_max / solution.panels.extent();
        prop_assert!(is_near(q.gap_max_percent, percent, 1e-14));
    }

    #[test]
    fn the_number_of_molds_is_between_one_and_all(k in 0.0..1000.0_f64, panels in 1..100_000_usize) {
        let molds = mold_count(k, panels);
        prop_assert!(molds >= 1 && molds <= panels);
        let free = k * (panels as f64).sqrt();
        let is_free = free >= 1.0 && free <= panels as f64;
        prop_assert!(!is_free || (molds as f64 - free).abs() <= 0.5);
    }

    #[test]
    fn poses_go_there_and_back(
        point in [-9.0..9.0_f64, -9.0..9.0_f64, -9.0..9.0_f64],
        origin in [-9.0..9.0_f64, -9.0..9.0_f64, -9.0..9.0_f64],
        angle in -3.0..3.0_f64,
    ) {
        let axis = DVec3::new(0.2, -0.4, 0.7).normalize();
        let rotation = glam::DMat3::from_axis_angle(axis, angle);
        let pose = Pose { origin: DVec3::from_array(origin), rotation };
        let point = DVec3::from_array(point);
        prop_assert!((pose.to_world(pose.to_local(point)) - point).length() < 1e-13);
    }

    #[test]
    fn types_are_read_as_they_are_printed(picks in prop::collection::vec(0..6_usize, 1..6)) {
        let list = List(picks.iter().map(|&k| MoldType::ALL[k]).collect::<Vec<_>>());
        prop_assert_eq!(List::read(&list.print().unwrap()), Ok(list));
    }
}
