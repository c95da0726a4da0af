//! Triangle meshes and the closest point on them.

use crate::{MeshError, PolyMesh};
use glam::DVec3;

/// The foot of a point on a surface: where the surface is nearest, and how it lies there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Nearest point of the surface.
    pub point: DVec3,
    /// Unit normal of the surface there.
    pub normal: DVec3,
}

/// A surface that knows its nearest point: a mesh, or a closed form.
///
/// # Example
/// ```
/// use geom_core::{ClosestPoint, DVec3, Foot};
/// /// The unit sphere, in closed form.
/// struct Sphere;
///
/// impl ClosestPoint for Sphere {
///     fn closest_point(&self, x: DVec3) -> Foot {
///         let normal = x.normalize_or(DVec3::Z);
///         Foot { point: normal, normal }
///     }
/// }
///
/// assert_eq!(Sphere.closest_point(DVec3::new(0.0, -3.0, 0.0)).point, -DVec3::Y);
/// ```
pub trait ClosestPoint: Send + Sync {
    /// The foot of `x`.
    fn closest_point(&self, x: DVec3) -> Foot;
}

/// What [`TriMesh::nearest`] found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Nearest point of the mesh.
    pub point: DVec3,
    /// Index of the triangle it lies on; the smallest of several equally near.
    pub triangle: usize,
    /// Its barycentric coordinates there; they sum to 1.
    pub barycentric: [f64; 3],
    /// Squared distance to the query point.
    pub distance_squared: f64,
}

/// An oriented triangle mesh with a box tree over its triangles.
///
/// Triangles name existing vertices, three different ones each, and coordinates are finite (kept
/// by [`TriMesh::new`]). Triangles of zero area are allowed; the mesh need not be manifold.
#[derive(Clone, Debug)]
pub struct TriMesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<DVec3>,
    nodes: Vec<Node>,
    // Triangle indices in the order of the leaves.
    order: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    // A leaf holds `order[start..start + count]`; an inner node has `count == 0`, its left child
    // right behind it and its right child at `start`.
    start: u32,
    count: u32,
}

const LEAF_SIZE: usize = 4;

impl TriMesh {
    /// Checks the triangles and builds vertex normals and the box tree.
    ///
    /// Vertex normals are the area-weighted means of the triangle normals around.
    ///
    /// # Errors
    /// [`MeshError`] names the first vertex or triangle at fault.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check(&positions, &triangles)?;
        let mut normals = vec![DVec3::ZERO; positions.len()];
        for &t in &triangles {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            for v in t {
                normals[v as usize] += (b - a).cross(c - a);
            }
        }
        for n in &mut normals {
            *n = n.normalize_or_zero();
        }
        let order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut mesh = Self { positions, triangles, normals, nodes: Vec::new(), order };
        let centres: Vec<DVec3> = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t).iter().sum::<DVec3>() / 3.0)
            .collect();
        mesh.build(&centres, 0, mesh.order.len());
        Ok(mesh)
    }

    /// The triangles of a polygon mesh: quads are cut along the shorter diagonal, larger faces
    /// fanned from their first corner. Vertices keep their numbers.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh, TriMesh};
    /// // A rhombus, twice as long as wide.
    /// let corners = vec![-2.0 * DVec3::X, -DVec3::Y, 2.0 * DVec3::X, DVec3::Y];
    /// let rhombus = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
    /// assert_eq!(TriMesh::from_poly_mesh(&rhombus).triangles(), [[0, 1, 3], [1, 2, 3]]);
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    #[must_use]
    pub fn from_poly_mesh(mesh: &PolyMesh) -> Self {
        let mut triangles = Vec::with_capacity(2 * mesh.face_count());
        for f in mesh.faces() {
            let c: Vec<u32> = mesh.face_vertices(f).map(|v| v.0).collect();
            let at = |k: usize| mesh.positions()[c[k] as usize];
            // Of diagonals equal but for rounding always the same one, however the mesh is turned.
            let clearly = 1.0 - 1e-9;
            if c.len() == 4
                && at(1).distance_squared(at(3)) < clearly * at(0).distance_squared(at(2))
            {
                triangles.push([c[0], c[1], c[3]]);
                triangles.push([c[1], c[2], c[3]]);
            } else {
                triangles.extend((1..c.len() - 1).map(|k| [c[0], c[k], c[k + 1]]));
            }
        }
        Self::new(mesh.positions().to_vec(), triangles)
            .expect("a polygon mesh has finite coordinates, at least one face, and sound corners")
    }

    /// The same triangles with every position mapped.
    ///
    /// # Panics
    /// If a position is mapped to one that is not finite.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        let positions = self.positions.iter().map(|&p| map(p)).collect();
        Self::new(positions, self.triangles.clone()).expect("finite positions, the same triangles")
    }

    /// Positions, indexed by vertex.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Vertex triples, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Unit vertex normals (zero where all triangles around have no area).
    #[must_use]
    pub fn vertex_normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// The three corner points of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The nearest point of the mesh, found through the box tree.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, TriMesh};
    /// let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]])?;
    /// let nearest = mesh.nearest(DVec3::new(0.25, 0.25, 3.0));
    /// assert_eq!(nearest.point, DVec3::new(0.25, 0.25, 0.0));
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    #[must_use]
    pub fn nearest(&self, x: DVec3) -> Nearest {
        let mut best = Nearest {
            point: DVec3::NAN,
            triangle: usize::MAX,
            barycentric: [f64::NAN; 3],
            distance_squared: f64::INFINITY,
        };
        let mut stack = Vec::with_capacity(64);
        stack.push((0_u32, self.nodes[0].distance_squared(x)));
        while let Some((at, bound)) = stack.pop() {
            // An equally near box may hold a triangle with a smaller index, so it is opened too.
            if bound > best.distance_squared {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                let (start, end) = (node.start as usize, (node.start + node.count) as usize);
                for &t in &self.order[start..end] {
                    self.improve(x, t as usize, &mut best);
                }
                continue;
            }
            let children = [at + 1, node.start];
            let [near, far] = children.map(|c| (c, self.nodes[c as usize].distance_squared(x)));
            let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
            stack.push(far);
            stack.push(near);
        }
        best
    }

    fn improve(&self, x: DVec3, triangle: usize, best: &mut Nearest) {
        let corners = self.corners(triangle);
        let barycentric = closest_barycentric(x, corners);
        let point =
            corners[0] * barycentric[0] + corners[1] * barycentric[1] + corners[2] * barycentric[2];
        let distance_squared = point.distance_squared(x);
        let tie = distance_squared == best.distance_squared && triangle < best.triangle;
        if distance_squared < best.distance_squared || tie {
            *best = Nearest { point, triangle, barycentric, distance_squared };
        }
    }

    fn build(&mut self, centres: &[DVec3], start: usize, end: usize) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut centre_low, mut centre_high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &t in &self.order[start..end] {
            for p in self.corners(t as usize) {
                low = low.min(p);
                high = high.max(p);
            }
            centre_low = centre_low.min(centres[t as usize]);
            centre_high = centre_high.max(centres[t as usize]);
        }
        let at = self.nodes.len();
        let count = end - start;
        self.nodes.push(Node { low, high, start: start as u32, count: count as u32 });
        if count <= LEAF_SIZE {
            return;
        }
        let extent = centre_high - centre_low;
        let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
        // Ties are broken by index, so that the tree does not depend on the selection's order.
        let key = |t: u32| (centres[t as usize][axis], t);
        let middle = count / 2;
        self.order[start..end].select_nth_unstable_by(middle, |&a, &b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        });
        self.build(centres, start, start + middle);
        let right = self.nodes.len();
        self.build(centres, start + middle, end);
        self.nodes[at].start = right as u32;
        self.nodes[at].count = 0;
    }
}

impl ClosestPoint for TriMesh {
    /// The normal is interpolated from the vertex normals, so that tangent planes turn
    /// continuously across the edges of the mesh.
    fn closest_point(&self, x: DVec3) -> Foot {
        let nearest = self.nearest(x);
        let [a, b, c] = self.triangles[nearest.triangle].map(|v| self.normals[v as usize]);
        let [u, v, w] = nearest.barycentric;
        Foot { point: nearest.point, normal: (a * u + b * v + c * w).normalize_or_zero() }
    }
}

impl Node {
    fn distance_squared(&self, x: DVec3) -> f64 {
        x.distance_squared(x.clamp(self.low, self.high))
    }
}

/// Barycentric coordinates of the point of a triangle nearest to `x` (Ericson 2004, §5.1.5).
///
/// A triangle without area is treated as its longest edge.
///
/// # Example
/// ```
/// use geom_core::{DVec3, closest_barycentric};
/// let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// let beyond_the_long_side = DVec3::new(1.0, 1.0, 5.0);
/// assert_eq!(closest_barycentric(beyond_the_long_side, corners), [0.0, 0.5, 0.5]);
/// ```
#[must_use]
pub fn closest_barycentric(x: DVec3, corners: [DVec3; 3]) -> [f64; 3] {
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    let area = ab.cross(ac).length_squared();
    if !(area > 1e-30 * ab.length_squared().max(ac.length_squared()).powi(2)) {
        return closest_on_edges(x, corners);
    }
    let (ax, bx, cx) = (x - a, x - b, x - c);
    let (d1, d2) = (ab.dot(ax), ac.dot(ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(bx), ac.dot(bx));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let (d5, d6) = (ab.dot(cx), ac.dot(cx));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    [1.0 - v - w, v, w]
}

/// The point of segment `a`–`b` nearest to `x`, as its parameter in 0..=1 (0 if `a == b`).
///
/// # Example
/// ```
/// use geom_core::{DVec3, closest_on_segment};
/// let (a, b) = (DVec3::ZERO, 4.0 * DVec3::X);
/// assert_eq!(closest_on_segment(DVec3::new(1.0, 7.0, 0.0), a, b), 0.25);
/// assert_eq!(closest_on_segment(DVec3::new(9.0, 7.0, 0.0), a, b), 1.0);
/// ```
#[must_use]
pub fn closest_on_segment(x: DVec3, a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    let length_squared = d.length_squared();
    if length_squared > 0.0 { (d.dot(x - a) / length_squared).clamp(0.0, 1.0) } else { 0.0 }
}

fn closest_on_edges(x: DVec3, corners: [DVec3; 3]) -> [f64; 3] {
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let t = closest_on_segment(x, a, b);
        let distance = x.distance_squared(a.lerp(b, t));
        if distance < best.1 {
            let mut barycentric = [0.0; 3];
            barycentric[k] = 1.0 - t;
            barycentric[(k + 1) % 3] += t;
            best = (barycentric, distance);
        }
    }
    best.0
}

fn check(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        let DVec3 { x, y, z } = positions[vertex];
        return Err(MeshError::NotFinite { vertex, x, y, z });
    }
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    if triangles.len() > (u32::MAX / 6) as usize {
        return Err(MeshError::TooLarge { corners: 3 * triangles.len() });
    }
    for (face, t) in triangles.iter().enumerate() {
        if let Some(&vertex) = t.iter().find(|&&v| v as usize >= positions.len()) {
            let (vertex, count) = (vertex as usize, positions.len());
            return Err(MeshError::NoSuchVertex { face, vertex, count });
        }
        let repeated = if t[0] == t[1] || t[0] == t[2] { Some(t[0]) } else { None };
        if let Some(vertex) = repeated.or((t[1] == t[2]).then_some(t[1])) {
            return Err(MeshError::RepeatedCorner { face, vertex: vertex as usize });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wavy(n: u32) -> TriMesh {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let positions = (0..=n)
            .flat_map(|i| {
                (0..=n).map(move |j| {
                    let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    DVec3::new(x, y, 0.2 * (7.0 * x).sin() * (5.0 * y).cos())
                })
            })
            .collect();
        let triangles = (0..n)
            .flat_map(|i| {
                (0..n).flat_map(move |j| {
                    [
                        [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                        [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]
                })
            })
            .collect();
        TriMesh::new(positions, triangles).unwrap()
    }

    #[test]
    fn foot_on_every_part_of_a_triangle() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let cases = [
            (DVec3::new(0.2, 0.3, -4.0), DVec3::new(0.2, 0.3, 0.0)),
            (DVec3::new(-1.0, -2.0, 1.0), DVec3::ZERO),
            (DVec3::new(3.0, -0.5, 0.0), DVec3::X),
            (DVec3::new(-0.1, 2.0, 0.0), DVec3::Y),
            (DVec3::new(0.4, -3.0, 2.0), DVec3::new(0.4, 0.0, 0.0)),
            (DVec3::new(-3.0, 0.6, 2.0), DVec3::new(0.0, 0.6, 0.0)),
            (DVec3::new(1.0, 1.0, 2.0), DVec3::new(0.5, 0.5, 0.0)),
        ];
        for (x, want) in cases {
            let [u, v, w] = closest_barycentric(x, corners);
            assert!((corners[0] * u + corners[1] * v + corners[2] * w).distance(want) < 1e-15);
        }
    }

    #[test]
    fn triangle_without_area_is_its_longest_edge() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X * 0.5];
        let [u, v, w] = closest_barycentric(DVec3::new(0.75, 1.0, 0.0), corners);
        let point = corners[0] * u + corners[1] * v + corners[2] * w;
        assert!(point.distance(DVec3::new(0.75, 0.0, 0.0)) < 1e-15);
    }

    #[test]
    fn tree_depth_is_logarithmic_and_every_triangle_is_in_one_leaf() {
        let mesh = wavy(40);
        let mut seen = mesh.order.clone();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(k, &t)| k == t as usize));
        let held: u32 = mesh.nodes.iter().map(|n| n.count).sum();
        assert_eq!(held as usize, mesh.triangles.len());
    }

    #[test]
    fn vertices_are_their_own_feet() {
        let mesh = wavy(12);
        for (&p, &n) in mesh.positions().iter().zip(mesh.vertex_normals()) {
            let foot = mesh.closest_point(p);
            assert!(foot.point.distance(p) < 1e-15);
            assert!(foot.normal.dot(n) > 1.0 - 1e-12);
        }
    }

    #[test]
    fn quads_are_cut_along_the_shorter_diagonal() {
        let positions = [(0.0, 0.0), (1.0, 0.0), (3.0, 3.0), (0.0, 1.0)]
            .map(|(x, y)| DVec3::new(x, y, 0.0))
            .to_vec();
        let mesh = PolyMesh::new(positions, &[[0, 1, 2, 3]]).unwrap();
        assert_eq!(TriMesh::from_poly_mesh(&mesh).triangles(), &[[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn bad_triangles_are_named() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let empty = TriMesh::new(points.clone(), vec![]).unwrap_err();
        assert_eq!(empty, MeshError::Empty);
        let out = TriMesh::new(points.clone(), vec![[0, 1, 5]]).unwrap_err();
        assert_eq!(out, MeshError::NoSuchVertex { face: 0, vertex: 5, count: 3 });
        let twice = TriMesh::new(points, vec![[0, 1, 1]]).unwrap_err();
        assert_eq!(twice, MeshError::RepeatedCorner { face: 0, vertex: 1 });
        let nan = TriMesh::new(vec![DVec3::NAN; 3], vec![[0, 1, 2]]).unwrap_err();
        assert!(matches!(nan, MeshError::NotFinite { vertex: 0, .. }));
    }

    proptest! {
        #[test]
        fn tree_finds_what_a_full_search_finds(
            x in -0.5..1.5_f64, y in -0.5..1.5_f64, z in -1.0..1.0_f64,
        ) {
            let mesh = wavy(9);
            let query = DVec3::new(x, y, z);
            let full = (0..mesh.triangles().len())
                .map(|t| {
                    let corners = mesh.corners(t);
                    let [u, v, w] = closest_barycentric(query, corners);
                    (corners[0] * u + corners[1] * v + corners[2] * w).distance_squared(query)
                })
                .fold(f64::INFINITY, f64::min);
            prop_assert_eq!(mesh.nearest(query).distance_squared, full);
        }
    }
}
