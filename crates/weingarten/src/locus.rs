//! Where a relation holds in the curvature diagram.

use std::fmt;

/// Points along a locus on either side of its middle.
const STEPS: i32 = 200;
/// `p` of the spacing `sinh(p s)/sinh(1)`, `-1 ≤ s ≤ 1`: dense where the surface is, yet long.
const REACH: f64 = 4.5;

/// The set of the `(H, K)` plane where a relation holds, in units of the model.
///
/// ```
/// use weingarten::RelationLocus;
/// let locus = RelationLocus::Line { a: 1.0, b: 0.0, c: 0.5 };
/// assert_eq!(locus.to_string(), "H = -0.5");
/// assert!(locus.points([-1.0, 0.0], [0.0, 1.0]).iter().all(|p| p[0] == -0.5));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum RelationLocus {
    /// `a H + b K + c = 0`.
    Line {
        /// Coefficient of `H`.
        a: f64,
        /// Coefficient of `K`.
        b: f64,
        /// Constant.
        c: f64,
    },
    /// `κ₁ = R κ₂` with `κ₁ ≥ κ₂`, for the given `R`.
    Ratio(f64),
    /// A cubic B-spline curve.
    Curve {
        /// Points `[H, K]` that lie on it, in order.
        points: Vec<[f64; 2]>,
        /// Its control points, as [`crate::Relation::Curve`] takes them.
        control: Vec<[f64; 2]>,
    },
}

impl RelationLocus {
    /// Points `[H, K]` along the locus, in order, dense over the given ranges of the surface's
    /// curvatures and some way beyond them.
    pub fn points(&self, h: [f64; 2], k: [f64; 2]) -> Vec<[f64; 2]> {
        match self {
            &Self::Line { a, b, c } => line_points(a, b, c, h, k),
            &Self::Ratio(ratio) => ratio_points(ratio, h, k),
            Self::Curve { points, .. } => points.clone(),
        }
    }
}

fn line_points(a: f64, b: f64, c: f64, h: [f64; 2], k: [f64; 2]) -> Vec<[f64; 2]> {
    let size = h[0].abs().max(h[1].abs()).max(k[0].abs().max(k[1].abs()).sqrt());
    let mut points = Vec::new();
    if b != 0.0 {
        let k_of = |h: f64| [h, -(a * h + c) / b];
        let (middle, half) = (0.5 * (h[0] + h[1]), (0.5 * (h[1] - h[0])).max(0.05 * size));
        points.extend(spaced().map(|s| k_of(middle + half * s)));
        // Where the line meets `K = H²` it ends in the plane of principal curvatures.
        let root = a * a - 4.0 * b * c;
        if root >= 0.0 {
            points.extend([root.sqrt(), -root.sqrt()].map(|r| k_of((-a + r) / (2.0 * b))));
        }
    }
    if a != 0.0 {
        // Equal steps of sign(K) √|K|, an axis of the diagram along which K = 0 is a sharp place.
        let half = k[0].abs().max(k[1].abs()).max(0.01 * size * size).sqrt();
        points
            .extend(spaced().map(|s| half * s).map(|q| [-(b * q * q.abs() + c) / a, q * q.abs()]));
    }
    let along = |p: &[f64; 2]| a * p[1] / size.max(f64::MIN_POSITIVE) - b * size * p[0];
    points.sort_by(|p, q| along(p).total_cmp(&along(q)));
    points
}

fn ratio_points(ratio: f64, h: [f64; 2], k: [f64; 2]) -> Vec<[f64; 2]> {
    let size = h[0].abs().max(h[1].abs()).max(k[0].abs().max(k[1].abs()).sqrt());
    let least = 0.5 * ((1.0 + ratio).abs()).max(ratio.abs().sqrt());
    let half = size / least.max(f64::MIN_POSITIVE);
    // κ₁ ≥ κ₂ leaves one sign of κ₂.
    let allowed = |k2: &f64| ratio * k2 >= *k2;
    let at = |k2: f64| [0.5 * (1.0 + ratio) * k2, ratio * k2 * k2];
    spaced().map(|s| half * s).filter(allowed).map(at).collect()
}

/// `-sinh(p)/sinh(1) … sinh(p)/sinh(1)`, 0 among them.
fn spaced() -> impl Iterator<Item = f64> {
    (-STEPS..=STEPS).map(|i| (REACH * f64::from(i) / f64::from(STEPS)).sinh() / 1f64.sinh())
}

impl fmt::Display for RelationLocus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { a, b, c } if *b == 0.0 => write!(f, "H = {}", short(-c / a)),
            Self::Line { a, b, c } if *a == 0.0 => write!(f, "K = {}", short(-c / b)),
            Self::Line { a, b, c } => {
                write!(f, "K = {} H {}", short(-a / b), signed(-c / b))
            }
            Self::Ratio(ratio) => write!(f, "κ₁ = {} κ₂", short(*ratio)),
            Self::Curve { .. } => write!(f, "curve"),
        }
    }
}

/// Four digits, and no minus before a zero.
fn short(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 0.0;
    }
    let power = 3 - x.abs().log10().floor() as i32;
    let scale = 10f64.powi(power.abs());
    if power >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale }
}

fn signed(x: f64) -> String {
    format!("{} {}", if x < 0.0 { '-' } else { '+' }, short(x.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: [f64; 2] = [-0.6, 0.1];
    const K: [f64; 2] = [-0.3, 0.2];

    #[test]
    fn lines_hold_their_equation_and_cover_the_ranges() {
        for (a, b, c) in [(1.0, 0.0, 0.3), (0.0, 2.0, -0.1), (0.5, -1.5, 0.2), (1.0, 1e-3, 0.0)] {
            let points = RelationLocus::Line { a, b, c }.points(H, K);
            let size = a.hypot(b);
            for [h, k] in &points {
                let large = (a * h).abs().max((b * k).abs()).max(c.abs()).max(size);
                assert!((a * h + b * k + c).abs() < 1e-12 * large, "{a} {b} {c}: {h}, {k}");
            }
            let reach = |axis: usize| {
                let values = points.iter().map(|p| p[axis]);
                let low = values.clone().fold(f64::MAX, f64::min);
                (low, values.fold(f64::MIN, f64::max))
            };
            if b != 0.0 {
                assert!(reach(0).0 < H[0] && reach(0).1 > H[1]);
            } else {
                assert!(reach(1).0 < K[0] && reach(1).1 > K[1]);
            }
            // In order along the line, without going back.
            let way = |p: &[f64; 2], q: &[f64; 2]| a * (q[1] - p[1]) - b * (q[0] - p[0]);
            assert!(points.windows(2).all(|w| way(&w[0], &w[1]) >= -1e-9 * size));
        }
    }

    #[test]
    fn ratios_hold_for_the_larger_curvature_first() {
        for ratio in [-2.0, -1.0, -0.3, 0.0, 0.4, 1.0, 3.0] {
            let points = RelationLocus::Ratio(ratio).points(H, K);
            assert!(points.len() > 200);
            for [h, k] in points {
                let root = (h * h - k).max(0.0).sqrt();
                let (k1, k2) = (h + root, h - root);
                assert!((k1 - ratio * k2).abs() <= 1e-7 * k1.abs().max(k2.abs()), "{k1} {k2}");
            }
        }
    }

    #[test]
    fn names_read_like_the_relation() {
        let line = |a, b, c| RelationLocus::Line { a, b, c }.to_string();
        assert_eq!(line(1.0, 0.0, 0.0), "H = 0");
        assert_eq!(line(0.0, 2.0, 0.08), "K = -0.04");
        assert_eq!(line(1.0, 2.0, -0.333_333), "K = -0.5 H + 0.1667");
        assert_eq!(RelationLocus::Ratio(-1.25).to_string(), "κ₁ = -1.25 κ₂");
    }
}
