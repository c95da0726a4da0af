//! The curves of a whole net from the normals along them.
//!
//! Unknown are the normal at every vertex, the tangent of every mesh line through it and the growth
//! of the normal along it (one for both sides of a line that goes on), and the middle of the
//! normals along every curve. So lines of the net have continuous tangents and derivatives of
//! the torsion at the vertices. Least squares make curves and normals fair and keep tangents and
//! normals near the data; that every curve reaches its end, and that the curvature is continuous along
//! lines, is imposed with a large weight and then, by shortest steps, to rounding.

use std::collections::HashMap;

use geom_core::{DVec2, DVec3};
use gp_solver::{
    Closeness, MinNormProjection, Options, Problem, ProjectionOptions, Stage, Status, solve,
};

use crate::boundary::normals::blocks::{Exactness, Fairness};
use crate::boundary::normals::curve::{COLUMNS, CURVE_DEGREE, CurveEnd, LINE, NormalCurve, OWN};
use crate::boundary::options::BoundaryOptions;
use crate::boundary::solved::Boundary;
use crate::curve::bezier::BezierCurve;
use crate::data::corners::{AsymptoticNet, DATA_DEGREE};
use crate::data::vertex::{
    PLANE_TOL, VertexFrame, arm_signs, bilinear_torsions, curve_families, vertex_frames,
};
use crate::error::{AsymptoticError, AsymptoticWarning};

/// Estimated torsions are kept above this share of their median: less is noise at flat places.
const LEAST_TORSION: f64 = 0.05;
/// Torsions times the longest chord below this are none.
const FLAT: f64 = 1e-9;
/// A net is refused if the faces at more than this share of its vertices twist the wrong way or not
/// at all: between random twists half of them do.
const MOST_WITHOUT_TWIST: f64 = 0.25;
/// Tangents that turn by more degrees from the estimates are warned about: on exact nets of coarse
/// meshes they turn by up to twelve, on meshes that are only roughly asymptotic by more than thirty,
/// with mean curvatures that jump accordingly.
const MOST_TURN: f64 = 20.0;
/// Weights of gaps and jumps, in chords, one solve after the other. Multipliers do most of the
/// closing: with weights alone, large ones, the solver crawls along the bottom of a bent valley.
const CLOSING: [f64; 4] = [10.0, 10.0, 30.0, 100.0];
/// Weight of the tilt of a normal, in radians.
const NORMAL_PULL: f64 = 0.1;
/// Weight of the change of a tangent, relative to its length.
const TANGENT_PULL: f64 = 0.1;
/// Weight of the logarithm of the length of a normal, and of its relative growth along a mean
/// chord: enough to decide what nothing else does.
const LENGTH_PULL: f64 = 1e-3;
const GROWTH_PULL: f64 = 1e-2;
/// How far a growth goes in shortest steps, where a tangent goes one.
const GROWTH_STEP: f64 = 0.1;
/// Arms with an angle of a cosine below this are one line.
const GOES_ON: f64 = -0.9;
/// Steps of Levenberg-Marquardt for each weight, and the relative decrease that ends them.
const STEPS: usize = 30;
const DECREASE: f64 = 1e-6;
/// Gaps that count as closed, in chords.
const CLOSED: f64 = 1e-11;

/// Solves for all curves of `net` as [`solve_boundary`](crate::solve_boundary) does, by normals.
///
/// # Errors
/// As there; [`AsymptoticError::NoFamilies`] where torsions cannot alternate around every vertex,
/// [`AsymptoticError::NoTwist`] for meshes along other lines, and
/// [`AsymptoticError::NotClosed`] where no such curves are found.
pub(crate) fn solve_by_normals(
    net: &AsymptoticNet,
    options: &BoundaryOptions,
) -> Result<Boundary, AsymptoticError> {
    if options.degree != CURVE_DEGREE && options.degree != DATA_DEGREE {
        let (degree, min, max) = (options.degree, CURVE_DEGREE, CURVE_DEGREE);
        return Err(AsymptoticError::Degree { what: "boundary", degree, min, max });
    }
    net.check()?;
    let mut net = net.clone();
    if curve_families(&net).is_none() {
        return Err(AsymptoticError::NoFamilies);
    }
    let frames = vertex_frames(&mut net, PLANE_TOL)?;
    let signs = arm_signs(&net, &frames);
    let estimated = bilinear_torsions(&net, &signs, &frames);
    let (orientation, mut torsions) = one_sign(&estimated);
    // A twist below rounding has no sign.
    let size = net.curves.iter().map(|c| net.chord(c).length()).fold(0.0, f64::max);
    let twists = |tau: &&f64| orientation * **tau * size > FLAT;
    let without = estimated.len() - estimated.iter().filter(twists).count();
    let share = without as f64 / estimated.len() as f64;
    if share > MOST_WITHOUT_TWIST {
        return Err(AsymptoticError::NoTwist { share: 100.0 * share });
    }
    let handle = |v: usize| options.torsions.get(v).copied().unwrap_or_default().bounds();
    let bounds: Vec<[f64; 2]> = (0..torsions.len()).map(handle).collect();
    let mut held = vec![false; torsions.len()];
    for (v, &[min, max]) in bounds.iter().enumerate() {
        let place = net.vertex_place(v);
        if !(min <= max) {
            return Err(AsymptoticError::TorsionBounds { place, min, max });
        }
        // The torsions of a family have one sign; at zero the normal would have no length.
        let reach = if orientation > 0.0 { max } else { -min };
        if !(reach > 0.0) {
            return Err(AsymptoticError::TorsionInfeasible { place, defect: -reach });
        }
        torsions[v] = torsions[v].clamp(min, max);
        held[v] = min == max;
    }
    loop {
        let mut problem = NormalNet::new(&net, &frames, &signs, &torsions);
        problem.solve(&held)?;
        let found = problem.torsions(orientation, &torsions);
        // Torsions that left their bounds are held there, and the others found again.
        let mut again = false;
        for (v, &tau) in found.iter().enumerate() {
            let bounded = tau.clamp(bounds[v][0], bounds[v][1]);
            if bounded != tau && !held[v] {
                (torsions[v], held[v], again) = (bounded, true, true);
            }
        }
        if again {
            continue;
        }
        let curves = problem.curves()?;
        let normals = problem.normals();
        let warnings = rough_tangents(&net, &curves).into_iter().collect();
        return Ok(Boundary {
            strain_energy: curves.iter().map(|c| c.derivative_energy(2)).sum(),
            freedoms: problem.freedoms(&held),
            inflections: vec![Vec::new(); curves.len()],
            curves,
            torsions: found,
            warnings,
            signs,
            normals,
        });
    }
}

/// The tangent that turned most from what the positions let expect, if that is too much.
fn rough_tangents(net: &AsymptoticNet, curves: &[BezierCurve]) -> Option<AsymptoticWarning> {
    let turn = |(i, e): (usize, usize)| {
        let forward = [1.0, -1.0][e];
        let tangent = curves[i].jet(e as f64).first * forward;
        tangent.angle_between(net.curves[i].arms[e]).to_degrees()
    };
    let ends = (0..curves.len()).flat_map(|i| [(i, 0), (i, 1)]);
    let (degrees, (curve, end)) =
        ends.map(|at| (turn(at), at)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let place = net.vertex_place(net.curves[curve].ends[end]);
    (degrees > MOST_TURN).then_some(AsymptoticWarning::RoughNet { place, degrees })
}

/// The common sign of the torsions and their values with it, away from zero.
fn one_sign(estimated: &[f64]) -> (f64, Vec<f64>) {
    let mut sorted = estimated.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let sign = if median < 0.0 { -1.0 } else { 1.0 };
    let least = LEAST_TORSION * median.abs();
    (sign, estimated.iter().map(|tau| sign * (sign * tau).max(least)).collect())
}

/// The problem: what is known of each curve, where its unknowns are, and their values.
struct NormalNet<'a> {
    net: &'a AsymptoticNet,
    frames: &'a [Option<VertexFrame>],
    curves: Vec<NormalCurve>,
    columns: Vec<[usize; COLUMNS]>,
    /// Curve and end of the two sides of every line that goes on at a vertex.
    continued: Vec<[(usize, usize); 2]>,
    /// First unknown of the tangents.
    tangents: usize,
    x: Vec<f64>,
}

impl<'a> NormalNet<'a> {
    fn new(
        net: &'a AsymptoticNet,
        frames: &'a [Option<VertexFrame>],
        signs: &[[f64; 2]],
        torsions: &[f64],
    ) -> Self {
        let tangents = 3 * net.positions.len();
        let mut out = Self {
            net,
            frames,
            curves: Vec::new(),
            columns: Vec::new(),
            continued: Vec::new(),
            tangents,
            x: vec![0.0; tangents],
        };
        let lines = out.add_tangents();
        let chords: f64 = net.curves.iter().map(|c| net.chord(c).length()).sum();
        let unit = chords / net.curves.len() as f64;
        for (i, curve) in net.curves.iter().enumerate() {
            let mut columns = [0; COLUMNS];
            let ends = [0, 1].map(|e| {
                let v = curve.ends[e];
                let line = &lines[&(i, e)];
                for k in 0..3 {
                    columns[3 * e + k] = 3 * v + k;
                }
                for k in 0..3 {
                    columns[6 + 3 * e + k] = line.unknown + k;
                }
                let speed = DATA_DEGREE as f64 * curve.arms[e].length();
                let forward = [1.0, -1.0][e];
                CurveEnd {
                    frame: out.frame_at(v),
                    length: torsions[v].abs().sqrt().recip(),
                    speed: forward * line.direction * speed,
                    relative_speed: forward * line.direction * speed / unit,
                }
            });
            for k in OWN..COLUMNS {
                columns[k] = out.x.len() + k - OWN;
            }
            let sign = (signs[i][0] * torsions[curve.ends[0]]).signum();
            let data = NormalCurve::new(net.chord(curve), ends, sign, curve.line);
            let mut own = columns.map(|c| out.x.get(c).copied().unwrap_or(0.0));
            data.start(&mut own);
            out.x.extend(&own[OWN..]);
            out.curves.push(data);
            out.columns.push(columns);
        }
        out
    }

    /// The normal, and two directions that halve the angles between the lines through the vertex.
    /// They depend on nothing but the lines, neither on axes nor on the order of anything (but
    /// where three or more lines of a family meet, on which of them comes first).
    fn frame_at(&self, v: usize) -> [DVec3; 3] {
        let Some(frame) = &self.frames[v] else { return [DVec3::Z, DVec3::X, DVec3::Y] };
        let up = frame.normal;
        let direction = |&(curve, end): &(usize, usize)| {
            let arm = self.net.curves[curve].arms[end];
            (arm - up * arm.dot(up)).normalize()
        };
        let right = direction(&frame.arms[0]);
        let left = up.cross(right);
        // Twice the angles, so that both ways along a line are the same; one family less the
        // other, which is never nothing where two lines cross.
        let mut doubled = DVec2::ZERO;
        for (arm, sign) in frame.arms.iter().zip(&frame.signs) {
            let arm = direction(arm);
            let arm = DVec2::new(arm.dot(right), arm.dot(left));
            doubled += arm.rotate(arm) * *sign;
        }
        if doubled.length() < 0.1 {
            return [up, right, left];
        }
        let turn = DVec2::from_angle(0.5 * doubled.to_angle());
        let halving = right * turn.x + left * turn.y;
        [up, halving, up.cross(halving)]
    }

    /// Numbers the tangents: where two arms of a vertex are one line, they share one.
    fn add_tangents(&mut self) -> HashMap<(usize, usize), LineAtVertex> {
        let mut lines = HashMap::new();
        for (v, frame) in self.frames.iter().enumerate() {
            let Some(frame) = frame else { continue };
            let direction = |(i, e): (usize, usize)| self.net.curves[i].arms[e].normalize();
            let [_, right, left] = self.frame_at(v);
            for (k, &arm) in frame.arms.iter().enumerate() {
                if lines.contains_key(&arm) {
                    continue;
                }
                let family: Vec<usize> =
                    (0..frame.arms.len()).filter(|j| frame.signs[*j] == frame.signs[k]).collect();
                let partner = family.iter().map(|j| frame.arms[*j]).find(|other| {
                    *other != arm
                        && family.len() == 2
                        && direction(*other).dot(direction(arm)) < GOES_ON
                });
                let unknown = self.x.len();
                lines.insert(arm, LineAtVertex { unknown, direction: 1.0 });
                let mut tangent = direction(arm);
                if let Some(other) = partner {
                    lines.insert(other, LineAtVertex { unknown, direction: -1.0 });
                    tangent = (tangent - direction(other)).normalize();
                    // A straight line is straight on both sides.
                    if !(self.net.curves[arm.0].line && self.net.curves[other.0].line) {
                        self.continued.push([arm, other]);
                    }
                }
                self.x.extend([tangent.dot(right), tangent.dot(left), 0.0]);
            }
        }
        lines
    }

    /// Least squares, then shortest steps onto the exact equations.
    fn solve(&mut self, held: &[bool]) -> Result<(), AsymptoticError> {
        let start = self.x.clone();
        let mut scale = vec![1.0; start.len()];
        for (curve, columns) in self.curves.iter().zip(&self.columns) {
            columns[OWN..].iter().for_each(|c| scale[*c] = curve.length());
            LINE.iter().for_each(|tangent| scale[columns[tangent + 2]] = GROWTH_STEP);
        }
        let mut fixed = Vec::new();
        for (v, frame) in self.frames.iter().enumerate() {
            match (frame, held[v]) {
                (None, _) => fixed.extend(3 * v..3 * v + 3),
                (_, true) => fixed.push(3 * v),
                _ => {}
            }
        }
        fixed.iter().for_each(|c| scale[*c] = 0.0);
        let mut fair = Fairness::new(&self.curves, &self.columns);
        let mut exact = Exactness::new(&self.curves, &self.columns, &self.continued);
        let mut pull = self.pull(&start);
        let options = Options { max_iterations: STEPS, energy_tol: DECREASE, ..Options::default() };
        let mut x = start.clone();
        for weight in CLOSING {
            exact.reweight(weight, &x);
            let mut problem = Problem::new(start.len());
            fixed.iter().for_each(|c| {
                problem.variables_mut().fix_unknown(*c);
            });
            // Normals, lines and curves have three unknowns each.
            problem.variables_mut().set_runs(3);
            problem.add(&mut fair);
            problem.add(&mut exact);
            problem.add(&mut pull);
            let report = solve(problem, &mut x, &options).map_err(AsymptoticError::Curves)?;
            if report.status == Status::IterationLimit {
                // No curves are near; more weights would take long to say so.
                break;
            }
        }
        exact.release();
        let mut projection =
            MinNormProjection::new(&exact, x.len(), 3).map_err(AsymptoticError::Curves)?;
        let options =
            ProjectionOptions { tolerance: 1e-3 * CLOSED, ..ProjectionOptions::default() };
        let stage = Stage::only("curves");
        projection
            .project(&exact, &mut x, &scale, &options, &stage, &mut ())
            .map_err(AsymptoticError::Curves)?;
        self.x = x;
        Ok(())
    }

    /// Keeps normals and tangents near their start.
    fn pull(&self, start: &[f64]) -> Closeness {
        let end = self.columns.first().map_or(start.len(), |c| c[OWN]);
        let weight = |c: usize| match (c >= self.tangents, c % 3) {
            (true, 2) => GROWTH_PULL,
            (false, 0) => LENGTH_PULL,
            (true, _) => TANGENT_PULL,
            (false, _) => NORMAL_PULL,
        };
        Closeness::new("data", start[..end].to_vec(), (0..end).map(weight).collect())
    }

    fn unknowns(&self, i: usize) -> [f64; COLUMNS] {
        self.columns[i].map(|c| self.x[c])
    }

    /// The solved curves, if all reach their ends.
    fn curves(&self) -> Result<Vec<BezierCurve>, AsymptoticError> {
        let gap = |i: usize| {
            let mut exact = [0.0; 6];
            self.curves[i].exactness(&self.unknowns(i), &mut exact, None);
            exact.iter().fold(0.0_f64, |a, b| a.max(b.abs()))
        };
        let gaps = (0..self.curves.len()).map(|i| (gap(i), i));
        if let Some((gap, i)) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))
            && !(gap <= CLOSED)
        {
            return Err(AsymptoticError::NotClosed { place: self.net.curve_place(i), gap });
        }
        let ends = |i: usize| self.net.curves[i].ends.map(|v| self.net.positions[v]);
        Ok((0..self.curves.len())
            .map(|i| self.curves[i].curve(&self.unknowns(i), ends(i)))
            .collect())
    }

    /// Torsion per vertex with the sign of the first family.
    fn torsions(&self, sign: f64, before: &[f64]) -> Vec<f64> {
        let mut out = before.to_vec();
        for (i, curve) in self.net.curves.iter().enumerate() {
            for e in 0..2 {
                out[curve.ends[e]] = sign * self.curves[i].torsion(e, &self.unknowns(i));
            }
        }
        out
    }

    /// Unit normal per vertex.
    fn normals(&self) -> Vec<DVec3> {
        (0..self.net.positions.len())
            .map(|v| {
                let [up, right, left] = self.frame_at(v);
                (up + right * self.x[3 * v + 1] + left * self.x[3 * v + 2]).normalize()
            })
            .collect()
    }

    /// Unknowns less equations.
    fn freedoms(&self, held: &[bool]) -> usize {
        let equations =
            self.curves.iter().map(NormalCurve::exact_rows).sum::<usize>() + self.continued.len();
        let fixed = held.iter().filter(|h| **h).count();
        self.x.len().saturating_sub(equations + fixed)
    }
}

/// The tangent of an arm: its first unknown, and whether the arm runs with or against it.
struct LineAtVertex {
    unknown: usize,
    direction: f64,
}
