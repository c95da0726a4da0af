//! One step of Catmull-Clark refinement, as connectivity and as a sparse matrix.

use crate::crease::{Creases, INFINITE_SHARPNESS, Tags, VertexMask};
use crate::error::SubdivisionError;
use crate::stencils::Stencils;
use geom_core::{HalfEdgeId, PolyMesh, VertexId};

/// Weights one refinement may have, 12 bytes each.
const MAX_WEIGHTS: usize = 1 << 27;

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
/// [`SubdivisionError::TooManyWeights`] if a face has thousands of corners, or
/// [`SubdivisionError::Mesh`] if the result has more half-edges than ids.
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
/// # Ok::<(), subdiv_catmull_clark::SubdivisionError>(())
/// ```
pub fn refine(mesh: &PolyMesh, creases: &Creases) -> Result<Refined, SubdivisionError> {
    check_weights(mesh)?;
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

/// Refuses what would fill the memory: a face of `m` corners writes `m` weights into each of the
/// `2 m` rows of its corners and edges.
fn check_weights(mesh: &PolyMesh) -> Result<(), SubdivisionError> {
    let square = |f| mesh.face_degree(f).saturating_mul(mesh.face_degree(f));
    let weights = mesh.faces().fold(0_usize, |sum, f| sum.saturating_add(2 * square(f)));
    match mesh.faces().max_by_key(|&f| mesh.face_degree(f)) {
        Some(f) if weights > MAX_WEIGHTS => Err(SubdivisionError::TooManyWeights {
            face: f.index(),
            corners: mesh.face_degree(f),
            weights,
            most: MAX_WEIGHTS,
        }),
        _ => Ok(()),
    }
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
