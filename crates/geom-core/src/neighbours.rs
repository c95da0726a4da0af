//! The vertices around a vertex, ring by ring, at a bounded cost.

use crate::poly_mesh::{HalfEdgeId, PolyMesh, VertexId};

/// Edges of the vertex itself that are followed, evenly spread if it has more.
const MOST_SPOKES: usize = 64;
/// Of a neighbour with more edges than this in all, those next to the way it was reached on.
const NEAR_SPOKES: usize = 32;
/// Of a face with more corners than this in all, those next to the corner.
const NEAR_CORNERS: usize = 32;
/// No further ring is added to so many vertices.
const ENOUGH: usize = 600;

/// Walks around the vertices of one mesh.
pub(crate) struct Neighbours<'m> {
    mesh: &'m PolyMesh,
    valences: Vec<u32>,
}

impl<'m> Neighbours<'m> {
    pub(crate) fn new(mesh: &'m PolyMesh) -> Self {
        // Counted in one sweep: walking around a vertex of a thousand edges takes a thousand steps.
        let mut valences = vec![0; mesh.vertex_count()];
        for h in mesh.edges() {
            valences[mesh.origin(h).index()] += 1;
            valences[mesh.target(h).index()] += 1;
        }
        Self { mesh, valences }
    }

    /// Vertices of the faces around `v`, of the faces around those, and so on for so many rings,
    /// in rising order and without `v`.
    ///
    /// Of vertices with more than 32 edges and of faces with more than 32 corners, which may have
    /// all of a mesh around them, only the parts next to `v` count.
    pub(crate) fn rings(&self, v: VertexId, rings: usize) -> Vec<VertexId> {
        let mut found: Vec<(VertexId, HalfEdgeId)> = Vec::new();
        let stride = (self.valences[v.index()] as usize).div_ceil(MOST_SPOKES).max(1);
        for h in self.mesh.outgoing_half_edges(v).step_by(stride) {
            self.corners(h, &mut found);
        }
        tidy(&mut found);
        for _ in 1..rings {
            if found.len() > ENOUGH {
                break;
            }
            let mut next = Vec::with_capacity(8 * found.len());
            for &(w, arrived) in &found {
                self.around(w, arrived, &mut next);
            }
            tidy(&mut next);
            found = next;
        }
        found.into_iter().map(|(w, _)| w).filter(|w| *w != v).collect()
    }

    /// The corners of the faces at `w`, which the half-edge `arrived` leaves.
    fn around(&self, w: VertexId, arrived: HalfEdgeId, out: &mut Vec<(VertexId, HalfEdgeId)>) {
        let mesh = self.mesh;
        if self.valences[w.index()] as usize <= NEAR_SPOKES {
            for h in mesh.outgoing_half_edges(w) {
                self.corners(h, out);
            }
            return;
        }
        let (mut left, mut right) = (arrived, arrived);
        self.corners(arrived, out);
        for _ in 0..NEAR_SPOKES / 2 {
            left = mesh.twin(mesh.prev(left));
            right = mesh.next(mesh.twin(right));
            self.corners(left, out);
            self.corners(right, out);
        }
    }

    /// The corners of the face on the left of `h`, as half-edges that leave them.
    fn corners(&self, h: HalfEdgeId, out: &mut Vec<(VertexId, HalfEdgeId)>) {
        let mesh = self.mesh;
        let Some(face) = mesh.face(h) else { return };
        let count = mesh.face_degree(face);
        if count <= NEAR_CORNERS {
            out.extend(mesh.face_half_edges(face).map(|h| (mesh.origin(h), h)));
            return;
        }
        let (mut before, mut after) = (h, h);
        out.push((mesh.origin(h), h));
        for _ in 0..NEAR_CORNERS / 2 {
            before = mesh.prev(before);
            after = mesh.next(after);
            out.push((mesh.origin(before), before));
            out.push((mesh.origin(after), after));
        }
    }
}

fn tidy(found: &mut Vec<(VertexId, HalfEdgeId)>) {
    found.sort_unstable();
    found.dedup_by_key(|(v, _)| *v);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn rings_of_a_grid_are_squares() {
        let positions = (0..81).map(|k| DVec3::new(f64::from(k / 9), f64::from(k % 9), 0.0));
        let faces: Vec<[u32; 4]> =
            (0..64).map(|k| (k / 8) * 9 + k % 8).map(|k| [k, k + 9, k + 10, k + 1]).collect();
        let mesh = PolyMesh::new(positions.collect(), &faces).unwrap();
        let neighbours = Neighbours::new(&mesh);
        for (rings, count) in [(1, 8), (2, 24), (3, 48)] {
            assert_eq!(neighbours.rings(VertexId(40), rings).len(), count);
        }
        assert_eq!(neighbours.rings(VertexId(0), 2).len(), 8);
        assert_eq!(neighbours.rings(VertexId(0), 1), [1, 9, 10].map(VertexId));
    }

    #[test]
    fn a_hub_of_thousands_of_faces_is_no_ring_of_all_of_them() {
        let n = 4_000_u32;
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
        let mut positions = vec![DVec3::ZERO];
        positions.extend((0..n).map(|k| DVec3::new(angle(k).cos(), angle(k).sin(), 0.0)));
        let faces: Vec<[u32; 3]> = (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect();
        let mesh = PolyMesh::new(positions.clone(), &faces).unwrap();
        let neighbours = Neighbours::new(&mesh);
        let total: usize = mesh.vertices().map(|v| neighbours.rings(v, 2).len()).sum();
        assert!(total < 200 * n as usize, "{total}");
        // So it is with one face of as many corners.
        let polygon = PolyMesh::new(positions, &[(1..=n).collect::<Vec<u32>>()]).unwrap();
        let neighbours = Neighbours::new(&polygon);
        let total: usize = polygon.vertices().map(|v| neighbours.rings(v, 2).len()).sum();
        assert!(total < 200 * n as usize, "{total}");
    }
}
