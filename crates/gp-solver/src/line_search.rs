//! Step lengths along a descent direction.

/// Decrease a step must bring, as a share of what the slope at its beginning promises.
const ARMIJO: f64 = 1e-4;
/// Evaluations after which a search gives up or takes the best point found.
const MAX_EVALUATIONS: usize = 30;

/// How a step length is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineSearch {
    /// Halving or quadratic interpolation until `φ(t) ≤ φ(0) + 10⁻⁴ t φ'(0)`.
    Armijo,
    /// That and `|φ'(t)| ≤ sigma |φ'(0)|` (Nocedal and Wright 2006, Algorithms 3.5 and 3.6).
    StrongWolfe {
        /// Share of the first slope that may remain; between 10⁻⁴ and 1, about 0.9 for
        /// quasi-Newton directions.
        sigma: f64,
    },
}

impl Default for LineSearch {
    fn default() -> Self {
        Self::StrongWolfe { sigma: 0.9 }
    }
}

/// What a line search found. The last evaluation was at the step returned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outcome {
    Step { length: f64, value: f64 },
    NoProgress,
}

#[derive(Clone, Copy)]
struct Point {
    t: f64,
    value: f64,
    slope: f64,
}

impl LineSearch {
    /// Searches from value and slope at 0; `evaluate` gives both at `t`.
    pub(crate) fn search(
        self,
        value: f64,
        slope: f64,
        first: f64,
        evaluate: &mut impl FnMut(f64) -> (f64, f64),
    ) -> Outcome {
        let start = Point { t: 0.0, value, slope };
        match self {
            Self::Armijo => armijo(start, first, evaluate),
            Self::StrongWolfe { sigma } => strong_wolfe(start, first, sigma, evaluate),
        }
    }
}

fn enough(start: Point, p: Point) -> bool {
    p.value.is_finite()
        && p.slope.is_finite()
        && p.value <= start.value + ARMIJO * p.t * start.slope
}

fn armijo(start: Point, first: f64, evaluate: &mut impl FnMut(f64) -> (f64, f64)) -> Outcome {
    let mut t = first;
    for _ in 0..MAX_EVALUATIONS {
        let (value, slope) = evaluate(t);
        if enough(start, Point { t, value, slope }) {
            return Outcome::Step { length: t, value };
        }
        // Minimum of the parabola through φ(0), φ'(0), φ(t).
        let parabola = -0.5 * start.slope * t * t / (value - start.value - start.slope * t);
        t = if parabola.is_finite() { parabola.clamp(0.1 * t, 0.5 * t) } else { 0.1 * t };
    }
    Outcome::NoProgress
}

fn strong_wolfe(
    start: Point,
    first: f64,
    sigma: f64,
    evaluate: &mut impl FnMut(f64) -> (f64, f64),
) -> Outcome {
    let mut low = start;
    let mut high: Option<Point> = None;
    let mut t = first;
    for _ in 0..MAX_EVALUATIONS {
        let (value, slope) = evaluate(t);
        let p = Point { t, value, slope };
        if !(value.is_finite() && slope.is_finite()) {
            high = Some(p);
            t = low.t + 0.1 * (t - low.t);
            continue;
        }
        if !enough(start, p) || (low.t > 0.0 && value >= low.value) {
            high = Some(p);
        } else {
            if slope.abs() <= -sigma * start.slope {
                return Outcome::Step { length: t, value };
            }
            if slope * (t - low.t) >= 0.0 {
                high = Some(low);
            }
            low = p;
        }
        t = match high {
            None => (low.t + 4.0 * (low.t - 0.0).max(first)).min(10.0 * low.t),
            Some(high) => between(low, high),
        };
        let width = high.map_or(f64::INFINITY, |h| (h.t - low.t).abs());
        if width <= 1e-12 * low.t.max(first) {
            break;
        }
    }
    if low.t > 0.0 {
        // The curvature condition could not be met, yet this point lowers the value.
        let (value, _) = evaluate(low.t);
        return Outcome::Step { length: low.t, value };
    }
    Outcome::NoProgress
}

/// Minimum of the cubic through two points, kept off the ends of the interval.
fn between(low: Point, high: Point) -> f64 {
    let middle = 0.5 * (low.t + high.t);
    if !(high.value.is_finite() && high.slope.is_finite()) {
        return middle;
    }
    let width = high.t - low.t;
    let d1 = low.slope + high.slope - 3.0 * (high.value - low.value) / width;
    let square = d1 * d1 - low.slope * high.slope;
    if !(square >= 0.0) {
        return middle;
    }
    let d2 = square.sqrt().copysign(width);
    let t = high.t - width * (high.slope + d2 - d1) / (high.slope - low.slope + 2.0 * d2);
    let (a, b) = (low.t + 0.1 * width, high.t - 0.1 * width);
    if t.is_finite() { t.clamp(a.min(b), a.max(b)) } else { middle }
}
