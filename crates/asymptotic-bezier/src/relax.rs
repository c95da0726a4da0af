//! Relaxed mode: moves tangents and curvatures as little as needed to make bad data good.
//!
//! Corner data are third-order data: one percent of noise on a tangent tilts the corner plane,
//! and where the curvature is small the torsion answers by spikes. The data are therefore taken
//! as measurements: unknowns are the eight tangents, the eight logarithms of the curvatures and
//! the four corner torsions; the torsion equations are solved for the own-arm coefficients, so
//! every iterate is an exact asymptotic quadrilateral. Levenberg-Marquardt minimises the squared
//! moves, in units of their tolerance, plus a fairness of the curves: fourth differences of the
//! polygons (zero for the cubics of an Enneper net) and the variation of the torsion. The weight
//! of the fairness is raised from small values until the result is acceptable, so data that are
//! nearly good are hardly touched.

use geom_core::DVec3;
use gp_solver::{Elements, Options as SolverOptions, Problem, ResidualBlock, solve};

use crate::boundary::{BoundaryOptions, TorsionHandle};
use crate::curve::BezierCurve;
use crate::data::{CURVE_CORNERS, CornerData, Curvatures, INTO_IS_LEFT};
use crate::error::{AsymptoticError, Place};
use crate::patch::{FilledPatch, PatchOptions, fill_patch};
use crate::quad::{Quadrilateral, TURNING_LIMIT, solve_quadrilateral, solve_signed};

/// Settings of the relaxed mode.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxOptions {
    /// Largest move of one tangent, `|Δt|/|t|`, or of one curvature, `|Δ log k|`.
    pub max_move: f64,
    /// Largest root mean square of all sixteen moves.
    pub rms_move: f64,
    /// Largest binormal turning of a curve, radians.
    pub max_turning: f64,
    /// Least sine between the parameter lines of the filled patch.
    pub min_sine: f64,
    /// Fairness weights, tried in this order until the result is acceptable.
    pub weights: Vec<f64>,
    /// Steps of each solve.
    pub max_iterations: usize,
}

impl Default for RelaxOptions {
    fn default() -> Self {
        Self {
            max_move: 0.05,
            rms_move: 0.02,
            max_turning: TURNING_LIMIT,
            min_sine: 0.1,
            weights: vec![0.03, 0.1, 0.3, 1.0, 3.0, 10.0],
            max_iterations: 60,
        }
    }
}

/// Result of the relaxed mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Relaxed {
    /// The moved data, curvatures signed.
    pub data: CornerData,
    /// The quadrilateral of the moved data with the torsions found.
    pub quad: Quadrilateral,
    /// The filled patch.
    pub filled: Option<FilledPatch>,
    /// Moves `|Δt|/|t|` of the eight tangents and `|Δ log k|` of the eight curvatures.
    pub moves: [f64; 16],
    /// Whether turning, torsion signs, regularity and moves are all within their limits.
    pub acceptable: bool,
    /// Solver steps of all weights tried.
    pub iterations: usize,
}

impl Relaxed {
    /// Root mean square of the moves.
    #[must_use]
    pub fn rms_move(&self) -> f64 {
        (self.moves.iter().map(|m| m * m).sum::<f64>() / 16.0).sqrt()
    }

    /// Largest move.
    #[must_use]
    pub fn max_move(&self) -> f64 {
        self.moves.iter().copied().fold(0.0, f64::max)
    }
}

/// Moves tangents and curvatures of `data` until the quadrilateral is acceptable.
///
/// Data that are acceptable already come back untouched. When no weight succeeds, the result
/// with the least turning within the tolerances is returned with `acceptable` false.
///
/// # Errors
/// The hard faults of the data themselves, which no small move can mend.
pub fn relax(data: &CornerData, options: &RelaxOptions) -> Result<Relaxed, AsymptoticError> {
    let quad = solve_quadrilateral(data, &BoundaryOptions::default())?;
    let mut start = data.clone();
    start.curvatures = Curvatures::Signed(quad.curvatures);
    let untouched = judge(&start, start.clone(), quad, options, 0);
    if untouched.acceptable {
        return Ok(untouched);
    }
    let mut best = untouched;
    let mut iterations = 0;
    let initial = Model::new(&start);
    let mut x = initial.start();
    for &weight in &options.weights {
        let mut model = Model::new(&start);
        model.weight = weight;
        iterations += model.minimize(&mut x, options.max_iterations);
        let (moved, torsions) = model.unpack(&x);
        let Curvatures::Signed(signed) = moved.curvatures else { continue };
        let handles = BoundaryOptions {
            torsions: torsions.iter().map(|t| TorsionHandle::Fixed(*t)).collect(),
            ..Default::default()
        };
        let Ok(quad) = solve_signed(&moved, &signed, &handles) else { continue };
        let result = judge(&start, moved, quad, options, iterations);
        if result.acceptable {
            return Ok(result);
        }
        let within = |r: &Relaxed| r.max_move() <= options.max_move;
        if within(&result) && result.quad.turning() < best.quad.turning() {
            best = result;
        }
    }
    best.iterations = iterations;
    Ok(best)
}

fn judge(
    from: &CornerData,
    data: CornerData,
    quad: Quadrilateral,
    options: &RelaxOptions,
    iterations: usize,
) -> Relaxed {
    let moves = moves(from, &data);
    let mut relaxed = Relaxed { data, quad, filled: None, moves, acceptable: false, iterations };
    let good = (0..4).filter(|i| !from.lines[*i]).all(|i| {
        let q = &relaxed.quad.qualities[i];
        q.turning < options.max_turning && q.torsion[0] * q.torsion[1] > 0.0
    });
    let small = relaxed.rms_move() <= options.rms_move && relaxed.max_move() <= options.max_move;
    if good && small {
        let filled =
            fill_patch(&relaxed.quad.boundary, &PatchOptions::default(), Place::Patch(0)).ok();
        relaxed.acceptable =
            filled.as_ref().is_some_and(|f| f.patch.least_sine(32) >= options.min_sine);
        relaxed.filled = filled;
    }
    relaxed
}

fn moves(from: &CornerData, to: &CornerData) -> [f64; 16] {
    let mut out = [0.0; 16];
    for i in 0..4 {
        for e in 0..2 {
            let (a, b) = (from.arm(i, e), to.arm(i, e));
            out[2 * i + e] = (b - a).length() / a.length();
            let (k, l) = (from.curvatures.values()[i][e], to.curvatures.values()[i][e]);
            if k != 0.0 {
                out[8 + 2 * i + e] = (l / k).ln().abs();
            }
        }
    }
    out
}

/// Unknowns: eight arms as `a = a₀ + |a₀| y`, eight logarithms of curvature ratios, four torsions
/// times the patch size.
const UNKNOWNS: usize = 24 + 8 + 4;
/// Parameters per curve at which the torsion is looked at.
const TORSION_SAMPLES: usize = 9;
/// Rows: moves, fourth differences, torsions, their variation, their sign.
const ROWS: usize = 32 + 4 * 6 + 3 * 4 * TORSION_SAMPLES;

// Shares of the fairness terms at weight one, against moves in percent: fourth differences over
// the chord, torsion times chord, its change between samples, its shortfall below the margin.
const FOURTH_SHARE: f64 = 100.0;
const TORSION_SHARE: f64 = 0.5;
const VARIATION_SHARE: f64 = 3.0;
const SIGN_SHARE: f64 = 10.0;
/// Torsion times chord that keeps clear of zero.
const SIGN_MARGIN: f64 = 0.1;

/// Residuals of the relaxed problem.
struct Model {
    data: CornerData,
    size: f64,
    elements: Elements,
    weight: f64,
    /// Sign of the torsion of the u-curves, as the corners of the patch are twisted.
    sign: f64,
}

impl Model {
    fn new(data: &CornerData) -> Self {
        let mut elements = Elements::new();
        elements.push(&(0..UNKNOWNS).collect::<Vec<usize>>(), ROWS);
        let mut model =
            Self { data: data.clone(), size: data.size(), elements, weight: 1.0, sign: 1.0 };
        let torsions = &model.start()[32..];
        model.sign = torsions.iter().sum::<f64>().signum();
        model
    }

    /// The data unmoved, with the torsions of the bilinear patch: those of noisy data are wild.
    fn start(&self) -> Vec<f64> {
        let mut x = vec![0.0; UNKNOWNS];
        let c = &self.data.corners;
        let twist = c[3] - c[1] - c[2] + c[0];
        for corner in 0..4 {
            let (u, v) = (corner % 2, corner / 2);
            let along_u = c[1 + 2 * v] - c[2 * v];
            let along_v = c[2 + u] - c[u];
            let n = along_u.cross(along_v);
            x[32 + corner] = twist.dot(n) / n.length_squared() * self.size;
        }
        x
    }

    fn minimize(&self, x: &mut [f64], max_iterations: usize) -> usize {
        let mut problem = Problem::new(UNKNOWNS);
        problem.add(Rows(self));
        for i in (0..4).filter(|i| self.data.lines[*i]) {
            for e in 0..2 {
                let arm = 2 * i + e;
                for k in 3 * arm..3 * arm + 3 {
                    problem.fix(k);
                }
                problem.fix(24 + arm);
            }
        }
        let options = SolverOptions {
            max_iterations,
            energy_tol: 1e-6,
            step_tol: 1e-8,
            ..Default::default()
        };
        solve(problem, x, &options).map_or(0, |report| report.iterations)
    }

    fn unpack(&self, x: &[f64]) -> (CornerData, [f64; 4]) {
        let mut data = self.data.clone();
        let mut k = *self.data.curvatures.values();
        for i in 0..4 {
            for e in 0..2 {
                let at = 2 * i + e;
                let arm = self.data.arm(i, e);
                let moved = arm + DVec3::from_slice(&x[3 * at..]) * arm.length();
                let tip = self.data.corners[CURVE_CORNERS[i][e]] + moved;
                if e == 0 {
                    data.start_points[i] = tip;
                } else {
                    data.end_points[i] = tip;
                }
                k[i][e] *= x[24 + at].exp();
            }
        }
        data.curvatures = Curvatures::Signed(k);
        (data, std::array::from_fn(|c| x[32 + c] / self.size))
    }

    /// The curves of an iterate: the torsion equations solved for the own-arm coefficients.
    fn curves(&self, x: &[f64]) -> [Option<BezierCurve>; 4] {
        let (data, torsions) = self.unpack(x);
        let k = data.curvatures.values();
        // The normal at each corner is that of counter-clockwise faces.
        let arms: [(usize, usize, usize, usize); 4] =
            [(0, 0, 1, 0), (3, 0, 0, 1), (1, 1, 2, 0), (2, 1, 3, 1)];
        let normals = arms.map(|(i, e, j, f)| data.arm(i, e).cross(data.arm(j, f)).normalize());
        std::array::from_fn(|i| {
            if data.lines[i] {
                return None;
            }
            let [s, t] = CURVE_CORNERS[i];
            let (a, b) = (data.arm(i, 0), data.arm(i, 1));
            let (p0, p5) = (data.corners[s], data.corners[t]);
            let side = |e: usize, arm: DVec3, n: DVec3| {
                n.cross(arm) * (1.25 * k[i][e] * INTO_IS_LEFT[i][e] * arm.length())
            };
            let (n0, n1) = (normals[s], normals[t]);
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let height = |e: usize, arm: DVec3, tau: f64| {
                k[i][e] * INTO_IS_LEFT[i][e] * arm.length().powi(3) * 25.0 / 12.0 * sign * tau
            };
            let (base2, base3) = (p0 + side(0, a, n0), p5 + side(1, b, n1));
            let x1 = (height(0, a, torsions[s]) - n0.dot(base3 - p0)) / n0.dot(b);
            let x0 = (height(1, b, torsions[t]) - n1.dot(base2 - p5)) / n1.dot(a);
            Some(BezierCurve::new(vec![p0, p0 + a, base2 + a * x0, base3 + b * x1, p5 + b, p5]))
        })
    }
}

/// Borrowed rows for the solver.
struct Rows<'a>(&'a Model);

impl ResidualBlock for Rows<'_> {
    fn name(&self) -> &str {
        "relaxed data"
    }

    fn elements(&self) -> &Elements {
        &self.0.elements
    }

    fn residuals(&self, x: &[f64], out: &mut [f64]) {
        let model = self.0;
        // Moves in percent: the noise this mode is for.
        for k in 0..32 {
            out[k] = 100.0 * x[k];
        }
        out[32..].fill(0.0);
        let weight = model.weight.sqrt();
        for (i, curve) in model.curves(x).iter().enumerate() {
            let Some(curve) = curve else { continue };
            let points = curve.points();
            let length = (points[5] - points[0]).length();
            for k in 0..2 {
                let fourth = points[k] - points[k + 1] * 4.0 + points[k + 2] * 6.0
                    - points[k + 3] * 4.0
                    + points[k + 4];
                let scaled = fourth * (weight * FOURTH_SHARE / length);
                out[32 + 6 * i + 3 * k..32 + 6 * i + 3 * k + 3].copy_from_slice(&scaled.to_array());
            }
            let table = crate::curve::JetTable::new(curve);
            let mut tau = [0.0; TORSION_SAMPLES];
            for (j, tau) in tau.iter_mut().enumerate() {
                let t = j as f64 / (TORSION_SAMPLES - 1) as f64;
                *tau = table.at(t).torsion() * length;
            }
            let (share, at) = (1.0 / (TORSION_SAMPLES as f64).sqrt(), 56 + TORSION_SAMPLES * i);
            for j in 0..TORSION_SAMPLES {
                // The torsion itself, gently, and its change from sample to sample.
                out[at + j] = weight * TORSION_SHARE * share * tau[j];
                let before = if j > 0 { tau[j - 1] } else { tau[j] };
                out[at + 4 * TORSION_SAMPLES + j] = weight * VARIATION_SHARE * (tau[j] - before);
                let inward = model.sign * if i % 2 == 0 { tau[j] } else { -tau[j] };
                out[at + 8 * TORSION_SAMPLES + j] =
                    weight * SIGN_SHARE * (SIGN_MARGIN - inward).max(0.0);
            }
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        // Central differences of a closed form in 36 unknowns: cheaper than the solve itself.
        let (mut plus, mut minus) = (vec![0.0; ROWS], vec![0.0; ROWS]);
        let mut y = x.to_vec();
        for k in 0..UNKNOWNS {
            let step = 1e-6;
            y[k] = x[k] + step;
            self.residuals(&y, &mut plus);
            y[k] = x[k] - step;
            self.residuals(&y, &mut minus);
            y[k] = x[k];
            for r in 0..ROWS {
                jacobian[r * UNKNOWNS + k] = (plus[r] - minus[r]) / (2.0 * step);
            }
        }
    }
}
