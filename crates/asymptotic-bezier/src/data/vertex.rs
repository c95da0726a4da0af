//! Vertices of a net: tangent planes, which arms share a torsion and which its opposite, and what
//! the corners say about it.

use geom_core::DVec3;

use crate::data::corners::{AsymptoticNet, MIN_CORNER_SINE};
use crate::error::Error;

/// Arms may leave their common plane by this much (0.5 degrees) before they are refused; within
/// it they are projected.
pub(crate) const PLANE_TOL: f64 = 8.7e-3;

/// The tangent plane at a vertex and the torsion signs of its arms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VertexFrame {
    /// Unit normal, on the side of counter-clockwise faces.
    pub(crate) normal: DVec3,
    /// `(curve, end)` of each arm.
    pub(crate) arms: Vec<(usize, usize)>,
    /// Sign of each arm's torsion relative to the vertex torsion, alternating around the vertex.
    pub(crate) signs: Vec<f64>,
    /// Whether alternation is impossible (odd interior valence), which forces torsion zero.
    pub(crate) odd: bool,
}

/// Builds the frames of all vertices and projects the arms of `net` into the tangent planes.
///
/// The torsion of the curves of one family is `+τ_v` and of the other `−τ_v` (Wang et al. 2019,
/// Prop. 3.1); families are spread over the faces from the first one, and locally where that
/// is contradictory. Arms that leave the plane by more than the angle `plane_tol` are refused.
pub(crate) fn vertex_frames(
    net: &mut AsymptoticNet,
    plane_tol: f64,
) -> Result<Vec<Option<VertexFrame>>, Error> {
    let families = curve_families(net);
    let mut arms: Vec<Vec<(usize, usize)>> = vec![Vec::new(); net.positions.len()];
    for (i, curve) in net.curves.iter().enumerate() {
        for e in 0..2 {
            arms[curve.ends[e]].push((i, e));
        }
    }
    let mut corners: Vec<Vec<[(usize, usize); 2]>> = vec![Vec::new(); net.positions.len()];
    for face in &net.faces {
        // Next and previous arm at 00, 10, 11, 01 in counter-clockwise order.
        for (next, prev) in [((0, 0), (1, 0)), ((3, 0), (0, 1)), ((2, 1), (3, 1)), ((1, 1), (2, 0))]
        {
            let arm = |(curve, end): (usize, usize)| {
                let end = if face.reversed[curve] { 1 - end } else { end };
                (face.curves[curve], end)
            };
            let (next, prev) = (arm(next), arm(prev));
            corners[net.curves[next.0].ends[next.1]].push([next, prev]);
        }
    }
    let mut frames = Vec::with_capacity(arms.len());
    for (v, arms) in arms.into_iter().enumerate() {
        if arms.is_empty() {
            frames.push(None);
            continue;
        }
        let place = net.vertex_place(v);
        let direction = |(i, e): (usize, usize)| net.curves[i].arms[e].normalize();
        let mut normal = DVec3::ZERO;
        for [next, prev] in &corners[v] {
            let n = direction(*next).cross(direction(*prev));
            if !(n.length() > MIN_CORNER_SINE) {
                return Err(Error::ParallelTangents { place, sine: n.length() });
            }
            normal += n;
        }
        let mut normal = normal.normalize_or_zero();
        if arms.len() > 2 {
            let directions: Vec<DVec3> = arms.iter().map(|a| direction(*a)).collect();
            normal = fit_normal(&directions, normal);
            let worst = directions.iter().map(|d| d.dot(normal).abs()).fold(0.0, f64::max);
            if !(worst <= plane_tol) {
                return Err(Error::TangentsNotCoplanar {
                    place,
                    angle_deg: worst.min(1.0).asin().to_degrees(),
                    limit_deg: plane_tol.to_degrees(),
                });
            }
            for &(i, e) in &arms {
                let arm = net.curves[i].arms[e];
                // Length is kept: it is the parametrisation, the plane is what is mended.
                let flat = arm - normal * arm.dot(normal);
                net.curves[i].arms[e] = flat * (arm.length() / flat.length());
            }
        }
        let (signs, odd) = alternate(&arms, &corners[v], families.as_deref());
        frames.push(Some(VertexFrame { normal, arms, signs, odd }));
    }
    Ok(frames)
}

/// Least-squares plane through the origin by inverse iteration, started from `guess`.
fn fit_normal(directions: &[DVec3], guess: DVec3) -> DVec3 {
    let mut m = geom_core::DMat3::ZERO;
    for d in directions {
        m += geom_core::DMat3::from_cols(*d * d.x, *d * d.y, *d * d.z);
    }
    // The shift keeps the inverse finite for exactly planar arms.
    let inverse = (m + geom_core::DMat3::IDENTITY * 1e-12).inverse();
    let mut n = guess;
    for _ in 0..8 {
        n = (inverse * n).normalize();
    }
    if n.dot(guess) < 0.0 { -n } else { n }
}

/// `±1` per curve: opposite sides of a face share it, neighbours differ; `None` when impossible.
pub(crate) fn curve_families(net: &AsymptoticNet) -> Option<Vec<f64>> {
    let mut family = vec![0.0_f64; net.curves.len()];
    let mut faces_of = vec![Vec::new(); net.curves.len()];
    for (f, face) in net.faces.iter().enumerate() {
        for c in face.curves {
            faces_of[c].push(f);
        }
    }
    let mut done = vec![false; net.faces.len()];
    for seed in 0..net.faces.len() {
        if done[seed] {
            continue;
        }
        let mut queue = std::collections::VecDeque::from([seed]);
        done[seed] = true;
        while let Some(f) = queue.pop_front() {
            let face = &net.faces[f];
            let known = face.curves.iter().enumerate().find(|(_, c)| family[**c] != 0.0);
            // u-curves are +, v-curves −, unless a neighbour has already decided.
            let u_sign = known.map_or(1.0, |(k, c)| family[*c] * [1.0, -1.0, 1.0, -1.0][k]);
            for (k, c) in face.curves.iter().enumerate() {
                let wanted = u_sign * [1.0, -1.0, 1.0, -1.0][k];
                if family[*c] != 0.0 && family[*c] != wanted {
                    return None;
                }
                family[*c] = wanted;
                for &g in &faces_of[*c] {
                    if !done[g] {
                        done[g] = true;
                        queue.push_back(g);
                    }
                }
            }
        }
    }
    Some(family)
}

/// Alternating signs of the arms at one vertex; the flag tells an odd closed fan.
fn alternate(
    arms: &[(usize, usize)],
    corners: &[[(usize, usize); 2]],
    families: Option<&[f64]>,
) -> (Vec<f64>, bool) {
    if let Some(family) = families {
        return (arms.iter().map(|(i, _)| family[*i]).collect(), false);
    }
    let mut signs = vec![0.0_f64; arms.len()];
    let index = |arm: (usize, usize)| arms.iter().position(|a| *a == arm);
    let mut odd = false;
    // The fan is small: sweep until nothing changes.
    for start in 0..arms.len() {
        if signs[start] != 0.0 {
            continue;
        }
        signs[start] = 1.0;
        let mut changed = true;
        while changed {
            changed = false;
            for [a, b] in corners {
                let (Some(a), Some(b)) = (index(*a), index(*b)) else { continue };
                for (a, b) in [(a, b), (b, a)] {
                    if signs[a] != 0.0 && signs[b] == 0.0 {
                        signs[b] = -signs[a];
                        changed = true;
                    }
                }
            }
        }
    }
    for [a, b] in corners {
        if let (Some(a), Some(b)) = (index(*a), index(*b)) {
            odd |= signs[a] == signs[b];
        }
    }
    (signs, odd)
}

/// Torsion sign of each end of each curve.
pub(crate) fn arm_signs(net: &AsymptoticNet, frames: &[Option<VertexFrame>]) -> Vec<[f64; 2]> {
    let mut signs = vec![[0.0; 2]; net.curves.len()];
    for frame in frames.iter().flatten() {
        for ((curve, end), sign) in frame.arms.iter().zip(&frame.signs) {
            signs[*curve][*end] = *sign;
        }
    }
    signs
}

/// Torsion `N·R_uv / |R_u × R_v|` of the bilinear patches in the faces at each vertex, averaged.
pub(crate) fn bilinear_torsions(
    net: &AsymptoticNet,
    signs: &[[f64; 2]],
    frames: &[Option<VertexFrame>],
) -> Vec<f64> {
    let mut sums = vec![[0.0, 0.0]; frames.len()];
    for face in &net.faces {
        let corners: [usize; 4] = std::array::from_fn(|c| net.face_corner(face, c));
        let x = corners.map(|v| net.positions[v]);
        let twist = x[3] - x[1] - x[2] + x[0];
        let (along_u, along_v) = ([x[1] - x[0], x[3] - x[2]], [x[2] - x[0], x[3] - x[1]]);
        for (c, v) in corners.into_iter().enumerate() {
            let normal = along_u[c / 2].cross(along_v[c % 2]);
            let u_curve = 2 * (c / 2);
            let end = usize::from((c % 2 == 1) != face.reversed[u_curve]);
            let sign = signs[face.curves[u_curve]][end];
            sums[v][0] += sign * normal.dot(twist) / normal.length_squared();
            sums[v][1] += 1.0;
        }
    }
    sums.iter().map(|[sum, count]| if *count > 0.0 { sum / count } else { 0.0 }).collect()
}
