//! The shapes a relation can have in the curvature diagram, and the way from one to another.

use crate::curve::{DiagramCurve, principal_axis};
use crate::field::Sample;

/// What a relation asks of the curvatures, on the working scale.
#[derive(Clone, Debug)]
pub(crate) enum Kind {
    /// `a H + b K + c`, the same for all samples.
    Affine([f64; 3]),
    /// A line fitted to the samples at every iterate.
    LinearFit,
    /// `cos θ κ₁ − sin θ κ₂` by `[cos θ, sin θ]`: a ratio `κ₁/κ₂` of `tan θ`.
    Ratio([f64; 2]),
    /// In coordinates over the deviations.
    Curve(DiagramCurve),
    /// A curve of so many control points, fitted to the samples at every iterate.
    CurveFit(usize),
}

/// A relation farther than this from what the surface has, in units of the curvatures' size, of angles or
/// of the spread, is gone to in parts.
const STRIDE: f64 = 0.15;
/// And in at most so many.
const MOST_PARTS: usize = 8;
/// A cloud farther than this from the curve fitted to it, in units of the spread, is too thick or too
/// branched to be followed: no curve goes along all of it.
const THICK: f64 = 0.1;
/// Control points on the way from a line to a curve.
const FEW_CONTROL: usize = 4;

/// What `H` and `K` are measured in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    /// Natural sizes.
    pub(crate) size: [f64; 2],
    /// Standard deviations of the input.
    pub(crate) deviation: [f64; 2],
}

impl Units {
    /// The samples in the curvature diagram, in units of the deviations.
    pub(crate) fn diagram(&self, samples: &[Sample]) -> Vec<[f64; 2]> {
        let [h, k] = self.deviation;
        samples.iter().map(|s| [s.jet.h / h, s.jet.k / k]).collect()
    }
}

/// Where a way through relations begins: at the one of the wanted kind that is nearest to a surface.
#[derive(Clone, Debug)]
pub(crate) struct Regressed {
    kind: Kind,
    /// Mean `H` and `K` over the natural sizes.
    mean: [f64; 2],
    /// Root mean square distance of the samples from the curve fitted to them, if one is wanted.
    thickness: f64,
}

impl Regressed {
    /// The relation of the kind of `wanted` nearest to `samples`; `None` for relations that are fitted
    /// anyway.
    pub(crate) fn new(wanted: &Kind, units: &Units, samples: &[Sample]) -> Option<Self> {
        let over = units.size;
        let scaled: Vec<[f64; 2]> =
            samples.iter().map(|s| [s.jet.h / over[0], s.jet.k / over[1]]).collect();
        let (mean, axis) = principal_axis(&scaled);
        let kind = match wanted {
            Kind::LinearFit => return None,
            Kind::CurveFit(_) => Kind::LinearFit,
            &Kind::Affine([a, b, _]) => {
                let own = unit([a * over[0], b * over[1]]);
                // A constant H or K stays one: only its value is sought.
                let normal = if a == 0.0 || b == 0.0 { own } else { [-axis[1], axis[0]] };
                Kind::Affine(line_through(mean, normal, over))
            }
            Kind::Ratio(_) => {
                // The line through the origin nearest to the points (κ₂, κ₁).
                let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
                for (k1, k2) in samples.iter().map(Sample::principal) {
                    xx += k2 * k2;
                    xy += k2 * k1;
                    yy += k1 * k1;
                }
                let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
                Kind::Ratio([angle.cos(), angle.sin()])
            }
            Kind::Curve(curve) => {
                let fitted = DiagramCurve::fit(&units.diagram(samples), curve.control().len())?;
                Kind::Curve(fitted.oriented_like(curve))
            }
        };
        let thickness = match wanted {
            &Kind::CurveFit(control) => DiagramCurve::thickness(&units.diagram(samples), control),
            _ => 0.0,
        };
        Some(Self { kind, mean, thickness })
    }

    /// In how many parts the way to `wanted` is to be gone.
    pub(crate) fn parts(&self, wanted: &Kind, units: &Units) -> usize {
        if matches!(wanted, Kind::CurveFit(_)) {
            // A line pulls branches together, and is a curve that can then be bent.
            return if self.thickness > THICK { 3 } else { 1 };
        }
        ((self.distance(wanted, units) / STRIDE).ceil() as usize).clamp(1, MOST_PARTS)
    }

    /// How far it is to `wanted`, in units of the natural sizes, of angles, or of the deviations.
    fn distance(&self, wanted: &Kind, units: &Units) -> f64 {
        match (&self.kind, wanted) {
            (Kind::Affine(from), Kind::Affine(to)) => {
                let (from, to) = (in_sizes(*from, units.size), in_sizes(*to, units.size));
                let miss = to[0] * self.mean[0] + to[1] * self.mean[1] + to[2];
                miss.abs() + turn([from[0], from[1]], [to[0], to[1]]).abs()
            }
            (&Kind::Ratio(from), &Kind::Ratio(to)) => turn(from, to).abs(),
            (Kind::Curve(from), Kind::Curve(to)) => from.distance(to),
            _ => 0.0,
        }
    }

    /// The relation at `share` of the way to `wanted`.
    pub(crate) fn towards(&self, wanted: &Kind, share: f64, units: &Units) -> Kind {
        if share >= 1.0 {
            return wanted.clone();
        }
        match (&self.kind, wanted) {
            (Kind::Affine(from), Kind::Affine(to)) => {
                let (from, to) = (in_sizes(*from, units.size), in_sizes(*to, units.size));
                let normal =
                    turned([from[0], from[1]], share * turn([from[0], from[1]], [to[0], to[1]]));
                let miss = to[0] * self.mean[0] + to[1] * self.mean[1] + to[2];
                let point = [0, 1].map(|k| self.mean[k] - share * miss * to[k]);
                Kind::Affine(line_through(point, normal, units.size))
            }
            (&Kind::Ratio(from), &Kind::Ratio(to)) => {
                Kind::Ratio(turned(from, share * turn(from, to)))
            }
            (Kind::Curve(from), Kind::Curve(to)) => Kind::Curve(from.towards(to, share)),
            (Kind::LinearFit, Kind::CurveFit(_)) if share < 0.5 => Kind::LinearFit,
            (Kind::LinearFit, &Kind::CurveFit(control)) => Kind::CurveFit(control.min(FEW_CONTROL)),
            _ => wanted.clone(),
        }
    }
}

/// The row of the line through `point` with unit `normal`, both in the natural sizes.
fn line_through(point: [f64; 2], normal: [f64; 2], size: [f64; 2]) -> [f64; 3] {
    let offset = -(normal[0] * point[0] + normal[1] * point[1]);
    [normal[0] / size[0], normal[1] / size[1], offset]
}

/// A row in natural sizes, with a unit normal.
fn in_sizes([a, b, c]: [f64; 3], size: [f64; 2]) -> [f64; 3] {
    let (a, b) = (a * size[0], b * size[1]);
    let length = a.hypot(b);
    [a / length, b / length, c / length]
}

fn unit(v: [f64; 2]) -> [f64; 2] {
    let length = v[0].hypot(v[1]);
    [v[0] / length, v[1] / length]
}

/// The angle from one direction to another, directions without sense: at most a right angle.
fn turn(from: [f64; 2], to: [f64; 2]) -> f64 {
    let (cosine, sine) = (from[0] * to[0] + from[1] * to[1], from[0] * to[1] - from[1] * to[0]);
    if cosine < 0.0 { (-sine).atan2(-cosine) } else { sine.atan2(cosine) }
}

fn turned(v: [f64; 2], angle: f64) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    [v[0] * cosine - v[1] * sine, v[0] * sine + v[1] * cosine]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNITS: Units = Units { size: [5.0, 25.0], deviation: [1.0, 2.0] };

    #[test]
    fn the_way_of_a_line_begins_at_the_mean_and_ends_at_the_line_wanted() {
        let from = Regressed {
            kind: Kind::Affine(line_through([0.4, -0.2], [0.6, 0.8], UNITS.size)),
            mean: [0.4, -0.2],
            thickness: 0.0,
        };
        let wanted = Kind::Affine([-2.0, 0.3, 1.5]);
        let at = |share: f64| match from.towards(&wanted, share, &UNITS) {
            Kind::Affine(row) => in_sizes(row, UNITS.size),
            other => panic!("{other:?}"),
        };
        let begin = at(0.0);
        assert!((begin[0] * 0.4 - begin[1] * 0.2 + begin[2]).abs() < 1e-14);
        let end = in_sizes([-2.0, 0.3, 1.5], UNITS.size);
        let near = at(1.0 - 1e-9);
        // The sense of a normal is of no account.
        let same = (0..3).map(|k| near[k] - end[k]).fold(0.0, |m: f64, d| m.max(d.abs()));
        let opposite = (0..3).map(|k| near[k] + end[k]).fold(0.0, |m: f64, d| m.max(d.abs()));
        assert!(same.min(opposite) < 1e-8, "{near:?} {end:?}");
    }

    #[test]
    fn a_ratio_turns_the_shorter_way() {
        let from = Regressed { kind: Kind::Ratio([0.8, 0.6]), mean: [0.0; 2], thickness: 0.0 };
        let wanted = Kind::Ratio(unit([1.0, -1.0]));
        let Kind::Ratio([c, s]) = from.towards(&wanted, 0.5, &UNITS) else { panic!("a ratio") };
        let half = 0.5 * (0.6f64.atan2(0.8) - std::f64::consts::FRAC_PI_4);
        assert!((s / c - half.tan()).abs() < 1e-12);
        assert!((from.distance(&wanted, &UNITS) - 2.0 * (0.6f64.atan2(0.8) - half)).abs() < 1e-12);
    }
}
