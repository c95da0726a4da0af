//! The curves of a net by normals: what is known of each, and where its unknowns are.

use std::collections::HashMap;

use geom_core::{DVec2, DVec3};
use gp_solver::{Closeness, Group, Variables};

use crate::boundary::normals::curve::{COLUMNS, CurveEnd, LINE, NormalCurve, OWN};
use crate::data::corners::{AsymptoticNet, DATA_DEGREE};
use crate::data::vertex::{
    PLANE_TOL, VertexFrame, arm_signs, bilinear_torsions, curve_families, vertex_frames,
};
use crate::error::Error;

/// Estimated torsions are kept above this share of their median: less is noise at flat places.
const LEAST_TORSION: f64 = 0.05;
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

/// The curves of a net given by the normals along them.
///
/// Groups of unknowns: `normals` per vertex (logarithm of the length, two tilts), `tangents` per
/// line through a vertex (two directions in the tangent plane, growth of the normal), `middles` per
/// curve (middle control point of its normals).
#[derive(Clone, Debug)]
pub struct NormalCurves {
    pub(crate) curves: Vec<NormalCurve>,
    pub(crate) columns: Vec<[usize; COLUMNS]>,
    /// Curve and end of the two sides of every line that goes on at a vertex.
    pub(crate) continued: Vec<[(usize, usize); 2]>,
    variables: Variables,
    normals: Group,
    tangents: Group,
    /// The normal and two tangents per vertex.
    frames: Vec<[DVec3; 3]>,
    /// Vertices that no curve meets.
    lonely: Vec<bool>,
    start: Vec<f64>,
}

/// The tangent of an arm: which it is, and whether the arm runs with or against it.
struct LineAtVertex {
    tangent: usize,
    direction: f64,
}

impl NormalCurves {
    /// The curves of a net whose torsions alternate around every vertex.
    ///
    /// # Errors
    /// Those of [`AsymptoticNet::check`], tangents that leave their planes, and
    /// [`Error::NoFamilies`].
    pub fn of_net(net: &AsymptoticNet) -> Result<Self, Error> {
        net.check()?;
        let mut net = net.clone();
        if curve_families(&net).is_none() {
            return Err(Error::NoFamilies);
        }
        let frames = vertex_frames(&mut net, PLANE_TOL)?;
        let signs = arm_signs(&net, &frames);
        let (_, torsions) = one_sign(&bilinear_torsions(&net, &signs, &frames));
        Ok(Self::new(&net, &frames, &signs, &torsions))
    }

    pub(crate) fn new(
        net: &AsymptoticNet,
        frames: &[Option<VertexFrame>],
        signs: &[[f64; 2]],
        torsions: &[f64],
    ) -> Self {
        let vertices = net.positions.len();
        let bases: Vec<[DVec3; 3]> = (0..vertices).map(|v| frame_at(net, frames, v)).collect();
        let mut continued = Vec::new();
        let mut starts = Vec::new();
        let lines = tangents(net, frames, &bases, &mut starts, &mut continued);
        let mut variables = Variables::new();
        let normals = variables.add("normals", vertices, 3);
        let tangents = variables.add("tangents", starts.len(), 3);
        let middles = variables.add("middles", net.curves.len(), 3);
        // Normals, lines and curves have three unknowns each.
        variables.set_runs(3);
        let mut start = vec![0.0; variables.len()];
        for (line, value) in starts.into_iter().enumerate() {
            tangents.set(&mut start, line, value);
        }
        let chords: f64 = net.curves.iter().map(|c| net.chord(c).length()).sum();
        let unit = chords / net.curves.len() as f64;
        let (mut curves, mut all) = (Vec::new(), Vec::new());
        for (i, curve) in net.curves.iter().enumerate() {
            let mut columns = [0; COLUMNS];
            let ends = [0, 1].map(|e| {
                let v = curve.ends[e];
                let line = &lines[&(i, e)];
                columns[3 * e..3 * e + 3].copy_from_slice(&normals.columns::<3>(v));
                columns[LINE[e]..LINE[e] + 3].copy_from_slice(&tangents.columns::<3>(line.tangent));
                let speed = DATA_DEGREE as f64 * curve.arms[e].length();
                let forward = [1.0, -1.0][e];
                CurveEnd {
                    frame: bases[v],
                    length: torsions[v].abs().sqrt().recip(),
                    speed: forward * line.direction * speed,
                    relative_speed: forward * line.direction * speed / unit,
                }
            });
            columns[OWN..].copy_from_slice(&middles.columns::<3>(i));
            let sign = (signs[i][0] * torsions[curve.ends[0]]).signum();
            let data = NormalCurve::new(net.chord(curve), ends, sign, curve.line);
            let mut own = columns.map(|c| start[c]);
            data.start(&mut own);
            middles.set::<3>(&mut start, i, std::array::from_fn(|k| own[OWN + k]));
            curves.push(data);
            all.push(columns);
        }
        let lonely = frames.iter().map(Option::is_none).collect();
        Self {
            curves,
            columns: all,
            continued,
            variables,
            normals,
            tangents,
            frames: bases,
            lonely,
            start,
        }
    }

    /// The unknowns; the length of the normal is fixed where the torsion is held.
    #[must_use]
    pub fn variables(&self, held: &[bool]) -> Variables {
        let mut variables = self.variables.clone();
        for (v, lonely) in self.lonely.iter().enumerate() {
            if *lonely {
                variables.fix(self.normals, v);
            } else if held.get(v).copied().unwrap_or(false) {
                variables.fix_unknown(self.normals.column(v, 0));
            }
        }
        variables
    }

    /// Everything as the data say.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// How willingly each unknown moves in shortest steps.
    pub(crate) fn scale(&self, held: &[bool]) -> Vec<f64> {
        let mut scale = vec![1.0; self.start.len()];
        for (curve, columns) in self.curves.iter().zip(&self.columns) {
            columns[OWN..].iter().for_each(|c| scale[*c] = curve.length());
            LINE.iter().for_each(|tangent| scale[columns[tangent + 2]] = GROWTH_STEP);
        }
        let variables = self.variables(held);
        let fixed = scale.iter_mut().zip(variables.fixed()).filter(|(_, fixed)| **fixed);
        fixed.for_each(|(scale, _)| *scale = 0.0);
        scale
    }

    /// Keeps normals and tangents near their start.
    #[must_use]
    pub fn closeness(&self) -> Closeness {
        let normals = (0..self.normals.len()).flat_map(|_| [LENGTH_PULL, NORMAL_PULL, NORMAL_PULL]);
        let tangents =
            (0..self.tangents.len()).flat_map(|_| [TANGENT_PULL, TANGENT_PULL, GROWTH_PULL]);
        let weights: Vec<f64> = normals.chain(tangents).collect();
        Closeness::new("data", self.start[..weights.len()].to_vec(), weights)
    }

    /// The unknowns of a curve.
    pub(crate) fn unknowns(&self, x: &[f64], i: usize) -> [f64; COLUMNS] {
        self.columns[i].map(|c| x[c])
    }

    /// Unit normal per vertex.
    pub(crate) fn normals(&self, x: &[f64]) -> Vec<DVec3> {
        let normal = |v: usize| {
            let [up, right, left] = self.frames[v];
            let [_, tilt_x, tilt_y] = self.normals.get(x, v);
            (up + right * tilt_x + left * tilt_y).normalize()
        };
        (0..self.frames.len()).map(normal).collect()
    }
}

/// The common sign of the torsions and their values with it, away from zero.
pub(crate) fn one_sign(estimated: &[f64]) -> (f64, Vec<f64>) {
    let mut sorted = estimated.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let sign = if median < 0.0 { -1.0 } else { 1.0 };
    let least = LEAST_TORSION * median.abs();
    (sign, estimated.iter().map(|tau| sign * (sign * tau).max(least)).collect())
}

/// The normal, and two directions that halve the angles between the lines through the vertex.
/// They depend on nothing but the lines, neither on axes nor on the order of anything (but
/// where three or more lines of a family meet, on which of them comes first).
fn frame_at(net: &AsymptoticNet, frames: &[Option<VertexFrame>], v: usize) -> [DVec3; 3] {
    let Some(frame) = &frames[v] else { return [DVec3::Z, DVec3::X, DVec3::Y] };
    let up = frame.normal;
    let direction = |&(curve, end): &(usize, usize)| {
        let arm = net.curves[curve].arms[end];
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
fn tangents(
    net: &AsymptoticNet,
    frames: &[Option<VertexFrame>],
    bases: &[[DVec3; 3]],
    starts: &mut Vec<[f64; 3]>,
    continued: &mut Vec<[(usize, usize); 2]>,
) -> HashMap<(usize, usize), LineAtVertex> {
    let mut lines = HashMap::new();
    for (v, frame) in frames.iter().enumerate() {
        let Some(frame) = frame else { continue };
        let direction = |(i, e): (usize, usize)| net.curves[i].arms[e].normalize();
        let [_, right, left] = bases[v];
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
            let number = starts.len();
            lines.insert(arm, LineAtVertex { tangent: number, direction: 1.0 });
            let mut tangent = direction(arm);
            if let Some(other) = partner {
                lines.insert(other, LineAtVertex { tangent: number, direction: -1.0 });
                tangent = (tangent - direction(other)).normalize();
                // A straight line is straight on both sides.
                if !(net.curves[arm.0].line && net.curves[other.0].line) {
                    continued.push([arm, other]);
                }
            }
            starts.push([tangent.dot(right), tangent.dot(left), 0.0]);
        }
    }
    lines
}
