//! Curvatures of a polygon mesh by fitting a small piece of surface at every vertex.

use crate::curvature_statistics::CurvatureStatistics;
use crate::forms::{FirstForm, SecondForm, gaussian_curvature, mean_curvature};
use crate::jet_fit::HeightFit;
use crate::neighbours::Neighbours;
use crate::poly_mesh::{FaceId, PolyMesh, VertexId};
use glam::DVec3;
use rayon::prelude::*;

/// What is tried at a vertex, in this order: degree of the piece, rings of neighbours it is fitted
/// to, and the largest gain ([`HeightFit::gain`]) at which it counts.
///
/// A cubic of two rings is the rule. Along the border it can be nearly singular (over three rows of
/// vertices `x³` is `x² − x` but for their irregularity); a piece of one degree more then sees as
/// many rings as it needs, so that its error falls as fast as inside.
const PIECES: [(usize, usize, f64); 6] =
    [(3, 2, 15.0), (4, 3, 60.0), (4, 4, 120.0), (3, 3, 60.0), (2, 2, 1e3), (2, 3, 1e3)];
/// From so many rings on the piece might reach around a bend, where it is no graph any more: the
/// vertex normals must stay within 78 degrees.
const FAR_RINGS: usize = 3;
const LEAST_COSINE: f64 = 0.2;

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
/// A cubic `z(x, y)` through the vertex is fitted to its neighbours within two rings, over the
/// plane of the mean face normal (Cazals and Pouget 2005); where these cannot tell its terms apart,
/// as along borders, a quartic of three or four rings, a cubic of three, or a quadratic. The error
/// of the curvatures falls with the square of the edge length on a smooth surface.
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
    let surroundings = Surroundings::new(mesh);
    (0..mesh.vertex_count())
        .into_par_iter()
        .with_min_len(64)
        .map(|v| surroundings.fit(VertexId(v as u32)))
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
        let area = vector_area(mesh, f).length();
        statistics.add_area(area);
        let share = area / mesh.face_degree(f) as f64;
        mesh.face_vertices(f).for_each(|v| shares[v.index()] += share);
    }
    for (v, curvature) in vertex_curvatures(mesh).into_iter().enumerate() {
        let point = mesh.positions()[v];
        match curvature {
            Some(c) => statistics.add(point, shares[v], c.mean, c.gaussian),
            // A vertex without faces is no part of the surface.
            None if shares[v] > 0.0 => statistics.add_singular(point, shares[v]),
            None => {}
        }
    }
    statistics
}

fn vector_area(mesh: &PolyMesh, f: FaceId) -> DVec3 {
    // Relative to one corner, so that a mesh far from the origin loses no digits.
    let mut corners = mesh.face_vertices(f).map(|v| mesh.position(v));
    let Some(first) = corners.next() else { return DVec3::ZERO };
    let mut from = corners.next().unwrap_or(first) - first;
    let mut sum = DVec3::ZERO;
    for corner in corners {
        let to = corner - first;
        sum += from.cross(to);
        from = to;
    }
    0.5 * sum
}

/// A mesh with what all its vertices ask for.
struct Surroundings<'m> {
    mesh: &'m PolyMesh,
    neighbours: Neighbours<'m>,
    /// Unit vertex normals, zero where the faces have no area.
    normals: Vec<DVec3>,
}

impl<'m> Surroundings<'m> {
    fn new(mesh: &'m PolyMesh) -> Self {
        let areas: Vec<DVec3> = mesh.faces().map(|f| vector_area(mesh, f)).collect();
        let normal = |v: VertexId| {
            let faces = mesh.outgoing_half_edges(v).filter_map(|h| mesh.face(h));
            faces.map(|f| areas[f.index()]).sum::<DVec3>().normalize_or_zero()
        };
        let normals = mesh.vertices().map(normal).collect();
        Self { mesh, neighbours: Neighbours::new(mesh), normals }
    }

    fn fit(&self, v: VertexId) -> Option<VertexCurvature> {
        let normal = self.normals[v.index()];
        if normal == DVec3::ZERO {
            return None;
        }
        let mut around: [Option<Vec<VertexId>>; 5] = Default::default();
        PIECES.into_iter().find_map(|(degree, rings, most)| {
            let neighbours = around[rings].get_or_insert_with(|| self.neighbours.rings(v, rings));
            let bends = |w: &VertexId| self.normals[w.index()].dot(normal) < LEAST_COSINE;
            if rings >= FAR_RINGS && neighbours.iter().any(bends) {
                return None;
            }
            self.piece(v, neighbours, degree, most)
        })
    }

    fn piece(
        &self,
        v: VertexId,
        neighbours: &[VertexId],
        degree: usize,
        most: f64,
    ) -> Option<VertexCurvature> {
        let (here, normal) = (self.mesh.position(v), self.normals[v.index()]);
        let (x, y) = normal.any_orthonormal_pair();
        // Right-handed, so that z = f(x, y) has its normal on the side of `normal`.
        let (x, y) = if x.cross(y).dot(normal) > 0.0 { (x, y) } else { (y, x) };
        let offsets = neighbours.iter().map(|w| self.mesh.position(*w) - here);
        let scale = offsets.clone().map(DVec3::length).sum::<f64>() / neighbours.len() as f64;
        let local: Vec<DVec3> = offsets
            .map(|p| p / scale)
            .map(|d| DVec3::new(d.dot(x), d.dot(y), d.dot(normal)))
            .collect();
        let fit = HeightFit::new(&local, degree).filter(|fit| fit.gain <= most)?;
        let ([a, b], [c, d, e]) = (fit.slope, fit.curvature);
        let slope = (1.0 + a * a + b * b).sqrt();
        let first = FirstForm { e: 1.0 + a * a, f: a * b, g: 1.0 + b * b };
        let second = SecondForm { l: c / slope, m: d / slope, n: e / slope };
        Some(VertexCurvature {
            normal: (normal - a * x - b * y) / slope,
            mean: mean_curvature(first, second).ok()? / scale,
            gaussian: gaussian_curvature(first, second).ok()? / (scale * scale),
        })
    }
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

    /// A patch of a torus, 2 and 1 its radii, cut into triangles by diagonals that alternate as
    /// those of modellers and Delaunay meshes do.
    fn alternating(n: u32) -> PolyMesh {
        let (u, v) = (0.489, 1.152);
        let at = |k: u32| {
            let share =
                |i: u32, from: f64, to: f64| from + (to - from) * f64::from(i) / f64::from(n);
            let (u, v) = (share(k / (n + 1), -u, u), share(k % (n + 1), v, v + 0.84));
            let r = 2.0 + v.cos();
            DVec3::new(r * u.cos(), r * u.sin(), v.sin())
        };
        let corner = |i: u32, j: u32| i * (n + 1) + j;
        let mut faces: Vec<[u32; 3]> = Vec::new();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            let [a, b, c, d] =
                [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            faces.extend(if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
        PolyMesh::new((0..(n + 1) * (n + 1)).map(at).collect(), &faces).unwrap()
    }

    #[test]
    fn alternating_diagonals_have_the_curvatures_of_the_surface() {
        // K = cos v / (2 + cos v) falls with v.
        let exact = |v: f64| v.cos() / (2.0 + v.cos());
        let (high, low) = (exact(1.152), exact(1.152 + 0.84));
        let range = high - low;
        for (n, share) in [(8, 0.06), (24, 0.01)] {
            let found = mesh_curvature_statistics(&alternating(n)).gaussian_curvature().unwrap();
            assert!((found.min - low).abs() < share * range, "{n}: {found:?} {low}");
            assert!((found.max - high).abs() < share * range, "{n}: {found:?} {high}");
        }
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
    fn a_narrow_strip_of_a_cylinder_has_its_curvatures() {
        // Three rows of vertices, a little off their places along the axis.
        let mesh = grid(40, 3, |u, v| {
            let angle = 2.0 * u;
            DVec3::new(angle.cos(), angle.sin(), 0.1 * v + 1e-4 * (50.0 * (u + v)).sin())
        });
        // At the ends a quadratic sees three steps to one side only, and errs in their measure.
        let step = 2.0 / 39.0;
        for c in vertex_curvatures(&mesh) {
            let c = c.unwrap();
            assert!((c.mean.abs() - 0.5).abs() < step && c.gaussian.abs() < step, "{c:?}");
        }
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
