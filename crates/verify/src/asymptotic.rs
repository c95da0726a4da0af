//! Claims of `asymptotic`: Bézier patches bounded by asymptotic curves.

use crate::claims::Values;
use crate::quadrature::gauss;
use crate::shape::{Shape, angle_deg};
use crate::spline::{Jet, Spline};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Samples along every side for the normal curvature.
const BOUNDARY: usize = 201;
/// Samples of a patch in each direction.
const GRID: usize = 81;
/// Samples along a shared side for kinks and jumps.
const JOIN: usize = 41;
/// Corners this close, as a share of the size of all, are one.
const SAME_PLACE: f64 = 1e-9;

/// Numbers of one patch.
#[derive(Clone, Copy)]
struct Measured {
    thin_plate: f64,
    normal_curvature: f64,
    sine: f64,
    positive: f64,
}

pub(crate) fn recompute(patches: &[Spline], size: f64, values: &mut Values) {
    let is_bezier = |s: &Spline| {
        let [p, q] = s.degree();
        p == q && s.counts() == [p + 1, q + 1] && !s.is_rational()
    };
    if patches.is_empty() || !patches.iter().all(is_bezier) {
        return;
    }
    values.count("patches", patches.len());
    values.count("degree", patches.iter().map(|s| s.degree()[0]).max().unwrap_or(0));
    let measured: Vec<Measured> = patches.par_iter().map(measure).collect();
    let most = |f: fn(&Measured) -> f64| {
        measured.iter().map(f).fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) })
    };
    values.number("thin_plate_energy", measured.iter().map(|m| m.thin_plate).sum());
    values.number("normal_curvature_max", most(|m| m.normal_curvature));
    values.number("min_sine", measured.iter().map(|m| m.sine).fold(1.0, f64::min));
    let positive = measured.iter().map(|m| m.positive).sum::<f64>();
    values.number("positive_gauss_fraction", positive / patches.len() as f64);
    sides(patches, SAME_PLACE * size, values);
}

fn measure(patch: &Spline) -> Measured {
    let mut out =
        Measured { thin_plate: 0.0, normal_curvature: 0.0, sine: f64::INFINITY, positive: 0.0 };
    let rule = gauss(patch.degree()[0] + 1);
    let nodes: Vec<f64> = rule.iter().map(|(x, _)| *x).collect();
    let (us, vs) = (patch.ready(0, &nodes, 2), patch.ready(1, &nodes, 2));
    for (u, (_, w)) in us.iter().zip(&rule) {
        patch.row(u, &vs, |j, jet| {
            let d = &jet.d;
            let density = d[2][0].length_squared()
                + 2.0 * d[1][1].length_squared()
                + d[0][2].length_squared();
            out.thin_plate += w * rule[j].1 * density;
        });
    }
    let corner = |u: f64, v: f64| patch.jet(u, v, 0).d[0][0];
    let size = corner(1.0, 1.0)
        .distance(corner(0.0, 0.0))
        .max(corner(1.0, 0.0).distance(corner(0.0, 1.0)));
    let along = patch.equidistant(0, BOUNDARY);
    let bend = |jet: &Jet, by_u: bool| {
        let shape = Shape::new(jet);
        if by_u { shape.second[0] / shape.e } else { shape.second[2] / shape.g }
    };
    let mut worst = 0.0_f64;
    let mut add = |value: f64| worst = if value.is_nan() { f64::NAN } else { worst.max(value) };
    for jet in patch.jets(&along, &[0.0, 1.0], 2) {
        add(bend(&jet, true).abs() * size);
    }
    for jet in patch.jets(&[0.0, 1.0], &along, 2) {
        add(bend(&jet, false).abs() * size);
    }
    out.normal_curvature = worst;
    let t = patch.equidistant(0, GRID);
    let mut curvatures = Vec::with_capacity(GRID * GRID);
    let (us, vs) = (patch.ready(0, &t, 2), patch.ready(1, &t, 2));
    for u in &us {
        patch.row(u, &vs, |_, jet| {
            let shape = Shape::new(jet);
            let sine = (shape.delta / (shape.e * shape.g)).sqrt();
            out.sine = if sine.is_nan() { f64::NAN } else { out.sine.min(sine) };
            curvatures.push(shape.gaussian);
        });
    }
    // Rounding around zero is not positive curvature.
    let noise = 1e-9 * curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs()));
    let positive = curvatures.iter().filter(|k| **k > noise).count();
    out.positive = positive as f64 / curvatures.len() as f64;
    out
}

/// A side of a patch: 0 and 2 run along u at v = 0 and 1, 1 and 3 along v at u = 0 and 1.
type SideId = (usize, usize);

fn parameters([_, k]: [usize; 2], t: f64) -> (f64, f64) {
    match k {
        0 => (t, 0.0),
        1 => (0.0, t),
        2 => (t, 1.0),
        _ => (1.0, t),
    }
}

/// Strain of the curves, each once, and how the patches meet along them.
fn sides(patches: &[Spline], reach: f64, values: &mut Values) {
    let at = |(p, k): SideId, t: f64, order: usize| {
        let (u, v) = parameters([p, k], t);
        patches[p].jet(u, v, order)
    };
    let place = |side: SideId, t: f64| at(side, t, 0).d[0][0];
    // Curves are the same if their ends and their middles are.
    let mut curves: Vec<Vec<SideId>> = Vec::new();
    let mut by_middle: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for side in (0..patches.len()).flat_map(|p| (0..4).map(move |k| (p, k))) {
        let [a, m, b] = [0.0, 0.5, 1.0].map(|t| place(side, t));
        let same = |curve: &usize| {
            let other = curves[*curve][0];
            let [c, n, d] = [0.0, 0.5, 1.0].map(|t| place(other, t));
            let close = |p: DVec3, q: DVec3| p.distance(q) <= reach;
            close(m, n) && (close(a, c) && close(b, d) || close(a, d) && close(b, c))
        };
        let key = |p: DVec3| (p / (8.0 * reach)).to_array().map(|x| x.floor() as i64);
        let [x, y, z] = key(m);
        let around = (-1..=1)
            .flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
        let found = around.filter_map(|cell| by_middle.get(&cell)).flatten().copied().find(same);
        match found {
            Some(curve) => curves[curve].push(side),
            None => {
                by_middle.entry(key(m)).or_default().push(curves.len());
                curves.push(vec![side]);
            }
        }
    }
    let strain = curves.iter().map(|sides| {
        let (p, k) = sides[0];
        let rule = gauss(patches[p].degree()[0] + 1);
        let density = |t: f64| {
            let jet = at((p, k), t, 2);
            if k % 2 == 0 { jet.d[2][0].length_squared() } else { jet.d[0][2].length_squared() }
        };
        rule.iter().map(|(t, w)| w * density(*t)).sum::<f64>()
    });
    values.number("strain_energy", strain.sum());
    let joins: Vec<[f64; 3]> = curves
        .par_iter()
        .filter_map(|sides| {
            let [a, b] = sides[..] else { return None };
            let turned = place(a, 0.0).distance(place(b, 0.0)) > reach;
            let mut worst = [0.0_f64; 3];
            for k in 0..JOIN {
                let t = k as f64 / (JOIN - 1) as f64;
                let s = if turned { 1.0 - t } else { t };
                let [f, g] = [Shape::new(&at(a, t, 2)), Shape::new(&at(b, s, 2))];
                let jumps = [
                    angle_deg(f.normal, g.normal),
                    (f.gaussian - g.gaussian).abs(),
                    (f.mean - g.mean).abs(),
                ];
                for (worst, jump) in worst.iter_mut().zip(jumps) {
                    *worst = worst.max(jump);
                }
            }
            Some(worst)
        })
        .collect();
    let keys = ["kink_max_deg", "gaussian_jump_max", "mean_jump_max"];
    for (k, key) in keys.into_iter().enumerate() {
        values.number(key, joins.iter().map(|j| j[k]).fold(0.0, f64::max));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `z = x y` over two neighbouring unit squares, degree 2.
    fn saddle(from: f64) -> Spline {
        let points: Vec<DVec3> = (0..9)
            .map(|k| {
                let (x, y) = (from + 0.5 * f64::from(k / 3), 0.5 * f64::from(k % 3));
                DVec3::new(x, y, x * y)
            })
            .collect();
        Spline::bezier(2, &points).unwrap()
    }

    #[test]
    fn a_saddle_has_straight_asymptotic_sides() {
        let mut values = Values::default();
        recompute(&[saddle(0.0), saddle(1.0)], 3.0, &mut values);
        let get = |key: &str| values.get(key).unwrap();
        assert_eq!((get("patches"), get("degree")), (2.0, 2.0));
        assert!(get("normal_curvature_max") < 1e-14 && get("strain_energy") < 1e-28);
        // Only R_uv = (0, 0, 1) is there, twice, on two patches.
        assert!((get("thin_plate_energy") - 4.0).abs() < 1e-14);
        assert!(get("kink_max_deg") < 1e-13 && get("positive_gauss_fraction") == 0.0);
        // The lines x = const and y = const have the cosine x y / √((1 + x²)(1 + y²)).
        let cosine = 2.0 / (5.0_f64 * 2.0).sqrt();
        assert!((get("min_sine") - (1.0 - cosine * cosine).sqrt()).abs() < 1e-14);
    }
}
