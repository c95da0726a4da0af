//! What a [`Relation`] asks of every sample, on the working scale.

use crate::curve::{CONTROL, DiagramCurve, principal_axis};
use crate::field::Sample;
use crate::kind::{Kind, Regressed, Units};
use crate::locus::RelationLocus;
use crate::relation::Relation;

/// Least standard deviation of `H` and `K` that rows are scaled with, relative to the size of the
/// curvatures: a constant curvature has none.
const DEVIATION_FLOOR: f64 = 1e-3;
/// `δ` of `√(H² − K + δ²)`, relative to the size of the curvatures: the root itself has no
/// derivative at umbilics.
const UMBILIC_SMOOTHING: f64 = 1e-3;

/// How the curvatures of the input are spread, on the working scale.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    /// Means of `H` and `K`.
    pub(crate) mean: [f64; 2],
    /// Their standard deviations.
    pub(crate) deviation: [f64; 2],
}

impl Spread {
    /// Of samples whose curvatures have the size `curvature`.
    pub(crate) fn of(samples: &[Sample], curvature: f64) -> Self {
        let n = samples.len() as f64;
        let mean = |f: fn(&Sample) -> f64| samples.iter().map(f).sum::<f64>() / n;
        let (mean_h, mean_k) = (mean(|s| s.jet.h), mean(|s| s.jet.k));
        let spread = |f: &dyn Fn(&Sample) -> f64, m: f64| {
            (samples.iter().map(|s| (f(s) - m).powi(2)).sum::<f64>() / n).sqrt()
        };
        let deviation = [
            spread(&|s| s.jet.h, mean_h).max(DEVIATION_FLOOR * curvature),
            spread(&|s| s.jet.k, mean_k).max(DEVIATION_FLOOR * curvature * curvature),
        ];
        Self { mean: [mean_h, mean_k], deviation }
    }
}

/// A relation on the working scale, where lengths are `unit` times those of the model.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    /// What is asked for in the end.
    wanted: Kind,
    /// What is asked for now.
    now: Kind,
    /// Working lengths per length of the model.
    unit: f64,
    units: Units,
}

impl Target {
    /// `None` for [`Relation::Free`] (and curves of fewer than two points). `spread` is that of the
    /// input on the working scale, `curvature` the size of its curvatures there.
    pub(crate) fn new(
        relation: &Relation,
        unit: f64,
        curvature: f64,
        spread: Spread,
    ) -> Option<Self> {
        // Curvatures of the model are `unit` times, products of two `unit²` times the working ones.
        let (h, k) = (1.0 / unit, 1.0 / (unit * unit));
        let deviation = spread.deviation;
        let units = Units { size: [curvature, curvature * curvature], deviation };
        let wanted = match relation {
            Relation::Free => return None,
            // a H + b K + c with model curvatures, rewritten for the working ones.
            Relation::Linear(a, b, c) => Kind::Affine([a / h, b / k, *c]),
            Relation::LinearFit => Kind::LinearFit,
            Relation::Minimal => Kind::Affine([1.0, 0.0, 0.0]),
            Relation::ConstantMean(value) => Kind::Affine([1.0, 0.0, -value * h]),
            Relation::ConstantMeanFit => Kind::Affine([1.0, 0.0, -spread.mean[0]]),
            Relation::Developable => Kind::Affine([0.0, 1.0, 0.0]),
            Relation::ConstantGauss(value) => Kind::Affine([0.0, 1.0, -value * k]),
            Relation::Ratio(ratio) => {
                let length = 1f64.hypot(*ratio);
                Kind::Ratio([1.0 / length, ratio / length])
            }
            Relation::Curve(points) => {
                let scaled = |p: &[f64; 2]| [p[0] * h / deviation[0], p[1] * k / deviation[1]];
                Kind::Curve(DiagramCurve::new(points.iter().map(scaled).collect())?)
            }
            Relation::CurveFit => Kind::CurveFit(CONTROL),
        };
        Some(Self { now: wanted.clone(), wanted, unit, units })
    }

    /// What is asked for in the end.
    pub(crate) fn wanted(&self) -> &Kind {
        &self.wanted
    }

    /// The relation nearest to `samples`, where a way to this one begins, and in how many parts it is to
    /// be gone; `None` for fitted lines.
    pub(crate) fn regressed(&self, samples: &[Sample]) -> Option<(Regressed, usize)> {
        let from = Regressed::new(&self.wanted, &self.units, samples)?;
        let parts = from.parts(&self.wanted, &self.units);
        Some((from, parts))
    }

    /// The target asking for what lies at `share` of the way from `begin`.
    pub(crate) fn on_the_way(mut self, begin: &Regressed, share: f64) -> Self {
        self.now = begin.towards(&self.wanted, share, &self.units);
        self
    }

    /// The same with what is asked for now as all that is wanted.
    pub(crate) fn for_now(&self) -> Self {
        Self { wanted: self.now.clone(), ..self.clone() }
    }

    /// Standard deviations of `H` and `K` of the input on the working scale, which fitted lines and
    /// curves are measured in.
    pub(crate) fn deviation(&self) -> [f64; 2] {
        self.units.deviation
    }

    /// Where the relation holds, in units of the model; what is fitted is fitted to `samples` (on
    /// the working scale).
    pub(crate) fn locus(&self, samples: &[Sample]) -> RelationLocus {
        let (h, k) = (1.0 / self.unit, 1.0 / (self.unit * self.unit));
        let line = |[a, b, c]: [f64; 3]| RelationLocus::Line { a: a * h, b: b * k, c };
        let curve = |curve: &DiagramCurve| {
            let [x, y] = self.units.deviation;
            let scaled = |p: &[f64; 2]| [p[0] * x / h, p[1] * y / k];
            RelationLocus::Curve {
                points: curve.points().iter().map(scaled).collect(),
                control: curve.control().iter().map(scaled).collect(),
            }
        };
        match &self.wanted {
            &Kind::Affine(row) => line(row),
            &Kind::Ratio([cosine, sine]) => RelationLocus::Ratio(sine / cosine),
            Kind::LinearFit => line(self.line(samples)),
            Kind::Curve(given) => curve(given),
            &Kind::CurveFit(control) => match self.fitted(samples, control) {
                Some(fitted) => curve(&fitted),
                None => line(self.line(samples)),
            },
        }
    }

    /// Whether the rows change from iterate to iterate.
    pub(crate) fn follows(&self) -> bool {
        matches!(self.now, Kind::LinearFit | Kind::Curve(_) | Kind::CurveFit(_))
    }

    /// `cos θ` and `sin θ` of the row over the natural size, and the smoothing of its root, if the
    /// relation is a ratio.
    pub(crate) fn ratio(&self) -> Option<([f64; 2], f64)> {
        match self.now {
            Kind::Ratio(row) => {
                let size = self.units.size[0];
                Some((row.map(|x| x / size), UMBILIC_SMOOTHING * size))
            }
            _ => None,
        }
    }

    /// `α, β, γ` of the row `α H + β K + γ` of every sample, in units of the natural sizes (given
    /// coefficients) or of the deviations (fitted ones).
    pub(crate) fn rows(&self, samples: &[Sample]) -> Vec<[f64; 3]> {
        self.rows_of(&self.now, samples)
    }

    fn rows_of(&self, kind: &Kind, samples: &[Sample]) -> Vec<[f64; 3]> {
        match kind {
            Kind::Ratio(_) => vec![[0.0; 3]; samples.len()],
            &Kind::Affine([a, b, c]) => {
                let scale = (a * self.units.size[0]).hypot(b * self.units.size[1]);
                vec![[a / scale, b / scale, c / scale]; samples.len()]
            }
            Kind::LinearFit => vec![self.line(samples); samples.len()],
            Kind::Curve(curve) => self.tangents(curve, samples),
            &Kind::CurveFit(control) => match self.fitted(samples, control) {
                Some(curve) => self.tangents(&curve, samples),
                None => vec![self.line(samples); samples.len()],
            },
        }
    }

    fn fitted(&self, samples: &[Sample], control: usize) -> Option<DiagramCurve> {
        DiagramCurve::fit(&self.units.diagram(samples), control)
    }

    /// The line of least squared distances in the diagram.
    fn line(&self, samples: &[Sample]) -> [f64; 3] {
        let (mean, axis) = principal_axis(&self.units.diagram(samples));
        self.through(mean, [-axis[1], axis[0]])
    }

    /// The row of the line through `point` with unit normal `normal`.
    fn through(&self, point: [f64; 2], normal: [f64; 2]) -> [f64; 3] {
        let offset = -(normal[0] * point[0] + normal[1] * point[1]);
        let [x, y] = self.units.deviation;
        [normal[0] / x, normal[1] / y, offset]
    }

    fn tangents(&self, curve: &DiagramCurve, samples: &[Sample]) -> Vec<[f64; 3]> {
        let feet = curve.feet(&self.units.diagram(samples));
        feet.iter().map(|foot| self.through(foot.point, foot.normal)).collect()
    }

    /// Root mean square distance from the relation over `samples`, unscaled: of `H − c`, `K − c`,
    /// `(a H + b K + c)/√(a² + b²)`, `(κ₁ − R κ₂)/√(1 + R²)`, and of the distance in the diagram in
    /// the input's standard deviations for fitted lines and curves. Each sample counts as `weights`
    /// say, all alike without any.
    pub(crate) fn rms(&self, samples: &[Sample], weights: Option<&[f64]>) -> f64 {
        let distances = self.distances(samples);
        let (mut sum, mut all) = (0.0, 0.0);
        for (k, distance) in distances.iter().enumerate() {
            let weight = weights.map_or(1.0, |w| w[k]);
            sum += weight * distance * distance;
            all += weight;
        }
        (sum / all).sqrt()
    }

    /// The distance of every sample from the relation, as [`Self::rms`] has them.
    pub(crate) fn distances(&self, samples: &[Sample]) -> Vec<f64> {
        match &self.wanted {
            &Kind::Affine([a, b, c]) => {
                let scale = a.hypot(b);
                samples.iter().map(|s| (a * s.jet.h + b * s.jet.k + c) / scale).collect()
            }
            &Kind::Ratio([cosine, sine]) => {
                let distance = |(k1, k2): (f64, f64)| cosine * k1 - sine * k2;
                samples.iter().map(|s| distance(s.principal())).collect()
            }
            Kind::LinearFit => {
                let [a, b, c] = self.line(samples);
                samples.iter().map(|s| a * s.jet.h + b * s.jet.k + c).collect()
            }
            Kind::Curve(curve) => self.distances_from(curve, samples),
            &Kind::CurveFit(control) => match self.fitted(samples, control) {
                Some(curve) => self.distances_from(&curve, samples),
                None => vec![0.0; samples.len()],
            },
        }
    }

    fn distances_from(&self, curve: &DiagramCurve, samples: &[Sample]) -> Vec<f64> {
        let points = self.units.diagram(samples);
        let feet = curve.feet(&points);
        let distance = |(p, foot): (&[f64; 2], &crate::curve::Foot)| {
            (p[0] - foot.point[0]).hypot(p[1] - foot.point[1])
        };
        points.iter().zip(&feet).map(distance).collect()
    }

    /// What [`Self::rms`] of a miss as large as the curvatures themselves would be: their natural size
    /// in the unit of the distances.
    pub(crate) fn natural(&self) -> f64 {
        match self.wanted {
            Kind::Affine([a, b, _]) => {
                (a * self.units.size[0]).hypot(b * self.units.size[1]) / a.hypot(b)
            }
            Kind::Ratio(_) => self.units.size[0],
            _ => 1.0,
        }
    }
}
