//! What holds for any spline: random degrees, knots, control points and weights.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use bspline::{BsplineCurve, BsplineSurface, Degree, KnotVector, SampleGrid, fit_curve};
use geom_core::{DMat3, DVec3, SurfaceJet};
use proptest::collection::vec;
use proptest::prelude::*;

/// Bounds for points, first and second derivatives. Knot spans down to a thousandth of the domain
/// make derivatives of order `k` as large as `10^(3k)`, so that these are far above rounding and
/// far below any real difference.
const BOUNDS: [f64; 3] = [1e-12, 1e-9, 1e-6];

fn near(got: DVec3, wanted: DVec3, bound: f64) -> Result<(), TestCaseError> {
    let off = got.distance(wanted);
    prop_assert!(off <= bound, "got {got}, wanted {wanted}: off by {off:e}, allowed {bound:e}");
    Ok(())
}

fn same_jet(got: &SurfaceJet, wanted: &SurfaceJet) -> Result<(), TestCaseError> {
    for order in 0..=2 {
        for b in 0..=order {
            near(got.d(order - b, b), wanted.d(order - b, b), BOUNDS[order])?;
        }
    }
    Ok(())
}

/// Knots with these distances between them, from 0 on.
fn knots(degree: usize, gaps: &[f64], periodic: bool) -> KnotVector {
    let degree = Degree::new(degree).unwrap();
    let mut breaks = vec![0.0];
    breaks.extend(gaps.iter().scan(0.0, |t, gap| {
        *t += gap;
        Some(*t)
    }));
    if periodic {
        return KnotVector::periodic(degree, &breaks).unwrap();
    }
    let (start, end) = (breaks[0], breaks[breaks.len() - 1]);
    let mut all = vec![start; degree.get()];
    all.extend(&breaks);
    all.extend(vec![end; degree.get()]);
    KnotVector::new(degree, all).unwrap()
}

fn points(coordinates: &[f64], count: usize) -> Vec<DVec3> {
    coordinates.chunks_exact(3).take(count).map(DVec3::from_slice).collect()
}

fn any_knots(periodic: impl Strategy<Value = bool>) -> impl Strategy<Value = KnotVector> {
    let gaps = vec(0.1..1.0_f64, 5..9);
    (1..=4_usize, gaps, periodic).prop_map(|(degree, gaps, p)| knots(degree, &gaps, p))
}

fn any_curve(periodic: impl Strategy<Value = bool>) -> impl Strategy<Value = BsplineCurve> {
    let controls = (vec(-1.0..1.0_f64, 36), proptest::option::of(vec(0.3..3.0_f64, 12)));
    (any_knots(periodic), controls).prop_map(|(knots, (coordinates, weights))| {
        let n = knots.control_count();
        let weights = weights.map(|w| w[..n].to_vec());
        BsplineCurve::new(knots, points(&coordinates, n), weights).unwrap()
    })
}

fn any_surface(rational: bool) -> impl Strategy<Value = BsplineSurface> {
    let direction = || (1..=3_usize, vec(0.1..1.0_f64, 4..6), any::<bool>());
    let controls = (vec(-1.0..1.0_f64, 192), vec(0.3..3.0_f64, 64), any::<bool>());
    (direction(), direction(), controls).prop_map(move |(u, v, (coordinates, weights, curved))| {
        let (u, v) = (knots(u.0, &u.1, u.2), knots(v.0, &v.1, v.2));
        let n = u.control_count() * v.control_count();
        let weights = (rational && curved).then(|| weights[..n].to_vec());
        BsplineSurface::new(u, v, points(&coordinates, n), weights).unwrap()
    })
}

/// The parameter at this share of the domain.
fn at(knots: &KnotVector, share: f64) -> f64 {
    let (start, end) = knots.domain();
    start + share * (end - start)
}

/// Knots to insert: each pick is an eighth of some span.
fn between(knots: &KnotVector, picks: &[(usize, u8)]) -> Vec<f64> {
    let breaks = knots.breaks();
    let mut added: Vec<f64> = picks
        .iter()
        .map(|&(span, eighth)| {
            let span = span % (breaks.len() - 1);
            breaks[span] + f64::from(eighth) / 8.0 * (breaks[span + 1] - breaks[span])
        })
        .collect();
    added.sort_by(f64::total_cmp);
    added.dedup();
    added
}

fn any_picks() -> impl Strategy<Value = Vec<(usize, u8)>> {
    vec((0..8_usize, 1..8_u8), 1..5)
}

/// A linear map far from singular, and a shift.
fn any_affine() -> impl Strategy<Value = (DMat3, DVec3)> {
    (vec(-0.4..0.4_f64, 9), vec(-3.0..3.0_f64, 3)).prop_map(|(m, t)| {
        let m: [f64; 9] = m.try_into().expect("nine entries");
        (DMat3::IDENTITY + DMat3::from_cols_array(&m), DVec3::from_slice(&t))
    })
}

/// Basis function `i` of degree `d` by the recursion of Cox and de Boor.
fn cox_de_boor(t: &[f64], i: usize, d: usize, x: f64) -> f64 {
    if d == 0 {
        return f64::from(u8::from(t[i] <= x && x < t[i + 1]));
    }
    let share = |a: f64, b: f64| if b > a { (x - a) / (b - a) } else { 0.0 };
    let falling = if t[i + d + 1] > t[i + 1] { 1.0 - share(t[i + 1], t[i + d + 1]) } else { 0.0 };
    share(t[i], t[i + d]) * cox_de_boor(t, i, d - 1, x) + falling * cox_de_boor(t, i + 1, d - 1, x)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn basis_functions_are_a_partition_of_unity(knots in any_knots(any::<bool>()), s in 0.0..1.0) {
        let basis = knots.basis(at(&knots, s), 3);
        let order = knots.degree().order();
        prop_assert!(basis.values[0][..order].iter().all(|b| *b >= 0.0));
        let sum = |k: usize| basis.values[k][..order].iter().sum::<f64>();
        let size = |k: usize| basis.values[k][..order].iter().map(|b| b.abs()).sum::<f64>();
        prop_assert!((sum(0) - 1.0).abs() < 1e-14);
        for k in 1..=3 {
            prop_assert!(sum(k).abs() <= 1e-13 * size(k), "derivative {k} sums to {}", sum(k));
        }
    }

    #[test]
    fn basis_functions_obey_cox_and_de_boor(knots in any_knots(any::<bool>()), s in 0.0..1.0) {
        let x = at(&knots, s);
        let basis = knots.basis(x, 0);
        let d = knots.degree().get();
        for r in 0..=d {
            let wanted = cox_de_boor(knots.knots(), basis.span - d + r, d, x);
            prop_assert!((basis.values[0][r] - wanted).abs() < 1e-14);
        }
    }

    #[test]
    fn greville_points_reproduce_the_parameter(knots in any_knots(Just(false)), s in 0.0..1.0) {
        let x = at(&knots, s);
        let line = knots.greville_points().iter().map(|&t| DVec3::new(t, 0.0, 0.0)).collect();
        let line = BsplineCurve::new(knots, line, None).unwrap();
        near(line.point(x), DVec3::new(x, 0.0, 0.0), 1e-14)?;
        near(line.derivatives(x, 1)[1], DVec3::X, 1e-12)?;
    }

    #[test]
    fn inserted_knots_keep_points_and_derivatives(
        curve in any_curve(any::<bool>()), picks in any_picks(), s in 0.0..1.0,
    ) {
        let finer = curve.insert_knots(&between(curve.knots(), &picks)).unwrap();
        let t = at(curve.knots(), s);
        let (got, wanted) = (finer.derivatives(t, 2), curve.derivatives(t, 2));
        for k in 0..=2 {
            near(got[k], wanted[k], BOUNDS[k])?;
        }
    }

    #[test]
    fn the_order_of_insertion_does_not_matter(
        curve in any_curve(any::<bool>()), picks in any_picks(),
    ) {
        let added = between(curve.knots(), &picks);
        let at_once = curve.insert_knots(&added).unwrap();
        let mut one_by_one = curve;
        for t in added.iter().rev() {
            one_by_one = one_by_one.insert_knots(&[*t]).unwrap();
        }
        prop_assert_eq!(one_by_one.knots(), at_once.knots());
        for (a, b) in one_by_one.control_points().iter().zip(at_once.control_points()) {
            near(*a, *b, 1e-12)?;
        }
    }

    #[test]
    fn an_elevated_degree_keeps_points_and_derivatives(
        curve in any_curve(any::<bool>()), more in 0..3_usize, s in 0.0..1.0,
    ) {
        let degree = Degree::new(curve.knots().degree().get() + more).unwrap();
        let elevated = curve.elevated(degree).unwrap();
        let t = at(curve.knots(), s);
        let (got, wanted) = (elevated.derivatives(t, 2), curve.derivatives(t, 2));
        for k in 0..=2 {
            near(got[k], wanted[k], BOUNDS[k])?;
        }
    }

    #[test]
    fn curves_follow_affine_maps(
        curve in any_curve(any::<bool>()), (map, shift) in any_affine(), s in 0.0..1.0,
    ) {
        let moved = curve.control_points().iter().map(|p| map * *p + shift).collect();
        let weights = curve.weights().map(<[f64]>::to_vec);
        let moved = BsplineCurve::new(curve.knots().clone(), moved, weights).unwrap();
        let t = at(curve.knots(), s);
        near(moved.point(t), map * curve.point(t) + shift, 1e-13)?;
        near(moved.derivatives(t, 1)[1], map * curve.derivatives(t, 1)[1], BOUNDS[1])?;
    }

    #[test]
    fn a_point_lies_in_the_hull_of_its_control_points(
        curve in any_curve(any::<bool>()), s in 0.0..1.0, direction in vec(-1.0..1.0_f64, 3),
    ) {
        let (t, direction) = (at(curve.knots(), s), DVec3::from_slice(&direction));
        let span = curve.knots().span(t);
        let reach = (0..curve.knots().degree().order())
            .map(|r| curve.control_points()[curve.knots().control_index(span, r)].dot(direction))
            .fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(curve.point(t).dot(direction) <= reach + 1e-14);
    }

    #[test]
    fn a_clamped_curve_leaves_along_its_control_polygon(curve in any_curve(Just(false))) {
        let (start, end) = curve.knots().domain();
        let control = curve.control_points();
        near(curve.point(start), control[0], 1e-14)?;
        near(curve.point(end), control[control.len() - 1], 1e-14)?;
        let d = curve.knots().degree().get();
        let speed = d as f64 / (curve.knots().knots()[d + 1] - start);
        let ratio = curve.weights().map_or(1.0, |w| w[1] / w[0]);
        let wanted = ratio * speed * (control[1] - control[0]);
        near(curve.derivatives(start, 1)[1], wanted, 1e-11)?;
    }

    #[test]
    fn a_curve_backwards_runs_through_the_same_points(
        curve in any_curve(any::<bool>()), s in 0.0..1.0,
    ) {
        let knots = curve.knots();
        let (start, end) = knots.domain();
        let gaps: Vec<f64> = knots.breaks().windows(2).rev().map(|b| b[1] - b[0]).collect();
        let degree = knots.degree().get();
        let turned = self::knots(degree, &gaps, knots.is_periodic());
        let mut control = curve.control_points().to_vec();
        let mut weights = curve.weights().map(<[f64]>::to_vec);
        control.reverse();
        weights.iter_mut().for_each(|w| w.reverse());
        if knots.is_periodic() {
            // Control point i has its support from knot i on, reversed from knot n + degree − i.
            let n = control.len();
            control.rotate_right(degree % n);
            weights.iter_mut().for_each(|w| w.rotate_right(degree % n));
        }
        let turned = BsplineCurve::new(turned, control, weights).unwrap();
        let t = at(knots, s);
        near(turned.point(start + end - t), curve.point(t), 1e-12)?;
    }

    #[test]
    fn periodic_seams_cannot_be_told(curve in any_curve(Just(true)), s in 0.0..1.0) {
        let knots = curve.knots();
        let (start, end) = knots.domain();
        let t = at(knots, s);
        near(curve.point(t + (end - start)), curve.point(t), BOUNDS[0])?;
        // All derivatives but the last, from the left of the seam and from its right.
        let last = knots.knots().len() - knots.degree().get() - 2;
        let left = knots.basis_on_span(last, end, 2);
        let right = knots.basis_on_span(knots.degree().get(), start, 2);
        let sum = |basis: &bspline::BasisValues, k: usize| -> DVec3 {
            let control = |r| curve.control_points()[knots.control_index(basis.span, r)];
            (0..knots.degree().order()).map(|r| basis.values[k][r] * control(r)).sum()
        };
        for k in 0..knots.degree().get().min(3) {
            near(sum(&left, k), sum(&right, k), BOUNDS[k])?;
        }
    }

    #[test]
    fn a_closed_curve_cut_open_keeps_its_points(curve in any_curve(Just(true)), s in 0.0..1.0) {
        let open = curve.clamped().unwrap();
        prop_assert!(open.knots().is_clamped() && !open.knots().is_periodic());
        let t = at(curve.knots(), s);
        near(open.point(t), curve.point(t), BOUNDS[0])?;
        let (start, end) = open.knots().domain();
        near(open.point(start), open.point(end), BOUNDS[0])?;
    }

    #[test]
    fn the_halves_of_a_split_curve_meet_and_lie_on_it(
        curve in any_curve(Just(false)), cut in 0.05..0.95, s in 0.0..1.0,
    ) {
        let d = curve.knots().degree().get();
        let t = at(curve.knots(), cut);
        let whole = curve.insert_knots(&vec![t; d - curve.knots().multiplicity(t)]).unwrap();
        let all = whole.knots().knots();
        let first = all.partition_point(|k| *k < t);
        let part = |knots: Vec<f64>, from: usize, to: usize| {
            let knots = KnotVector::new(curve.knots().degree(), knots).unwrap();
            let weights = whole.weights().map(|w| w[from..to].to_vec());
            BsplineCurve::new(knots, whole.control_points()[from..to].to_vec(), weights).unwrap()
        };
        // Each half takes the knot once more at its end; the control point there is both's.
        let left = part([&all[..first + d], &[t]].concat(), 0, first);
        let right = part([&[t], &all[first..]].concat(), first - 1, all.len() - d - 1);
        near(left.point(t), right.point(t), BOUNDS[0])?;
        let x = at(curve.knots(), s);
        let half = if x < t { &left } else { &right };
        near(half.point(x), curve.point(x), BOUNDS[0])?;
    }

    #[test]
    fn interpolation_gives_a_curve_back(curve in any_curve(Just(false))) {
        let knots = curve.knots();
        let polynomial =
            BsplineCurve::new(knots.clone(), curve.control_points().to_vec(), None).unwrap();
        let t = knots.greville_points();
        let samples: Vec<DVec3> = t.iter().map(|t| polynomial.point(*t)).collect();
        let fitted = fit_curve(knots, &t, &samples).unwrap();
        for (a, b) in fitted.control_points().iter().zip(polynomial.control_points()) {
            near(*a, *b, 1e-11)?;
        }
    }

    #[test]
    fn equal_weights_are_none(curve in any_curve(any::<bool>()), w in 0.1..10.0, s in 0.0..1.0) {
        let control = || curve.control_points().to_vec();
        let knots = || curve.knots().clone();
        let plain = BsplineCurve::new(knots(), control(), None).unwrap();
        let equal = BsplineCurve::new(knots(), control(), Some(vec![w; control().len()])).unwrap();
        let t = at(curve.knots(), s);
        let (got, wanted) = (equal.derivatives(t, 2), plain.derivatives(t, 2));
        for k in 0..=2 {
            near(got[k], wanted[k], BOUNDS[k])?;
        }
    }

    #[test]
    fn bezier_pieces_agree_with_the_surface(
        surface in any_surface(true), pick in 0..64_usize, s in 0.0..1.0, t in 0.0..1.0,
    ) {
        let pieces = surface.bezier_patches().unwrap();
        let piece = &pieces[pick % pieces.len()];
        let (du, dv) = (piece.u[1] - piece.u[0], piece.v[1] - piece.v[0]);
        let wanted = surface.jet(piece.u[0] + s * du, piece.v[0] + t * dv, 2);
        let mut got = piece.patch.jet(s, t, 2);
        for order in 0..=2 {
            for b in 0..=order {
                let scale = du.powi(order - b) * dv.powi(b);
                let index = SurfaceJet::index((order - b) as usize, b as usize);
                got.derivatives[index] /= scale;
            }
        }
        same_jet(&got, &wanted)?;
    }

    #[test]
    fn refined_surfaces_keep_their_jets(
        surface in any_surface(true), picks in [any_picks(), any_picks()], more in 0..2_usize,
        s in 0.0..1.0, t in 0.0..1.0,
    ) {
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let (u, v) = (at(ku, s), at(kv, t));
        let wanted = surface.jet(u, v, 2);
        let finer = surface.insert_knots(&between(ku, &picks[0]), &between(kv, &picks[1])).unwrap();
        same_jet(&finer.jet(u, v, 2), &wanted)?;
        let raised = |k: &KnotVector| Degree::new(k.degree().get() + more).unwrap();
        let elevated = surface.elevated(raised(ku), raised(kv)).unwrap();
        same_jet(&elevated.jet(u, v, 2), &wanted)?;
        same_jet(&surface.clamped().unwrap().jet(u, v, 2), &wanted)?;
    }

    #[test]
    fn a_surface_with_u_and_v_exchanged_has_exchanged_jets(
        surface in any_surface(true), s in 0.0..1.0, t in 0.0..1.0,
    ) {
        let (n_u, n_v) = (surface.n_u(), surface.n_v());
        let order = |k: usize| (k % n_u) * n_v + k / n_u;
        let control = (0..n_u * n_v).map(|k| surface.control_points()[order(k)]).collect();
        let weights = surface.weights().map(|w| (0..n_u * n_v).map(|k| w[order(k)]).collect());
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let turned = BsplineSurface::new(kv.clone(), ku.clone(), control, weights).unwrap();
        let (u, v) = (at(ku, s), at(kv, t));
        let mut wanted = surface.jet(u, v, 2);
        wanted.derivatives.swap(SurfaceJet::index(1, 0), SurfaceJet::index(0, 1));
        wanted.derivatives.swap(SurfaceJet::index(2, 0), SurfaceJet::index(0, 2));
        same_jet(&turned.jet(v, u, 2), &wanted)?;
    }

    #[test]
    fn parameter_lines_are_curves(surface in any_surface(false), s in 0.0..1.0, t in 0.0..1.0) {
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let (u, v) = (at(ku, s), at(kv, t));
        let rows = surface.control_points().chunks_exact(surface.n_v());
        let across = |row: &[DVec3]| {
            BsplineCurve::new(kv.clone(), row.to_vec(), None).unwrap().point(v)
        };
        let line = BsplineCurve::new(ku.clone(), rows.map(across).collect(), None).unwrap();
        let (jet, wanted) = (surface.jet(u, v, 2), line.derivatives(u, 2));
        for k in 0..=2 {
            near(jet.d(k, 0), wanted[k], BOUNDS[k])?;
        }
    }

    #[test]
    fn tables_and_grids_give_the_jets_of_single_points(
        surface in any_surface(false), s in vec(0.0..1.0_f64, 3), t in vec(0.0..1.0_f64, 4),
    ) {
        let u: Vec<f64> = s.iter().map(|s| at(surface.knots_u(), *s)).collect();
        let v: Vec<f64> = t.iter().map(|t| at(surface.knots_v(), *t)).collect();
        let grid = surface.jet_grid(&u, &v, 2);
        let table = SampleGrid::new(&surface, &u, &v, 2).jets(surface.control_points(), 2);
        for k in 0..12 {
            let wanted = surface.jet(u[k / 4], v[k % 4], 2);
            prop_assert_eq!(&grid[k], &wanted);
            same_jet(&table[k], &wanted)?;
        }
    }

    #[test]
    fn a_foot_point_is_no_farther_than_its_start(
        surface in any_surface(true), s in 0.0..1.0, t in 0.0..1.0, x in vec(-2.0..2.0_f64, 3),
    ) {
        let (u, v) = (at(surface.knots_u(), s), at(surface.knots_v(), t));
        let x = DVec3::from_slice(&x);
        let ([fu, fv], distance) = surface.foot_point(x, [u, v]);
        prop_assert!(distance <= surface.point(u, v).distance(x));
        prop_assert!((surface.point(fu, fv).distance(x) - distance).abs() < 1e-14);
        let inside = |k: &KnotVector, t: f64| (k.domain().0..=k.domain().1).contains(&t);
        prop_assert!(inside(surface.knots_u(), fu) && inside(surface.knots_v(), fv));
    }
}
