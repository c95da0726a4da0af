//! The connectivity of a mesh: half-edges by number, and why faces may have none.

use glam::DVec3;
use std::collections::HashMap;

/// Why a list of faces is not a mesh this crate can work on.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let fault = PolyMesh::new(corners, &[[0, 1, 2], [0, 1, 3]]).unwrap_err();
/// assert_eq!(
///     fault.to_string(),
///     "faces 0 and 1 both run from vertex 0 to 1; \
///      flip one of them so that all faces are oriented alike"
/// );
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum MeshError {
    /// A NaN or an infinity among the coordinates.
    #[error("vertex {vertex} is ({x}, {y}, {z}); coordinates must be finite")]
    NotFinite { vertex: usize, x: f64, y: f64, z: f64 },
    /// A face with fewer than three corners.
    #[error("face {face} has {corners} corners; a face needs at least 3")]
    TooFewCorners { face: usize, corners: usize },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, but there are only {count}")]
    NoSuchVertex { face: usize, vertex: usize, count: usize },
    /// A face visits a vertex twice.
    #[error("face {face} visits vertex {vertex} twice; drop or split the face")]
    RepeatedCorner { face: usize, vertex: usize },
    /// More than two faces share an edge.
    #[error(
        "edge {from}–{to} has more than 2 faces ({faces:?}); split the mesh there or drop one face"
    )]
    NonManifoldEdge { from: usize, to: usize, faces: Vec<usize> },
    /// Two faces run along an edge in the same direction.
    #[error(
        "faces {first} and {second} both run from vertex {from} to {to}; flip one of them so that all faces are oriented alike"
    )]
    Flipped { from: usize, to: usize, first: usize, second: usize },
    /// The faces at a vertex form more than one fan.
    #[error("the faces at vertex {vertex} touch only at that vertex; split it in two")]
    NonManifoldVertex { vertex: usize },
    /// No face at all.
    #[error("the mesh has no face")]
    Empty,
    /// More half-edges than 32-bit ids can count.
    #[error("the mesh has {corners} face corners; at most 2^31 are supported")]
    TooLarge { corners: usize },
}

pub(crate) const NONE: u32 = u32::MAX;

/// How many faces of a non-manifold edge an error names.
const NAMED_FACES: usize = 8;

/// The connectivity: half-edges by number.
#[derive(Debug, PartialEq)]
pub(crate) struct Links {
    pub(crate) origin: Vec<u32>,
    pub(crate) next: Vec<u32>,
    pub(crate) prev: Vec<u32>,
    pub(crate) twin: Vec<u32>,
    pub(crate) face: Vec<u32>,
    pub(crate) face_start: Vec<u32>,
    // For a boundary vertex the half-edge that leaves along the boundary loop, so that a ring
    // walk that starts here sees every face of the fan once.
    pub(crate) outgoing: Vec<u32>,
}

impl Links {
    pub(crate) fn new<F: AsRef<[u32]>>(vertices: usize, faces: &[F]) -> Result<Self, MeshError> {
        let corners: usize = faces.iter().map(|f| f.as_ref().len()).sum();
        if corners > (u32::MAX / 2) as usize {
            return Err(MeshError::TooLarge { corners });
        }
        let mut links = Self {
            outgoing: vec![NONE; vertices],
            origin: Vec::with_capacity(corners),
            next: Vec::with_capacity(corners),
            prev: Vec::with_capacity(corners),
            twin: vec![NONE; corners],
            face: Vec::with_capacity(corners),
            face_start: Vec::with_capacity(faces.len() + 1),
        };
        links.push_faces(faces);
        links.match_twins()?;
        links.close_boundaries()?;
        links.choose_outgoing()?;
        Ok(links)
    }

    fn push_faces<F: AsRef<[u32]>>(&mut self, faces: &[F]) {
        for (f, corners) in faces.iter().enumerate() {
            let corners = corners.as_ref();
            let (start, n) = (self.origin.len() as u32, corners.len() as u32);
            self.face_start.push(start);
            for k in 0..n {
                self.origin.push(corners[k as usize]);
                self.next.push(start + (k + 1) % n);
                self.prev.push(start + (k + n - 1) % n);
                self.face.push(f as u32);
            }
        }
        self.face_start.push(self.origin.len() as u32);
    }

    fn match_twins(&mut self) -> Result<(), MeshError> {
        let mut by_ends: HashMap<(u32, u32), u32> = HashMap::with_capacity(self.origin.len());
        for h in 0..self.origin.len() as u32 {
            let ends = (self.origin[h as usize], self.origin[self.next[h as usize] as usize]);
            if let Some(&other) = by_ends.get(&ends) {
                return Err(self.edge_error(ends, other, h));
            }
            by_ends.insert(ends, h);
        }
        for h in 0..self.origin.len() {
            let ends = (self.origin[self.next[h] as usize], self.origin[h]);
            if let Some(&twin) = by_ends.get(&ends) {
                self.twin[h] = twin;
            }
        }
        Ok(())
    }

    /// Two faces run along `ends` in the same direction: one flipped face, or three on one edge.
    fn edge_error(&self, ends: (u32, u32), first: u32, second: u32) -> MeshError {
        let on_edge = |h: &usize| {
            let (a, b) = (self.origin[*h], self.origin[self.next[*h] as usize]);
            (a, b) == ends || (b, a) == ends
        };
        // A few are enough to find the place, however many there are.
        let faces = (0..self.origin.len()).filter(on_edge).map(|h| self.face[h] as usize);
        let faces: Vec<usize> = faces.take(NAMED_FACES).collect();
        let (from, to) = (ends.0 as usize, ends.1 as usize);
        if faces.len() > 2 {
            return MeshError::NonManifoldEdge { from, to, faces };
        }
        let (first, second) = (self.face[first as usize], self.face[second as usize]);
        MeshError::Flipped { from, to, first: first as usize, second: second as usize }
    }

    fn close_boundaries(&mut self) -> Result<(), MeshError> {
        let inner = self.origin.len() as u32;
        let mut leaving: HashMap<u32, u32> = HashMap::new();
        for h in 0..inner {
            if self.twin[h as usize] != NONE {
                continue;
            }
            let b = self.origin.len() as u32;
            let start = self.origin[self.next[h as usize] as usize];
            self.origin.push(start);
            self.face.push(NONE);
            self.twin.push(h);
            self.next.push(NONE);
            self.prev.push(NONE);
            self.twin[h as usize] = b;
            if leaving.insert(start, b).is_some() {
                return Err(MeshError::NonManifoldVertex { vertex: start as usize });
            }
        }
        for b in inner..self.origin.len() as u32 {
            let end = self.origin[self.twin[b as usize] as usize];
            let next = leaving[&end];
            self.next[b as usize] = next;
            self.prev[next as usize] = b;
        }
        Ok(())
    }

    fn choose_outgoing(&mut self) -> Result<(), MeshError> {
        let mut degree = vec![0_u32; self.outgoing.len()];
        for h in 0..self.origin.len() {
            let v = self.origin[h] as usize;
            degree[v] += 1;
            if self.outgoing[v] == NONE || self.face[h] == NONE {
                self.outgoing[v] = h as u32;
            }
        }
        for (v, &first) in self.outgoing.iter().enumerate() {
            // All half-edges around a vertex are met from one of them.
            let around = |&h: &u32| {
                let following = self.next[self.twin[h as usize] as usize];
                (following != first).then_some(following)
            };
            let begin = (first != NONE).then_some(first);
            if std::iter::successors(begin, around).count() != degree[v] as usize {
                return Err(MeshError::NonManifoldVertex { vertex: v });
            }
        }
        Ok(())
    }
}

pub(crate) fn check_faces<F: AsRef<[u32]>>(
    positions: &[DVec3],
    faces: &[F],
) -> Result<(), MeshError> {
    if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
        let DVec3 { x, y, z } = positions[vertex];
        return Err(MeshError::NotFinite { vertex, x, y, z });
    }
    if faces.is_empty() {
        return Err(MeshError::Empty);
    }
    for (face, corners) in faces.iter().enumerate() {
        let corners = corners.as_ref();
        if corners.len() < 3 {
            return Err(MeshError::TooFewCorners { face, corners: corners.len() });
        }
        let mut sorted = corners.to_vec();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(MeshError::RepeatedCorner { face, vertex: pair[0] as usize });
        }
        let largest = sorted[sorted.len() - 1] as usize;
        if largest >= positions.len() {
            return Err(MeshError::NoSuchVertex { face, vertex: largest, count: positions.len() });
        }
    }
    Ok(())
}
