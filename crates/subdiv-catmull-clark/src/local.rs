//! The neighbourhood of one quad that decides its limit patch, cut out of a mesh.

use crate::crease::{INFINITE_SHARPNESS, Tags, VertexMask};
use crate::jet::{JetWeights, cubic_basis, jet_index, separable_jet};
use crate::refine::{edge_numbers, next_sharpness, refine_tagged};
use crate::stencils::Stencils;
use geom_core::{DVec3, FaceId, HalfEdgeId, PolyMesh, VertexId};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// All faces that share a corner with one quad, with local vertex numbers.
///
/// Face 0 is the quad, its first corner at `(u, v) = (0, 0)`, the next ones at `(1, 0)`, `(1, 1)`,
/// `(0, 1)`. Vertices are numbered as a walk around the four corners meets them: corner 0 and its
/// ring counter-clockwise, then what is new around corners 1, 2 and 3. A quad with one
/// extraordinary corner of valence `n` has `2n + 8` of them, a regular one 16. Only faces that
/// follow one another around a corner are glued, so a small closed mesh whose neighbourhood
/// overlaps itself causes no trouble; the same vertex may then stand in the list twice.
#[derive(Clone, Debug)]
pub(crate) struct LocalPatch {
    pub(crate) mesh: PolyMesh,
    pub(crate) tags: Tags,
}

/// Control points of a patch as half-edges of the mesh it was cut from: each leaves the vertex.
pub(crate) type Sources = Vec<HalfEdgeId>;

impl LocalPatch {
    /// Cuts out the patch of the face on the left of `corner`, which leaves its first corner;
    /// also says where the local vertices come from. `None` if a neighbour is not a quad or the
    /// cut-out is not a manifold.
    pub(crate) fn cut(mesh: &PolyMesh, tags: &Tags, corner: HalfEdgeId) -> Option<(Self, Sources)> {
        let mut walk = Walk { mesh, places: HashMap::new(), starts: Vec::new() };
        let mut at = corner;
        for _ in 0..4 {
            walk.fan(at);
            at = mesh.next(at);
        }
        let (faces, sources) = walk.number_vertices(corner)?;
        let local = PolyMesh::new(vec![DVec3::ZERO; sources.len()], &faces).ok()?;
        let mut local_tags = Tags {
            sharpness: vec![0.0; local.half_edge_count()],
            shift: vec![0.0; local.half_edge_count()],
            corner: vec![false; local.vertex_count()],
        };
        for (f, &start) in walk.starts.iter().enumerate() {
            let mut global = start;
            for h in local.face_half_edges(FaceId(f as u32)) {
                let (t, gt) = (local.twin(h), mesh.twin(global));
                local_tags.sharpness[h.index()] = tags.sharpness[global.index()];
                local_tags.sharpness[t.index()] = tags.sharpness[gt.index()];
                local_tags.shift[h.index()] = tags.shift[global.index()];
                local_tags.shift[t.index()] = tags.shift[gt.index()];
                global = mesh.next(global);
            }
        }
        let mut at = corner;
        for i in 0..4 {
            local_tags.corner[i_corner(&local, i).index()] = tags.corner[mesh.origin(at).index()];
            at = mesh.next(at);
        }
        Some((Self { mesh: local, tags: local_tags }, sources))
    }

    /// Everything the limit patch depends on, as comparable numbers.
    pub(crate) fn key(&self) -> Vec<u64> {
        let mut key = Vec::new();
        for f in self.mesh.faces() {
            for h in self.mesh.face_half_edges(f) {
                key.push(u64::from(self.mesh.origin(h).0));
                if self.touches_patch(h) {
                    key.push(self.tags.sharpness[h.index()].to_bits());
                    key.push(self.tags.shift[h.index()].to_bits());
                    key.push(self.tags.shift[self.mesh.twin(h).index()].to_bits());
                }
            }
        }
        key.extend((0..4).map(|i| u64::from(self.tags.corner[i_corner(&self.mesh, i).index()])));
        key
    }

    /// Edges at the first corner if the other three are regular and no crease is near.
    pub(crate) fn interior_valence(&self) -> Option<usize> {
        let mesh = &self.mesh;
        let corners: [VertexId; 4] = std::array::from_fn(|i| i_corner(mesh, i));
        let smooth = |h: HalfEdgeId| {
            let [a, b] = [h, mesh.twin(h)].map(HalfEdgeId::index);
            self.tags.sharpness[a] == 0.0 && self.tags.shift[a] == 0.0 && self.tags.shift[b] == 0.0
        };
        let sound = |&v: &VertexId| {
            !mesh.is_boundary_vertex(v)
                && !self.tags.corner[v.index()]
                && mesh.outgoing_half_edges(v).all(smooth)
        };
        let regular = |&v: &VertexId| mesh.valence(v) == 4;
        (corners.iter().all(sound) && corners[1..].iter().all(regular))
            .then(|| mesh.valence(corners[0]))
            .filter(|&n| n >= 3)
    }

    // Tags of edges that do not end at a corner of the patch have no influence on it.
    fn touches_patch(&self, h: HalfEdgeId) -> bool {
        let corner = |v: VertexId| (0..4).any(|i| i_corner(&self.mesh, i) == v);
        corner(self.mesh.origin(h)) || corner(self.mesh.target(h))
    }

    /// The four sub-patches at the corners, each with the rows (new local vertex by old local
    /// vertex) of the refinement matrix. They are sparse: a step costs as much as the vertices
    /// around have edges, also where hundreds meet.
    pub(crate) fn children(&self) -> Option<[(Self, Stencils); 4]> {
        let (faces, stencils) = refine_tagged(&self.mesh, &self.tags);
        let fine = PolyMesh::new(vec![DVec3::ZERO; stencils.rows()], &faces).ok()?;
        let tags = self.refined_tags(&fine);
        let child = |i: usize| {
            // Sub-quad i is listed as (corner, edge, centre, edge) with its old corner first; in
            // the parameters that corner is number i.
            let start = (4 - i) % 4;
            let h = fine.face_half_edges(FaceId(i as u32)).nth(start)?;
            let (local, sources) = Self::cut(&fine, &tags, h)?;
            let rows = sources.iter().map(|&h| fine.origin(h).index());
            Some((local, stencils.select(rows)))
        };
        Some([child(0)?, child(1)?, child(2)?, child(3)?])
    }

    fn refined_tags(&self, fine: &PolyMesh) -> Tags {
        let numbers = edge_numbers(&self.mesh);
        let nv = self.mesh.vertex_count();
        let mut tags = Tags {
            sharpness: vec![0.0; fine.half_edge_count()],
            shift: vec![0.0; fine.half_edge_count()],
            corner: vec![false; fine.vertex_count()],
        };
        tags.corner[..nv].copy_from_slice(&self.tags.corner);
        for v in self.mesh.vertices() {
            for h in self.mesh.outgoing_half_edges(v) {
                let middle = VertexId(nv as u32 + numbers[h.index()]);
                if let Some(g) = fine.half_edge_between(v, middle) {
                    let sharpness = next_sharpness(self.tags.sharpness[h.index()]);
                    tags.sharpness[g.index()] = sharpness;
                    tags.sharpness[fine.twin(g).index()] = sharpness;
                    tags.shift[g.index()] = self.tags.shift[h.index()];
                }
            }
        }
        tags
    }

    /// The 4×4 control points of the patch if it is a bi-cubic B-spline patch, each a combination
    /// of local vertices; entry `4 i + j` stands at `(i − 1, j − 1)`.
    ///
    /// Beyond a boundary or an infinitely sharp crease the points are `2 P₀ − P₁`, which makes the
    /// tensor-product refinement equal to the boundary masks.
    pub(crate) fn regular_grid(&self) -> Option<[Vec<(usize, f64)>; 16]> {
        let mesh = &self.mesh;
        let sides: Vec<HalfEdgeId> = mesh.face_half_edges(FaceId(0)).collect();
        let open: Vec<bool> = sides.iter().map(|&h| self.is_seam(h)).collect();
        for i in 0..4 {
            self.regular_corner(sides[i], open[i], open[(i + 3) % 4])?;
        }
        let mut grid: [Vec<(usize, f64)>; 16] = Default::default();
        let at = |p: (i32, i32)| (4 * (p.0 + 1) + p.1 + 1) as usize;
        for i in 0..4 {
            let (corner, next) = (CORNERS[i], CORNERS[(i + 1) % 4]);
            let out = OUTWARD[i];
            grid[at(corner)] = vec![(mesh.origin(sides[i]).index(), 1.0)];
            if !open[i] {
                let beyond = mesh.next(mesh.twin(sides[i]));
                grid[at((corner.0 + out.0, corner.1 + out.1))] =
                    vec![(mesh.target(beyond).index(), 1.0)];
                grid[at((next.0 + out.0, next.1 + out.1))] =
                    vec![(mesh.target(mesh.next(beyond)).index(), 1.0)];
            }
        }
        let reflect = |grid: &mut [Vec<(usize, f64)>; 16], p: (i32, i32), out: (i32, i32)| {
            let near = grid[at((p.0 - out.0, p.1 - out.1))].clone();
            let far = grid[at((p.0 - 2 * out.0, p.1 - 2 * out.1))].clone();
            let mut sum: Vec<_> = near.into_iter().map(|(k, w)| (k, 2.0 * w)).collect();
            sum.extend(far.into_iter().map(|(k, w)| (k, -w)));
            grid[at(p)] = sum;
        };
        for i in 0..4 {
            if open[i] {
                for corner in [CORNERS[i], CORNERS[(i + 1) % 4]] {
                    let out = OUTWARD[i];
                    reflect(&mut grid, (corner.0 + out.0, corner.1 + out.1), out);
                }
            }
        }
        for i in 0..4 {
            let (out, before) = (OUTWARD[i], OUTWARD[(i + 3) % 4]);
            let corner = CORNERS[i];
            let p = (corner.0 + out.0 + before.0, corner.1 + out.1 + before.1);
            if open[i] {
                reflect(&mut grid, p, out);
            } else if open[(i + 3) % 4] {
                reflect(&mut grid, p, before);
            } else {
                let spoke = mesh.twin(mesh.next(mesh.twin(sides[i])));
                grid[at(p)] = vec![(mesh.origin(mesh.prev(spoke)).index(), 1.0)];
            }
        }
        Some(grid)
    }

    fn is_seam(&self, h: HalfEdgeId) -> bool {
        self.tags.sharpness[h.index()] == INFINITE_SHARPNESS
    }

    // Whether the surroundings of the corner that `side` leaves are those of a B-spline.
    fn regular_corner(&self, side: HalfEdgeId, open: bool, open_before: bool) -> Option<()> {
        let mesh = &self.mesh;
        let v = mesh.origin(side);
        let mut seams = 0;
        for h in mesh.outgoing_half_edges(v) {
            let s = self.tags.sharpness[h.index()];
            let shifted =
                self.tags.shift[h.index()] != 0.0 || self.tags.shift[mesh.twin(h).index()] != 0.0;
            if shifted || (s > 0.0 && s != INFINITE_SHARPNESS) {
                return None;
            }
            seams += usize::from(s > 0.0);
        }
        let mask = self.tags.vertex_rule(mesh, v).now;
        let regular = match (open, open_before) {
            (true, true) => mask == VertexMask::Corner,
            (false, false) => seams == 0 && mask == VertexMask::Smooth && mesh.valence(v) == 4,
            // One neighbour, and the seam goes on behind it.
            (true, false) => {
                let other = mesh.twin(mesh.prev(mesh.twin(mesh.prev(side))));
                matches!(mask, VertexMask::Crease(..)) && self.is_seam(other)
            }
            (false, true) => {
                matches!(mask, VertexMask::Crease(..)) && self.is_seam(mesh.next(mesh.twin(side)))
            }
        };
        regular.then_some(())
    }
}

const CORNERS: [(i32, i32); 4] = [(0, 0), (1, 0), (1, 1), (0, 1)];
const OUTWARD: [(i32, i32); 4] = [(0, -1), (1, 0), (0, 1), (-1, 0)];

fn i_corner(mesh: &PolyMesh, i: usize) -> VertexId {
    let first = mesh.face_half_edge(FaceId(0));
    mesh.origin(HalfEdgeId(first.0 + i as u32))
}

/// Weights of a bi-cubic patch at `(u, v)` on the local vertices its grid is made of.
pub(crate) fn grid_weights(
    grid: &[Vec<(usize, f64)>; 16],
    count: usize,
    u: f64,
    v: f64,
) -> JetWeights {
    let (bu, bv) = (cubic_basis(u), cubic_basis(v));
    let mut out = JetWeights::zeros(count);
    for i in 0..4 {
        for j in 0..4 {
            let jet = separable_jet(
                &std::array::from_fn(|d| bu[d][i]),
                &std::array::from_fn(|d| bv[d][j]),
            );
            for &(k, w) in &grid[4 * i + j] {
                for (d, &(p, q)) in crate::jet::JET_ORDERS.iter().enumerate() {
                    out.row_mut(d)[k] += w * jet[jet_index(p, q)];
                }
            }
        }
    }
    out
}

struct Walk<'a> {
    mesh: &'a PolyMesh,
    // Where in the list a face stands.
    places: HashMap<FaceId, usize>,
    // The half-edge each face's corners are listed from.
    starts: Vec<HalfEdgeId>,
}

impl Walk<'_> {
    // Visits the faces around the origin of `h`: counter-clockwise from the face of `h`, and, if
    // that ends at the boundary, clockwise as well.
    fn fan(&mut self, h: HalfEdgeId) {
        let mesh = self.mesh;
        let mut at = h;
        loop {
            self.visit(at);
            at = mesh.twin(mesh.prev(at));
            if at == h {
                return;
            }
            if mesh.face(at).is_none() {
                break;
            }
        }
        at = mesh.twin(h);
        while mesh.face(at).is_some() {
            at = mesh.next(at);
            self.visit(at);
            at = mesh.twin(at);
        }
    }

    fn visit(&mut self, h: HalfEdgeId) {
        if let Some(f) = self.mesh.face(h)
            && let Entry::Vacant(place) = self.places.entry(f)
        {
            place.insert(self.starts.len());
            self.starts.push(h);
        }
    }

    // Glues the faces along the edges at the quad's corners and numbers what remains.
    fn number_vertices(&self, corner: HalfEdgeId) -> Option<(Vec<[u32; 4]>, Sources)> {
        let mesh = self.mesh;
        if self.places.keys().any(|&f| mesh.face_degree(f) != 4) {
            return None;
        }
        let quad: [VertexId; 4] = {
            let mut at = corner;
            std::array::from_fn(|_| {
                let v = mesh.origin(at);
                at = mesh.next(at);
                v
            })
        };
        let slot = |h: HalfEdgeId| -> Option<usize> {
            let i = *self.places.get(&mesh.face(h)?)?;
            let mut at = self.starts[i];
            for k in 0..4 {
                if at == h {
                    return Some(4 * i + k);
                }
                at = mesh.next(at);
            }
            None
        };
        let mut parent: Vec<usize> = (0..4 * self.starts.len()).collect();
        for &start in &self.starts {
            let mut h = start;
            for _ in 0..4 {
                let spoke = quad.contains(&mesh.origin(h)) || quad.contains(&mesh.target(h));
                let t = mesh.twin(h);
                if spoke
                    && let (Some(a), Some(b), Some(c), Some(d)) =
                        (slot(h), slot(mesh.next(t)), slot(mesh.next(h)), slot(t))
                {
                    join(&mut parent, a, b);
                    join(&mut parent, c, d);
                }
                h = mesh.next(h);
            }
        }
        let mut number = vec![u32::MAX; parent.len()];
        let mut sources = Vec::new();
        let mut faces = Vec::with_capacity(self.starts.len());
        for (i, &start) in self.starts.iter().enumerate() {
            let mut h = start;
            let mut corners = [0; 4];
            for (k, corner) in corners.iter_mut().enumerate() {
                let root = find(&mut parent, 4 * i + k);
                if number[root] == u32::MAX {
                    number[root] = sources.len() as u32;
                    sources.push(h);
                }
                *corner = number[root];
                h = mesh.next(h);
            }
            faces.push(corners);
        }
        Some((faces, sources))
    }
}

fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

fn join(parent: &mut [usize], a: usize, b: usize) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b)] = a.min(b);
}
