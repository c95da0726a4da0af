//! A loop of edges as a chain in the parameter plane, run after run, without jumps.

use super::chart::{Chart, Place};
use super::{FaceEdge, FaceError};
use crate::curve::BsplineCurve;
use crate::trim::signed_area;
use glam::{DVec2, DVec3};

/// Fewest points of an edge that are located.
const LEAST: usize = 8;
/// Most points of an edge that are located.
const MOST: usize = 2000;
/// Two points of an edge further apart than this share of a period get others between them.
const JUMP: f64 = 0.25;
/// How often the piece between two points is halved for that.
const HALVINGS: usize = 40;
/// Courses in the parameter plane are this near to their edges, as a share of its size, or are not
/// taken.
const EXACT: f64 = 1e-6;
/// Places at which they are compared.
const CHECKS: usize = 16;
/// Ends that differ by less than this share of a period around a pole are one meridian.
const SAME_MERIDIAN: f64 = 1e-7;

/// A point of a run: its parameter on the run's curve and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) t: f64,
    pub(super) at: [f64; 2],
    pub(super) pole: Option<usize>,
}

/// A part of a chain: an edge, or a straight line that no edge is on (along a pole or a seam).
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// In space; none on a line without an edge.
    pub(super) curve: Option<BsplineCurve>,
    /// In the parameter plane, if the file has it.
    pub(super) parameters: Option<BsplineCurve>,
    /// At parameters of `parameters` if that is there, else of `curve`.
    pub(super) samples: Vec<Sample>,
}

impl Run {
    /// A straight line without an edge.
    pub(super) fn line(from: [f64; 2], to: [f64; 2]) -> Self {
        let end = |t: f64, at: [f64; 2]| Sample { t, at, pole: None };
        Self { curve: None, parameters: None, samples: vec![end(0.0, from), end(1.0, to)] }
    }

    pub(super) fn start(&self) -> Sample {
        self.samples[0]
    }

    pub(super) fn end(&self) -> Sample {
        self.samples[self.samples.len() - 1]
    }

    pub(super) fn shift(&mut self, by: [f64; 2]) -> Result<(), FaceError> {
        if by == [0.0, 0.0] {
            return Ok(());
        }
        for sample in &mut self.samples {
            sample.at = [sample.at[0] + by[0], sample.at[1] + by[1]];
        }
        if let Some(curve) = &self.parameters {
            self.parameters = Some(curve.mapped(|p| p + DVec3::new(by[0], by[1], 0.0))?);
        }
        Ok(())
    }

    /// The whole of an edge whose course the file gives in the parameter plane; `None` if that is
    /// not where the edge runs.
    fn given(edge: &FaceEdge, parameters: &BsplineCurve, chart: &Chart<'_>) -> Option<Self> {
        let at = |t: f64| {
            let p = parameters.point(t);
            [p.x, p.y]
        };
        let samples: Vec<Sample> =
            places(parameters).into_iter().map(|t| Sample { t, at: at(t), pole: None }).collect();
        let size = edge.curve.control_points()[0];
        let spread = edge.curve.control_points().iter().map(|p| p.distance(size));
        let slack = 1e-4 * spread.fold(0.0, f64::max) + 100.0 * chart.tolerance;
        let middle =
            chart.point(at(0.5 * (parameters.knots().domain().0 + parameters.knots().domain().1)));
        let nearest = edge.curve.point(edge.curve.closest_parameter(middle));
        let (start, end) = edge.curve.knots().domain();
        let fits = chart.point(samples[0].at).distance(edge.curve.point(start)) <= slack
            && chart.point(samples[samples.len() - 1].at).distance(edge.curve.point(end)) <= slack
            && nearest.distance(middle) <= slack;
        fits.then(|| Self {
            curve: Some(edge.curve.clone()),
            parameters: Some(parameters.clone()),
            samples,
        })
    }

    /// Whether a given course runs along its edge, to what the file calls the same place.
    fn is_exact(&self, chart: &Chart<'_>) -> bool {
        let Some(curve) = &self.curve else { return true };
        let points = curve.control_points();
        let spread = points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max);
        let slack = EXACT * spread + chart.tolerance;
        let every = self.samples.len().div_ceil(CHECKS);
        self.samples.iter().step_by(every).chain(self.samples.last()).all(|sample| {
            let p = chart.point(sample.at);
            curve.point(curve.closest_parameter(p)).distance(p) <= slack
        })
    }

    /// An edge whose course is found point by point; cut where it passes through a pole, and
    /// nothing if it is one point.
    fn located(curve: &BsplineCurve, chart: &Chart<'_>) -> Result<Vec<Self>, FaceError> {
        let mut samples: Vec<Sample> = Vec::new();
        for t in places(curve) {
            let next = sample(curve, t, chart, samples.last())?;
            refine(curve, chart, &mut samples, next, HALVINGS)?;
        }
        if samples.iter().all(|s| s.pole.is_some()) {
            return Ok(Vec::new());
        }
        // The meaningless coordinate of a pole is that of the nearest point beside it.
        let inner: Vec<usize> =
            (1..samples.len() - 1).filter(|&k| samples[k].pole.is_some()).collect();
        let mut runs = Vec::new();
        let mut first = 0;
        for last in inner.into_iter().chain([samples.len() - 1]) {
            let mut part = samples[first..=last].to_vec();
            let n = part.len();
            for (k, beside) in [(0, 1), (n - 1, n - 2)] {
                if let Some(axis) = part[k].pole {
                    part[k].at[1 - axis] = part[beside].at[1 - axis];
                }
            }
            let piece = curve.subdomain(part[0].t, part[n - 1].t)?;
            runs.push(Self { curve: Some(piece), parameters: None, samples: part });
            first = last;
        }
        Ok(runs)
    }

    /// Cuts the run between samples `k` and `k + 1` where a coordinate is `x`.
    pub(super) fn split(
        &self,
        k: usize,
        axis: usize,
        x: f64,
        chart: &Chart<'_>,
    ) -> Result<[Self; 2], FaceError> {
        let (a, b) = (self.samples[k], self.samples[k + 1]);
        let at = |t: f64| -> Result<[f64; 2], FaceError> {
            if let Some(curve) = &self.parameters {
                let p = curve.point(t);
                return Ok([p.x, p.y]);
            }
            match &self.curve {
                Some(curve) => Ok(sample(curve, t, chart, Some(&a))?.at),
                None => {
                    let s = (t - a.t) / (b.t - a.t);
                    Ok([0, 1].map(|i| a.at[i] + s * (b.at[i] - a.at[i])))
                }
            }
        };
        let (mut low, mut high) = (a.t, b.t);
        let rising = a.at[axis] < b.at[axis];
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if middle == low || middle == high {
                break;
            }
            *(if (at(middle)?[axis] < x) == rising { &mut low } else { &mut high }) = middle;
        }
        let t = 0.5 * (low + high);
        let mut cut = Sample { t, at: at(t)?, pole: None };
        cut.at[axis] = x;
        let parts = |curve: &BsplineCurve, t: f64| -> Result<[BsplineCurve; 2], FaceError> {
            let (start, end) = curve.knots().domain();
            Ok([curve.subdomain(start, t)?, curve.subdomain(t, end)?])
        };
        let parameters = self.parameters.as_ref().map(|c| parts(c, t)).transpose()?;
        let curves = match (&self.curve, &self.parameters) {
            (Some(curve), None) => Some(parts(curve, t)?),
            (Some(curve), Some(_)) => {
                Some(parts(curve, curve.closest_parameter(chart.point(cut.at)))?)
            }
            (None, _) => None,
        };
        let mut first = self.samples[..=k].to_vec();
        first.push(cut);
        let mut second = vec![cut];
        second.extend_from_slice(&self.samples[k + 1..]);
        let [curve_a, curve_b] = curves.map_or([None, None], |c| c.map(Some));
        let [parameters_a, parameters_b] = parameters.map_or([None, None], |c| c.map(Some));
        Ok([
            Self { curve: curve_a, parameters: parameters_a, samples: first },
            Self { curve: curve_b, parameters: parameters_b, samples: second },
        ])
    }
}

/// Parameters at which a curve is looked at.
fn places(curve: &BsplineCurve) -> Vec<f64> {
    let breaks = curve.knots().breaks();
    let spans = breaks.len() - 1;
    let wanted = (2 * curve.knots().degree().get()).max(LEAST.div_ceil(spans));
    let pieces = wanted.min(MOST / spans).max(1);
    let mut all = Vec::with_capacity(spans * pieces + 1);
    for pair in breaks.windows(2) {
        all.extend((0..pieces).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / pieces as f64));
    }
    all.extend(breaks.last());
    all
}

/// A located point of a curve, in the period of the one before it.
pub(super) fn sample(
    curve: &BsplineCurve,
    t: f64,
    chart: &Chart<'_>,
    before: Option<&Sample>,
) -> Result<Sample, FaceError> {
    let Place { mut at, pole } = chart.locate(curve.point(t), before.map(|s| s.at))?;
    if let Some(before) = before {
        for axis in 0..2 {
            at[axis] = chart.near(axis, at[axis], before.at[axis]);
        }
    }
    Ok(Sample { t, at, pole })
}

/// Appends a sample, and others before it until none is far from the next.
fn refine(
    curve: &BsplineCurve,
    chart: &Chart<'_>,
    samples: &mut Vec<Sample>,
    next: Sample,
    halvings: usize,
) -> Result<(), FaceError> {
    if let Some(&last) = samples.last()
        && halvings > 0
        && samples.len() < 4 * MOST
    {
        let far = |axis: usize| {
            let means = last.pole != Some(1 - axis) && next.pole != Some(1 - axis);
            chart.periods[axis]
                .is_some_and(|p| means && (next.at[axis] - last.at[axis]).abs() > JUMP * p)
        };
        if far(0) || far(1) {
            let middle = sample(curve, 0.5 * (last.t + next.t), chart, Some(&last))?;
            refine(curve, chart, samples, middle, halvings - 1)?;
            let again = sample(curve, next.t, chart, samples.last())?;
            return refine(curve, chart, samples, again, halvings - 1);
        }
    }
    samples.push(next);
    Ok(())
}

/// A closed loop in the parameter plane; closed up to periods.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    pub(super) runs: Vec<Run>,
    /// How many periods the end is ahead of the start.
    pub(super) winding: [i32; 2],
}

impl Chain {
    /// Follows a loop; `None` if it is a single point.
    pub(super) fn walk(edges: &[FaceEdge], chart: &Chart<'_>) -> Result<Option<Self>, FaceError> {
        // A seam has two places; the walk begins at an edge that has one.
        let first = edges.iter().position(|e| e.parameters.len() < 2).unwrap_or(0);
        let mut chain = Self { runs: Vec::new(), winding: [0, 0] };
        let mut owners: Vec<usize> = Vec::new();
        for step in 0..edges.len() {
            let index = (first + step) % edges.len();
            let edge = &edges[index];
            let before = chain.runs.last().map(Run::end);
            let planar = edge.parameters.iter().filter(|_| chart.is_spline());
            let mut given: Vec<Run> = planar.filter_map(|p| Run::given(edge, p, chart)).collect();
            // The place of a seam that continues the walk.
            if let Some(before) = before {
                let gap = |run: &Run| {
                    let at = run.start().at;
                    (0..2)
                        .map(|a| {
                            (chart.near(a, at[a], before.at[a]) - before.at[a]).abs()
                                * chart.scale[a]
                        })
                        .fold(0.0, f64::max)
                };
                let other = |run: &Run| {
                    let at = run.start().at;
                    (0..2)
                        .map(|a| (at[a] - before.at[a]).abs() * chart.scale[a])
                        .fold(0.0, f64::max)
                };
                given.sort_by(|a, b| gap(a).total_cmp(&gap(b)).then(other(a).total_cmp(&other(b))));
            }
            let runs = match given.into_iter().next() {
                Some(run) if run.is_exact(chart) => vec![run],
                // The edge in space is the better one; if it is not on the surface, this must do.
                Some(run) => Run::located(&edge.curve, chart).unwrap_or_else(|_| vec![run]),
                None => Run::located(&edge.curve, chart)?,
            };
            for mut run in runs {
                if let Some(end) = chain.runs.last().map(Run::end) {
                    let before = &chain.runs[chain.runs.len() - 1];
                    let meet = joint(before, run.start(), chart);
                    let Some((shift, line)) = meet else {
                        let index = owners.last().copied().unwrap_or(index);
                        return Err(FaceError::Open { index, next: (first + step) % edges.len() });
                    };
                    run.shift(shift)?;
                    if line {
                        chain.runs.push(Run::line(end.at, run.start().at));
                    }
                }
                chain.runs.push(run);
            }
            owners.push(index);
        }
        let (Some(start), Some(end)) =
            (chain.runs.first().map(Run::start), chain.runs.last().map(Run::end))
        else {
            return Ok(None);
        };
        let Some((shift, line)) = joint(&chain.runs[chain.runs.len() - 1], start, chart) else {
            let last = owners.last().copied().unwrap_or(0);
            return Err(FaceError::Open { index: last, next: first });
        };
        let target = [start.at[0] + shift[0], start.at[1] + shift[1]];
        if line {
            chain.runs.push(Run::line(end.at, target));
        }
        for axis in 0..2 {
            if let Some(period) = chart.periods[axis] {
                chain.winding[axis] = (shift[axis] / period).round() as i32;
            }
        }
        Ok(Some(chain))
    }

    pub(super) fn polygon(&self) -> Vec<DVec2> {
        let open = self.runs.iter().flat_map(|run| &run.samples[..run.samples.len() - 1]);
        open.map(|s| DVec2::from_array(s.at)).collect()
    }

    pub(super) fn area(&self) -> f64 {
        signed_area(&self.polygon())
    }

    /// Lowest and highest value of a coordinate.
    pub(super) fn range(&self, axis: usize) -> [f64; 2] {
        let values = self.runs.iter().flat_map(|run| &run.samples).map(|s| s.at[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    }

    pub(super) fn shift(&mut self, by: [f64; 2]) -> Result<(), FaceError> {
        self.runs.iter_mut().try_for_each(|run| run.shift(by))
    }
}

/// How a run that begins at `start` must be moved to continue after `before`, and whether a line
/// along a pole comes first; `None` if the two do not meet.
fn joint(before: &Run, start: Sample, chart: &Chart<'_>) -> Option<([f64; 2], bool)> {
    let end = before.end();
    let mut shift = [0, 1].map(|a| chart.near(a, start.at[a], end.at[a]) - start.at[a]);
    if chart.point(end.at).distance(chart.point(start.at)) > chart.joint_slack() {
        return None;
    }
    // A curve of the file does not know of poles.
    let is_pole = |s: Sample, axis: usize| {
        s.pole == Some(axis)
            || chart.poles[axis].iter().any(|p| (s.at[axis] - p).abs() <= chart.slack(axis))
    };
    let Some(axis) = (0..2).find(|&axis| is_pole(end, axis) && is_pole(start, axis)) else {
        return Some((shift, false));
    };
    let other = 1 - axis;
    if let Some(period) = chart.periods[other] {
        // With the face to the left, the way along an upper pole of v leads to smaller u, along a
        // lower one to larger u; of u the other way round.
        let is_upper = before.samples[before.samples.len() / 2].at[axis] < end.at[axis];
        let backwards = is_upper == (axis == 1);
        let ahead = start.at[other] - end.at[other];
        let turn = if backwards { -ahead } else { ahead }.rem_euclid(period);
        let turn = if turn < SAME_MERIDIAN * period { turn + period } else { turn };
        let target = end.at[other] + if backwards { -turn } else { turn };
        shift[other] = target - start.at[other];
    }
    let moved = start.at[other] + shift[other];
    Some((shift, (moved - end.at[other]).abs() > chart.slack(other)))
}
