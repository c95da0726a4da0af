//! Quad meshes that are grids.

use crate::poly_mesh::{HalfEdgeId, PolyMesh, VertexId};

/// Why a mesh is no grid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum GridError {
    /// A face that is no quad.
    #[error("face {face} has {corners} corners; a grid has quads only, remesh it")]
    NotAQuad { face: usize, corners: usize },
    /// A vertex inside with other than four edges.
    #[error("vertex {vertex} has {valence} edges; inside a grid all have 4, cut the mesh there")]
    Irregular { vertex: usize, valence: usize },
    /// A vertex at the boundary with more than three edges.
    #[error(
        "boundary vertex {vertex} has {valence} edges; along the border of a grid there are 3, \
         or 2 at a corner; cut the mesh there"
    )]
    IrregularBoundary { vertex: usize, valence: usize },
    /// Not four corners on one border, and not a tube.
    #[error(
        "the mesh has {loops} borders and {corners} corners; a grid has one border with four \
         corners, a tube two borders without any"
    )]
    Shape { loops: usize, corners: usize },
    /// More than one piece.
    #[error("the mesh falls into pieces: {reached} of {vertices} vertices; keep one of them")]
    Pieces { reached: usize, vertices: usize },
}

/// The vertices of a quad mesh as rows and columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuadGrid {
    /// Number of vertices along u.
    pub n_u: usize,
    /// Number of vertices along v.
    pub n_v: usize,
    /// Whether the last vertex along u is joined to the first.
    pub closed_u: bool,
    /// `vertices[i * n_v + j]`; u, v and the normals of the faces are right-handed.
    pub vertices: Vec<VertexId>,
}

impl QuadGrid {
    /// Finds rows and columns: one border with four corners (vertices of two edges), of which the
    /// one with the lowest number is the origin; or a tube, closed in u.
    ///
    /// # Errors
    /// [`GridError`] names the first face or vertex that fits in no grid.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh, QuadGrid};
    /// // Two quads side by side.
    /// let at = |x: u32, y: u32| DVec3::new(f64::from(x), f64::from(y), 0.0);
    /// let points = vec![at(0, 0), at(1, 0), at(2, 0), at(0, 1), at(1, 1), at(2, 1)];
    /// let mesh = PolyMesh::new(points, &[[0, 1, 4, 3], [1, 2, 5, 4]])?;
    /// let grid = QuadGrid::of(&mesh)?;
    /// assert_eq!((grid.n_u, grid.n_v, grid.closed_u), (3, 2, false));
    /// let numbers: Vec<u32> = grid.vertices.iter().map(|v| v.0).collect();
    /// assert_eq!(numbers, [0, 3, 1, 4, 2, 5]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(mesh: &PolyMesh) -> Result<Self, GridError> {
        for f in mesh.faces() {
            let corners = mesh.face_degree(f);
            if corners != 4 {
                return Err(GridError::NotAQuad { face: f.index(), corners });
            }
        }
        let (mut corners, mut used) = (Vec::new(), 0);
        for v in mesh.vertices() {
            let (vertex, valence) = (v.index(), mesh.valence(v));
            match (mesh.is_boundary_vertex(v), valence) {
                (_, 0) => continue,
                (true, 2) => corners.push(v),
                (true, 3) | (false, 4) => {}
                (true, _) => return Err(GridError::IrregularBoundary { vertex, valence }),
                (false, _) => return Err(GridError::Irregular { vertex, valence }),
            }
            used += 1;
        }
        let loops = mesh.boundary_loops();
        let (closed_u, origin) = match (loops.len(), corners.len()) {
            (1, 4) => (false, corners[0]),
            (2, 0) => (true, mesh.origin(loops[0][0])),
            (loops, corners) => return Err(GridError::Shape { loops, corners }),
        };
        let grid = Self::walk(mesh, origin, closed_u);
        let reached = grid.vertices.len();
        if reached == used { Ok(grid) } else { Err(GridError::Pieces { reached, vertices: used }) }
    }

    fn walk(mesh: &PolyMesh, origin: VertexId, closed_u: bool) -> Self {
        let across = |h: HalfEdgeId| mesh.twin(mesh.next(h));
        let above = |h: HalfEdgeId| mesh.twin(mesh.next(mesh.next(h)));
        // The edge along the border with the surface on its left: u runs along it.
        let along_border =
            |h: &HalfEdgeId| mesh.face(*h).is_some() && mesh.face(mesh.twin(*h)).is_none();
        let first = mesh.outgoing_half_edges(origin).find(along_border);
        let mut bottom: Vec<HalfEdgeId> = first.into_iter().collect();
        while let Some(&last) = bottom.last() {
            let right = across(last);
            let next = mesh.next(right);
            if mesh.face(right).is_none() || Some(next) == first {
                break;
            }
            bottom.push(next);
        }
        let column = |start: HalfEdgeId, vertex: &dyn Fn(HalfEdgeId) -> VertexId| {
            // Below every edge of a column but the last there is a face.
            let mut list = Vec::new();
            let mut h = start;
            while mesh.face(h).is_some() {
                list.push(vertex(h));
                h = above(h);
            }
            list.push(vertex(h));
            list
        };
        let mut columns: Vec<Vec<VertexId>> =
            bottom.iter().map(|h| column(*h, &|h| mesh.origin(h))).collect();
        if let Some(&last) = bottom.last()
            && !closed_u
        {
            columns.push(column(last, &|h| mesh.target(h)));
        }
        let n_v = columns.first().map_or(0, Vec::len);
        Self { n_u: columns.len(), n_v, closed_u, vertices: columns.concat() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Vertex `i + j * n_u` at `(i, j)`, normals up; joined in u if asked.
    fn grid(n_u: u32, n_v: u32, closed: bool) -> PolyMesh {
        let positions = (0..n_u * n_v)
            .map(|k| DVec3::new(f64::from(k % n_u), f64::from(k / n_u), 0.0))
            .collect();
        let id = |i: u32, j: u32| i % n_u + j * n_u;
        let cells = if closed { n_u } else { n_u - 1 };
        let faces: Vec<[u32; 4]> = (0..cells * (n_v - 1))
            .map(|k| (k % cells, k / cells))
            .map(|(i, j)| [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)])
            .collect();
        PolyMesh::new(positions, &faces).unwrap()
    }

    #[test]
    fn rows_and_columns_are_found() {
        let mesh = grid(5, 4, false);
        let found = QuadGrid::of(&mesh).unwrap();
        assert_eq!((found.n_u, found.n_v, found.closed_u), (5, 4, false));
        for i in 0..5 {
            for j in 0..4 {
                let p = mesh.position(found.vertices[i * 4 + j]);
                assert_eq!(p, DVec3::new(i as f64, j as f64, 0.0));
            }
        }
    }

    #[test]
    fn a_tube_is_closed_in_u() {
        let found = QuadGrid::of(&grid(6, 3, true)).unwrap();
        assert_eq!((found.n_u, found.n_v, found.closed_u), (6, 3, true));
        assert_eq!(found.vertices.len(), 18);
    }

    #[test]
    fn other_meshes_are_named() {
        let mut points: Vec<DVec3> = (0..7).map(|k| DVec3::splat(f64::from(k))).collect();
        let triangle = PolyMesh::new(points.clone(), &[[0, 1, 2]]).unwrap();
        let message = QuadGrid::of(&triangle).unwrap_err().to_string();
        assert_eq!(message, "face 0 has 3 corners; a grid has quads only, remesh it");
        // Three quads around vertex 0.
        let star = [[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]];
        let star = PolyMesh::new(points.clone(), &star).unwrap();
        assert_eq!(QuadGrid::of(&star), Err(GridError::Irregular { vertex: 0, valence: 3 }));
        points.extend((0..9).map(|k| DVec3::new(f64::from(k), 1.0, 0.0)));
        // An L of three quads: vertex 4 has four edges at the boundary.
        let l = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6]];
        let l = PolyMesh::new(points.clone(), &l).unwrap();
        let error = QuadGrid::of(&l);
        assert_eq!(error, Err(GridError::IrregularBoundary { vertex: 4, valence: 4 }));
        let two = PolyMesh::new(points, &[[0, 1, 2, 3], [4, 5, 6, 7]]).unwrap();
        assert_eq!(QuadGrid::of(&two), Err(GridError::Shape { loops: 2, corners: 8 }));
    }
}
