//! What a [`Relation`] asks of every sample, on the working scale.

use crate::curve::{DiagramCurve, principal_axis};
use crate::field::Sample;
use crate::locus::RelationLocus;
use crate::relation::Relation;

/// Least standard deviation of `H` and `K` that rows are scaled with, relative to the size of the
/// curvatures: a constant curvature has none.
const DEVIATION_FLOOR: f64 = 1e-3;
/// `δ` of `√(H² − K + δ²)`, relative to the size of the curvatures: the root itself has no
/// derivative at umbilics.
const UMBILIC_SMOOTHING: f64 = 1e-3;

/// A relation on the working scale, where lengths are `unit` times those of the model.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    kind: Kind,
    /// Working lengths per length of the model.
    unit: f64,
    /// Natural sizes of `H` and `K`.
    size: [f64; 2],
    /// Standard deviations at the start.
    deviation: [f64; 2],
}

#[derive(Clone, Debug)]
enum Kind {
    /// `a H + b K + c`, the same for all samples.
    Affine([f64; 3]),
    LinearFit,
    Ratio(f64),
    /// In coordinates over the deviations.
    Curve(DiagramCurve),
    CurveFit,
}

impl Target {
    /// `None` for [`Relation::Free`] (and curves of fewer than two points). `start` are samples of
    /// the start on the working scale; `curvature` is the size of its curvatures there.
    pub(crate) fn new(
        relation: &Relation,
        unit: f64,
        curvature: f64,
        start: &[Sample],
    ) -> Option<Self> {
        // Curvatures of the model are `unit` times, products of two `unit²` times the working ones.
        let (h, k) = (1.0 / unit, 1.0 / (unit * unit));
        let size = [curvature, curvature * curvature];
        let n = start.len() as f64;
        let mean = |f: fn(&Sample) -> f64| start.iter().map(f).sum::<f64>() / n;
        let (mean_h, mean_k) = (mean(|s| s.jet.h), mean(|s| s.jet.k));
        let spread = |f: &dyn Fn(&Sample) -> f64, m: f64| {
            (start.iter().map(|s| (f(s) - m).powi(2)).sum::<f64>() / n).sqrt()
        };
        let deviation = [
            spread(&|s| s.jet.h, mean_h).max(DEVIATION_FLOOR * size[0]),
            spread(&|s| s.jet.k, mean_k).max(DEVIATION_FLOOR * size[1]),
        ];
        let kind = match relation {
            Relation::Free => return None,
            // a H + b K + c with model curvatures, rewritten for the working ones.
            Relation::Linear(a, b, c) => Kind::Affine([a / h, b / k, *c]),
            Relation::LinearFit => Kind::LinearFit,
            Relation::Minimal => Kind::Affine([1.0, 0.0, 0.0]),
            Relation::ConstantMean(value) => Kind::Affine([1.0, 0.0, -value * h]),
            Relation::ConstantMeanFit => Kind::Affine([1.0, 0.0, -mean_h]),
            Relation::Developable => Kind::Affine([0.0, 1.0, 0.0]),
            Relation::ConstantGauss(value) => Kind::Affine([0.0, 1.0, -value * k]),
            Relation::Ratio(ratio) => Kind::Ratio(*ratio),
            Relation::Curve(points) => {
                let scaled = |p: &[f64; 2]| [p[0] * h / deviation[0], p[1] * k / deviation[1]];
                Kind::Curve(DiagramCurve::new(points.iter().map(scaled).collect())?)
            }
            Relation::CurveFit => Kind::CurveFit,
        };
        Some(Self { kind, unit, size, deviation })
    }

    /// Standard deviations of `H` and `K` at the start on the working scale, which fitted lines and
    /// curves are measured in.
    pub(crate) fn deviation(&self) -> [f64; 2] {
        self.deviation
    }

    /// Where the relation holds, in units of the model; what is fitted is fitted to `samples` (on
    /// the working scale).
    pub(crate) fn locus(&self, samples: &[Sample]) -> RelationLocus {
        let (h, k) = (1.0 / self.unit, 1.0 / (self.unit * self.unit));
        let line = |[a, b, c]: [f64; 3]| RelationLocus::Line { a: a * h, b: b * k, c };
        let curve = |curve: &DiagramCurve| {
            let scaled = |[x, y]: [f64; 2]| [x * self.deviation[0] / h, y * self.deviation[1] / k];
            RelationLocus::Curve(curve.points().into_iter().map(scaled).collect())
        };
        match &self.kind {
            &Kind::Affine(row) => line(row),
            &Kind::Ratio(ratio) => RelationLocus::Ratio(ratio),
            Kind::LinearFit => line(self.line(samples)),
            Kind::Curve(given) => curve(given),
            Kind::CurveFit => match DiagramCurve::fit(&self.diagram(samples)) {
                Some(fitted) => curve(&fitted),
                None => line(self.line(samples)),
            },
        }
    }

    /// Whether the rows change from iterate to iterate.
    pub(crate) fn follows(&self) -> bool {
        matches!(self.kind, Kind::LinearFit | Kind::Curve(_) | Kind::CurveFit)
    }

    /// Ratio, factor to natural size, and smoothing, if the relation is a ratio.
    pub(crate) fn ratio(&self) -> Option<(f64, f64, f64)> {
        match self.kind {
            Kind::Ratio(ratio) => {
                let scale = 1.0 / (self.size[0] * 1f64.hypot(ratio));
                Some((ratio, scale, UMBILIC_SMOOTHING * self.size[0]))
            }
            _ => None,
        }
    }

    /// `α, β, γ` of the row `α H + β K + γ` of every sample, in units of the natural sizes (given
    /// coefficients) or of the deviations (fitted ones).
    pub(crate) fn rows(&self, samples: &[Sample]) -> Vec<[f64; 3]> {
        match &self.kind {
            Kind::Ratio(_) => vec![[0.0; 3]; samples.len()],
            &Kind::Affine([a, b, c]) => {
                let scale = (a * self.size[0]).hypot(b * self.size[1]);
                vec![[a / scale, b / scale, c / scale]; samples.len()]
            }
            Kind::LinearFit => vec![self.line(samples); samples.len()],
            Kind::Curve(curve) => self.tangents(curve, samples),
            Kind::CurveFit => match DiagramCurve::fit(&self.diagram(samples)) {
                Some(curve) => self.tangents(&curve, samples),
                None => vec![self.line(samples); samples.len()],
            },
        }
    }

    /// The samples in the curvature diagram, in units of the deviations.
    fn diagram(&self, samples: &[Sample]) -> Vec<[f64; 2]> {
        let [h, k] = self.deviation;
        samples.iter().map(|s| [s.jet.h / h, s.jet.k / k]).collect()
    }

    /// The line of least squared distances in the diagram.
    fn line(&self, samples: &[Sample]) -> [f64; 3] {
        let (mean, axis) = principal_axis(&self.diagram(samples));
        self.through(mean, [-axis[1], axis[0]])
    }

    /// The row of the line through `point` with unit normal `normal`.
    fn through(&self, point: [f64; 2], normal: [f64; 2]) -> [f64; 3] {
        let offset = -(normal[0] * point[0] + normal[1] * point[1]);
        [normal[0] / self.deviation[0], normal[1] / self.deviation[1], offset]
    }

    fn tangents(&self, curve: &DiagramCurve, samples: &[Sample]) -> Vec<[f64; 3]> {
        let feet = curve.feet(&self.diagram(samples));
        feet.iter().map(|foot| self.through(foot.point, foot.normal)).collect()
    }

    /// Root mean square distance from the relation over `samples`, unscaled: of `H − c`, `K − c`,
    /// `(a H + b K + c)/√(a² + b²)`, `(κ₁ − R κ₂)/√(1 + R²)`, and of the distance in the diagram
    /// scaled to unit standard deviations for fitted lines and curves.
    pub(crate) fn rms(&self, samples: &[Sample]) -> f64 {
        let square = |r: f64| r * r;
        let sum: f64 = match self.kind {
            Kind::Affine([a, b, c]) => {
                let scale = a.hypot(b);
                samples.iter().map(|s| square((a * s.jet.h + b * s.jet.k + c) / scale)).sum()
            }
            Kind::Ratio(ratio) => {
                let scale = 1f64.hypot(ratio);
                let distance = |s: &Sample| {
                    let (k1, k2) = s.principal();
                    (k1 - ratio * k2) / scale
                };
                samples.iter().map(|s| square(distance(s))).sum()
            }
            _ => {
                let rows = self.rows(samples);
                let distance = |(s, [a, b, c]): (&Sample, &[f64; 3])| a * s.jet.h + b * s.jet.k + c;
                samples.iter().zip(&rows).map(|pair| square(distance(pair))).sum()
            }
        };
        (sum / samples.len() as f64).sqrt()
    }
}
