//! Symmetries of a control mesh, so that one fundamental domain is enough.

use geom_core::{DMat3, DVec3, HalfEdgeId, PolyMesh, VertexId};
use subdiv_catmull_clark::Creases;

/// Relative to the size of the mesh: how far a vertex may be from the image of another.
const TOLERANCE: f64 = 1e-6;
/// Faces in the largest mesh without extraordinary vertices that is searched.
const MAX_REGULAR_FACES: usize = 20_000;

/// A rotation or reflection about the mesh's centre that maps the mesh to itself.
#[derive(Clone, Debug)]
pub(crate) struct Symmetry {
    pub(crate) matrix: DMat3,
    /// Image of every vertex.
    pub(crate) vertices: Vec<u32>,
    /// Image of every face.
    pub(crate) faces: Vec<u32>,
}

/// All symmetries, the identity included.
#[derive(Clone, Debug)]
pub(crate) struct SymmetryGroup {
    pub(crate) centre: DVec3,
    pub(crate) elements: Vec<Symmetry>,
}

impl SymmetryGroup {
    /// The identity alone.
    pub(crate) fn trivial(mesh: &PolyMesh) -> Self {
        let identity = Symmetry {
            matrix: DMat3::IDENTITY,
            vertices: (0..mesh.vertex_count() as u32).collect(),
            faces: (0..mesh.face_count() as u32).collect(),
        };
        Self { centre: DVec3::ZERO, elements: vec![identity] }
    }

    /// Finds the symmetries of a connected mesh.
    ///
    /// One half-edge's image decides that of all others, so every half-edge of the right kind is
    /// tried as the image of one at a rare vertex, in both orientations. Ends with the identity alone
    /// once `stop` says so.
    pub(crate) fn detect(mesh: &PolyMesh, stop: &mut dyn FnMut() -> bool) -> Self {
        let trivial = Self::trivial(mesh);
        let count = mesh.vertex_count() as f64;
        let centre = mesh.positions().iter().copied().sum::<DVec3>() / count;
        let points: Vec<DVec3> = mesh.positions().iter().map(|&p| p - centre).collect();
        let size = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        let Some(frame) = independent_triple(&points, size) else { return trivial };
        let valence: Vec<usize> = mesh.vertices().map(|v| mesh.valence(v)).collect();
        // The rarest kind of vertex, by valence and distance from the centre.
        let kind = |v: usize| (valence[v], (points[v].length() / (size * 1e-4)).round() as i64);
        let mut frequency = std::collections::BTreeMap::new();
        for v in 0..points.len() {
            *frequency.entry(kind(v)).or_insert(0_usize) += 1;
        }
        let Some((_, &fewest)) = frequency.iter().min_by_key(|(_, n)| **n) else { return trivial };
        if fewest > 64 && mesh.face_count() > MAX_REGULAR_FACES {
            return trivial;
        }
        let Some(seed) = (0..points.len()).find(|&v| frequency[&kind(v)] == fewest) else {
            return trivial;
        };
        let search =
            Search { mesh, points: &points, valence: &valence, tolerance: TOLERANCE * size };
        let Some(first) = mesh.outgoing(VertexId(seed as u32)) else { return trivial };
        let mut elements = Vec::new();
        for v in mesh.vertices() {
            // Kinds are rounded, so neighbours of the same class are let in too.
            let (a, b) = (kind(v.index()), kind(seed));
            if a.0 != b.0 || (a.1 - b.1).abs() > 1 {
                continue;
            }
            if stop() {
                return trivial;
            }
            for h in mesh.outgoing_half_edges(v) {
                for mirrored in [false, true] {
                    if let Some(images) = search.spread(first, h, mirrored)
                        && let Some(symmetry) = search.as_matrix(&frame, images)
                    {
                        elements.push(symmetry);
                    }
                }
            }
        }
        if elements.is_empty() {
            return trivial;
        }
        // The identity first; the others in the order of the images, which is deterministic.
        elements.sort_by_key(|s| (s.vertices != trivial.elements[0].vertices, s.vertices.clone()));
        elements.dedup_by(|a, b| a.vertices == b.vertices);
        Self { centre, elements }
    }

    /// The elements whose matrices are in a declared list.
    pub(crate) fn restricted_to(mut self, matrices: &[DMat3]) -> Self {
        self.elements.retain(|s| {
            matrices.iter().chain([&DMat3::IDENTITY]).any(|m| m.abs_diff_eq(s.matrix, 1e-5))
        });
        self
    }

    /// Drops the elements that do not keep a marked set of vertices.
    pub(crate) fn keeping(mut self, marked: &[bool]) -> Self {
        self.elements.retain(|s| {
            s.vertices.iter().enumerate().all(|(v, &w)| marked[v] == marked[w as usize])
        });
        self
    }

    /// Drops the elements that do not map creases to creases of the same sharpness and corners to
    /// corners.
    pub(crate) fn keeping_creases(mut self, mesh: &PolyMesh, creases: &Creases) -> Self {
        self.elements.retain(|s| {
            let image = |v: VertexId| VertexId(s.vertices[v.index()]);
            mesh.edges().all(|h| {
                let (a, b) = (mesh.origin(h), mesh.target(h));
                creases.sharpness(a, b) == creases.sharpness(image(a), image(b))
            }) && mesh.vertices().all(|v| creases.is_corner(v) == creases.is_corner(image(v)))
        });
        self
    }

    /// For every face the size of its orbit if it is the first of it, else zero.
    pub(crate) fn face_multiplicities(&self) -> Vec<u32> {
        let faces = self.elements[0].faces.len();
        let mut out = vec![0; faces];
        let mut seen = vec![false; faces];
        for f in 0..faces {
            if !seen[f] {
                for s in &self.elements {
                    let image = s.faces[f] as usize;
                    out[f] += u32::from(!std::mem::replace(&mut seen[image], true));
                }
            }
        }
        out
    }
}

// Three vertices far from being coplanar with the centre.
fn independent_triple(points: &[DVec3], size: f64) -> Option<[usize; 3]> {
    let farthest = |score: &dyn Fn(DVec3) -> f64| {
        (0..points.len()).max_by(|&i, &j| score(points[i]).total_cmp(&score(points[j])))
    };
    let a = farthest(&|p| p.length())?;
    let b = farthest(&|p| p.cross(points[a]).length())?;
    let normal = points[a].cross(points[b]);
    let c = farthest(&|p| p.dot(normal).abs())?;
    (points[c].dot(normal).abs() > 1e-6 * size.powi(3)).then_some([a, b, c])
}

struct Search<'a> {
    mesh: &'a PolyMesh,
    points: &'a [DVec3],
    valence: &'a [usize],
    tolerance: f64,
}

impl Search<'_> {
    /// Vertex images of the automorphism that takes `from` to `to`, if there is one.
    fn spread(&self, from: HalfEdgeId, to: HalfEdgeId, mirrored: bool) -> Option<Vec<u32>> {
        let mesh = self.mesh;
        let mut image = vec![u32::MAX; mesh.half_edge_count()];
        let mut vertices = vec![u32::MAX; mesh.vertex_count()];
        let mut stack = vec![from];
        image[from.index()] = to.0;
        while let Some(h) = stack.pop() {
            let g = HalfEdgeId(image[h.index()]);
            let (v, w) = (mesh.origin(h).index(), mesh.origin(g).index());
            if vertices[v] == u32::MAX {
                let off = (self.points[v].length() - self.points[w].length()).abs();
                if self.valence[v] != self.valence[w] || off > self.tolerance {
                    return None;
                }
                vertices[v] = w as u32;
            } else if vertices[v] != w as u32 {
                return None;
            }
            // A mirrored half-edge has the image face on its right.
            let side = if mirrored { mesh.twin(g) } else { g };
            if mesh.face(h).is_none() != mesh.face(side).is_none() {
                return None;
            }
            let next = if mirrored { mesh.twin(mesh.prev(side)) } else { mesh.next(g) };
            for (a, b) in [(mesh.next(h), next), (mesh.twin(h), mesh.twin(g))] {
                if image[a.index()] == u32::MAX {
                    image[a.index()] = b.0;
                    stack.push(a);
                } else if image[a.index()] != b.0 {
                    return None;
                }
            }
        }
        vertices.iter().all(|&v| v != u32::MAX).then_some(vertices)
    }

    /// The orthogonal matrix that does the same to the positions.
    fn as_matrix(&self, frame: &[usize; 3], vertices: Vec<u32>) -> Option<Symmetry> {
        let columns = |pick: &dyn Fn(usize) -> usize| {
            DMat3::from_cols(
                self.points[pick(frame[0])],
                self.points[pick(frame[1])],
                self.points[pick(frame[2])],
            )
        };
        let matrix = columns(&|v| vertices[v] as usize) * columns(&|v| v).inverse();
        if !(matrix * matrix.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-5) {
            return None;
        }
        for (v, &w) in vertices.iter().enumerate() {
            if (matrix * self.points[v]).distance(self.points[w as usize]) > self.tolerance {
                return None;
            }
        }
        let mesh = self.mesh;
        let mut faces = Vec::with_capacity(mesh.face_count());
        for f in mesh.faces() {
            let h = mesh.face_half_edge(f);
            let id = |v: VertexId| VertexId(vertices[v.index()]);
            let g = mesh.half_edge_between(id(mesh.origin(h)), id(mesh.target(h)))?;
            let third = id(mesh.target(mesh.next(h)));
            // A mirror image lies on the other side.
            let g = if mesh.target(mesh.next(g)) == third { g } else { mesh.twin(g) };
            faces.push(mesh.face(g)?.0);
        }
        Some(Symmetry { matrix: orthonormal(matrix), vertices, faces })
    }
}

fn orthonormal(m: DMat3) -> DMat3 {
    let x = m.x_axis.normalize();
    let y = m.y_axis.reject_from(x).normalize();
    let z = x.cross(y);
    DMat3::from_cols(x, y, if z.dot(m.z_axis) < 0.0 { -z } else { z })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::quad_graphs;

    fn order(mesh: &PolyMesh) -> usize {
        let group = SymmetryGroup::detect(mesh, &mut || false);
        let faces: u32 = group.face_multiplicities().iter().sum();
        assert_eq!(faces as usize, mesh.face_count());
        for s in &group.elements {
            for (v, &w) in s.vertices.iter().enumerate() {
                let image = s.matrix * (mesh.positions()[v] - group.centre) + group.centre;
                assert!(image.distance(mesh.positions()[w as usize]) < 1e-5);
            }
        }
        group.elements.len()
    }

    #[test]
    fn groups_have_the_right_order() {
        assert_eq!(order(&quad_graphs::theta_graph(3)), 12);
        assert_eq!(order(&quad_graphs::theta_graph(4)), 16);
        assert_eq!(order(&quad_graphs::tetrahedron_graph()), 24);
        assert_eq!(order(&quad_graphs::prism_graph()), 12);
        assert_eq!(order(&quad_graphs::cube_graph()), 48);
        assert_eq!(order(&quad_graphs::torus(12, 8, 1.0, 0.4)), 48);
        assert_eq!(order(&quad_graphs::vase(10)), 20);
    }

    #[test]
    fn a_bump_breaks_the_symmetry() {
        let mut mesh = quad_graphs::theta_graph(3);
        mesh.positions_mut()[7] += DVec3::new(0.03, 0.02, -0.05);
        assert_eq!(order(&mesh), 1);
    }
}
