//! Chains that run around a closed surface, joined so that every chain bounds a part of the plane.

use super::FaceError;
use super::chain::{Chain, Run, Sample};
use super::chart::Chart;

/// Places around a period that are tried for a seam.
const SEAMS: usize = 64;

/// Chains without winding, all in the same period.
pub(super) fn close(chains: Vec<Chain>, chart: &Chart<'_>) -> Result<Vec<Chain>, FaceError> {
    let (rings, mut holes): (Vec<Chain>, Vec<Chain>) =
        chains.into_iter().partition(|c| c.winding != [0, 0]);
    let outer = if !rings.is_empty() {
        Some(joined(rings, &holes, chart)?)
    } else if holes.is_empty() || is_complement(&holes, chart) {
        Some(natural(&holes, chart)?)
    } else {
        None
    };
    let outer = match outer {
        Some(outer) => outer,
        None => {
            let largest = (0..holes.len())
                .max_by(|&a, &b| holes[a].area().abs().total_cmp(&holes[b].area().abs()));
            holes.swap_remove(largest.unwrap_or(0))
        }
    };
    let ranges = [0, 1].map(|axis| outer.range(axis));
    for hole in &mut holes {
        let mut shift = [0.0; 2];
        for axis in 0..2 {
            if let Some(period) = chart.periods[axis] {
                let [low, high] = hole.range(axis);
                let ([from, to], middle) = (ranges[axis], 0.5 * (low + high));
                let turns = ((0.5 * (from + to) - middle) / period).round();
                shift[axis] = turns * period;
            }
        }
        hole.shift(shift)?;
    }
    holes.insert(0, outer);
    Ok(holes)
}

/// Whether loops on a closed surface all have the face outside, so that it is the surface without
/// what they bound.
fn is_complement(chains: &[Chain], chart: &Chart<'_>) -> bool {
    let ends = |axis: usize| chart.periods[axis].is_some() || chart.poles[axis].len() >= 2;
    ends(0) && ends(1) && chains.iter().all(|c| c.area() < 0.0)
}

/// The border of the whole carrier, cut open where no hole is.
fn natural(holes: &[Chain], chart: &Chart<'_>) -> Result<Chain, FaceError> {
    let mut bounds = chart.bounds;
    if bounds.iter().flatten().any(|t| !t.is_finite()) {
        return Err(FaceError::Unbounded);
    }
    for axis in 0..2 {
        if let Some(period) = chart.periods[axis] {
            let start = seam(axis, bounds[axis][0], period, holes)?;
            bounds[axis] = [start, start + period];
        }
    }
    let [[u0, u1], [v0, v1]] = bounds;
    let corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]];
    let runs = (0..4).map(|k| Run::line(corners[k], corners[(k + 1) % 4])).collect();
    Ok(Chain { runs, winding: [0, 0] })
}

/// A value at which no hole stands, `wanted` if possible.
fn seam(axis: usize, wanted: f64, period: f64, holes: &[Chain]) -> Result<f64, FaceError> {
    let is_free = |x: &f64| {
        holes.iter().all(|hole| {
            let [low, high] = hole.range(axis);
            // The first value that stands for x and is not below the hole.
            let first = x + ((low - x) / period).ceil() * period;
            first > high || high == low
        })
    };
    let tried = (0..SEAMS).map(|k| wanted + period * k as f64 / SEAMS as f64);
    let mut tried = tried.filter(is_free);
    tried.next().ok_or(FaceError::Winding)
}

/// Rings around a closed direction, with a seam between two of them or between one and a pole.
fn joined(rings: Vec<Chain>, holes: &[Chain], chart: &Chart<'_>) -> Result<Chain, FaceError> {
    let axis = usize::from(rings[0].winding[0] == 0);
    let across = 1 - axis;
    let (Some(period), sign) = (chart.periods[axis], if axis == 0 { 1 } else { -1 }) else {
        return Err(FaceError::Winding);
    };
    let (mut lower, mut upper) = (None, None);
    for ring in rings {
        let side = match ring.winding[axis] * sign {
            1 => &mut lower,
            -1 => &mut upper,
            _ => return Err(FaceError::Winding),
        };
        if ring.winding[across] != 0 || side.is_some() {
            return Err(FaceError::Winding);
        }
        *side = Some(ring);
    }
    // A spline keeps the seam it has.
    let first = lower.as_ref().or(upper.as_ref()).map_or(0.0, |c| c.runs[0].start().at[axis]);
    let wanted = if chart.is_spline() { chart.bounds[axis][0] } else { first };
    let start = seam(axis, wanted, period, holes)?;
    match (lower, upper) {
        (Some(lower), Some(mut upper)) => {
            if let Some(other) = chart.periods[across] {
                let (low, high) = (lower.range(across)[0], upper.range(across)[0]);
                let mut shift = [0.0; 2];
                shift[across] = ((low - high) / other).ceil() * other;
                upper.shift(shift)?;
            }
            let lower = rotated(lower, axis, start, chart)?;
            let end = start + f64::from(sign) * period;
            let upper = rotated(upper, axis, end, chart)?;
            let line = |from: &[Run], to: &[Run]| {
                Run::line(from[from.len() - 1].end().at, to[0].start().at)
            };
            let (up, down) = (line(&lower, &upper), line(&upper, &lower));
            Ok(around([lower, vec![up], upper, vec![down]]))
        }
        (Some(ring), None) | (None, Some(ring)) => {
            let is_lower = ring.winding[axis] * sign == 1;
            let [low, high] = ring.range(across);
            let beyond = |t: &f64| if is_lower { *t > high } else { *t < low };
            let ends = chart.poles[across].iter().chain(&chart.bounds[across]).copied();
            let ends = ends.filter(|t| t.is_finite() && beyond(t));
            let near = |a: &f64, b: &f64| (a - low).abs().total_cmp(&(b - low).abs());
            let cap = ends.min_by(near).ok_or(FaceError::Winding)?;
            let ring = rotated(ring, axis, start, chart)?;
            let (from, to) = (ring[0].start().at, ring[ring.len() - 1].end().at);
            let on = |mut at: [f64; 2]| {
                at[across] = cap;
                at
            };
            let back =
                [Run::line(to, on(to)), Run::line(on(to), on(from)), Run::line(on(from), from)];
            Ok(around([ring, back.to_vec(), Vec::new(), Vec::new()]))
        }
        (None, None) => Err(FaceError::Winding),
    }
}

fn around(parts: [Vec<Run>; 4]) -> Chain {
    Chain { runs: parts.into_iter().flatten().collect(), winding: [0, 0] }
}

/// The runs of a ring from where a coordinate is `x`.
fn rotated(ring: Chain, axis: usize, x: f64, chart: &Chart<'_>) -> Result<Vec<Run>, FaceError> {
    let period = chart.periods[axis].ok_or(FaceError::Winding)?;
    let mut runs = ring.runs;
    let slack = chart.slack(axis);
    let stands = |at: f64| (chart.near(axis, at, x) - x).abs() <= slack;
    let first = match runs.iter().position(|run| stands(run.start().at[axis])) {
        Some(first) => first,
        None => {
            let crossing = |pair: &[Sample]| {
                let (a, b) = (pair[0].at[axis], pair[1].at[axis]);
                let value = x + ((a.min(b) - x) / period).ceil() * period;
                (value < a.max(b)).then_some(value)
            };
            let found = runs.iter().enumerate().find_map(|(r, run)| {
                let mut pairs = run.samples.windows(2).enumerate();
                pairs.find_map(|(k, pair)| crossing(pair).map(|value| (r, k, value)))
            });
            let (r, k, value) = found.ok_or(FaceError::Winding)?;
            let [before, after] = runs[r].split(k, axis, value, chart)?;
            runs.splice(r..=r, [before, after]);
            r + 1
        }
    };
    let mut ahead = [0.0; 2];
    ahead[axis] = f64::from(ring.winding[axis]) * period;
    let mut rest = runs.split_off(first);
    for run in &mut runs {
        run.shift(ahead)?;
    }
    rest.append(&mut runs);
    let mut shift = [0.0; 2];
    shift[axis] = ((x - rest[0].start().at[axis]) / period).round() * period;
    for run in &mut rest {
        run.shift(shift)?;
    }
    Ok(rest)
}
