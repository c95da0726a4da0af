//! Claims of `darboux`: the patches are pieces of cyclides whose parameter lines are circles.
//!
//! The written mesh has a grid of points per patch, one after the other. A line of a patch goes to
//! a circle, so the points along every row and column lie on one; its tangents give the normals.

use crate::claims::{Claims, Values};
use crate::content::{Mesh, centroid, diagonal};
use crate::shape::angle_deg;
use glam::DVec3;
use std::collections::BTreeMap;

/// Corners this close, as a share of the size of all, are one.
const SAME_PLACE: f64 = 1e-8;
/// The largest kink of an image that counts as smooth, in degrees.
const SMOOTH: f64 = 1e-6;

pub(crate) fn recompute(mesh: &Mesh, claims: &Claims<'_>, values: &mut Values) {
    let Some(faces) = claims.count("faces") else { return };
    values.count("samples", mesh.positions.len());
    if let Some(mean) = centroid(mesh.positions.iter().copied()) {
        values.place("centroid", mean);
    }
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
    // The largest kink of an edge may be anywhere along it; none is anywhere along a smooth one.
    if claims.number("kink_max_deg").is_some_and(|kink| kink <= SMOOTH) {
        values.number("kink_max_deg", kink_max_deg(&grids, side));
    }
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

/// Largest angle between the normals of two patches with a common edge, at the ends of it: between
/// them the two have their samples at places of their own.
fn kink_max_deg(grids: &[&[DVec3]], side: usize) -> f64 {
    let last = side - 1;
    // Numbers of the corners, equal where patches meet; of each patch in turn.
    let mut numbers: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    let size = diagonal(grids.iter().flat_map(|g| g.iter().copied())).unwrap_or(1.0);
    let mut corners: Vec<[(usize, DVec3); 4]> = Vec::with_capacity(grids.len());
    for grid in grids {
        let at = |i: usize, j: usize| grid[i * side + j];
        corners.push([(0, 0), (last, 0), (last, last), (0, last)].map(|(i, j)| {
            // Two more points of each of the two lines through the corner.
            let (i1, i2, j1, j2) = (last / 2, last - i, last / 2, last - j);
            let along = |to: usize| if to > 0 { 1.0 } else { -1.0 };
            let along_u = tangent(at(i, j), at(i1, j), at(i2, j)) * along(i2);
            let along_v = tangent(at(i, j), at(i, j1), at(i, j2)) * along(j2);
            let key = (at(i, j) / (SAME_PLACE * size)).round().to_array().map(|x| x as i64);
            let next = numbers.len();
            // Rounding may put one place into neighbouring cells.
            let around = (-1..=1).flat_map(|x| {
                (-1..=1)
                    .flat_map(move |y| (-1..=1).map(move |z| [key[0] + x, key[1] + y, key[2] + z]))
            });
            let known = around.filter_map(|cell| numbers.get(&cell)).next().copied();
            let number = known.unwrap_or_else(|| *numbers.entry(key).or_insert(next));
            (number, along_u.cross(along_v))
        }));
    }
    // The two ends of every edge, and the normals of its patches there.
    let mut edges: BTreeMap<[usize; 2], Vec<[DVec3; 2]>> = BTreeMap::new();
    for patch in &corners {
        for k in 0..4 {
            let ((a, m), (b, n)) = (patch[k], patch[(k + 1) % 4]);
            let (key, normals) = if a < b { ([a, b], [m, n]) } else { ([b, a], [n, m]) };
            edges.entry(key).or_default().push(normals);
        }
    }
    let kink = |sides: &Vec<[DVec3; 2]>| match sides[..] {
        [[a, b], [c, d]] => angle_deg(a, c).max(angle_deg(b, d)),
        _ => 0.0,
    };
    edges.values().map(kink).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

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
            let metrics = json!({"faces": 2, "kink_max_deg": 0.0});
            let mut values = Values::default();
            recompute(mesh, &Claims::new(&metrics), &mut values);
            ["circle_defect_max", "kink_max_deg", "centroid.2"].map(|k| values.get(k).unwrap())
        };
        let [defect, kink, height] = measure(&torus(None));
        assert!(defect < 1e-14 && kink < 1e-11, "{defect} {kink}");
        for moved in 0..50 {
            let [defect, _, mean] = measure(&torus(Some(moved)));
            assert!(defect > 1e-6, "{moved}: {defect}");
            assert!((mean - height - 1e-5 / 50.0).abs() < 1e-14);
        }
        // A point of the common edge that moves in one patch only is a kink too.
        assert!(measure(&torus(Some(22)))[1] > 1e-5);
    }
}
