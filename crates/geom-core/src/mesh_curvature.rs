//! Curvatures of a polygon mesh by fitting a small piece of surface at every vertex.

use crate::curvature_statistics::CurvatureStatistics;
use crate::forms::{FirstForm, SecondForm, gaussian_curvature, mean_curvature};
use crate::poly_mesh::{PolyMesh, VertexId};
use glam::DVec3;
use numerics::least_squares;
use rayon::prelude::*;

/// Unknowns of a quadratic and of a cubic piece through the vertex itself.
const QUADRATIC: usize = 5;
const CUBIC: usize = 9;
/// A piece is fitted to at least this many neighbours per unknown.
const NEIGHBOURS_PER_UNKNOWN: f64 = 1.3;

/// What a mesh says about its surface at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexCurvature {
    /// Unit normal of the fitted piece, on the side of the face normals.
    pub normal: DVec3,
    /// Mean curvature in 1/length.
    pub mean: f64,
    /// Gaussian curvature in 1/length².
    pub gaussian: f64,
}

/// Normal, mean and Gaussian curvature at every vertex, `None` where they have no value (a vertex
/// without faces, or neighbours on a line). Computed in parallel.
///
/// A cubic `z(x, y)` through the vertex is fitted to its neighbours within two rings, three on the
/// border, over the plane of the mean face normal; a quadratic one if they are few (Cazals and
/// Pouget 2005). The error of the curvatures falls with the square of the edge length on a smooth
/// surface. Strips of two faces across have too few rows for a cubic: do not trust theirs.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh, vertex_curvatures};
/// // The paraboloid z = (x² + y²) / 2 on a grid; its vertex, number 12, has H = 1 and K = 1.
/// let xy = |k: u32| (0.1 * (f64::from(k / 5) - 2.0), 0.1 * (f64::from(k % 5) - 2.0));
/// let points = (0..25).map(xy).map(|(x, y)| DVec3::new(x, y, 0.5 * (x * x + y * y))).collect();
/// let quad = |k: u32| {
///     let at = 5 * (k / 4) + k % 4;
///     [at, at + 5, at + 6, at + 1]
/// };
/// let mesh = PolyMesh::new(points, &(0..16).map(quad).collect::<Vec<_>>())?;
/// let vertex = vertex_curvatures(&mesh)[12].expect("it has neighbours");
/// assert!((vertex.mean - 1.0).abs() < 1e-10 && (vertex.gaussian - 1.0).abs() < 1e-10);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[must_use]
pub fn vertex_curvatures(mesh: &PolyMesh) -> Vec<Option<VertexCurvature>> {
    (0..mesh.vertex_count())
        .into_par_iter()
        .with_min_len(64)
        .map(|v| fit(mesh, VertexId(v as u32)))
        .collect()
}

/// Curvatures of the whole mesh, each vertex standing for its share of the faces around it.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh, mesh_curvature_statistics};
/// let points = (0..9).map(|k| DVec3::new(f64::from(k / 3), f64::from(k % 3), 0.0)).collect();
/// let flat = PolyMesh::new(points, &[[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])?;
/// let statistics = mesh_curvature_statistics(&flat);
/// assert_eq!((statistics.area, statistics.samples), (4.0, 9));
/// assert!(statistics.mean_curvature().expect("samples").mean_abs < 1e-12);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[must_use]
pub fn mesh_curvature_statistics(mesh: &PolyMesh) -> CurvatureStatistics {
    let mut shares = vec![0.0; mesh.vertex_count()];
    let mut statistics = CurvatureStatistics::default();
    for f in mesh.faces() {
        let corners: Vec<VertexId> = mesh.face_vertices(f).collect();
        let area = vector_area(mesh, &corners).length();
        statistics.add_area(area);
        for v in &corners {
            shares[v.index()] += area / corners.len() as f64;
        }
    }
    for (v, curvature) in vertex_curvatures(mesh).into_iter().enumerate() {
        let point = mesh.positions()[v];
        match curvature {
            Some(c) => statistics.add(point, shares[v], c.mean, c.gaussian),
            // A vertex without faces is no part of the surface.
            None if shares[v] > 0.0 => statistics.add_singular(point),
            None => {}
        }
    }
    statistics
}

fn vector_area(mesh: &PolyMesh, corners: &[VertexId]) -> DVec3 {
    // Relative to one corner, so that a mesh far from the origin loses no digits.
    let p = |k: usize| mesh.position(corners[k]) - mesh.position(corners[0]);
    0.5 * (1..corners.len() - 1).map(|k| p(k).cross(p(k + 1))).sum::<DVec3>()
}

fn fit(mesh: &PolyMesh, v: VertexId) -> Option<VertexCurvature> {
    let here = mesh.position(v);
    let normal = mesh
        .outgoing_half_edges(v)
        .filter_map(|h| mesh.face(h))
        .map(|f| vector_area(mesh, &mesh.face_vertices(f).collect::<Vec<_>>()))
        .sum::<DVec3>()
        .try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    // Right-handed, so that z = f(x, y) has its normal on the side of `normal`.
    let (x, y) = if x.cross(y).dot(normal) > 0.0 { (x, y) } else { (y, x) };
    // A cubic needs four rows of vertices: two on either side of this one, or three on one.
    let neighbours = neighbourhood(mesh, v, if mesh.is_boundary_vertex(v) { 3 } else { 2 });
    let scale = neighbours.iter().map(|p| p.distance(here)).sum::<f64>() / neighbours.len() as f64;
    let local: Vec<DVec3> = neighbours
        .iter()
        .map(|p| (*p - here) / scale)
        .map(|d| DVec3::new(d.dot(x), d.dot(y), d.dot(normal)))
        .collect();
    let (columns, count) = (CUBIC, local.len());
    let enough = |unknowns: usize| count as f64 >= NEIGHBOURS_PER_UNKNOWN * unknowns as f64;
    let cubic = enough(columns).then(|| solve(&local, CUBIC)).flatten();
    let quadratic = || (count >= QUADRATIC).then(|| solve(&local, QUADRATIC)).flatten();
    let [a, b, c, d, e] = cubic.or_else(quadratic)?;
    let slope = (1.0 + a * a + b * b).sqrt();
    let first = FirstForm { e: 1.0 + a * a, f: a * b, g: 1.0 + b * b };
    let second = SecondForm { l: c / slope, m: d / slope, n: e / slope };
    Some(VertexCurvature {
        normal: (normal - a * x - b * y) / slope,
        mean: mean_curvature(first, second).ok()? / scale,
        gaussian: gaussian_curvature(first, second).ok()? / (scale * scale),
    })
}

/// Vertices of the faces around `v`, of the faces around those, and so on for so many rings.
fn neighbourhood(mesh: &PolyMesh, v: VertexId, rings: usize) -> Vec<DVec3> {
    let around = |v: VertexId| {
        mesh.outgoing_half_edges(v).filter_map(|h| mesh.face(h)).flat_map(|f| mesh.face_vertices(f))
    };
    let mut found = vec![v];
    for _ in 0..rings {
        found = found.iter().flat_map(|w| around(*w)).collect();
        found.sort_unstable();
        found.dedup();
    }
    found.into_iter().filter(|w| *w != v).map(|w| mesh.position(w)).collect()
}

/// Coefficients `a, b, c, d, e` of `z = a x + b y + (c x² + 2 d x y + e y²) / 2 + cubic terms`.
fn solve(points: &[DVec3], unknowns: usize) -> Option<[f64; 5]> {
    let mut matrix = Vec::with_capacity(points.len() * unknowns);
    let mut heights = Vec::with_capacity(points.len());
    for p in points {
        let (x, y) = (p.x, p.y);
        // Nearer neighbours say more about the vertex.
        let weight = 1.0 / p.length().max(1e-3);
        let row =
            [x, y, 0.5 * x * x, x * y, 0.5 * y * y, x * x * x, x * x * y, x * y * y, y * y * y];
        matrix.extend(row[..unknowns].iter().map(|value| weight * value));
        heights.push(weight * p.z);
    }
    least_squares(&mut matrix, unknowns, &mut heights, 1).ok()?;
    heights[..5].try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest errors of H and K on a quad mesh of the torus with radii 3 and 1, normals out.
    fn torus_errors(n: usize) -> (f64, f64) {
        let angle = |k: usize| std::f64::consts::TAU * (k % n) as f64 / n as f64;
        let point = |i: usize, j: usize| {
            let (u, v) = (angle(i), angle(j));
            let r = 3.0 + v.cos();
            DVec3::new(r * u.cos(), r * u.sin(), v.sin())
        };
        let positions = (0..n * n).map(|k| point(k / n, k % n)).collect();
        let id = |i: usize, j: usize| ((i % n) * n + j % n) as u32;
        let faces: Vec<[u32; 4]> = (0..n * n)
            .map(|k| (k / n, k % n))
            .map(|(i, j)| [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)])
            .collect();
        let mesh = PolyMesh::new(positions, &faces).unwrap();
        let (mut mean, mut gaussian) = (0.0_f64, 0.0_f64);
        for (k, c) in vertex_curvatures(&mesh).into_iter().enumerate() {
            let (c, cos) = (c.unwrap(), angle(k % n).cos());
            let r = 3.0 + cos;
            mean = mean.max((c.mean + 0.5 * (1.0 + cos / r)).abs());
            gaussian = gaussian.max((c.gaussian - cos / r).abs());
        }
        (mean, gaussian)
    }

    #[test]
    fn torus_errors_fall_with_the_square_of_the_edges() {
        let (coarse, fine) = (torus_errors(48), torus_errors(96));
        assert!(fine.0 < 0.01 && fine.1 < 0.01, "{fine:?}");
        assert!(coarse.0 / fine.0 > 3.5 && coarse.1 / fine.1 > 3.5, "{coarse:?} {fine:?}");
    }

    /// A mesh of `n_u` by `n_v` vertices.
    fn grid(n_u: usize, n_v: usize, point: impl Fn(f64, f64) -> DVec3) -> PolyMesh {
        let at = |k: usize| {
            let share = |i: usize, n: usize| i as f64 / (n - 1) as f64;
            point(share(k / n_v, n_u), share(k % n_v, n_v))
        };
        let quad = |k: usize| {
            let first = k / (n_v - 1) * n_v + k % (n_v - 1);
            [first, first + n_v, first + n_v + 1, first + 1].map(|v| v as u32)
        };
        let quads: Vec<[u32; 4]> = (0..(n_u - 1) * (n_v - 1)).map(quad).collect();
        PolyMesh::new((0..n_u * n_v).map(at).collect(), &quads).unwrap()
    }

    #[test]
    fn errors_fall_as_fast_on_the_border() {
        let height = |x: f64, y: f64| 0.6 * x.sin() * y.sin();
        let exact = |x: f64, y: f64| {
            let (p, q) = (0.6 * x.cos() * y.sin(), 0.6 * x.sin() * y.cos());
            let first = FirstForm { e: 1.0 + p * p, f: p * q, g: 1.0 + q * q };
            let slope = (1.0 + p * p + q * q).sqrt();
            let (bend, twist) = (-height(x, y) / slope, 0.6 * x.cos() * y.cos() / slope);
            mean_curvature(first, SecondForm { l: bend, m: twist, n: bend }).unwrap()
        };
        let error = |n: usize| {
            let angle = |share: f64| std::f64::consts::TAU * share;
            let mesh = grid(n, n, |u, v| {
                let (x, y) = (angle(u), angle(v));
                DVec3::new(x, y, height(x, y))
            });
            let curvatures = vertex_curvatures(&mesh).into_iter().zip(mesh.positions());
            let errors = curvatures.map(|(c, p)| (c.unwrap().mean - exact(p.x, p.y)).abs());
            errors.fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(25), error(49));
        assert!(fine < 0.05 && coarse / fine > 3.0, "{coarse} {fine}");
    }

    #[test]
    fn statistics_of_a_flat_mesh_far_away() {
        let shift = DVec3::splat(1e6);
        let positions =
            (0..36).map(|k| DVec3::new(f64::from(k / 6), f64::from(k % 6), 0.0) + shift);
        let faces: Vec<[u32; 4]> =
            (0..25).map(|k| (k / 5) * 6 + k % 5).map(|k| [k, k + 6, k + 7, k + 1]).collect();
        let mesh = PolyMesh::new(positions.collect(), &faces).unwrap();
        let statistics = mesh_curvature_statistics(&mesh);
        assert_eq!((statistics.area, statistics.samples), (25.0, 36));
        assert!(statistics.mean_curvature().unwrap().mean_abs < 1e-9);
        assert_eq!(statistics.bounding_box.unwrap().size(), DVec3::new(5.0, 5.0, 0.0));
    }
}
