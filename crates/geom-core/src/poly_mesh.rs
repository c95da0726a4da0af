//! Polygon meshes: quads, triangles and larger faces, with or without boundary.

use crate::half_edges::{Links, MeshError, NONE, check_faces};
use glam::DVec3;
use std::sync::Arc;

/// Index of a vertex of a [`PolyMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VertexId(pub u32);

/// Index of a face of a [`PolyMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FaceId(pub u32);

/// Index of a half-edge of a [`PolyMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct HalfEdgeId(pub u32);

impl VertexId {
    /// As an index into per-vertex arrays.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl FaceId {
    /// As an index into per-face arrays.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl HalfEdgeId {
    /// As an index into per-half-edge arrays.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// An oriented manifold polygon mesh as half-edges; vertices without a face are allowed.
///
/// Half-edges of faces come first, face by face and in the order of its corners, so that
/// `face_half_edge(f)` starts at the first corner given; the half-edges along the boundary
/// follow. Positions may be changed freely, the connectivity never changes.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh, VertexId};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let tetrahedron = PolyMesh::new(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
/// assert_eq!((tetrahedron.edge_count(), tetrahedron.euler_characteristic()), (6, 2));
/// assert!(!tetrahedron.is_boundary_vertex(VertexId(0)));
/// // Edges as pairs of points, to draw them.
/// let length = |h| {
///     let (from, to) = (tetrahedron.origin(h), tetrahedron.target(h));
///     tetrahedron.position(from).distance(tetrahedron.position(to))
/// };
/// let total: f64 = tetrahedron.edges().map(length).sum();
/// assert!((total - (3.0 + 3.0 * 2.0_f64.sqrt())).abs() < 1e-14);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PolyMesh {
    positions: Vec<DVec3>,
    /// Shared by all copies of a mesh: a copy costs its positions.
    links: Arc<Links>,
}

impl PolyMesh {
    /// Builds the connectivity of `faces` (corners counter-clockwise seen from outside).
    ///
    /// # Errors
    /// [`MeshError`] names the first face, edge or vertex at fault.
    pub fn new<F: AsRef<[u32]>>(positions: Vec<DVec3>, faces: &[F]) -> Result<Self, MeshError> {
        check_faces(&positions, faces)?;
        let links = Arc::new(Links::new(positions.len(), faces)?);
        Ok(Self { positions, links })
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of faces.
    #[must_use]
    pub fn face_count(&self) -> usize {
        self.links.face_start.len() - 1
    }

    /// Number of half-edges, those along the boundary included.
    #[must_use]
    pub fn half_edge_count(&self) -> usize {
        self.links.origin.len()
    }

    /// Number of edges.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.links.origin.len() / 2
    }

    /// Positions, indexed by vertex.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Positions to be changed in place.
    pub fn positions_mut(&mut self) -> &mut [DVec3] {
        &mut self.positions
    }

    /// Position of one vertex.
    #[must_use]
    pub fn position(&self, v: VertexId) -> DVec3 {
        self.positions[v.index()]
    }

    /// All vertices.
    pub fn vertices(&self) -> impl ExactSizeIterator<Item = VertexId> + use<> {
        (0..self.positions.len() as u32).map(VertexId)
    }

    /// All faces.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = FaceId> + use<> {
        (0..self.face_count() as u32).map(FaceId)
    }

    /// One half-edge per edge: the one with the smaller index, so never one along the boundary.
    pub fn edges(&self) -> impl Iterator<Item = HalfEdgeId> + '_ {
        (0..self.links.origin.len() as u32)
            .filter(|&h| h < self.links.twin[h as usize])
            .map(HalfEdgeId)
    }

    /// The next half-edge around the face or boundary loop.
    #[must_use]
    pub fn next(&self, h: HalfEdgeId) -> HalfEdgeId {
        HalfEdgeId(self.links.next[h.index()])
    }

    /// The previous half-edge around the face or boundary loop.
    #[must_use]
    pub fn prev(&self, h: HalfEdgeId) -> HalfEdgeId {
        HalfEdgeId(self.links.prev[h.index()])
    }

    /// The half-edge of the same edge in the other direction.
    #[must_use]
    pub fn twin(&self, h: HalfEdgeId) -> HalfEdgeId {
        HalfEdgeId(self.links.twin[h.index()])
    }

    /// The vertex the half-edge leaves.
    #[must_use]
    pub fn origin(&self, h: HalfEdgeId) -> VertexId {
        VertexId(self.links.origin[h.index()])
    }

    /// The vertex the half-edge enters.
    #[must_use]
    pub fn target(&self, h: HalfEdgeId) -> VertexId {
        self.origin(self.twin(h))
    }

    /// The face on the left, or `None` along the boundary.
    #[must_use]
    pub fn face(&self, h: HalfEdgeId) -> Option<FaceId> {
        let face = self.links.face[h.index()];
        (face != NONE).then_some(FaceId(face))
    }

    /// The half-edge that leaves the first corner of a face.
    #[must_use]
    pub fn face_half_edge(&self, f: FaceId) -> HalfEdgeId {
        HalfEdgeId(self.links.face_start[f.index()])
    }

    /// Half-edges of a face, from its first corner on.
    pub fn face_half_edges(&self, f: FaceId) -> impl ExactSizeIterator<Item = HalfEdgeId> + use<> {
        (self.links.face_start[f.index()]..self.links.face_start[f.index() + 1]).map(HalfEdgeId)
    }

    /// Corners of a face, in the order given to `new`.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, FaceId, PolyMesh};
    /// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let quad = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
    /// let centre = quad.face_vertices(FaceId(0)).map(|v| quad.position(v)).sum::<DVec3>() / 4.0;
    /// assert_eq!(centre, DVec3::new(0.5, 0.5, 0.0));
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    #[must_use]
    pub fn face_vertices(&self, f: FaceId) -> FaceCorners<'_> {
        let range = self.links.face_start[f.index()] as usize
            ..self.links.face_start[f.index() + 1] as usize;
        FaceCorners(self.links.origin[range].iter())
    }

    /// Number of corners of a face.
    #[must_use]
    pub fn face_degree(&self, f: FaceId) -> usize {
        (self.links.face_start[f.index() + 1] - self.links.face_start[f.index()]) as usize
    }

    /// Whether every face has four corners.
    #[must_use]
    pub fn is_quad_mesh(&self) -> bool {
        self.faces().all(|f| self.face_degree(f) == 4)
    }

    /// The half-edge a walk around `v` starts with, `None` if no face uses the vertex. At the
    /// boundary it is the half-edge that leaves along the boundary loop.
    #[must_use]
    pub fn outgoing(&self, v: VertexId) -> Option<HalfEdgeId> {
        let h = self.links.outgoing[v.index()];
        (h != NONE).then_some(HalfEdgeId(h))
    }

    /// Half-edges that leave `v`, clockwise (each one is `next(twin(..))` of the one before); at
    /// the boundary the first runs along the boundary loop.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh, VertexId};
    /// use std::f64::consts::{FRAC_PI_2, TAU};
    /// // The angle that three right angles at the corner of a tetrahedron lack.
    /// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    /// let mesh = PolyMesh::new(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
    /// let angle = |h| {
    ///     let (after, before) = (mesh.target(h), mesh.origin(mesh.prev(h)));
    ///     mesh.position(after).angle_between(mesh.position(before))
    /// };
    /// let sum: f64 = mesh.outgoing_half_edges(VertexId(0)).map(angle).sum();
    /// assert!((TAU - sum - FRAC_PI_2).abs() < 1e-14);
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    pub fn outgoing_half_edges(&self, v: VertexId) -> impl Iterator<Item = HalfEdgeId> + '_ {
        let first = self.outgoing(v);
        let mut at = first;
        std::iter::from_fn(move || {
            let h = at?;
            let following = self.next(self.twin(h));
            at = (Some(following) != first).then_some(following);
            Some(h)
        })
    }

    /// Neighbours of `v` along edges, in the order of [`Self::outgoing_half_edges`].
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh, VertexId};
    /// // A roof of four triangles over a square, smoothed at its apex.
    /// let base = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let corners = [&base[..], &[DVec3::new(0.3, 0.6, 1.0)]].concat();
    /// let mut roof = PolyMesh::new(corners, &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])?;
    /// let apex = VertexId(4);
    /// let sum: DVec3 = roof.ring(apex).map(|v| roof.position(v)).sum();
    /// let mean = sum / roof.valence(apex) as f64;
    /// roof.positions_mut()[apex.index()] = mean;
    /// assert_eq!(roof.position(apex), DVec3::new(0.5, 0.5, 0.0));
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    pub fn ring(&self, v: VertexId) -> impl Iterator<Item = VertexId> + '_ {
        self.outgoing_half_edges(v).map(|h| self.target(h))
    }

    /// Number of edges at `v`.
    #[must_use]
    pub fn valence(&self, v: VertexId) -> usize {
        self.outgoing_half_edges(v).count()
    }

    /// Whether `v` is on the boundary.
    #[must_use]
    pub fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.outgoing(v).is_some_and(|h| self.face(h).is_none())
    }

    /// Whether the edge of `h` has a face on one side only.
    #[must_use]
    pub fn is_boundary_edge(&self, h: HalfEdgeId) -> bool {
        self.face(h).is_none() || self.face(self.twin(h)).is_none()
    }

    /// The boundary loops, each as its half-edges in order (the surface on their right).
    #[must_use]
    pub fn boundary_loops(&self) -> Vec<Vec<HalfEdgeId>> {
        let first_boundary = self.links.face_start[self.face_count()];
        let mut seen = vec![false; self.links.origin.len() - first_boundary as usize];
        let mut loops = Vec::new();
        for start in first_boundary..self.links.origin.len() as u32 {
            let mut walk = Vec::new();
            let mut at = start;
            while !std::mem::replace(&mut seen[(at - first_boundary) as usize], true) {
                walk.push(HalfEdgeId(at));
                at = self.links.next[at as usize];
            }
            if !walk.is_empty() {
                loops.push(walk);
            }
        }
        loops
    }

    /// For every vertex the number of its connected component (`None` without a face), and the
    /// number of components.
    #[must_use]
    pub fn components(&self) -> (Vec<Option<usize>>, usize) {
        let mut component = vec![None; self.vertex_count()];
        let mut count = 0;
        let mut stack = Vec::new();
        for v in self.vertices() {
            if component[v.index()].is_some() || self.outgoing(v).is_none() {
                continue;
            }
            component[v.index()] = Some(count);
            stack.push(v);
            while let Some(w) = stack.pop() {
                for x in self.ring(w) {
                    if component[x.index()].is_none() {
                        component[x.index()] = Some(count);
                        stack.push(x);
                    }
                }
            }
            count += 1;
        }
        (component, count)
    }

    /// Euler characteristic `V − E + F` (vertices without a face are not counted).
    #[must_use]
    pub fn euler_characteristic(&self) -> i64 {
        let used = self.vertices().filter(|&v| self.outgoing(v).is_some()).count();
        used as i64 - self.edge_count() as i64 + self.face_count() as i64
    }

    /// The half-edge from `from` to `to`, if there is an edge.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, FaceId, PolyMesh, VertexId};
    /// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let quad = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
    /// let side = quad.half_edge_between(VertexId(0), VertexId(1)).expect("a side");
    /// assert_eq!((quad.face(side), quad.face(quad.twin(side))), (Some(FaceId(0)), None));
    /// assert_eq!(quad.half_edge_between(VertexId(0), VertexId(2)), None); // a diagonal
    /// # Ok::<(), geom_core::MeshError>(())
    /// ```
    #[must_use]
    pub fn half_edge_between(&self, from: VertexId, to: VertexId) -> Option<HalfEdgeId> {
        self.outgoing_half_edges(from).find(|&h| self.target(h) == to)
    }

    /// Mean edge length, in model units.
    #[must_use]
    pub fn mean_edge_length(&self) -> f64 {
        let total: f64 = self
            .edges()
            .map(|h| self.position(self.origin(h)).distance(self.position(self.target(h))))
            .sum();
        total / self.edge_count() as f64
    }
}

/// Corners of a face.
#[derive(Clone, Debug)]
pub struct FaceCorners<'a>(std::slice::Iter<'a, u32>);

impl Iterator for FaceCorners<'_> {
    type Item = VertexId;

    fn next(&mut self) -> Option<VertexId> {
        self.0.next().map(|&v| VertexId(v))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.0.size_hint()
    }
}

impl ExactSizeIterator for FaceCorners<'_> {}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u32) -> PolyMesh {
        let positions = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| DVec3::new(f64::from(i), f64::from(j), 0.0)))
            .collect();
        let at = |i, j| i * (n + 1) + j;
        let faces: Vec<[u32; 4]> = (0..n)
            .flat_map(|i| {
                (0..n).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            })
            .collect();
        PolyMesh::new(positions, &faces).unwrap()
    }

    fn cube_faces() -> Vec<Vec<u32>> {
        vec![
            vec![0, 3, 2, 1],
            vec![4, 5, 6, 7],
            vec![0, 1, 5, 4],
            vec![1, 2, 6, 5],
            vec![2, 3, 7, 6],
            vec![3, 0, 4, 7],
        ]
    }

    fn points(n: u32) -> Vec<DVec3> {
        (0..n).map(|k| DVec3::new(f64::from(k), f64::from(k * k), f64::from(k % 3))).collect()
    }

    #[test]
    fn grid_has_one_boundary_loop_and_regular_inside() {
        let mesh = grid(3);
        assert_eq!(mesh.boundary_loops().len(), 1);
        assert_eq!(mesh.boundary_loops()[0].len(), 12);
        assert_eq!(mesh.euler_characteristic(), 1);
        let inner: Vec<_> = mesh.vertices().filter(|&v| !mesh.is_boundary_vertex(v)).collect();
        assert_eq!(inner.len(), 4);
        assert!(inner.iter().all(|&v| mesh.valence(v) == 4));
        assert_eq!(mesh.valence(VertexId(0)), 2);
    }

    #[test]
    fn closed_cube_has_no_boundary() {
        let mesh = PolyMesh::new(points(8), &cube_faces()).unwrap();
        assert!(mesh.boundary_loops().is_empty());
        assert_eq!(mesh.euler_characteristic(), 2);
        assert_eq!(mesh.edge_count(), 12);
        assert_eq!(mesh.components().1, 1);
        for v in mesh.vertices() {
            assert_eq!(mesh.valence(v), 3);
        }
    }

    #[test]
    fn ring_walk_is_consistent_with_faces() {
        let mesh = grid(2);
        let centre = VertexId(4);
        for h in mesh.outgoing_half_edges(centre) {
            assert_eq!(mesh.origin(h), centre);
            assert_eq!(mesh.twin(mesh.twin(h)), h);
            assert_eq!(mesh.prev(mesh.next(h)), h);
        }
    }

    #[test]
    fn every_fault_is_named() {
        let nan = PolyMesh::new(vec![DVec3::NAN; 3], &[[0, 1, 2]]).unwrap_err();
        assert!(matches!(nan, MeshError::NotFinite { vertex: 0, .. }));
        let few = PolyMesh::new(points(3), &[vec![0, 1]]).unwrap_err();
        assert_eq!(few.to_string(), "face 0 has 2 corners; a face needs at least 3");
        let out = PolyMesh::new(points(3), &[[0, 1, 7]]).unwrap_err();
        assert_eq!(out, MeshError::NoSuchVertex { face: 0, vertex: 7, count: 3 });
        let twice = PolyMesh::new(points(3), &[[0, 1, 1]]).unwrap_err();
        assert_eq!(twice, MeshError::RepeatedCorner { face: 0, vertex: 1 });
        let flipped = PolyMesh::new(points(4), &[[0, 1, 2], [1, 2, 3]]).unwrap_err();
        assert_eq!(flipped, MeshError::Flipped { from: 1, to: 2, first: 0, second: 1 });
        let fan = PolyMesh::new(points(5), &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap_err();
        assert_eq!(fan, MeshError::NonManifoldEdge { from: 0, to: 1, faces: vec![0, 1, 2] });
        let bow_tie = PolyMesh::new(points(5), &[[0, 1, 2], [0, 3, 4]]).unwrap_err();
        assert_eq!(bow_tie, MeshError::NonManifoldVertex { vertex: 0 });
        let empty = PolyMesh::new(points(5), &[] as &[[u32; 3]]).unwrap_err();
        assert_eq!(empty, MeshError::Empty);
    }

    #[test]
    fn two_closed_fans_at_one_vertex_are_refused() {
        // Two tetrahedra that share vertex 0 only.
        let faces = [
            [0, 2, 1],
            [0, 1, 3],
            [0, 3, 2],
            [1, 2, 3],
            [0, 5, 4],
            [0, 4, 6],
            [0, 6, 5],
            [4, 5, 6],
        ];
        let error = PolyMesh::new(points(7), &faces).unwrap_err();
        assert_eq!(error, MeshError::NonManifoldVertex { vertex: 0 });
    }
}
