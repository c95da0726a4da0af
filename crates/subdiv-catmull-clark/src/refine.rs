//! One step of Catmull-Clark refinement, as connectivity and as a sparse matrix.

use crate::crease::{Creases, INFINITE_SHARPNESS, Tags, VertexMask};
use geom_core::{DVec3, HalfEdgeId, MeshError, PolyMesh, VertexId};

/// A sparse matrix that makes new points from old ones; every row sums to one.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Creases, refine};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
/// let quad = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
/// let stencils = refine(&quad, &Creases::none())?.stencils;
/// // The last new point is the middle of the face.
/// assert_eq!(stencils.row(8), (&[0, 1, 2, 3][..], &[0.25; 4][..]));
/// // Refined again with other positions, at the cost of a product.
/// let raised: Vec<DVec3> = quad.positions().iter().map(|p| *p + DVec3::Z).collect();
/// assert_eq!(stencils.apply(&raised)[8], DVec3::new(0.5, 0.5, 1.0));
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stencils {
    starts: Vec<usize>,
    columns: Vec<u32>,
    weights: Vec<f64>,
}

impl Stencils {
    fn with_capacity(rows: usize, entries: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self { starts, columns: Vec::with_capacity(entries), weights: Vec::with_capacity(entries) }
    }

    fn push(&mut self, row: &mut Vec<(u32, f64)>) {
        row.sort_by_key(|&(column, _)| column);
        for &(column, weight) in row.iter() {
            let fresh = self.columns.len() == self.starts[self.starts.len() - 1]
                || self.columns[self.columns.len() - 1] != column;
            if fresh {
                self.columns.push(column);
                self.weights.push(weight);
            } else if let Some(last) = self.weights.last_mut() {
                *last += weight;
            }
        }
        self.starts.push(self.columns.len());
        row.clear();
    }

    /// Number of new points.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Old points and weights of new point `i`, sorted by index.
    #[must_use]
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.columns[range.clone()], &self.weights[range])
    }

    /// The new points.
    ///
    /// # Panics
    /// If `old` is shorter than the largest index.
    #[must_use]
    pub fn apply(&self, old: &[DVec3]) -> Vec<DVec3> {
        (0..self.rows())
            .map(|i| {
                let (columns, weights) = self.row(i);
                columns.iter().zip(weights).map(|(&c, &w)| w * old[c as usize]).sum()
            })
            .collect()
    }
}

/// A refined control mesh and how its points come from the old ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// The new control mesh, all quads: first the old vertices, then one per edge (in the order of
    /// [`PolyMesh::edges`]), then one per face.
    pub mesh: PolyMesh,
    /// The creases that are left.
    pub creases: Creases,
    /// New points from old ones.
    pub stencils: Stencils,
}

/// One Catmull-Clark step (Catmull and Clark 1978) with creases (DeRose et al. 1998) and boundary
/// masks (Biermann et al. 2000). The limit surface stays the same.
///
/// Face `f` with `m` corners becomes `m` quads in the order of its corners, each with the old
/// corner first.
///
/// # Errors
/// [`MeshError::TooLarge`] if the result has more half-edges than ids.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Creases, refine};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let tetrahedron = PolyMesh::new(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
/// let fine = refine(&tetrahedron, &Creases::none())?.mesh;
/// // One vertex for each vertex, edge and face; one quad for each corner of a face.
/// assert_eq!((fine.vertex_count(), fine.face_count()), (4 + 6 + 4, 12));
/// assert_eq!(fine.euler_characteristic(), 2);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
pub fn refine(mesh: &PolyMesh, creases: &Creases) -> Result<Refined, MeshError> {
    let tags = Tags::new(mesh, creases);
    let (faces, stencils) = refine_tagged(mesh, &tags);
    let positions = stencils.apply(mesh.positions());
    let fine = PolyMesh::new(positions, &faces)?;
    let mut left = Creases::none();
    for v in mesh.vertices() {
        if creases.is_corner(v) {
            left.set_corner(v);
        }
    }
    for (k, h) in mesh.edges().enumerate() {
        let s = creases.sharpness(mesh.origin(h), mesh.target(h));
        if s > 1.0 {
            let middle = VertexId((mesh.vertex_count() + k) as u32);
            left.set(mesh.origin(h), middle, s - 1.0);
            left.set(middle, mesh.target(h), s - 1.0);
        }
    }
    Ok(Refined { mesh: fine, creases: left, stencils })
}

/// Number of every edge, by half-edge, in the order of [`PolyMesh::edges`].
pub(crate) fn edge_numbers(mesh: &PolyMesh) -> Vec<u32> {
    let mut numbers = vec![0; mesh.half_edge_count()];
    for (k, h) in mesh.edges().enumerate() {
        numbers[h.index()] = k as u32;
        numbers[mesh.twin(h).index()] = k as u32;
    }
    numbers
}

pub(crate) fn refine_tagged(mesh: &PolyMesh, tags: &Tags) -> (Vec<[u32; 4]>, Stencils) {
    let numbers = edge_numbers(mesh);
    let (nv, ne, nf) = (mesh.vertex_count(), mesh.edge_count(), mesh.face_count());
    let edge_point = |h: HalfEdgeId| nv as u32 + numbers[h.index()];
    let mut faces = Vec::with_capacity(4 * nf);
    for f in mesh.faces() {
        let centre = (nv + ne + f.index()) as u32;
        for h in mesh.face_half_edges(f) {
            faces.push([mesh.origin(h).0, edge_point(h), centre, edge_point(mesh.prev(h))]);
        }
    }
    let mut stencils = Stencils::with_capacity(nv + ne + nf, 12 * nv);
    let mut row = Vec::new();
    for v in mesh.vertices() {
        vertex_row(mesh, tags, v, &mut row);
        stencils.push(&mut row);
    }
    for h in mesh.edges() {
        edge_row(mesh, tags, h, &mut row);
        stencils.push(&mut row);
    }
    for f in mesh.faces() {
        add_face_point(mesh, mesh.face_half_edge(f), 1.0, &mut row);
        stencils.push(&mut row);
    }
    (faces, stencils)
}

fn add_face_point(mesh: &PolyMesh, h: HalfEdgeId, weight: f64, row: &mut Vec<(u32, f64)>) {
    if let Some(f) = mesh.face(h) {
        let share = weight / mesh.face_degree(f) as f64;
        row.extend(mesh.face_vertices(f).map(|v| (v.0, share)));
    }
}

fn vertex_row(mesh: &PolyMesh, tags: &Tags, v: VertexId, row: &mut Vec<(u32, f64)>) {
    let rule = tags.vertex_rule(mesh, v);
    for (mask, weight) in [(rule.now, rule.weight), (rule.next, 1.0 - rule.weight)] {
        if weight == 0.0 {
            continue;
        }
        match mask {
            VertexMask::Corner => row.push((v.0, weight)),
            VertexMask::Crease(a, b) => {
                row.extend([(v.0, 0.75 * weight), (a.0, 0.125 * weight), (b.0, 0.125 * weight)]);
            }
            VertexMask::Smooth if mesh.outgoing(v).is_none() => row.push((v.0, weight)),
            VertexMask::Smooth => {
                // (Q + 2R + (n − 3) v) / n, Q the mean of the face points, R of the edge midpoints.
                let n = mesh.valence(v) as f64;
                row.push((v.0, weight * (n - 3.0) / n));
                let share = weight / (n * n);
                for h in mesh.outgoing_half_edges(v) {
                    row.extend([(v.0, share), (mesh.target(h).0, share)]);
                    add_face_point(mesh, h, share, row);
                }
            }
        }
    }
}

fn edge_row(mesh: &PolyMesh, tags: &Tags, h: HalfEdgeId, row: &mut Vec<(u32, f64)>) {
    let (a, b, twin) = (mesh.origin(h).0, mesh.target(h).0, mesh.twin(h));
    let sharp = tags.sharpness[h.index()].clamp(0.0, 1.0);
    if sharp > 0.0 {
        row.extend([(a, 0.5 * sharp), (b, 0.5 * sharp)]);
    }
    let smooth = 1.0 - sharp;
    if smooth > 0.0 {
        // Both ends may be extraordinary crease vertices: their shifts then act against each other.
        let shift = tags.shift[h.index()] - tags.shift[twin.index()];
        row.extend([(a, smooth * (0.25 + shift)), (b, smooth * (0.25 - shift))]);
        add_face_point(mesh, h, 0.25 * smooth, row);
        add_face_point(mesh, twin, 0.25 * smooth, row);
    }
}

/// Sharpness left after one step.
pub(crate) fn next_sharpness(s: f64) -> f64 {
    if s == INFINITE_SHARPNESS { s } else { (s - 1.0).max(0.0) }
}
