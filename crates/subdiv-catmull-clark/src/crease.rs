//! Semi-sharp creases, corners, and the masks they and the boundary ask for.

use geom_core::{HalfEdgeId, PolyMesh, VertexId};
use std::collections::HashMap;

/// Sharpness of an edge that stays sharp for ever.
pub const INFINITE_SHARPNESS: f64 = f64::INFINITY;

/// Above this sharpness an edge counts as infinitely sharp: no evaluation halves a patch oftener,
/// so that none comes near enough to see the edge turn smooth.
pub const LARGEST_SHARPNESS: f64 = MAX_DEPTH as f64;

/// How many halvings an evaluation takes at most.
pub(crate) const MAX_DEPTH: usize = 48;

/// Edge sharpness (DeRose, Kass and Truong 1998) and corners of a control mesh.
///
/// An edge of sharpness `s` uses the crease masks for `s` refinements and turns smooth
/// afterwards, or never if `s` exceeds [`LARGEST_SHARPNESS`]; boundary edges are always infinitely sharp and need no entry. A corner vertex is
/// interpolated. A boundary vertex with a single face is a corner by itself, so that the surface
/// of a regular grid with boundary is the bi-cubic B-spline with natural ends.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Creases, INFINITE_SHARPNESS, refine};
/// # let corners = (0..8).map(|k| {
/// #     DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - 1.0
/// # });
/// # let ends = [[0, 2, 3, 1], [4, 5, 7, 6]];
/// # let sides = [[0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
/// # let faces = [&ends[..], &sides].concat();
/// # let cube = PolyMesh::new(corners.collect(), &faces)?;
/// // A cube from −1 to 1 of which all edges are sharp stays a cube.
/// let mut creases = Creases::none();
/// for edge in cube.edges() {
///     creases.set(cube.origin(edge), cube.target(edge), INFINITE_SHARPNESS);
/// }
/// let once = refine(&cube, &creases)?;
/// let twice = refine(&once.mesh, &once.creases)?;
/// assert!(twice.mesh.positions().iter().all(|p| p.abs().max_element() == 1.0));
/// # Ok::<(), subdiv_catmull_clark::SubdivisionError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Creases {
    sharpness: HashMap<(u32, u32), f64>,
    corners: Vec<VertexId>,
}

impl Creases {
    /// No creases and no corners.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Sets the sharpness of the edge between two vertices; zero or less makes it smooth, more than
    /// [`LARGEST_SHARPNESS`] infinitely sharp.
    pub fn set(&mut self, a: VertexId, b: VertexId, sharpness: f64) {
        let key = (a.0.min(b.0), a.0.max(b.0));
        if sharpness > LARGEST_SHARPNESS {
            self.sharpness.insert(key, INFINITE_SHARPNESS);
        } else if sharpness > 0.0 {
            self.sharpness.insert(key, sharpness);
        } else {
            self.sharpness.remove(&key);
        }
    }

    /// Makes `v` a corner.
    pub fn set_corner(&mut self, v: VertexId) {
        if let Err(at) = self.corners.binary_search(&v) {
            self.corners.insert(at, v);
        }
    }

    /// Sharpness of an edge, boundary not considered.
    #[must_use]
    pub fn sharpness(&self, a: VertexId, b: VertexId) -> f64 {
        self.sharpness.get(&(a.0.min(b.0), a.0.max(b.0))).copied().unwrap_or(0.0)
    }

    /// Whether no edge is sharp to any degree, and no vertex a corner.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sharpness.is_empty() && self.corners.is_empty()
    }

    /// Whether `v` was made a corner.
    #[must_use]
    pub fn is_corner(&self, v: VertexId) -> bool {
        self.corners.binary_search(&v).is_ok()
    }
}

/// Creases as written in a file, by vertex numbers of the mesh.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CreaseList {
    /// Edges by their ends, with their sharpness; [`INFINITE_SHARPNESS`] stays for ever.
    pub edges: Vec<((u32, u32), f64)>,
    /// Vertices that are interpolated.
    pub corners: Vec<u32>,
}

/// Why a list of creases does not fit a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum CreaseError {
    /// Two vertices that no edge joins.
    #[error("the mesh has no edge {a}–{b} to crease; name the two ends of an edge")]
    NoEdge { a: u32, b: u32 },
    /// A vertex number beyond the last.
    #[error("the creases name vertex {vertex}, but there are only {count}, numbered from 0")]
    NoVertex { vertex: u32, count: usize },
    /// A sharpness that is negative or not a number.
    #[error("edge {a}–{b} has sharpness {sharpness}; give a number from 0 up, or inf")]
    Sharpness { a: u32, b: u32, sharpness: f64 },
}

impl CreaseList {
    /// What is to be said if a finite sharpness counts as infinite.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        let above = |s: f64| s > LARGEST_SHARPNESS && s != INFINITE_SHARPNESS;
        let ((a, b), sharpness) = *self.edges.iter().find(|(_, s)| above(*s))?;
        Some(format!(
            "edge {a}–{b} has sharpness {sharpness:e}; above {LARGEST_SHARPNESS} an edge counts as \
             infinitely sharp"
        ))
    }

    /// The creases, checked against a mesh.
    ///
    /// # Errors
    /// [`CreaseError`] names the first entry at fault.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, PolyMesh, VertexId};
    /// use subdiv_catmull_clark::CreaseList;
    /// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let quad = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
    /// let side = CreaseList { edges: vec![((0, 1), 2.5)], corners: vec![3] }.for_mesh(&quad)?;
    /// assert_eq!(side.sharpness(VertexId(1), VertexId(0)), 2.5);
    /// let diagonal = CreaseList { edges: vec![((0, 2), 2.5)], corners: vec![] };
    /// assert_eq!(
    ///     diagonal.for_mesh(&quad).unwrap_err().to_string(),
    ///     "the mesh has no edge 0–2 to crease; name the two ends of an edge"
    /// );
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn for_mesh(&self, mesh: &PolyMesh) -> Result<Creases, CreaseError> {
        let count = mesh.vertex_count();
        let known = |vertex: u32| {
            let beyond = CreaseError::NoVertex { vertex, count };
            if (vertex as usize) < count { Ok(VertexId(vertex)) } else { Err(beyond) }
        };
        let mut creases = Creases::none();
        for &((a, b), sharpness) in &self.edges {
            let (from, to) = (known(a)?, known(b)?);
            if mesh.half_edge_between(from, to).is_none() {
                return Err(CreaseError::NoEdge { a, b });
            }
            if !(sharpness >= 0.0) {
                return Err(CreaseError::Sharpness { a, b, sharpness });
            }
            creases.set(from, to, sharpness);
        }
        for &v in &self.corners {
            creases.set_corner(known(v)?);
        }
        Ok(creases)
    }
}

/// What the masks need to know about a mesh besides its connectivity: sharpness and the mask of
/// Biermann, Levin and Zorin (2000) per half-edge, corner marks per vertex.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tags {
    /// Per half-edge, the same on both sides of an edge.
    pub(crate) sharpness: Vec<f64>,
    /// Per half-edge: how much the weight of its origin in the edge mask exceeds 3/8 (and that of
    /// its target falls short of it), because the origin is an extraordinary crease vertex.
    pub(crate) shift: Vec<f64>,
    pub(crate) corner: Vec<bool>,
}

impl Tags {
    pub(crate) fn new(mesh: &PolyMesh, creases: &Creases) -> Self {
        let mut tags = Self {
            sharpness: vec![0.0; mesh.half_edge_count()],
            shift: vec![0.0; mesh.half_edge_count()],
            corner: mesh.vertices().map(|v| creases.is_corner(v)).collect(),
        };
        for h in mesh.edges() {
            let s = if mesh.is_boundary_edge(h) {
                INFINITE_SHARPNESS
            } else {
                creases.sharpness(mesh.origin(h), mesh.target(h))
            };
            tags.sharpness[h.index()] = s;
            tags.sharpness[mesh.twin(h).index()] = s;
        }
        for v in mesh.vertices() {
            if mesh.is_boundary_vertex(v) && mesh.valence(v) == 2 {
                tags.corner[v.index()] = true;
            }
        }
        for v in mesh.vertices() {
            tags.shift_sectors(mesh, v);
        }
        tags
    }

    /// Sets the shifts of the smooth edges at `v`: `cos(θ_k)/4`, from γ = 3/8 − cos(θ_k)/4 of
    /// Biermann et al. 2000 (sec. 3.2), in a sector of `k` faces between two infinitely sharp edges.
    fn shift_sectors(&mut self, mesh: &PolyMesh, v: VertexId) {
        let infinite = |tags: &Self, h: HalfEdgeId| tags.sharpness[h.index()] == INFINITE_SHARPNESS;
        let sharp: Vec<HalfEdgeId> =
            mesh.outgoing_half_edges(v).filter(|&h| infinite(self, h)).collect();
        if sharp.len() < 2 {
            return;
        }
        let crease = sharp.len() == 2 && !self.corner[v.index()];
        let mut inside = Vec::new();
        for &first in sharp.iter().filter(|&&h| mesh.face(h).is_some()) {
            inside.clear();
            let mut at = mesh.twin(mesh.prev(first));
            while !infinite(self, at) {
                inside.push(at);
                at = mesh.twin(mesh.prev(at));
            }
            let faces = (inside.len() + 1) as f64;
            // The regular sectors must come out as exact zeros: they decide what is a B-spline
            // patch.
            let shift = match crease {
                true if inside.len() == 1 => 0.0,
                true => 0.25 * (std::f64::consts::PI / faces).cos(),
                // A convex corner, taken as a right angle.
                false => 0.25 * (std::f64::consts::FRAC_PI_2 / faces).cos(),
            };
            for &h in &inside {
                if self.sharpness[h.index()] == 0.0 {
                    self.shift[h.index()] = shift;
                }
            }
        }
    }

    /// How the vertex rule of `v` mixes its smooth, crease and corner masks.
    pub(crate) fn vertex_rule(&self, mesh: &PolyMesh, v: VertexId) -> VertexRule {
        let sharpness = |h: HalfEdgeId| self.sharpness[h.index()];
        let kind = |level: f64| {
            let sharp: Vec<_> =
                mesh.outgoing_half_edges(v).filter(|&h| sharpness(h) > level).collect();
            match sharp[..] {
                _ if self.corner[v.index()] => VertexMask::Corner,
                [] | [_] => VertexMask::Smooth,
                [a, b] => VertexMask::Crease(mesh.target(a), mesh.target(b)),
                _ => VertexMask::Corner,
            }
        };
        let (now, next) = (kind(0.0), kind(1.0));
        let mut fading = 0.0;
        let mut count = 0.0;
        for h in mesh.outgoing_half_edges(v) {
            let s = sharpness(h);
            if s > 0.0 && s < 1.0 {
                fading += s;
                count += 1.0;
            }
        }
        let weight = if now == next || count == 0.0 { 1.0 } else { fading / count };
        VertexRule { now, next, weight }
    }
}

/// Masks of the new position of an old vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VertexMask {
    Smooth,
    Crease(VertexId, VertexId),
    Corner,
}

/// `weight · now + (1 − weight) · next`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexRule {
    pub(crate) now: VertexMask,
    pub(crate) next: VertexMask,
    pub(crate) weight: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::DVec3;

    #[test]
    fn lists_are_checked_against_the_mesh() {
        let mesh =
            PolyMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y], &[[0, 1, 2, 3]])
                .unwrap();
        let list =
            |a: u32, b: u32, s: f64| CreaseList { edges: vec![((a, b), s)], corners: vec![] };
        assert_eq!(
            list(0, 2, 1.0).for_mesh(&mesh).unwrap_err().to_string(),
            "the mesh has no edge 0–2 to crease; name the two ends of an edge"
        );
        assert!(matches!(
            list(0, 9, 1.0).for_mesh(&mesh),
            Err(CreaseError::NoVertex { vertex: 9, count: 4 })
        ));
        assert!(matches!(list(0, 1, f64::NAN).for_mesh(&mesh), Err(CreaseError::Sharpness { .. })));
        let creases = list(1, 0, f64::INFINITY).for_mesh(&mesh).unwrap();
        assert_eq!(creases.sharpness(VertexId(0), VertexId(1)), INFINITE_SHARPNESS);
        let huge = list(0, 1, 1e6);
        let creases = huge.for_mesh(&mesh).unwrap();
        assert_eq!(creases.sharpness(VertexId(0), VertexId(1)), INFINITE_SHARPNESS);
        assert_eq!(
            huge.note().unwrap(),
            "edge 0–1 has sharpness 1e6; above 48 an edge counts as infinitely sharp"
        );
        assert_eq!(list(0, 1, f64::INFINITY).note(), None);
    }
}
