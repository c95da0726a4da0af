//! Claims of `darboux`: the patches are pieces of cyclides whose parameter lines are circles.
//!
//! The written mesh has a grid of points per patch, one after the other. A line of a patch goes to
//! a circle, so the points along every row and column lie on one; its tangents give the normals.

use crate::claims::Values;
use crate::content::Mesh;
use crate::shape::angle_deg;
use glam::DVec3;
use std::collections::BTreeMap;

/// Points this close, as a share of the size of a cell, are one place of two patches.
const SAME_PLACE: f64 = 1e-3;

pub(crate) fn recompute(mesh: &Mesh, faces: usize, values: &mut Values) {
    values.count("samples", mesh.positions.len());
    if faces == 0 || !mesh.positions.len().is_multiple_of(faces) {
        return;
    }
    let side = side_of(mesh.positions.len() / faces);
    let Some(side) = side.filter(|n| mesh.faces.len() == faces * (n - 1) * (n - 1)) else { return };
    values.count("faces", faces);
    let grids: Vec<&[DVec3]> = mesh.positions.chunks(side * side).collect();
    let mut defect = 0.0_f64;
    for grid in &grids {
        for k in 0..side {
            let row: Vec<DVec3> = (0..side).map(|j| grid[k * side + j]).collect();
            let column: Vec<DVec3> = (0..side).map(|i| grid[i * side + k]).collect();
            defect = defect.max(circle_defect(&row)).max(circle_defect(&column));
        }
    }
    values.number("circle_defect_max", defect);
    values.number("kink_max_deg", kink_max_deg(&grids, side));
}

fn side_of(count: usize) -> Option<usize> {
    (3..=1025).find(|n| n * n >= count).filter(|n| n * n == count)
}

/// Largest distance of the points from the circle (or line) through the first, the middle and the
/// last of them.
///
/// Of `p` on the circle through `a, b, c`, the inversion at `a` lies on the line of the inverted
/// `b` and `c`; scaled back by the square of the distance from `a`, the distance from that line is
/// the distance from the circle to first order.
fn circle_defect(points: &[DVec3]) -> f64 {
    let last = points.len() - 1;
    let (a, b, c) = (points[0], points[last / 2], points[last]);
    let inverted = |p: DVec3| (p - a) / (p - a).length_squared();
    let (from, along) = (inverted(c), (inverted(b) - inverted(c)).normalize_or_zero());
    let far = |p: &DVec3| {
        let off = inverted(*p) - from;
        (off - off.dot(along) * along).length() * (*p - a).length_squared()
    };
    points[1..last].iter().map(far).fold(0.0, f64::max)
}

/// Tangent at the first of three points of a circle: the limit of chords.
///
/// With chords `p = b − a` and `q = c − a` it is `p/|p|² − q/|q|²` up to length: that is the
/// direction of the line the circle is inverted to.
fn tangent(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (p, q) = (b - a, c - a);
    p / p.length_squared() - q / q.length_squared()
}

/// Largest angle between the normals of two patches at common places of their borders.
fn kink_max_deg(grids: &[&[DVec3]], side: usize) -> f64 {
    let last = side - 1;
    let far = |k: usize| if 2 * k < last { last } else { 0 };
    let mut borders: Vec<(usize, DVec3, DVec3, bool)> = Vec::new();
    let mut cell = f64::INFINITY;
    for (patch, grid) in grids.iter().enumerate() {
        let at = |i: usize, j: usize| grid[i * side + j];
        cell = cell.min(at(0, 0).distance(at(0, 1))).min(at(0, 0).distance(at(1, 0)));
        for i in 0..side {
            for j in 0..side {
                if i != 0 && i != last && j != 0 && j != last {
                    continue;
                }
                // Two more points of each line, the second as far away as it can be.
                let pick = |k: usize| {
                    let end = far(k);
                    let between = usize::midpoint(k, end);
                    if between == k || between == end { (last - end, end) } else { (between, end) }
                };
                let ((i1, i2), (j1, j2)) = (pick(i), pick(j));
                let along_u = tangent(at(i, j), at(i1, j), at(i2, j)) * sign(i1, i);
                let along_v = tangent(at(i, j), at(i, j1), at(i, j2)) * sign(j1, j);
                let is_corner = (i == 0 || i == last) && (j == 0 || j == last);
                borders.push((patch, at(i, j), along_u.cross(along_v), is_corner));
            }
        }
    }
    pairs(&borders, SAME_PLACE * cell)
}

/// Of chords towards higher parameters 1, else −1.
fn sign(to: usize, from: usize) -> f64 {
    if to > from { 1.0 } else { -1.0 }
}

/// Compares the points of different patches that are closer than `reach`.
fn pairs(borders: &[(usize, DVec3, DVec3, bool)], reach: f64) -> f64 {
    let cell = |p: DVec3| (p / (4.0 * reach)).to_array().map(|x| x.floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (k, (_, p, ..)) in borders.iter().enumerate() {
        cells.entry(cell(*p)).or_default().push(k);
    }
    let mut kink = 0.0_f64;
    for (k, (patch, p, normal, is_corner)) in borders.iter().enumerate() {
        let [x, y, z] = cell(*p);
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    for &other in cells.get(&[x + dx, y + dy, z + dz]).into_iter().flatten() {
                        let (other_patch, q, other_normal, _) = &borders[other];
                        if other <= k || other_patch == patch || p.distance(*q) > reach {
                            continue;
                        }
                        // Around a corner patches meet that share no edge; kinks are of edges.
                        if !is_corner {
                            kink = kink.max(angle_deg(*normal, *other_normal));
                        }
                    }
                }
            }
        }
    }
    kink
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patches of a torus between its circles of curvature.
    fn torus(moved: Option<usize>) -> Mesh {
        let n = 5;
        let mut mesh = Mesh::default();
        for patch in 0..2 {
            for i in 0..n {
                for j in 0..n {
                    let (u, v) = (0.1 * (i + patch * (n - 1)) as f64, 0.15 * j as f64);
                    let radius = 3.0 + v.cos();
                    mesh.positions.push(DVec3::new(radius * u.cos(), radius * u.sin(), v.sin()));
                }
            }
            let at = |i: usize, j: usize| patch * n * n + i * n + j;
            for i in 0..n - 1 {
                for j in 0..n - 1 {
                    mesh.faces.push(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        if let Some(k) = moved {
            mesh.positions[k].z += 1e-5;
        }
        mesh
    }

    #[test]
    fn circles_are_met_and_a_moved_point_is_seen_anywhere() {
        let measure = |mesh: &Mesh| {
            let mut values = Values::default();
            recompute(mesh, 2, &mut values);
            ["circle_defect_max", "kink_max_deg"].map(|k| values.get(k).unwrap())
        };
        let [defect, kink] = measure(&torus(None));
        assert!(defect < 1e-14 && kink < 1e-11, "{defect} {kink}");
        for moved in 0..50 {
            let [defect, ..] = measure(&torus(Some(moved)));
            assert!(defect > 1e-6, "{moved}: {defect}");
        }
    }
}
