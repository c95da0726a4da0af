//! Nets of as many patches around one vertex as wanted, with curves of consistent torsion.

use std::f64::consts::TAU;

use asymptotic_bezier::{AsymptoticNet, NetCurve};
use geom_core::{DMat3, DVec3};
use numerics::{Matrix, affine_space};

/// Curvature of the arms, bending to the left, and size of the torsion at their outer ends.
const ARM: [f64; 2] = [0.45, 0.5];

/// A curve by arc length: where it is and its Frenet frame.
#[derive(Clone, Copy)]
struct Frenet {
    position: DVec3,
    tangent: DVec3,
    /// To the left of the tangent in the osculating plane.
    left: DVec3,
    normal: DVec3,
}

impl Frenet {
    /// Follows curvature `k` and torsion `tau` along `length` by the midpoint rule.
    fn follow(self, length: f64, k: f64, tau: f64) -> Self {
        let steps = 400;
        let h = length / f64::from(steps);
        let slope = |f: &Self| Self {
            position: f.tangent,
            tangent: f.left * k,
            left: f.normal * tau - f.tangent * k,
            normal: f.left * -tau,
        };
        let moved = |f: &Self, d: &Self, h: f64| Self {
            position: f.position + d.position * h,
            tangent: f.tangent + d.tangent * h,
            left: f.left + d.left * h,
            normal: f.normal + d.normal * h,
        };
        (0..steps).fold(self, |f, _| {
            let middle = moved(&f, &slope(&f), 0.5 * h);
            moved(&f, &slope(&middle), h)
        })
    }

    /// The same point and plane, another direction.
    fn turned(self, angle: f64) -> Self {
        let tangent = self.tangent * angle.cos() + self.left * angle.sin();
        Self { tangent, left: self.normal.cross(tangent), ..self }
    }
}

/// Length, direction relative to the arm and curvature of a curve that leaves the end of an arm.
type Side = [f64; 3];

/// `valence` quads around the origin: an even number of arms of constant, alternating torsion, or
/// an [`odd_star`].
pub(crate) fn star(valence: usize) -> AsymptoticNet {
    if valence % 2 == 1 {
        return odd_star(valence);
    }
    let sector = TAU / valence as f64;
    let [bend, twist] = ARM;
    let torsion = |k: usize| if k.is_multiple_of(2) { twist } else { -twist };
    let tips: Vec<Frenet> = (0..valence)
        .map(|k| {
            let turn = DMat3::from_rotation_z(sector * k as f64);
            let start = Frenet {
                position: DVec3::ZERO,
                tangent: turn * DVec3::X,
                left: turn * DVec3::Y,
                normal: DVec3::Z,
            };
            start.follow(1.0, bend, torsion(k))
        })
        .collect();
    let mut positions = vec![DVec3::ZERO];
    positions.extend(tips.iter().map(|t| t.position));
    let mut curves: Vec<NetCurve> = (0..valence)
        .map(|k| {
            let out = DMat3::from_rotation_z(sector * k as f64) * DVec3::X;
            curve([0, 1 + k], [out, tips[k].tangent], 1.0, bend)
        })
        .collect();
    for k in 0..valence {
        let next = (k + 1) % valence;
        let (sides, ends) = meet([tips[k], tips[next]], [torsion(k), torsion(next)]);
        positions.push(ends[0].position);
        for (from, (side, end)) in [k, next].into_iter().zip(sides.into_iter().zip(ends)) {
            let start = tips[from].turned(side[1]);
            let joined = [1 + from, 1 + valence + k];
            curves.push(curve(joined, [start.tangent, end.tangent], side[0], side[2]));
        }
    }
    net(valence, positions, curves)
}

/// An odd number of quads around the origin with straight outer sides. The torsion of the arms
/// grows from zero at the origin, where the third control points lie in the plane of the first
/// ones, to what lifts their ends into planes that rise outwards.
fn odd_star(valence: usize) -> AsymptoticNet {
    let sector = TAU / valence as f64;
    let (slope, bend) = (0.35, 0.3);
    // The plane of the third control point at 0.6 of the way is the horizontal one there.
    let rise = 0.4 * slope;
    let radial = |k: f64| DMat3::from_rotation_z(sector * k) * DVec3::X;
    let mut positions = vec![DVec3::ZERO];
    positions.extend((0..valence).map(|k| radial(k as f64) + DVec3::Z * rise));
    let (reach, half) = (1.7, 0.5 * sector);
    let height = rise + slope * (reach * half.cos() - 1.0);
    positions.extend((0..valence).map(|k| radial(k as f64 + 0.5) * reach + DVec3::Z * height));
    let mut curves = Vec::new();
    for k in 0..valence {
        let (out, side) = (radial(k as f64), DVec3::Z.cross(radial(k as f64)));
        // Leaving to the right and bending to the left, in the planes of both ends.
        let start = out - side * bend;
        let end = out + DVec3::Z * slope + side * bend;
        let mut arm = curve([0, 1 + k], [start, end], 1.0, 2.0 * bend);
        arm.curvatures = arm.curvatures.map(|c| c * (1.0 + bend * bend).powf(-1.5));
        curves.push(arm);
    }
    for k in 0..valence {
        for from in [k, (k + 1) % valence] {
            let ends = [1 + from, 1 + valence + k];
            let chord = positions[ends[1]] - positions[ends[0]];
            let side = curve(ends, [chord, chord], 1.0, 0.0);
            curves.push(NetCurve { line: true, ..side });
        }
    }
    net(valence, positions, curves)
}

fn net(valence: usize, positions: Vec<DVec3>, curves: Vec<NetCurve>) -> AsymptoticNet {
    let quads: Vec<[usize; 4]> =
        (0..valence).map(|k| [0, 1 + k, 1 + valence + k, 1 + (k + 1) % valence]).collect();
    AsymptoticNet::new(positions, &quads, curves).unwrap()
}

fn curve(ends: [usize; 2], [start, end]: [DVec3; 2], length: f64, k: f64) -> NetCurve {
    NetCurve {
        ends,
        arms: [start * (0.2 * length), end * (-0.2 * length)],
        // Left of the arm: the second arm runs against the curve.
        curvatures: [k, -k],
        line: false,
        inflections: 0,
    }
}

/// The two curves from the tips of neighbouring arms that meet with one tangent plane, by
/// Gauss-Newton steps of least length from straight ones.
fn meet(tips: [Frenet; 2], torsions: [f64; 2]) -> ([Side; 2], [Frenet; 2]) {
    // Across the arms the torsion is the opposite one.
    let end = |i: usize, side: Side| tips[i].turned(side[1]).follow(side[0], side[2], -torsions[i]);
    let middle = tips[0].position.midpoint(tips[1].position) * 1.55;
    let guess = |i: usize| {
        let d = middle - tips[i].position;
        let angle = d.dot(tips[i].left).atan2(d.dot(tips[i].tangent));
        let k = if i == 0 { -0.35 } else { 0.35 };
        // Leaning to the other side than it bends, to end where the chord ends.
        [d.length(), angle - 0.5 * k * d.length(), k]
    };
    let mut sides = [guess(0), guess(1)];
    let miss = |sides: [Side; 2]| {
        let [a, b] = [end(0, sides[0]), end(1, sides[1])];
        let (gap, turn) = (a.position - b.position, a.normal.cross(b.normal));
        [gap.x, gap.y, gap.z, turn.x, turn.y]
    };
    for _ in 0..60 {
        let value = miss(sides);
        let mut jacobian = Matrix::zeros(5, 6);
        for k in 0..6 {
            let mut moved = sides;
            moved[k / 3][k % 3] += 1e-6;
            for (r, (a, b)) in miss(moved).into_iter().zip(value).enumerate() {
                jacobian[(r, k)] = (a - b) / 1e-6;
            }
        }
        let step = affine_space(&jacobian, &value.map(|v| -v), &[1.0; 6], 1e-12).particular;
        let largest = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        for k in 0..6 {
            sides[k / 3][k % 3] += step[k] * (0.15 / largest).min(1.0);
        }
    }
    assert!(miss(sides).into_iter().all(|v| v.abs() < 1e-9), "{sides:?}: {:?}", miss(sides));
    (sides, [end(0, sides[0]), end(1, sides[1])])
}
