//! Quad nets with their two families of edges, as the solvers need them.

use super::join::EdgeJoin;
use crate::Error;
use geom_core::{DVec3, FaceId, PolyMesh, VertexId};

/// One of the two families of asymptotic curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The edges 0–1 and 2–3 of every face.
    First,
    /// The edges 1–2 and 3–0 of every face.
    Second,
}

/// An edge of a net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NetEdge {
    /// Its ends.
    pub ends: [usize; 2],
    /// Its family; opposite edges of a face belong to the same one.
    pub family: Family,
    /// Whether it has one face only.
    pub boundary: bool,
}

/// An edge between two faces, with the control points around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InnerEdge {
    /// The face that runs along the edge from `b₀` to `b₃`, and the other one.
    pub faces: [usize; 2],
    /// The vertices `b₀ … b₅` of [`EdgeJoin`].
    pub b: [usize; 6],
    /// Exponent (+1 or −1) that turns the shape parameter of each face into that of its diagonal
    /// through `b₀`.
    pub exponents: [f64; 2],
}

/// An oriented quad mesh whose edges fall into two families.
///
/// Corners of every face are rotated so that the edge 0–1 belongs to the first family (kept by
/// [`QuadNet::new`]). The diagonal 0–2 of the faces is then chosen consistently over the whole
/// net, whatever its topology: families never swap along a loop, and reversing both directions
/// keeps the diagonal. Shape parameters belong to that diagonal. Interior valences are even,
/// every vertex has a face.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use hyperbolic_nets::QuadNet;
/// // Four quads on z = xy around a vertex of valence four.
/// let at = |k: u32| (f64::from(k / 3) - 1.0, f64::from(k % 3) - 1.0);
/// let points = (0..9).map(at).map(|(x, y)| DVec3::new(x, y, x * y)).collect();
/// let mesh = PolyMesh::new(points, &[[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])?;
/// let net = QuadNet::new(&mesh)?;
/// assert_eq!((net.edges().len(), net.inner_edges().len()), (12, 4));
/// assert_eq!(net.boundary().iter().filter(|is_boundary| !**is_boundary).count(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct QuadNet {
    mesh: PolyMesh,
    quads: Vec<[u32; 4]>,
    edges: Vec<NetEdge>,
    inner: Vec<InnerEdge>,
    boundary: Vec<bool>,
    colours: Option<Vec<bool>>,
    components: Vec<usize>,
}

impl QuadNet {
    /// Sorts the edges of a quad mesh into families. Vertices without a face are dropped and the
    /// others keep their order; faces keep their order and orientation.
    ///
    /// # Errors
    /// [`Error`] for faces that are not quads, odd interior valences, families that swap.
    pub fn new(mesh: &PolyMesh) -> Result<Self, Error> {
        if let Some(f) = mesh.faces().find(|&f| mesh.face_degree(f) != 4) {
            return Err(Error::NotQuad { face: f.index(), corners: mesh.face_degree(f) });
        }
        check_valences(mesh)?;
        let turned = turned_faces(mesh)?;
        let mut number = vec![u32::MAX; mesh.vertex_count()];
        let mut positions = Vec::with_capacity(mesh.vertex_count());
        for v in mesh.vertices().filter(|&v| mesh.outgoing(v).is_some()) {
            number[v.index()] = positions.len() as u32;
            positions.push(mesh.position(v));
        }
        let quads: Vec<[u32; 4]> = mesh
            .faces()
            .map(|f| {
                let c: Vec<u32> = mesh.face_vertices(f).map(|v| number[v.index()]).collect();
                let o = usize::from(turned[f.index()]);
                [c[o], c[o + 1], c[(o + 2) % 4], c[(o + 3) % 4]]
            })
            .collect();
        let mesh = PolyMesh::new(positions, &quads)
            .expect("turning corners and renumbering keeps a mesh sound");
        check_edges(&mesh)?;
        Ok(Self::assemble(mesh, quads))
    }

    fn assemble(mesh: PolyMesh, quads: Vec<[u32; 4]>) -> Self {
        let mut edges = Vec::with_capacity(mesh.edge_count());
        let mut inner = Vec::new();
        for h in mesh.edges() {
            // The half-edges of face f are 4 f, …, 4 f + 3.
            let (f, k) = (h.index() / 4, h.index() % 4);
            let family = if k % 2 == 0 { Family::First } else { Family::Second };
            let ends = [mesh.origin(h).index(), mesh.target(h).index()];
            let twin = mesh.twin(h);
            edges.push(NetEdge { ends, family, boundary: mesh.face(twin).is_none() });
            if let Some(g) = mesh.face(twin) {
                let (g, l) = (g.index(), twin.index() % 4);
                let left = |c: usize| quads[f][(k + c) % 4] as usize;
                let right = |c: usize| quads[g][(l + c) % 4] as usize;
                let sign = |corner: usize| if corner.is_multiple_of(2) { 1.0 } else { -1.0 };
                inner.push(InnerEdge {
                    faces: [f, g],
                    b: [left(0), left(3), left(2), left(1), right(3), right(2)],
                    exponents: [sign(k), sign(l + 1)],
                });
            }
        }
        let boundary = mesh.vertices().map(|v| mesh.is_boundary_vertex(v)).collect();
        let components =
            mesh.components().0.into_iter().map(|c| c.expect("every vertex has a face")).collect();
        let colours = two_colouring(&mesh);
        Self { mesh, quads, edges, inner, boundary, colours, components }
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &PolyMesh {
        &self.mesh
    }

    /// Positions, indexed by vertex.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        self.mesh.positions()
    }

    /// The same net with other positions.
    ///
    /// # Panics
    /// If there is not one position for every vertex.
    #[must_use]
    pub fn with_positions(mut self, positions: &[DVec3]) -> Self {
        self.mesh.positions_mut().copy_from_slice(positions);
        self
    }

    /// Corners of the faces; the edge 0–1 belongs to the first family.
    #[must_use]
    pub fn quads(&self) -> &[[u32; 4]] {
        &self.quads
    }

    /// All edges.
    #[must_use]
    pub fn edges(&self) -> &[NetEdge] {
        &self.edges
    }

    /// The edges between two faces.
    #[must_use]
    pub fn inner_edges(&self) -> &[InnerEdge] {
        &self.inner
    }

    /// Whether each vertex is on the boundary.
    #[must_use]
    pub fn boundary(&self) -> &[bool] {
        &self.boundary
    }

    /// An alternating colouring of the vertices, if there is one.
    ///
    /// With it the shape parameters of an exact net keep one free factor; without it they are
    /// unique.
    #[must_use]
    pub fn colours(&self) -> Option<&[bool]> {
        self.colours.as_deref()
    }

    /// The connected component of each vertex.
    #[must_use]
    pub fn components(&self) -> &[usize] {
        &self.components
    }

    /// The patches' control points around an inner edge.
    #[must_use]
    pub fn join(&self, edge: &InnerEdge, positions: &[DVec3]) -> EdgeJoin {
        EdgeJoin { b: edge.b.map(|v| positions[v]) }
    }

    /// Neighbours of a vertex in order; at the boundary the first and the last lie on it.
    pub fn ring(&self, v: usize) -> impl Iterator<Item = usize> + '_ {
        self.mesh.ring(VertexId(v as u32)).map(VertexId::index)
    }

    /// Three vertices in a row along a curve of the net, for every place where that is clear:
    /// straight on at interior vertices of valence 4, along the boundary at its vertices with 3
    /// neighbours.
    #[must_use]
    pub fn curve_triples(&self) -> Vec<[usize; 3]> {
        let mut triples = Vec::with_capacity(2 * self.boundary.len());
        for v in 0..self.boundary.len() {
            let ring: Vec<usize> = self.ring(v).collect();
            match (self.boundary[v], ring.as_slice()) {
                (false, &[a, b, c, d]) => triples.extend([[a, v, c], [b, v, d]]),
                (true, &[a, _, c]) => triples.push([a, v, c]),
                _ => {}
            }
        }
        triples
    }

    /// Four vertices in a row along a curve of the net.
    #[must_use]
    pub fn curve_quadruples(&self) -> Vec<[usize; 4]> {
        let mesh = &self.mesh;
        // Straight on: from a vertex of valence 4 across two corners, along the boundary along it.
        let straight = |h: geom_core::HalfEdgeId| {
            let v = mesh.target(h);
            let back = mesh.twin(h);
            let leaving: Vec<_> = mesh.outgoing_half_edges(v).collect();
            let at = leaving.iter().position(|&o| o == back)?;
            match (mesh.is_boundary_vertex(v), leaving.len()) {
                (false, 4) => Some(leaving[(at + 2) % 4]),
                (true, 3) if at != 1 => Some(leaving[2 - at]),
                _ => None,
            }
        };
        let mut quadruples = Vec::new();
        for h in mesh.edges() {
            if let (Some(on), Some(back)) = (straight(h), straight(mesh.twin(h))) {
                let ends = [mesh.target(back), mesh.origin(h), mesh.target(h), mesh.target(on)];
                quadruples.push(ends.map(VertexId::index));
            }
        }
        quadruples
    }

    /// Interior vertices whose valence is not 4.
    #[must_use]
    pub fn irregular_vertices(&self) -> Vec<usize> {
        let mesh = &self.mesh;
        (0..self.boundary.len())
            .filter(|&v| !self.boundary[v] && mesh.valence(VertexId(v as u32)) != 4)
            .collect()
    }

    /// Quads `(v, r_k, r_k+1, r_k+2)` of neighbours `r` of every vertex `v`, valence − 2 each:
    /// all are planar iff all vertex stars are (Shi et al. 2014, §3.2, option ii).
    #[must_use]
    pub fn star_quads(&self) -> Vec<[usize; 4]> {
        let mut quads = Vec::with_capacity(2 * self.boundary.len());
        for v in 0..self.boundary.len() {
            let ring: Vec<usize> = self.ring(v).collect();
            for k in 0..ring.len().saturating_sub(2) {
                quads.push([v, ring[k], ring[k + 1], ring[(k + 2) % ring.len()]]);
            }
        }
        quads
    }

    /// Unit vertex normals, area-weighted from the corners of the faces.
    #[must_use]
    pub fn vertex_normals(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; positions.len()];
        for q in &self.quads {
            let p = q.map(|v| positions[v as usize]);
            for k in 0..4 {
                let normal = (p[(k + 1) % 4] - p[k]).cross(p[(k + 3) % 4] - p[k]);
                normals[q[k] as usize] += normal;
            }
        }
        for n in &mut normals {
            *n = n.normalize_or_zero();
        }
        normals
    }
}

fn check_valences(mesh: &PolyMesh) -> Result<(), Error> {
    let odd = |v: &VertexId| {
        mesh.outgoing(*v).is_some() && !mesh.is_boundary_vertex(*v) && mesh.valence(*v) % 2 == 1
    };
    let vertices: Vec<usize> = mesh.vertices().filter(odd).map(VertexId::index).collect();
    match vertices.first() {
        Some(&v) => {
            let valence = mesh.valence(VertexId(v as u32));
            Err(Error::OddValence { vertices, valence })
        }
        None => Ok(()),
    }
}

fn check_edges(mesh: &PolyMesh) -> Result<(), Error> {
    for h in mesh.edges() {
        let (from, to) = (mesh.origin(h), mesh.target(h));
        if mesh.position(from) == mesh.position(to) {
            return Err(Error::ZeroEdge { from: from.index(), to: to.index() });
        }
    }
    Ok(())
}

/// For every face whether its edge 0–1 belongs to the second family, so that corners must turn.
fn turned_faces(mesh: &PolyMesh) -> Result<Vec<bool>, Error> {
    let mut turned: Vec<Option<bool>> = vec![None; mesh.face_count()];
    let local = |h: geom_core::HalfEdgeId, f: FaceId| h.index() - mesh.face_half_edge(f).index();
    for start in mesh.faces() {
        if turned[start.index()].is_some() {
            continue;
        }
        turned[start.index()] = Some(false);
        let mut stack = vec![(start, false)];
        while let Some((f, turn)) = stack.pop() {
            for h in mesh.face_half_edges(f) {
                let twin = mesh.twin(h);
                let Some(g) = mesh.face(twin) else { continue };
                // The shared edge is number k here and l there, and of one family.
                let odd = (local(h, f) + local(twin, g)) % 2 == 1;
                let want = turn != odd;
                match turned[g.index()] {
                    None => {
                        turned[g.index()] = Some(want);
                        stack.push((g, want));
                    }
                    Some(have) if have != want => {
                        let (from, to) = (mesh.origin(h).index(), mesh.target(h).index());
                        return Err(Error::FamiliesSwap { from, to });
                    }
                    Some(_) => {}
                }
            }
        }
    }
    Ok(turned.into_iter().map(|t| t == Some(true)).collect())
}

fn two_colouring(mesh: &PolyMesh) -> Option<Vec<bool>> {
    let mut colours: Vec<Option<bool>> = vec![None; mesh.vertex_count()];
    for start in mesh.vertices() {
        if colours[start.index()].is_some() {
            continue;
        }
        colours[start.index()] = Some(false);
        let mut stack = vec![(start, false)];
        while let Some((v, colour)) = stack.pop() {
            for w in mesh.ring(v) {
                match colours[w.index()] {
                    None => {
                        colours[w.index()] = Some(!colour);
                        stack.push((w, !colour));
                    }
                    Some(have) if have == colour => return None,
                    Some(_) => {}
                }
            }
        }
    }
    Some(colours.into_iter().map(|c| c == Some(true)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::asymptotic_nets;

    fn net(model: &asymptotic_nets::AsymptoticNet) -> QuadNet {
        QuadNet::new(&PolyMesh::new(model.positions.clone(), &model.quads).unwrap()).unwrap()
    }

    #[test]
    fn families_and_exponents_agree_across_every_edge() {
        for model in [
            asymptotic_nets::helicoid(),
            asymptotic_nets::catenoid(12, 8),
            asymptotic_nets::catenoid_odd(),
            asymptotic_nets::schwarz_p_cell(2),
        ] {
            let net = net(&model);
            for e in net.inner_edges() {
                let [f, g] = e.faces.map(|f| net.quads()[f].map(|v| v as usize));
                for (face, exponent) in [(f, e.exponents[0]), (g, e.exponents[1])] {
                    let corner = face.iter().position(|&v| v == e.b[0]).unwrap();
                    assert_eq!(exponent, if corner % 2 == 0 { 1.0 } else { -1.0 });
                }
                // Edge k of a face has family k mod 2, on both sides.
                let k = f.iter().position(|&v| v == e.b[0]).unwrap();
                let l = g.iter().position(|&v| v == e.b[3]).unwrap();
                assert_eq!(k % 2, l % 2);
            }
        }
    }

    #[test]
    fn only_the_odd_ring_has_no_colouring() {
        assert!(net(&asymptotic_nets::catenoid(12, 8)).colours().is_some());
        assert!(net(&asymptotic_nets::catenoid_odd()).colours().is_none());
        assert!(net(&asymptotic_nets::schwarz_p_cell(2)).colours().is_some());
    }

    #[test]
    fn star_quads_and_triples_have_the_expected_count() {
        let net = net(&asymptotic_nets::schwarz_p_disc(3));
        let interior = net.boundary().iter().filter(|b| !**b).count();
        assert_eq!(net.irregular_vertices().len(), 1);
        let by_boundary: usize = (0..net.boundary().len())
            .filter(|&v| net.boundary()[v])
            .map(|v| net.ring(v).count() - 2)
            .sum();
        assert_eq!(net.star_quads().len(), 2 * (interior - 1) + 4 + by_boundary);
        let straight = net.curve_quadruples();
        assert!(!straight.is_empty());
        for [a, b, c, d] in straight {
            assert!(net.ring(b).any(|v| v == a) && net.ring(c).any(|v| v == d) && a != c && b != d);
        }
    }

    #[test]
    fn unusable_meshes_are_refused_with_the_remedy() {
        let triangle = PolyMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]).unwrap();
        let error = QuadNet::new(&triangle).unwrap_err();
        assert_eq!(error, Error::NotQuad { face: 0, corners: 3 });
        assert!(error.to_string().contains("remesh"));
        // Three quads around a vertex.
        let ring = |k: usize, r: f64| {
            let a = std::f64::consts::TAU * k as f64 / 6.0;
            DVec3::new(r * a.cos(), r * a.sin(), 0.1 * k as f64)
        };
        let mut points = vec![DVec3::ZERO];
        points.extend((0..6).map(|k| ring(k, 1.0)));
        let odd = PolyMesh::new(points, &[[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]]).unwrap();
        let error = QuadNet::new(&odd).unwrap_err();
        assert_eq!(error, Error::OddValence { vertices: vec![0], valence: 3 });
        // The three quadrants at the corner of a box, without their faces at the corner itself:
        // a ring around a vertex that would have valence 3.
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let mut points: Vec<DVec3> = Vec::new();
        let mut quads = Vec::new();
        for k in 0..3 {
            for (i, j) in [(1, 0), (1, 1), (0, 1)] {
                let corner =
                    |i: i32, j: i32| axes[k] * f64::from(i) + axes[(k + 1) % 3] * f64::from(j);
                let corners =
                    [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                quads.push(corners.map(|p| {
                    let known = points.iter().position(|q| *q == p).unwrap_or_else(|| {
                        points.push(p);
                        points.len() - 1
                    });
                    known as u32
                }));
            }
        }
        let error = QuadNet::new(&PolyMesh::new(points, &quads).unwrap()).unwrap_err();
        assert!(matches!(error, Error::FamiliesSwap { .. }), "{error}");
        let mut same = asymptotic_nets::helicoid();
        same.positions[1] = same.positions[0];
        let mesh = PolyMesh::new(same.positions, &same.quads).unwrap();
        assert!(matches!(QuadNet::new(&mesh), Err(Error::ZeroEdge { .. })));
    }

    #[test]
    fn vertices_without_a_face_are_dropped() {
        let mut model = asymptotic_nets::helicoid();
        model.positions.insert(0, DVec3::splat(9.0));
        let quads: Vec<[u32; 4]> = model.quads.iter().map(|q| q.map(|v| v + 1)).collect();
        let net = QuadNet::new(&PolyMesh::new(model.positions, &quads).unwrap()).unwrap();
        assert_eq!(net.positions().len(), 104);
    }
}
