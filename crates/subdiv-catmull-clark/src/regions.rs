//! How far the blends at the extraordinary vertices of a mesh reach.

use crate::wide::{Cell, ring_points};
use geom_core::{FaceId, HalfEdgeId, PolyMesh, VertexId};
use std::collections::HashMap;

/// Rings of a blend, unasked, and control points: each of its patches takes as long to evaluate as
/// ten others, and all its control points depend on one another, which a Gauss-Newton matrix has to
/// hold. In proportion to the distance both stay a fixed share of those of the whole mesh.
const MOST_RINGS: usize = 3;
const DISTANCE_PER_RING: usize = 10;
const MOST_POINTS: usize = 170;
const POINTS_PER_DISTANCE: f64 = 2.7;
/// How far to look for the next vertex that is not regular.
const FARTHEST: usize = 256;

/// Rings of patches of a blend around a vertex of valence `n`, the next vertex that is not regular
/// being `distance` rings away.
///
/// The wider the better: what Catmull-Clark patches `k` rings from the vertex cannot hold falls as
/// `1/k²`. But the polynomial has to follow the surface, so that the part of the way it covers
/// should fall as the mesh becomes finer, and cost sets a limit.
fn automatic_rings(n: usize, distance: usize) -> usize {
    let most_points = MOST_POINTS.max((POINTS_PER_DISTANCE * distance as f64) as usize);
    let most_rings = MOST_RINGS.max(distance / DISTANCE_PER_RING);
    let mut rings = (distance / 4 + 1).min(distance / 2).clamp(1, most_rings);
    while rings > 1 && ring_points(n, rings + 1) > most_points {
        rings -= 1;
    }
    rings
}

/// A face inside the blend of an extraordinary vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegionFace {
    /// The half-edge of the face whose origin is nearest to the vertex, in the direction of the
    /// sector's first edge.
    pub(crate) corner: HalfEdgeId,
    /// Position of that origin in the sector's grid.
    pub(crate) cell: Cell,
    /// Which sector, as a place in [`Regions::sectors`].
    pub(crate) sector: usize,
}

/// One sector of a blend of several rings.
#[derive(Clone, Debug)]
pub(crate) struct RegionSector {
    pub(crate) valence: usize,
    pub(crate) rings: usize,
    /// The half-edge from the vertex along the sector's first edge.
    pub(crate) spoke: HalfEdgeId,
    /// The vertices up to ring `rings + 1`, this sector first.
    pub(crate) vertices: Vec<u32>,
}

/// Blends of more than one ring.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regions {
    pub(crate) faces: HashMap<FaceId, RegionFace>,
    pub(crate) sectors: Vec<RegionSector>,
    /// Rings of every blended vertex.
    pub(crate) rings: Vec<usize>,
}

impl Regions {
    /// Gives each of the `blended` vertices `wanted` rings, or as many as [`automatic_rings`] says.
    /// No blend reaches farther than half the way to the next vertex that is not regular, so that
    /// no two of them overlap.
    pub(crate) fn new(
        mesh: &PolyMesh,
        blended: &[bool],
        is_regular: &dyn Fn(VertexId) -> bool,
        wanted: Option<usize>,
    ) -> Self {
        let mut this = Self::default();
        let mut seen = vec![u32::MAX; mesh.vertex_count()];
        let farthest = wanted.map_or(FARTHEST, |rings| rings.saturating_mul(2));
        for v in mesh.vertices().filter(|v| blended[v.index()]) {
            let distance = irregular_distance(mesh, v, is_regular, farthest, &mut seen);
            let mut rings = match wanted {
                Some(rings) => rings.min(distance / 2).max(1),
                None => automatic_rings(mesh.valence(v), distance),
            };
            while rings > 1 && !this.insert(mesh, v, rings) {
                rings -= 1;
            }
            this.rings.push(rings);
        }
        this
    }

    // Adds the faces of a blend; does nothing if they overlap one another.
    fn insert(&mut self, mesh: &PolyMesh, v: VertexId, rings: usize) -> bool {
        let spokes: Vec<HalfEdgeId> = spokes(mesh, v).collect();
        let first = self.sectors.len();
        let mut faces = HashMap::new();
        for (sector, &spoke) in spokes.iter().enumerate() {
            for (a, column) in straight(mesh, spoke).take(rings).enumerate() {
                for (b, corner) in upwards(mesh, column).take(rings).enumerate() {
                    let Some(face) = mesh.face(corner) else { return false };
                    let here = RegionFace { corner, cell: (a, b), sector: first + sector };
                    if self.faces.contains_key(&face) || faces.insert(face, here).is_some() {
                        return false;
                    }
                }
            }
        }
        self.faces.extend(faces);
        for k in 0..spokes.len() {
            let mut vertices = vec![v.0];
            for &spoke in spokes[k..].iter().chain(&spokes[..k]) {
                for column in straight(mesh, spoke).take(rings + 1) {
                    vertices
                        .extend(upwards(mesh, column).take(rings + 2).map(|h| mesh.target(h).0));
                }
            }
            let (valence, spoke) = (spokes.len(), spokes[k]);
            self.sectors.push(RegionSector { valence, rings, spoke, vertices });
        }
        true
    }
}

/// The half-edges that leave a vertex, counter-clockwise.
fn spokes(mesh: &PolyMesh, v: VertexId) -> impl Iterator<Item = HalfEdgeId> + '_ {
    let first = mesh.outgoing(v);
    std::iter::successors(first, move |&h| {
        let next = mesh.twin(mesh.prev(h));
        (Some(next) != first).then_some(next)
    })
}

/// A half-edge and those that continue it straight on.
fn straight(mesh: &PolyMesh, h: HalfEdgeId) -> impl Iterator<Item = HalfEdgeId> + '_ {
    std::iter::successors(Some(h), |&h| Some(mesh.next(mesh.twin(mesh.next(h)))))
}

/// A half-edge and its parallels across the quads on its left.
fn upwards(mesh: &PolyMesh, h: HalfEdgeId) -> impl Iterator<Item = HalfEdgeId> + '_ {
    std::iter::successors(Some(h), |&h| Some(mesh.twin(mesh.next(mesh.next(h)))))
}

/// In which ring around `v` the first vertex stands that is not regular, at most `farthest`.
fn irregular_distance(
    mesh: &PolyMesh,
    v: VertexId,
    is_regular: &dyn Fn(VertexId) -> bool,
    farthest: usize,
    seen: &mut [u32],
) -> usize {
    let mut ring = vec![v];
    seen[v.index()] = v.0;
    for distance in 1..farthest {
        let mut next = Vec::new();
        for &w in &ring {
            for h in mesh.outgoing_half_edges(w) {
                for u in [mesh.target(h), mesh.target(mesh.next(h))] {
                    if std::mem::replace(&mut seen[u.index()], v.0) != v.0 {
                        if !is_regular(u) {
                            return distance;
                        }
                        next.push(u);
                    }
                }
            }
        }
        if next.is_empty() {
            // The whole mesh is nearer.
            return distance;
        }
        ring = next;
    }
    farthest
}
