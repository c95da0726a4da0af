//! The least-squares problem of the relaxed mode: unknowns, rows and their exact Jacobian.

use geom_core::DVec3;
use std::sync::Arc;

use gp_solver::{Elements, Group, Problem, ResidualBlock, Variables};

use crate::curve::bernstein::{derivative, eval};
use crate::data::corners::{AsymptoticNet, DATA_DEGREE};
use crate::data::vertex::{VertexFrame, arm_signs, bilinear_torsions, vertex_frames};
use crate::error::Error;
use crate::stages::TORSIONS;

/// Arms may leave their common plane by this much (10 degrees) when they are to be moved anyway.
const PLANE_TOL: f64 = 0.175;
/// Unknowns one curve reads: of both vertices two tilts and the torsion, of both ends stretch and
/// turn of the arm and the logarithm of the curvature ratio.
const COLUMNS: usize = 12;
/// Parameters per curve at which the torsion is looked at.
const SAMPLES: usize = 9;
/// Rows of a curve: moves of both ends, two fourth differences, torsions, their variation, sign.
const ROWS: usize = 8 + 6 + 3 * SAMPLES;

// Shares of the fairness terms at weight one, against moves in percent: fourth differences over
// the chord, torsion times chord, its change between samples, its shortfall below the margin.
const FOURTH_SHARE: f64 = 100.0;
const TORSION_SHARE: f64 = 0.5;
const VARIATION_SHARE: f64 = 3.0;
const SIGN_SHARE: f64 = 10.0;
/// Torsion times chord that keeps clear of zero.
const SIGN_MARGIN: f64 = 0.1;

/// A net whose normals, arms, curvatures and torsions may move.
///
/// Groups of unknowns: `tilts` (two per vertex, of its normal), `torsions` (one per vertex, times the
/// length of the net's median curve), `arms` (stretch and turn of the arm in the tangent plane, per
/// curve end), `curvatures` (logarithm of the ratio to the data, per curve end).
#[derive(Clone, Debug)]
pub struct MovableNet {
    /// The net as given.
    given: AsymptoticNet,
    /// Unit normal and two tangents per vertex.
    frames: Vec<[DVec3; 3]>,
    /// Whether the valence of a vertex is odd.
    odd: Vec<bool>,
    curves: Vec<Curve>,
    size: f64,
    /// Torsions times size to start from.
    starts: Vec<f64>,
    variables: Variables,
    groups: Groups,
}

/// Where the unknowns are.
#[derive(Clone, Copy, Debug)]
struct Groups {
    tilts: Group,
    torsions: Group,
    arms: Group,
    curvatures: Group,
}

impl Groups {
    /// Two tilts, torsion, stretch, turn, curvature at both ends of a curve.
    fn columns(&self, curve: usize, ends: [usize; 2]) -> [usize; COLUMNS] {
        let mut out = [0; COLUMNS];
        for e in 0..2 {
            let (v, end) = (ends[e], 2 * curve + e);
            let [a, b] = self.tilts.columns(v);
            let [stretch, turn] = self.arms.columns(end);
            let own =
                [a, b, self.torsions.column(v, 0), stretch, turn, self.curvatures.column(end, 0)];
            out[6 * e..6 * e + 6].copy_from_slice(&own);
        }
        out
    }
}

/// One curve that moves.
#[derive(Clone, Copy, Debug)]
struct Curve {
    index: usize,
    chord: DVec3,
    /// Arms in the planes of the frames, the start of the iteration.
    arms: [DVec3; 2],
    /// Sign of each end's torsion relative to its vertex.
    signs: [f64; 2],
    /// Sign its torsion should keep; zero where nothing is asked.
    wanted: f64,
    /// Inflected curves are found later; here only their data move.
    fair: bool,
    /// `|r′ × r″|²` at both ends of the data.
    reference: [f64; 2],
}

/// What one end of a curve contributes, and its derivatives in tilt, tilt, torsion, stretch,
/// turn, curvature.
struct End {
    arm: DVec3,
    normal: DVec3,
    curvature: f64,
    torsion: f64,
    d_arm: [DVec3; 6],
    d_normal: [DVec3; 6],
    d_curvature: [f64; 6],
    d_torsion: [f64; 6],
}

/// Control points of a curve from its start, and their derivatives.
struct Shape {
    points: [DVec3; 6],
    slopes: [[DVec3; 6]; COLUMNS],
}

impl MovableNet {
    /// The net with the torsions that the corners let expect.
    ///
    /// # Errors
    /// The hard faults of the data themselves, which no small move can mend.
    pub fn new(net: &AsymptoticNet) -> Result<Self, Error> {
        net.check()?;
        let mut projected = net.clone();
        let frames = vertex_frames(&mut projected, PLANE_TOL)?;
        let torsions = bilinear_torsions(net, &arm_signs(net, &frames), &frames);
        Ok(Self::started(net, &projected, &frames, &torsions))
    }

    /// `frames` and `torsions` per vertex; `projected` is `given` with its arms in the planes.
    fn started(
        given: &AsymptoticNet,
        projected: &AsymptoticNet,
        frames: &[Option<VertexFrame>],
        torsions: &[f64],
    ) -> Self {
        let vertices = given.positions.len();
        let mut variables = Variables::new();
        let [tilts, turning] = variables.interleave(vertices, [("tilts", 2), (TORSIONS, 1)]);
        let ends = 2 * given.curves.len();
        let [arms, curvatures] = variables.interleave(ends, [("arms", 2), ("curvatures", 1)]);
        let groups = Groups { tilts, torsions: turning, arms, curvatures };
        let mut read = vec![false; variables.len()];
        let mut lengths: Vec<f64> = given.curves.iter().map(|c| given.chord(c).length()).collect();
        lengths.sort_by(f64::total_cmp);
        let size = lengths[lengths.len() / 2];
        let odd = |v: usize| frames[v].as_ref().is_none_or(|f| f.odd);
        let mut signs = vec![[0.0; 2]; given.curves.len()];
        for frame in frames.iter().flatten() {
            for ((i, e), sign) in frame.arms.iter().zip(&frame.signs) {
                signs[*i][*e] = *sign;
            }
        }
        let bases = vertex_bases(projected, frames);
        // In a net whose families are known everywhere all vertices vote on one sign.
        let coloured = signs.iter().all(|[a, b]| a == b);
        let vote = torsions.iter().sum::<f64>().signum();
        let mut curves = Vec::new();
        for (index, curve) in projected.curves.iter().enumerate() {
            if curve.line {
                continue;
            }
            groups.columns(index, curve.ends).into_iter().for_each(|c| read[c] = true);
            let along = [0, 1].map(|e| signs[index][e] * torsions[curve.ends[e]]);
            let wanted = if odd(curve.ends[0]) || odd(curve.ends[1]) {
                0.0
            } else if coloured {
                vote * signs[index][0]
            } else {
                (along[0] + along[1]).signum()
            };
            curves.push(Curve {
                index,
                chord: given.chord(curve),
                arms: curve.arms,
                signs: signs[index],
                wanted,
                fair: curve.inflections == 0,
                reference: [0, 1].map(|e| {
                    let speed = DATA_DEGREE as f64 * curve.arms[e].length();
                    (curve.curvatures[e] * speed.powi(3)).powi(2)
                }),
            });
        }
        // What no element reads stays.
        let unread = (0..read.len()).filter(|k| !read[*k]);
        unread.for_each(|k| _ = variables.fix_unknown(k));
        for (v, (_, lines)) in bases.iter().enumerate() {
            // A line stays, so the plane may only turn about it.
            for w in 0..(*lines).min(2) {
                variables.fix_unknown(tilts.column(v, w));
            }
            if odd(v) {
                variables.fix(turning, v);
            }
        }
        let start = (0..vertices).map(|v| if odd(v) { 0.0 } else { torsions[v] * size });
        Self {
            given: given.clone(),
            frames: bases.into_iter().map(|(basis, _)| basis).collect(),
            odd: frames.iter().map(|f| f.as_ref().is_some_and(|f| f.odd)).collect(),
            curves,
            size,
            starts: start.collect(),
            variables,
            groups,
        }
    }

    /// The unknowns; lines stay, and torsions at vertices of odd valence.
    #[must_use]
    pub fn variables(&self) -> &Variables {
        &self.variables
    }

    /// Everything unmoved.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.variables.len()];
        for (v, tau) in self.starts.iter().enumerate() {
            self.groups.torsions.set(&mut x, v, [*tau]);
        }
        x
    }

    /// Whether the valence of each vertex is odd.
    pub(crate) fn odd(&self) -> &[bool] {
        &self.odd
    }

    /// The problem with this weight of the fairness against the moves.
    pub(crate) fn problem(self: &Arc<Self>, weight: f64, tame: bool) -> Problem<'static> {
        let mut problem = Problem::new(self.variables.clone());
        problem.add(Moves::new(self, weight, tame));
        problem
    }

    /// The moved net and the torsions of its vertices.
    pub(crate) fn unpack(&self, x: &[f64]) -> (AsymptoticNet, Vec<f64>) {
        let mut net = self.given.clone();
        for curve in &self.curves {
            let ends = self.ends(curve, x);
            let moved = &mut net.curves[curve.index];
            for (e, end) in ends.iter().enumerate() {
                moved.arms[e] = end.arm;
                moved.curvatures[e] = end.curvature;
            }
        }
        let torsion = |v: usize| self.groups.torsions.get::<1>(x, v)[0] / self.size;
        (net, (0..self.starts.len()).map(torsion).collect())
    }

    fn ends(&self, curve: &Curve, x: &[f64]) -> [End; 2] {
        let data = &self.given.curves[curve.index];
        let columns = self.groups.columns(curve.index, data.ends);
        [0, 1].map(|e| {
            let at = |k: usize| x[columns[6 * e + k]];
            let [n, t1, t2] = self.frames[data.ends[e]];
            let raw = n + t1 * at(0) + t2 * at(1);
            let normal = raw.normalize();
            let tilts = [t1, t2].map(|t| (t - normal * normal.dot(t)) / raw.length());
            // The arm as it was, stretched and turned, then laid into the tilted plane.
            let length = curve.arms[e].length();
            let (own, side) = (curve.arms[e], n.cross(curve.arms[e]));
            let raw = own * (1.0 + at(3)) + side * at(4);
            let flat = |v: DVec3| v - normal * v.dot(normal);
            let tilted = |d: DVec3| -(d * raw.dot(normal) + normal * raw.dot(d));
            debug_assert!(length > 0.0, "checked with the net");
            let curvature = data.curvatures[e] * at(5).exp();
            let zero = DVec3::ZERO;
            let per_torsion = curve.signs[e] / self.size;
            End {
                arm: flat(raw),
                normal,
                curvature,
                torsion: at(2) * per_torsion,
                d_arm: [tilted(tilts[0]), tilted(tilts[1]), zero, flat(own), flat(side), zero],
                d_normal: [tilts[0], tilts[1], zero, zero, zero, zero],
                d_curvature: [0.0, 0.0, 0.0, 0.0, 0.0, curvature],
                d_torsion: [0.0, 0.0, per_torsion, 0.0, 0.0, 0.0],
            }
        })
    }
}

/// Normal and two tangents per vertex, the first along the first line there, with the number of
/// lines in different directions.
fn vertex_bases(net: &AsymptoticNet, frames: &[Option<VertexFrame>]) -> Vec<([DVec3; 3], usize)> {
    frames
        .iter()
        .map(|frame| {
            let Some(frame) = frame else { return ([DVec3::Z, DVec3::X, DVec3::Y], 0) };
            let arm = |(i, e): (usize, usize)| net.curves[i].arms[e].normalize();
            let lines: Vec<DVec3> =
                frame.arms.iter().filter(|(i, _)| net.curves[*i].line).map(|a| arm(*a)).collect();
            let first = lines.first().copied().unwrap_or_else(|| arm(frame.arms[0]));
            let crossing = lines.iter().any(|d| d.cross(first).length() > 1e-6);
            let count = usize::from(!lines.is_empty()) + usize::from(crossing);
            ([frame.normal, first, frame.normal.cross(first)], count)
        })
        .collect()
}

impl Shape {
    /// The quintic between two ends, its torsion equations solved for the own-arm coefficients.
    fn new(chord: DVec3, ends: &[End; 2]) -> Self {
        let mut points = [DVec3::ZERO; 6];
        points[5] = chord;
        let mut slopes = [[DVec3::ZERO; 6]; COLUMNS];
        // Third points without their own-arm part, and the heights the torsions ask for.
        let (mut base, mut height) = ([DVec3::ZERO, chord], [0.0; 2]);
        let (mut d_base, mut d_height) = ([[DVec3::ZERO; 6]; 2], [[0.0; 6]; 2]);
        for (e, end) in ends.iter().enumerate() {
            let a = end.arm.length();
            let side = end.normal.cross(end.arm);
            let lever = 25.0 / 12.0 * a.powi(3);
            points[[1, 4][e]] = points[[0, 5][e]] + end.arm;
            base[e] += side * (1.25 * end.curvature * a);
            height[e] = lever * end.curvature * end.torsion;
            for k in 0..6 {
                let stretch = end.arm.dot(end.d_arm[k]) / a;
                let d_side = end.d_normal[k].cross(end.arm) + end.normal.cross(end.d_arm[k]);
                let d_size = end.d_curvature[k] * a + end.curvature * stretch;
                d_base[e][k] = d_side * (1.25 * end.curvature * a) + side * (1.25 * d_size);
                d_height[e][k] = lever
                    * (end.d_curvature[k] * end.torsion + end.curvature * end.d_torsion[k])
                    + 3.0 * height[e] * stretch / a;
                slopes[6 * e + k][[1, 4][e]] = end.d_arm[k];
            }
        }
        // The height of each far third point over the plane of the other end.
        for (e, end) in ends.iter().enumerate() {
            let far = &ends[1 - e];
            let corner = [DVec3::ZERO, chord][e];
            let (reach, at) = (end.normal.dot(far.arm), [3, 2][e]);
            let x = (height[e] - end.normal.dot(base[1 - e] - corner)) / reach;
            points[at] = base[1 - e] + far.arm * x;
            for k in 0..6 {
                // Unknowns of this end, then of the far one.
                let rise = end.d_normal[k].dot(base[1 - e] - corner);
                let turn = end.d_normal[k].dot(far.arm);
                let dx = (d_height[e][k] - rise - x * turn) / reach;
                slopes[6 * e + k][at] = far.arm * dx;
                let sway = end.normal.dot(d_base[1 - e][k]) + x * end.normal.dot(far.d_arm[k]);
                slopes[6 * (1 - e) + k][at] =
                    d_base[1 - e][k] + far.d_arm[k] * x - far.arm * (sway / reach);
            }
        }
        Self { points, slopes }
    }
}

/// Derivative polygons of order one to three.
fn polygons(points: &[DVec3; 6]) -> [Vec<DVec3>; 3] {
    let first = derivative(points);
    let second = derivative(&first);
    let third = derivative(&second);
    [first, second, third]
}

/// Of every curved curve the moves of its end data in percent (arms relative to their length,
/// logarithms of curvature ratios) and, times the root of the weight, its fairness: fourth
/// differences of the polygon over the chord, torsion times chord, its change from sample to sample,
/// and how far it falls short of the sign it should keep. No unit.
///
/// The torsion equations (Wang et al. 2019, Eq. 3.2) are solved for the own-arm coefficients, so that
/// every iterate is an exact asymptotic net; derivatives are exact, moves count from the data.
#[derive(Clone, Debug)]
pub struct Moves {
    model: Arc<MovableNet>,
    elements: Elements,
    weight: f64,
    /// Divides the determinant of the torsion by the `|r′ × r″|²` of the data instead of the
    /// curve's own: without the poles at inflections and cusps even wild curves find home.
    tame: bool,
}

impl Moves {
    /// The rows of all curves that are not lines, with this weight of the fairness; `tame` replaces
    /// the poles of the torsion at inflections by its value for the curvatures given.
    #[must_use]
    pub fn new(model: &Arc<MovableNet>, weight: f64, tame: bool) -> Self {
        let mut elements = Elements::new();
        for curve in &model.curves {
            let ends = model.given.curves[curve.index].ends;
            elements.push(&model.groups.columns(curve.index, ends), ROWS);
        }
        Self { model: Arc::clone(model), elements, weight, tame }
    }

    /// Residuals of one curve, and their derivatives row by row when wanted.
    fn curve(&self, curve: &Curve, x: &[f64], out: &mut [f64], jacobian: Option<&mut [f64]>) {
        let model = &self.model;
        let mut none = [];
        let (jacobian, exact) = match jacobian {
            Some(values) => (values, true),
            None => (&mut none[..], false),
        };
        let mut put = |row: usize, value: f64, slope: &dyn Fn(usize) -> f64| {
            out[row] = value;
            if exact {
                for k in 0..COLUMNS {
                    jacobian[row * COLUMNS + k] = slope(k);
                }
            }
        };
        let data = &model.given.curves[curve.index];
        let ends = model.ends(curve, x);
        // Moves in percent: the noise this mode is for.
        for (e, end) in ends.iter().enumerate() {
            let share = 100.0 / data.arms[e].length();
            let own = |k: usize| (k / 6 == e).then_some(k % 6);
            let moved = (end.arm - data.arms[e]) * share;
            for axis in 0..3 {
                put(4 * e + axis, moved[axis], &|k| {
                    own(k).map_or(0.0, |k| end.d_arm[k][axis] * share)
                });
            }
            let log = (end.curvature / data.curvatures[e]).ln();
            put(4 * e + 3, 100.0 * log, &|k| if own(k) == Some(5) { 100.0 } else { 0.0 });
        }
        let length = curve.chord.length();
        let weight = self.weight.sqrt();
        if !curve.fair {
            for row in 8..ROWS {
                put(row, 0.0, &|_| 0.0);
            }
            return;
        }
        let shape = Shape::new(curve.chord, &ends);
        let fourth = |p: &[DVec3; 6], k: usize| {
            p[k] - p[k + 1] * 4.0 + p[k + 2] * 6.0 - p[k + 3] * 4.0 + p[k + 4]
        };
        let scale = weight * FOURTH_SHARE / length;
        for row in 0..6 {
            let (k, axis) = (row / 3, row % 3);
            put(8 + row, fourth(&shape.points, k)[axis] * scale, &|c| {
                fourth(&shape.slopes[c], k)[axis] * scale
            });
        }
        let (tau, slopes) = torsions(&shape, length, self.tame.then_some(curve.reference), exact);
        let at = 14;
        let gentle = weight * TORSION_SHARE / (SAMPLES as f64).sqrt();
        for j in 0..SAMPLES {
            // The torsion itself, gently, and its change from sample to sample.
            put(at + j, gentle * tau[j], &|k| gentle * slopes[j][k]);
            let before = j.saturating_sub(1);
            let change = weight * VARIATION_SHARE;
            put(at + SAMPLES + j, change * (tau[j] - tau[before]), &|k| {
                change * (slopes[j][k] - slopes[before][k])
            });
            let short = SIGN_MARGIN - curve.wanted * tau[j];
            let active = curve.wanted != 0.0 && short > 0.0;
            let share = if active { weight * SIGN_SHARE } else { 0.0 };
            put(at + 2 * SAMPLES + j, share * short, &|k| -share * curve.wanted * slopes[j][k]);
        }
    }
}

/// Torsion times `length` at the samples, and its derivatives when wanted; with a reference the
/// determinant of the derivatives over that.
fn torsions(
    shape: &Shape,
    length: f64,
    reference: Option<[f64; 2]>,
    exact: bool,
) -> ([f64; SAMPLES], [[f64; COLUMNS]; SAMPLES]) {
    let mut values = [0.0; SAMPLES];
    let mut slopes = [[0.0; COLUMNS]; SAMPLES];
    let here = polygons(&shape.points);
    let parameter = |j: usize| j as f64 / (SAMPLES - 1) as f64;
    let jets: [[DVec3; 3]; SAMPLES] =
        std::array::from_fn(|j| [0, 1, 2].map(|d| eval(&here[d], parameter(j))));
    let reference = |j: usize| {
        let t = parameter(j);
        reference.map(|[start, end]| start * (1.0 - t) + end * t)
    };
    for (j, (value, [first, second, third])) in values.iter_mut().zip(&jets).enumerate() {
        let b = first.cross(*second);
        *value = length * b.dot(*third) / reference(j).unwrap_or(b.length_squared());
    }
    if !exact {
        return (values, slopes);
    }
    for k in 0..COLUMNS {
        let change = polygons(&shape.slopes[k]);
        for j in 0..SAMPLES {
            let [first, second, third] = jets[j];
            let d = [0, 1, 2].map(|o| eval(&change[o], parameter(j)));
            let b = first.cross(second);
            let db = d[0].cross(second) + first.cross(d[1]);
            let change = db.dot(third) + b.dot(d[2]);
            slopes[j][k] = length
                * match reference(j) {
                    Some(bb) => change / bb,
                    None => {
                        let bb = b.length_squared();
                        (change - 2.0 * b.dot(third) / bb * b.dot(db)) / bb
                    }
                };
        }
    }
    (values, slopes)
}

impl ResidualBlock for Moves {
    fn name(&self) -> &str {
        "relaxed data"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (curve, out) in self.model.curves.iter().zip(residuals.chunks_exact_mut(ROWS)) {
            self.curve(curve, x, out, None);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let blocks =
            residuals.chunks_exact_mut(ROWS).zip(jacobian.chunks_exact_mut(ROWS * COLUMNS));
        for (curve, (out, jacobian)) in self.model.curves.iter().zip(blocks) {
            self.curve(curve, x, out, Some(jacobian));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_central_differences() {
        let v = DVec3::new;
        let data = crate::CornerData {
            corners: [v(-1., -1., 0.6), v(1., -1., -0.6), v(-1., 1., -0.6), v(1., 1., 0.6)],
            start_points: [
                v(-0.6, -1.08, 0.384),
                v(-1.08, -0.6, 0.384),
                v(-0.6, 1.08, -0.384),
                v(1.08, -0.6, -0.384),
            ],
            end_points: [
                v(0.6, -1.08, -0.384),
                v(-1.08, 0.6, -0.384),
                v(0.6, 1.08, 0.384),
                v(1.08, 0.6, 0.384),
            ],
            curvatures: crate::Curvatures::Signed([[0.3; 2]; 4]),
            lines: [false; 4],
            inflections: [0; 4],
        };
        let model = Arc::new(MovableNet::new(&data.to_net(&[[0.3; 2]; 4])).unwrap());
        let mut x = model.start();
        for (k, x) in x.iter_mut().enumerate() {
            *x += 0.03 * (1.7 * k as f64).sin();
        }
        for tame in [false, true] {
            let rows = Moves::new(&model, 1.0, tame);
            let worst = gp_solver::check_jacobian(&rows, &x).unwrap().unwrap();
            assert!(worst.error < 1e-6, "{worst:?}");
        }
    }
}
