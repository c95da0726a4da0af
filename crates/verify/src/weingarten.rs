//! Claims of `weingarten`: curvatures of the written surface, its distance from the input.

use crate::claims::{Claims, Values};
use crate::content::diagonal;
use crate::shape::{Shape, Slopes};
use crate::spline::{Jet, Spline};

/// A curvature counts as constant if it varies by no more than this fraction of its size.
const CONSTANT_RATIO: f64 = 1e-9;

/// Recomputes what the surface and, where it is known, the input give. The metrics must hold
/// `samples_u` and `samples_v`; everything is measured at the middles of twice as many cells.
pub(crate) fn recompute(
    surface: &Spline,
    input: Option<&Spline>,
    claims: &Claims<'_>,
    values: &mut Values,
) {
    let [n_u, n_v] = surface.different_counts();
    values.count("control_points", n_u * n_v);
    let surface = match input {
        Some(input) => &like(surface, input),
        // Which way round it was is not known.
        None if surface.closed() == [true; 2] => return,
        None => surface,
    };
    let (Some(m_u), Some(m_v)) = (claims.count("samples_u"), claims.count("samples_v")) else {
        return;
    };
    values.count("samples", m_u * m_v);
    if m_u == 0 || m_v == 0 || 4 * m_u * m_v > MOST_SAMPLES {
        return;
    }
    let (u, v) = (surface.midpoints(0, 2 * m_u), surface.midpoints(1, 2 * m_v));
    let jets = surface.jets(&u, &v, 3);
    let samples: Vec<(Shape, Slopes)> = jets
        .iter()
        .map(|jet| {
            let shape = Shape::new(jet);
            (shape, shape.slopes(jet))
        })
        .collect();
    let range = |f: fn(&Shape) -> f64| {
        samples
            .iter()
            .map(|(s, _)| f(s))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let (h, k) = (range(|s| s.mean), range(|s| s.gaussian));
    values.number("mean_curvature_min", h[0]);
    values.number("mean_curvature_max", h[1]);
    values.number("gaussian_curvature_min", k[0]);
    values.number("gaussian_curvature_max", k[1]);
    let size = input.unwrap_or(surface).size().unwrap_or(1.0);
    let [alignment, area] = alignment(surface, &samples, size, h, k);
    values.number("alignment_rms", alignment);
    values.number("diagram_area", area);
    if let Some(input) = input {
        deviations(surface, input, [&u, &v], &jets, size, values);
    }
    if let Some(rms) = relation_rms(claims, &samples) {
        values.number("relation_rms", rms);
    }
}

/// The surface with the parameters of its input: a closed one is written so that its normals are
/// outside, which may exchange them.
fn like(surface: &Spline, input: &Spline) -> Spline {
    const PLACES: usize = 9;
    let apart = |s: &Spline| {
        let is_same = (0..2).all(|k| s.domain(k) == input.domain(k));
        let at = [0, 1].map(|k| input.equidistant(k, PLACES));
        let far = |(a, b): (&Jet, &Jet)| a.d[0][0].distance(b.d[0][0]);
        let there = input.jets(&at[0], &at[1], 0);
        is_same.then(|| s.jets(&at[0], &at[1], 0).iter().zip(&there).map(far).sum::<f64>())
    };
    let swapped = surface.swapped();
    match (apart(surface), apart(&swapped)) {
        (None, Some(_)) => swapped,
        (Some(here), Some(there)) if there < here => swapped,
        _ => surface.clone(),
    }
}

/// More samples than a run could have had.
const MOST_SAMPLES: usize = 100_000_000;

/// Root mean square sine between `∇H` and `∇K`, and the area of the curvature diagram in its box.
fn alignment(
    surface: &Spline,
    samples: &[(Shape, Slopes)],
    size: f64,
    h: [f64; 2],
    k: [f64; 2],
) -> [f64; 2] {
    let largest = |s: &Shape| s.principal().iter().fold(0.0, |a: f64, p| a.max(p.abs()));
    let curved = samples.iter().map(|(s, _)| largest(s)).fold(CONSTANT_RATIO / size, f64::max);
    let (range_h, range_k) = (h[1] - h[0], k[1] - k[0]);
    if range_h <= CONSTANT_RATIO * curved || range_k <= CONSTANT_RATIO * curved * curved {
        return [0.0; 2];
    }
    let (mut sines, mut weights, mut area) = (0.0, 0.0, 0.0);
    for (s, slopes) in samples {
        let (a, b) = (slopes.mean, slopes.gaussian);
        let jacobian = a[0] * b[1] - a[1] * b[0];
        let squared = |t: [f64; 2]| {
            (s.g * t[0] * t[0] - 2.0 * s.f * t[0] * t[1] + s.e * t[1] * t[1]) / s.delta
        };
        sines += jacobian * jacobian / s.delta;
        weights += squared(a) * squared(b);
        area += jacobian.abs();
    }
    let [u, v] = [surface.domain(0), surface.domain(1)];
    let cell = (u[1] - u[0]) * (v[1] - v[0]) / samples.len() as f64;
    let rms = if weights > 0.0 { (sines / weights).sqrt() } else { 0.0 };
    [rms, area * cell / (range_h * range_k)]
}

/// Distances between points of the same parameters, in percent of the input's size.
fn deviations(
    surface: &Spline,
    input: &Spline,
    [u, v]: [&[f64]; 2],
    jets: &[Jet],
    size: f64,
    values: &mut Values,
) {
    if (0..2).any(|k| surface.domain(k) != input.domain(k)) {
        return;
    }
    let there = input.jets(u, v, 0);
    let far = |(a, b): (&Jet, &Jet)| a.d[0][0].distance(b.d[0][0]);
    let (sum, most) = jets
        .iter()
        .zip(&there)
        .map(far)
        .fold((0.0, 0.0_f64), |(sum, most), d| (sum + d, most.max(d)));
    let mean = sum / jets.len() as f64;
    // The open sides at the same parameters and at their ends.
    let with_ends = |t: &[f64], k: usize| {
        let [start, end] = surface.domain(k);
        [&[start], t, &[end]].concat()
    };
    let mut border = 0.0_f64;
    let sides = [(0, with_ends(u, 0)), (1, with_ends(v, 1))];
    for (along, t) in &sides {
        let across = 1 - along;
        if surface.closed()[across] {
            continue;
        }
        let ends = surface.domain(across);
        let both = |s: &Spline| match along {
            0 => s.jets(t, &ends, 0),
            _ => s.jets(&ends, t, 0),
        };
        border = both(surface).iter().zip(&both(input)).map(far).fold(border, f64::max);
    }
    let diagonal = diagonal(input.control_points()).unwrap_or(1.0);
    for (of, length) in [("", size), ("_box", diagonal)] {
        values.number(&format!("deviation_mean_percent{of}"), 100.0 * mean / length);
        values.number(&format!("deviation_max_percent{of}"), 100.0 * most / length);
        values.number(&format!("boundary_deviation_max_percent{of}"), 100.0 * border / length);
    }
}

/// Root mean square distance from the relation the metrics name, on the surface scaled by
/// `working_scale`; `None` for curves of the diagram, and where something is missing.
fn relation_rms(claims: &Claims<'_>, samples: &[(Shape, Slopes)]) -> Option<f64> {
    let relation = claims.text("relation")?;
    if relation == "free" {
        return Some(0.0);
    }
    let unit = claims.number("working_scale").filter(|s| *s > 0.0)?;
    let points: Vec<[f64; 2]> =
        samples.iter().map(|(s, _)| [s.mean / unit, s.gaussian / (unit * unit)]).collect();
    let rms = |distance: &dyn Fn(&[f64; 2]) -> f64| {
        let sum: f64 = points.iter().map(|p| distance(p).powi(2)).sum();
        (sum / points.len() as f64).sqrt()
    };
    if let Some(ratio) = relation.strip_prefix("ratio=") {
        let ratio: f64 = ratio.parse().ok()?;
        return Some(rms(&|[h, k]| {
            let root = (h * h - k).max(0.0).sqrt();
            ((h + root) - ratio * (h - root)) / 1f64.hypot(ratio)
        }));
    }
    if relation == "linear" {
        return fitted_line_rms(&points, claims);
    }
    if relation.starts_with("curve") {
        return None;
    }
    // `a H + b K + c` in units of the model becomes one of working units.
    let line = ["a", "b", "c"].map(|k| claims.number(&format!("relation_line.{k}")));
    let [Some(a), Some(b), Some(c)] = line else { return None };
    let (a, b) = (a * unit, b * unit * unit);
    Some(rms(&|[h, k]| (a * h + b * k + c) / a.hypot(b)))
}

/// Distance from the line of least squares in the diagram over the deviations of the start.
fn fitted_line_rms(points: &[[f64; 2]], claims: &Claims<'_>) -> Option<f64> {
    let scale = [0, 1].map(|k| claims.number(&format!("relation_scale.{k}")));
    let [Some(x), Some(y)] = scale else { return None };
    let n = points.len() as f64;
    let scaled: Vec<[f64; 2]> = points.iter().map(|p| [p[0] / x, p[1] / y]).collect();
    let mean = [0, 1].map(|k| scaled.iter().map(|p| p[k]).sum::<f64>() / n);
    let moment = |i: usize, j: usize| {
        scaled.iter().map(|p| (p[i] - mean[i]) * (p[j] - mean[j])).sum::<f64>() / n
    };
    let (a, b, c) = (moment(0, 0), moment(0, 1), moment(1, 1));
    // Distances along the normal of the longer axis keep digits that the product of the
    // eigenvalues would lose.
    let longer = 0.5 * (a + c) + (0.5 * (a - c)).hypot(b);
    let axis = if a > c { [longer - c, b] } else { [b, longer - a] };
    let length = axis[0].hypot(axis[1]);
    if !(length > 0.0) {
        return None;
    }
    let normal = [-axis[1] / length, axis[0] / length];
    let far = |p: &[f64; 2]| normal[0] * (p[0] - mean[0]) + normal[1] * (p[1] - mean[1]);
    Some((scaled.iter().map(|p| far(p).powi(2)).sum::<f64>() / n).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use serde_json::json;

    /// A cylinder of radius 2 as a polynomial graph near its ridge is none; a paraboloid
    /// `z = (x² + y²)/2` has rotational symmetry, so isolines of H and K are the same.
    fn paraboloid(lift: f64) -> Spline {
        let at = |i: usize| -1.0 + i as f64;
        let square = |i: usize| if i == 1 { -1.0 } else { 1.0 };
        let points: Vec<DVec3> = (0..9)
            .map(|k| {
                let (i, j) = (k / 3, k % 3);
                DVec3::new(at(i), at(j), 0.5 * (square(i) + square(j)) + lift)
            })
            .collect();
        Spline::bezier(2, &points).unwrap()
    }

    #[test]
    fn a_paraboloid_is_weingarten_and_measured_against_its_input() {
        let metrics = json!({"samples_u": 6, "samples_v": 5, "relation": "free"});
        let mut values = Values::default();
        let (surface, input) = (paraboloid(0.1), paraboloid(0.0));
        recompute(&surface, Some(&input), &Claims::new(&metrics), &mut values);
        let get = |key: &str| values.get(key).unwrap();
        // The control points of the input span 2 x 2 x 2; the surface is a bowl one deep whose rim
        // at that height has four corners, and the ball around it goes through them alone.
        for (of, length) in [("", 8f64.sqrt()), ("_box", 12f64.sqrt())] {
            let percent = 100.0 * 0.1 / length;
            for key in ["deviation_mean_percent", "deviation_max_percent"] {
                assert!((get(&format!("{key}{of}")) - percent).abs() < 1e-12);
            }
            let border = get(&format!("boundary_deviation_max_percent{of}"));
            assert!((border - percent).abs() < 1e-12);
        }
        assert!(get("alignment_rms") < 1e-13 && get("diagram_area") < 1e-13);
        // K = 1/(1 + r²)² at the middle of the cell nearest to the top (12 x 10 cells).
        let r = (1.0_f64 / 12.0).hypot(0.1);
        let want = (1.0 + r * r).powi(-2);
        assert!((get("gaussian_curvature_max") - want).abs() < 1e-13);
        assert_eq!(get("relation_rms"), 0.0);
    }

    #[test]
    fn relations_are_distances_on_the_working_scale() {
        let sample = |mean: f64, gaussian: f64| {
            let mut shape = Shape::new(&Jet::default());
            (shape.mean, shape.gaussian) = (mean, gaussian);
            (shape, Slopes { mean: [0.0; 2], gaussian: [0.0; 2] })
        };
        let samples = [sample(2.0, 3.0), sample(4.0, 12.0)];
        let rms = |metrics: serde_json::Value| relation_rms(&Claims::new(&metrics), &samples);
        // H − 1 at 2 and 4 on twice the size: (2/2 − 1/2, 4/2 − 1/2).
        let cmc = json!({"relation": "cmc=1", "working_scale": 2.0,
            "relation_line": {"a": 1.0, "b": 0.0, "c": -1.0}});
        let want = ((0.25 + 2.25) / 2.0_f64).sqrt();
        assert!((rms(cmc).unwrap() - want).abs() < 1e-14);
        let ratio = json!({"relation": "ratio=3", "working_scale": 1.0});
        // κ of (2, 3) are 3 and 1: exact; of (4, 12) 6 and 2: exact.
        assert!(rms(ratio).unwrap() < 1e-14);
        let fitted =
            json!({"relation": "linear", "working_scale": 1.0, "relation_scale": [1.0, 2.0]});
        assert!(rms(fitted).unwrap() < 1e-14, "two points have a line");
        assert_eq!(rms(json!({"relation": "curve", "working_scale": 1.0})), None);
        assert_eq!(rms(json!({"relation": "cmc=1"})), None);
    }
}
