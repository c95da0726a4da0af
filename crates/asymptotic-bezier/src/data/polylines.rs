//! Nets from the polylines of their curves.

use std::collections::BTreeSet;

use geom_core::DVec3;
use numerics::least_squares;

use crate::data::corners::{AsymptoticNet, NetCurve};
use crate::data::net::net_curve;
use crate::error::Error;
use crate::faults::NetFault;

/// Ends of polylines this near, relative to the median length, are one vertex.
const MERGE_TOL: f64 = 1e-6;
/// Highest degree of the polynomials that tangents and curvatures are taken from.
const FIT_DEGREE: usize = 7;

impl AsymptoticNet {
    /// A net of the curves that polylines sample: their ends are the vertices, every closed ring of
    /// four curves is a face.
    ///
    /// Tangents and curvatures at the ends are those of polynomials in the chord length, of degree
    /// seven where the polyline has twice as many points, fitted by least squares.
    ///
    /// # Errors
    /// [`Error::Net`] when a polyline has fewer than three points, or when rings do not
    /// tell the faces (a curve on none, or on more than two); then the faults of
    /// [`AsymptoticNet::new`].
    pub fn from_polylines(polylines: &[Vec<DVec3>]) -> Result<Self, Error> {
        if let Some(i) = polylines.iter().position(|p| p.len() < 3) {
            let points = polylines[i].len();
            return Err(NetFault::ShortPolyline { polyline: i, points }.into());
        }
        if let Some(i) = polylines.iter().position(|p| p.iter().any(|q| !q.is_finite())) {
            return Err(NetFault::PolylineNotFinite { polyline: i }.into());
        }
        let (positions, ends) = merge_ends(polylines);
        let quads = rings(positions.len(), &ends)?;
        let mut derivatives = Vec::with_capacity(polylines.len());
        for (i, polyline) in polylines.iter().enumerate() {
            let backwards: Vec<DVec3> = polyline.iter().rev().copied().collect();
            let (Some(start), Some(end)) = (end_derivatives(polyline), end_derivatives(&backwards))
            else {
                return Err(NetFault::RepeatedPoints { polyline: i }.into());
            };
            derivatives.push([start, end]);
        }
        // Normals of the counter-clockwise faces at the vertices.
        let mut normals = vec![DVec3::ZERO; positions.len()];
        let arm = |from: usize, to: usize| {
            let mut found = ends.iter().zip(&derivatives);
            found.find_map(|([a, b], d)| match (*a == from && *b == to, *a == to && *b == from) {
                (true, _) => Some(d[0].0.normalize()),
                (_, true) => Some(d[1].0.normalize()),
                _ => None,
            })
        };
        for quad in &quads {
            for k in 0..4 {
                let (v, next, prev) = (quad[k], quad[(k + 1) % 4], quad[(k + 3) % 4]);
                if let (Some(next), Some(prev)) = (arm(v, next), arm(v, prev)) {
                    normals[v] += next.cross(prev);
                }
            }
        }
        let curves: Vec<NetCurve> = ends
            .iter()
            .zip(derivatives)
            .map(|(ends, derivatives)| {
                let normals = ends.map(|v| normals[v].normalize_or_zero());
                let chord = positions[ends[1]] - positions[ends[0]];
                net_curve(*ends, chord, derivatives, normals)
            })
            .collect();
        let net = Self::new(positions, &quads, curves)?;
        Ok(Self { estimated: true, ..net })
    }
}

/// Vertices and the two of them that each polyline joins.
fn merge_ends(polylines: &[Vec<DVec3>]) -> (Vec<DVec3>, Vec<[usize; 2]>) {
    let mut lengths: Vec<f64> = polylines.iter().map(|p| p[0].distance(p[p.len() - 1])).collect();
    lengths.sort_by(f64::total_cmp);
    let tol = MERGE_TOL * lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
    let mut positions: Vec<DVec3> = Vec::new();
    let ends = polylines
        .iter()
        .map(|p| {
            [p[0], p[p.len() - 1]].map(|q| {
                positions.iter().position(|r| r.distance(q) <= tol).unwrap_or_else(|| {
                    positions.push(q);
                    positions.len() - 1
                })
            })
        })
        .collect();
    (positions, ends)
}

/// The closed rings of four curves, oriented alike across every curve.
fn rings(vertices: usize, ends: &[[usize; 2]]) -> Result<Vec<[usize; 4]>, NetFault> {
    let mut near: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); vertices];
    for [a, b] in ends {
        near[*a].insert(*b);
        near[*b].insert(*a);
    }
    let mut found: Vec<[usize; 4]> = Vec::new();
    for a in 0..vertices {
        // Each ring once: from its least vertex, towards the lesser of its neighbours.
        for &b in near[a].range(a + 1..) {
            for &d in near[a].range(b + 1..) {
                let across = near[b].intersection(&near[d]).filter(|c| **c > a);
                found.extend(across.map(|c| [a, b, *c, d]));
            }
        }
    }
    let sides = |quad: &[usize; 4]| -> [[usize; 2]; 4] {
        std::array::from_fn(|k| [quad[k], quad[(k + 1) % 4]])
    };
    let key = |[a, b]: [usize; 2]| [a.min(b), a.max(b)];
    let mut of_curve: std::collections::BTreeMap<[usize; 2], Vec<usize>> =
        ends.iter().map(|e| (key(*e), Vec::new())).collect();
    for (f, quad) in found.iter().enumerate() {
        for side in sides(quad) {
            of_curve.entry(key(side)).or_default().push(f);
        }
    }
    for ([a, b], faces) in &of_curve {
        if faces.is_empty() || faces.len() > 2 {
            return Err(NetFault::Rings { a: *a, b: *b, rings: faces.len() });
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; found.len()];
    for seed in 0..found.len() {
        let mut queue = vec![(seed, false)];
        while let Some((f, turn)) = queue.pop() {
            if turned[f].is_some() {
                continue;
            }
            turned[f] = Some(turn);
            for side in sides(&found[f]) {
                for &g in of_curve.get(&key(side)).into_iter().flatten().filter(|g| **g != f) {
                    // Neighbours run through a curve against one another.
                    let alike = sides(&found[g]).contains(&side);
                    queue.push((g, turn != alike));
                }
            }
        }
    }
    for (quad, turn) in found.iter_mut().zip(turned) {
        if turn == Some(true) {
            quad.swap(1, 3);
        }
    }
    Ok(found)
}

/// First and second derivative at the start of a polyline, by its chord length from 0 to 1.
fn end_derivatives(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let mut at = vec![0.0];
    for pair in points.windows(2) {
        at.push(at[at.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = at[at.len() - 1];
    let degree = FIT_DEGREE.min((points.len() / 2).max(2)).min(points.len() - 1);
    // p(s) − p(0) = Σ c_k s^k, k ≥ 1.
    let (mut matrix, mut right) = (Vec::new(), Vec::new());
    for (s, p) in at.iter().zip(points).skip(1) {
        let s = s / length;
        matrix.extend((1..=degree).map(|k| s.powi(k as i32)));
        right.extend((*p - points[0]).to_array());
    }
    least_squares(&mut matrix, degree, &mut right, 3).ok()?;
    let c = |k: usize| DVec3::from_slice(&right[3 * (k - 1)..]);
    Some((c(1), c(2) * 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_of_a_grid_are_its_faces_oriented_alike() {
        // 2 × 2 faces over nine vertices.
        let at = |i: usize, j: usize| 3 * i + j;
        let mut ends = Vec::new();
        for i in 0..3 {
            for j in 0..3 {
                if i < 2 {
                    ends.push([at(i, j), at(i + 1, j)]);
                }
                if j < 2 {
                    ends.push([at(i, j + 1), at(i, j)]);
                }
            }
        }
        let quads = rings(9, &ends).unwrap();
        assert_eq!(quads.len(), 4);
        let mut directed: Vec<[usize; 2]> =
            quads.iter().flat_map(|q| (0..4).map(|k| [q[k], q[(k + 1) % 4]])).collect();
        let count = directed.len();
        directed.sort_unstable();
        directed.dedup();
        assert_eq!(directed.len(), count, "no side is run through twice the same way");
        let error = rings(9, &ends[..11]).unwrap_err().to_string();
        assert!(error.contains("lies on 0 rings of four"), "{error}");
    }

    #[test]
    fn derivatives_of_a_sampled_arc_are_right() {
        let points: Vec<DVec3> = (0..=32)
            .map(|k| {
                DVec3::from_array([(f64::from(k) / 40.0).cos(), (f64::from(k) / 40.0).sin(), 0.0])
            })
            .collect();
        let (first, second) = end_derivatives(&points).unwrap();
        let curvature = first.cross(second).length() / first.length().powi(3);
        assert!((curvature - 1.0).abs() < 1e-4, "{curvature}");
        assert!((first.length() - 0.8).abs() < 1e-4 && first.x.abs() < 1e-5);
    }
}
