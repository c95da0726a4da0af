//! Panelings within bounds on kinks, gaps and the distance from the design, and how few molds they
//! need.

#![allow(clippy::unwrap_used, reason = "a test stops at the first fault")]

use bspline::BsplineSurface;
use fixtures::surfaces::{Shape, plane, sphere_cap, torus_patch};
use gp_solver::{Counts, List, Status};
use paneling::{Error, MoldType, Options, Solution, solve};

fn options(side: usize, degrees: f64, types: &[MoldType]) -> Options {
    Options {
        panels: Some(Counts { u: side, v: side }),
        max_kink_deg: Some(degrees),
        mold_types: List(types.to_vec()),
        compare_grid: false,
        ..Options::default()
    }
}

fn within(surface: &BsplineSurface, options: &Options) -> Solution {
    let solution = solve(surface, options, &mut ()).unwrap();
    let (metrics, measures) = (&solution.metrics, &solution.result.measures);
    assert_eq!(solution.report.status, Status::Converged, "{metrics:?}");
    assert!(metrics.worst_excess.unwrap() <= 1.0);
    // Recomputed from what is given out, not from what the search has judged.
    let degrees = options.max_kink_deg.unwrap();
    assert!(measures.kinks.max.to_degrees() <= degrees * (1.0 + 1e-9));
    assert!(measures.max_deviation() <= metrics.max_deviation.unwrap() * (1.0 + 1e-9));
    solution
}

#[test]
fn surfaces_that_are_molds_themselves_need_one() {
    let cases = [
        (plane(6, 6, 3), vec![MoldType::Plane]),
        (plane(6, 6, 3), vec![MoldType::Cubic]),
        (sphere_cap(4, 3), vec![MoldType::Sphere]),
        (torus_patch(4, 4), vec![MoldType::Torus]),
        (plane(6, 6, 3), MoldType::ALL.to_vec()),
        (sphere_cap(4, 3), MoldType::ALL.to_vec()),
        (torus_patch(4, 4), vec![MoldType::Plane, MoldType::Sphere, MoldType::Torus]),
    ];
    for (surface, types) in cases {
        let solution = within(&surface, &options(8, 1e-6, &types));
        let quality = solution.metrics.quality;
        assert_eq!(quality.molds, 1, "{types:?}");
        assert!(quality.kink_max_deg <= 1e-6, "{types:?}: {}", quality.kink_max_deg);
    }
}

#[test]
fn loose_bounds_do_not_flatten_the_design() {
    let roof = Shape::Roof.surface(14, 14, 4, 4);
    let types = [MoldType::Plane, MoldType::Cubic];
    let solution = within(&roof, &options(12, 1.0, &types));
    assert!(solution.metrics.quality.deviation_max_percent <= 0.2);
    let design = solution.panels.extent();
    assert!((solution.metrics.max_deviation.unwrap() - 0.002 * design).abs() <= 1e-12 * design);
    // Planes alone cannot: the design is kept, and the bound on kinks is called unmet.
    let planes = options(12, 1.0, &[MoldType::Plane]);
    let solution = solve(&roof, &planes, &mut ()).unwrap();
    assert_eq!(solution.report.status, Status::Infeasible);
    assert!(solution.metrics.quality.deviation_max_percent <= 0.2);
    assert!(solution.metrics.worst_excess.unwrap() > 1.0);
    // Unless the design may be left.
    let loose = Options { max_deviation: Some(0.2 * design), max_kink_deg: Some(5.0), ..planes };
    assert!(within(&roof, &loose).metrics.quality.deviation_max_percent > 0.2);
}

#[test]
fn a_bound_on_the_design_can_stand_alone() {
    let roof = Shape::Roof.surface(14, 14, 4, 4);
    let mut before = usize::MAX;
    for deviation in [1e-5, 1e-3, 0.1] {
        let bound = Options {
            max_kink_deg: None,
            max_deviation: Some(deviation),
            ..options(8, 1.0, &[MoldType::Sphere])
        };
        let solution = solve(&roof, &bound, &mut ()).unwrap();
        let most = solution.result.measures.max_deviation();
        assert_eq!(solution.report.status == Status::Converged, most <= deviation * (1.0 + 1e-9));
        if solution.report.status == Status::Converged {
            assert!(solution.metrics.quality.molds <= before);
            before = solution.metrics.quality.molds;
        }
    }
    assert_eq!(before, 1);
    let both = Options { molds: Some(3), max_deviation: Some(1.0), ..Options::default() };
    assert_eq!(both.check(), Err(Error::SeveralRules));
    for (name, options) in [
        ("max_deviation", Options { max_deviation: Some(f64::NAN), ..Options::default() }),
        ("effort", Options { effort: 0.0, ..Options::default() }),
    ] {
        assert!(matches!(options.check(), Err(Error::BadOption { name: n, .. }) if n == name));
    }
}

#[test]
fn looser_bounds_need_no_more_molds_and_the_slack_is_spent() {
    let roof = Shape::Roof.surface(14, 14, 4, 4);
    let mut before = usize::MAX;
    for degrees in [0.3, 0.6, 1.2, 2.4, 4.8] {
        let quality = within(&roof, &options(12, degrees, &[MoldType::Cubic])).metrics.quality;
        assert!(quality.molds <= before, "{degrees}: {} after {before}", quality.molds);
        // With more than one mold the bound is nearly reached.
        assert!(quality.molds == 1 || quality.kink_max_deg >= 0.8 * degrees);
        before = quality.molds;
    }
    assert_eq!(before, 1);
}

#[test]
fn within_bounds_every_gap_is_too() {
    let roof = Shape::Roof.surface(14, 14, 4, 4);
    let free = within(&roof, &options(10, 1.0, &[MoldType::Cubic]));
    let most = 0.3 * free.result.measures.gaps.max;
    let bounded = Options { max_gap: Some(most), ..options(10, 1.0, &[MoldType::Cubic]) };
    let held = within(&roof, &bounded);
    assert!(held.result.measures.gaps.max <= most * (1.0 + 1e-9));
    assert!(held.metrics.quality.molds >= free.metrics.quality.molds);
}

#[test]
fn panels_and_blanks_have_their_sizes() {
    use paneling::{Input, Price, PriceList};
    // 1.5 by 1 in panels of 0.375 by 0.25.
    let flat = plane(6, 6, 3);
    let options = Options { compare_grid: false, ..options(4, 1.0, &[MoldType::Plane]) };
    let price = Price { mold: 10.0, panel: 2.0, area: 100.0 };
    let input = Input::from(&flat).with_prices(PriceList::new([(MoldType::Plane, price)]));
    let solution = solve(input, &options, &mut ()).unwrap();
    let metrics = solution.metrics;
    let [long, broad] = solution.panels.breadths(5);
    assert!((long - 0.375).abs() < 1e-12 && (broad - 0.25).abs() < 1e-12);
    assert!((metrics.panel_area - 1.5).abs() < 1e-12);
    assert_eq!(metrics.quality.molds, 1);
    // The blank holds at least the largest panel.
    assert!(metrics.blank_area >= 0.375 * 0.25 - 1e-12);
    let cost = 10.0 + 16.0 * 2.0 + 100.0 * metrics.blank_area;
    assert!((metrics.cost - cost).abs() < 1e-9);
    use paneling::SheetSize;
    let limit =
        |width, height| Options { panel_max: Some(SheetSize { width, height }), ..options.clone() };
    assert!(solve(&flat, &limit(0.26, 0.38), &mut ()).is_ok());
    let error = solve(&flat, &limit(0.3, 0.3), &mut ()).unwrap_err();
    assert!(matches!(error, Error::PanelTooLarge { panel: 0, .. }), "{error}");
}
