//! The surface and the trim curves of a face from its chains.

use super::chain::{Chain, Run, sample};
use super::chart::Chart;
use super::{Carrier, Face, FaceError};
use crate::curve::BsplineCurve;
use crate::elementary::Elementary;
use crate::lift::fit_to;
use crate::region::bisect;
use crate::surface::BsplineSurface;
use crate::trim::{Trim, TrimCurve, TrimLoop, with_end};
use glam::{DVec2, DVec3};

/// How much further than a bent border an elementary surface reaches, as a share of its extent.
const MARGIN: f64 = 0.01;
/// Parameter curves are fitted to within this share of the tolerance.
const FIT: f64 = 0.1;
/// Ranges that fill a period to within this share are the whole of it.
const WHOLE: f64 = 1e-9;
/// A bounded part smaller than the box by no more than this share of it is the box.
const SAME_AREA: f64 = 1e-7;

/// From the carrier's own parameters to those of the spline.
enum Map<'a> {
    Same,
    Elementary(&'a Elementary, [[f64; 2]; 2]),
}

impl Map<'_> {
    fn at(&self, at: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Same => at,
            Self::Elementary(surface, [u, v]) => surface.spline_parameters(*u, *v, at),
        }
    }
}

pub(super) fn build(
    carrier: &Carrier,
    chart: &Chart<'_>,
    chains: Vec<Chain>,
) -> Result<Face, FaceError> {
    let mut chains = chains;
    let (surface, map, domain) = match carrier {
        Carrier::Elementary(surface) => {
            let [u, v] = [0, 1].map(|axis| extent(&chains, axis, chart));
            (surface.surface(u, v)?, Map::Elementary(surface, [u, v]), [u, v])
        }
        Carrier::Spline(surface) => {
            let (surface, shift) = opened(surface, &chains, chart)?;
            chains.iter_mut().try_for_each(|chain| chain.shift(shift))?;
            let domain = [surface.knots_u().domain(), surface.knots_v().domain()];
            (surface, Map::Same, domain.map(|(a, b)| [a, b]))
        }
    };
    if is_whole(&chains, chart, domain) {
        return Ok(Face { surface, trim: None });
    }
    let mut loops = Vec::with_capacity(chains.len());
    for chain in &chains {
        loops.push(trim_loop(chain, chart, &map, &surface, domain)?);
    }
    Ok(Face { surface, trim: Some(Trim::new(loops)?) })
}

/// The value of a coordinate that a run keeps.
fn constant(run: &Run, axis: usize, chart: &Chart<'_>) -> Option<f64> {
    let values = run.samples.iter().map(|s| s.at[axis]);
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let keeps = high - low <= 2.0 * chart.slack(axis);
    keeps.then_some(if high == low { low } else { 0.5 * (low + high) })
}

/// The range of a coordinate that a surface must have to hold the chains: exact where a line of
/// constant parameter bounds them, with a margin beyond a bent border.
fn extent(chains: &[Chain], axis: usize, chart: &Chart<'_>) -> [f64; 2] {
    let runs = || chains.iter().flat_map(|c| &c.runs);
    let all = |end: f64| {
        let values = runs().flat_map(|r| &r.samples).map(|s| s.at[axis] * end);
        end * values.fold(f64::NEG_INFINITY, f64::max)
    };
    let (low, high) = (all(-1.0), all(1.0));
    let margin = MARGIN * (high - low);
    let straight: Vec<f64> = runs().filter_map(|run| constant(run, axis, chart)).collect();
    let side = |end: f64, out: f64| {
        // The outermost line, if no bent run comes near to it between its points.
        let line = straight.iter().copied().find(|t| (t - end).abs() <= 4.0 * chart.slack(axis));
        let bent = runs().filter(|run| constant(run, axis, chart).is_none()).any(|run| {
            let inner = &run.samples[1..run.samples.len() - 1];
            inner.iter().any(|s| (s.at[axis] - end) * out > -0.05 * margin)
        });
        match line {
            Some(line) if !bent => line,
            _ if chart.is_plane().is_some() && !bent => end,
            _ => end + out * margin,
        }
    };
    let [mut from, mut to] = [side(low, -1.0), side(high, 1.0)];
    let [least, most] = chart.bounds[axis];
    match chart.periods[axis] {
        Some(period) => {
            if to - from > period * (1.0 - WHOLE) {
                // A full turn, from the line that bounds it if there is one.
                let from_line = straight.iter().any(|t| (t - from).abs() <= chart.slack(axis));
                if !from_line && straight.iter().any(|t| (t - to).abs() <= chart.slack(axis)) {
                    from = to - period;
                }
                to = from + period;
            }
        }
        None => (from, to) = (from.max(least), to.min(most)),
    }
    // A cone does not reach beyond its apex.
    for pole in &chart.poles[axis] {
        if low >= pole - chart.slack(axis) {
            from = from.max(*pole);
        } else if high <= pole + chart.slack(axis) {
            to = to.min(*pole);
        }
    }
    [from, to]
}

/// A spline, opened beside the face in the directions in which that runs across its seam; and by
/// how much the chains move.
fn opened(
    surface: &BsplineSurface,
    chains: &[Chain],
    chart: &Chart<'_>,
) -> Result<(BsplineSurface, [f64; 2]), FaceError> {
    let (mut surface, mut shift) = (surface.clone(), [0.0; 2]);
    for axis in 0..2 {
        let Some(period) = chart.periods[axis] else { continue };
        let ranges = chains.iter().map(|c| c.range(axis));
        let [low, high] =
            ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], r| [a.min(r[0]), b.max(r[1])]);
        let ([start, end], slack) = (chart.bounds[axis], chart.slack(axis));
        let turns = ((0.5 * (start + end) - 0.5 * (low + high)) / period).round();
        let (low, high) = (low + turns * period, high + turns * period);
        shift[axis] = turns * period;
        if low >= start - slack && high <= end + slack {
            continue;
        }
        if high - low > period * (1.0 + WHOLE) + slack {
            return Err(FaceError::Winding);
        }
        // In the middle of the gap, and within the domain.
        let seam = low - 0.5 * (period - (high - low)).max(0.0);
        let inside = seam - ((seam - start) / period).floor() * period;
        shift[axis] += inside - seam;
        surface = if axis == 0 {
            surface.with_seam_at_u(inside)?
        } else {
            surface.swapped().with_seam_at_u(inside)?.swapped()
        };
    }
    Ok((surface, shift))
}

/// Whether the chains are the border of the whole domain.
fn is_whole(chains: &[Chain], chart: &Chart<'_>, domain: [[f64; 2]; 2]) -> bool {
    let [chain] = chains else { return false };
    let on_side = |run: &Run| {
        (0..2).any(|axis| {
            let at = constant(run, axis, chart);
            let slack = 4.0 * chart.slack(axis);
            at.is_some_and(|at| domain[axis].iter().any(|side| (side - at).abs() <= slack))
        })
    };
    let whole = (domain[0][1] - domain[0][0]) * (domain[1][1] - domain[1][0]);
    chain.runs.iter().all(on_side) && (chain.area().abs() / whole - 1.0).abs() < SAME_AREA
}

/// A run in the parameter plane of the spline.
struct Drawn {
    parameters: BsplineCurve,
    edge: Option<BsplineCurve>,
    /// The coordinates that it keeps.
    constant: [Option<f64>; 2],
}

fn trim_loop(
    chain: &Chain,
    chart: &Chart<'_>,
    map: &Map<'_>,
    surface: &BsplineSurface,
    domain: [[f64; 2]; 2],
) -> Result<TrimLoop, FaceError> {
    let mut drawn = Vec::with_capacity(chain.runs.len());
    for run in &chain.runs {
        drawn.push(draw(run, chart, map, surface, domain)?);
    }
    let n = drawn.len();
    for k in 0..n {
        let next = (k + 1) % n;
        let (a, b) = (end_of(&drawn[k].parameters, true), end_of(&drawn[next].parameters, false));
        let corner: [f64; 2] = std::array::from_fn(|axis| {
            let kept = drawn[k].constant[axis].or(drawn[next].constant[axis]);
            kept.unwrap_or(if a[axis] == b[axis] { a[axis] } else { 0.5 * (a[axis] + b[axis]) })
        });
        for (k, last, at) in [(k, true, a), (next, false, b)] {
            if at.to_array() != corner {
                drawn[k].parameters = with_end(&drawn[k].parameters, last, DVec2::from(corner))?;
            }
        }
    }
    let curves = drawn.into_iter().map(|d| TrimCurve { parameters: d.parameters, edge: d.edge });
    Ok(TrimLoop::new(curves.collect(), 0.0)?)
}

fn end_of(curve: &BsplineCurve, last: bool) -> DVec2 {
    let points = curve.control_points();
    points[if last { points.len() - 1 } else { 0 }].truncate()
}

fn draw(
    run: &Run,
    chart: &Chart<'_>,
    map: &Map<'_>,
    surface: &BsplineSurface,
    domain: [[f64; 2]; 2],
) -> Result<Drawn, FaceError> {
    let edge = run.curve.clone();
    if let Some(given) = &run.parameters {
        return Ok(Drawn { parameters: given.clamped()?, edge, constant: [None, None] });
    }
    let mut constant = [0, 1].map(|axis| constant(run, axis, chart));
    for axis in 0..2 {
        // A line along a side of the domain is that side.
        constant[axis] = constant[axis].map(|at| {
            let near = |side: &&f64| (**side - at).abs() <= 4.0 * chart.slack(axis);
            domain[axis].iter().find(near).copied().unwrap_or(at)
        });
    }
    let end = |at: [f64; 2]| {
        let kept: [f64; 2] = std::array::from_fn(|axis| constant[axis].unwrap_or(at[axis]));
        let at = map.at(kept);
        DVec3::new(at[0], at[1], 0.0)
    };
    let (start, stop) = (run.start(), run.end());
    let straight = run.curve.is_none() || constant.iter().any(Option::is_some);
    if straight {
        let (a, b) = (end(start.at), end(stop.at));
        let mapped = [0, 1].map(|axis| constant[axis].map(|_| a[axis]));
        let parameters = BsplineCurve::segment(a, b, start.t, stop.t)?;
        return Ok(Drawn { parameters, edge, constant: mapped });
    }
    let Some(curve) = &run.curve else { return Err(FaceError::Winding) };
    if let Some(plane) = chart.is_plane() {
        let flat = |p: DVec3| {
            let local = plane.frame.local(p);
            DVec3::new(local.x, local.y, 0.0)
        };
        let parameters = curve.clamped()?.mapped(flat)?;
        return Ok(Drawn { parameters, edge, constant: [None, None] });
    }
    let before = |t: f64| {
        let k = run.samples.partition_point(|s| s.t <= t).max(1) - 1;
        run.samples[k]
    };
    // Located points are checked once when the run is made, so that a failure here is far off.
    let natural = |t: f64| {
        let from = before(t);
        let mut at = sample(curve, t, chart, Some(&from)).map_or(from.at, |s| s.at);
        for s in [start, stop] {
            if s.t == t {
                at = s.at;
            }
        }
        at
    };
    let at = |t: f64| {
        let at = map.at(natural(t));
        DVec3::new(at[0], at[1], 0.0)
    };
    let lines = [surface.knots_u().breaks(), surface.knots_v().breaks()];
    let mut breaks = curve.knots().breaks();
    for pair in run.samples.windows(2) {
        for (axis, lines) in lines.iter().enumerate() {
            let (from, to) = (map.at(pair[0].at)[axis], map.at(pair[1].at)[axis]);
            let crossed = lines.iter().filter(|l| (from - **l) * (to - **l) < 0.0);
            breaks.extend(crossed.map(|l| bisect(pair[0].t, pair[1].t, |t| at(t)[axis] - l)));
        }
    }
    breaks.sort_by(f64::total_cmp);
    let near = 1e-9 * (stop.t - start.t);
    breaks.dedup_by(|b, a| *b - *a <= near);
    let last = breaks.len() - 1;
    (breaks[0], breaks[last]) = (start.t, stop.t);
    let accuracy = FIT * chart.slack(0).min(chart.slack(1));
    let (parameters, _) = fit_to(&breaks, at, accuracy)?;
    Ok(Drawn { parameters, edge, constant: [None, None] })
}
