//! Umbilics of a sampled surface, found so that none is missed or counted twice.

use geom_core::{DVec3, PolyMesh, ThirdOrder, UmbilicKind};
use std::collections::BTreeMap;
use subdiv_catmull_clark::Patch;

/// A sample is an umbilic itself if its principal curvatures differ by less than this share of
/// their size; the principal direction there is noise.
const ROUND: f64 = 1e-5;

/// An umbilic and its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Umbilic {
    /// Where it is, to the accuracy of the sampling.
    pub position: DVec3,
    /// Half-turns of the principal directions around it: twice its index. Over a closed surface
    /// they sum to twice the Euler characteristic.
    pub half_turns: i32,
    /// Pattern of the curvature lines around it; `None` for other indices than ±1/2.
    pub kind: Option<UmbilicKind>,
}

/// The principal directions at all samples, those that patches share taken once.
pub(crate) struct DirectionField<'a> {
    mesh: &'a PolyMesh,
    side: usize,
    /// By [`Self::id`]: shape and unit vector of the first principal direction.
    samples: Vec<Option<Sample>>,
}

#[derive(Clone, Copy)]
struct Sample {
    position: DVec3,
    normal: DVec3,
    direction: DVec3,
    round: bool,
}

/// A cell of the samples with its winding number.
struct Cell {
    patch: usize,
    ids: [usize; 4],
    centre: [f64; 2],
    half_turns: i32,
}

impl<'a> DirectionField<'a> {
    pub(crate) fn new(mesh: &'a PolyMesh, side: usize) -> Self {
        let inner = side - 2;
        let halves = mesh.half_edge_count();
        let count = mesh.vertex_count() + halves * inner + mesh.face_count() * inner * inner;
        Self { mesh, side, samples: vec![None; count] }
    }

    /// Number of the sample at `(i, j)` of a patch's grid, the same from every patch it lies on.
    fn id(&self, patch: &Patch, i: usize, j: usize) -> usize {
        let (mesh, last, inner) = (self.mesh, self.side - 1, self.side - 2);
        let edge = |turns: usize, k: usize| -> usize {
            let h = (0..turns).fold(patch.corner, |h, _| mesh.next(h));
            if k == 0 || k == last {
                let corner = if k == 0 { h } else { mesh.next(h) };
                return mesh.origin(corner).index();
            }
            let twin = mesh.twin(h);
            let (h, k) = if twin.index() < h.index() { (twin, last - k) } else { (h, k) };
            mesh.vertex_count() + h.index() * inner + k - 1
        };
        match (i, j) {
            (k, 0) => edge(0, k),
            (i, k) if i == last => edge(1, k),
            (k, j) if j == last => edge(2, last - k),
            (0, k) => edge(3, last - k),
            _ => {
                let edges = mesh.half_edge_count() * inner;
                mesh.vertex_count() + edges + (patch.face.index() * inner + i - 1) * inner + j - 1
            }
        }
    }

    /// Takes the sample at `(i, j)`, unless another patch brought it.
    pub(crate) fn insert(
        &mut self,
        patch: &Patch,
        (i, j): (usize, usize),
        at: DVec3,
        shape: &ThirdOrder,
    ) {
        let id = self.id(patch, i, j);
        self.samples[id].get_or_insert_with(|| {
            let [l, m, q] = shape.second;
            let (sin, cos) = (0.5 * (2.0 * m).atan2(l - q)).sin_cos();
            let half = (0.5 * (l - q)).hypot(m);
            Sample {
                position: at,
                normal: shape.e1.cross(shape.e2),
                direction: cos * shape.e1 + sin * shape.e2,
                round: half <= ROUND * (l * l + 2.0 * m * m + q * q).sqrt(),
            }
        });
    }

    /// All umbilics; `shape_at` evaluates a patch.
    ///
    /// The half-turns of the direction from sample to sample are counted around every cell, the
    /// same number on both sides of an edge but for the sign, and so are the turns of the tangent
    /// planes. Therefore the sum over all cells of a closed surface is twice its Euler
    /// characteristic, whatever the directions are.
    pub(crate) fn umbilics(
        &self,
        patches: &[Patch],
        shape_at: impl Fn(usize, f64, f64) -> Option<(DVec3, ThirdOrder)>,
    ) -> Vec<Umbilic> {
        let mut cells = Vec::new();
        for (patch, p) in patches.iter().enumerate() {
            for i in 1..self.side {
                for j in 1..self.side {
                    let ids = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)]
                        .map(|(i, j)| self.id(p, i, j));
                    let around = ids.map(|id| self.samples[id]);
                    let [Some(a), Some(b), Some(c), Some(d)] = around else { continue };
                    let half_turns = half_turns(&[a, b, c, d], &ids);
                    if half_turns != 0 || [a, b, c, d].iter().any(|s| s.round) {
                        let step = 1.0 / (self.side - 1) as f64;
                        let centre = [i, j].map(|k| (k as f64 - 0.5) * step);
                        cells.push(Cell { patch, ids, centre, half_turns });
                    }
                }
            }
        }
        self.joined(&cells)
            .into_iter()
            .filter_map(|group| self.umbilic(&group, &shape_at))
            .collect()
    }

    /// Cells around one round sample belong together, and so do neighbours of opposite sign: a
    /// direction that turns by nearly a quarter along their edge.
    fn joined<'c>(&self, cells: &'c [Cell]) -> Vec<Vec<&'c Cell>> {
        let mut parent: Vec<usize> = (0..cells.len()).collect();
        fn root(parent: &mut [usize], mut k: usize) -> usize {
            while parent[k] != k {
                parent[k] = parent[parent[k]];
                k = parent[k];
            }
            k
        }
        let mut at_sample: BTreeMap<usize, usize> = BTreeMap::new();
        let mut at_edge: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (k, cell) in cells.iter().enumerate() {
            for (c, &id) in cell.ids.iter().enumerate() {
                if self.samples[id].is_some_and(|s| s.round) {
                    let other = *at_sample.entry(id).or_insert(k);
                    let (a, b) = (root(&mut parent, other), root(&mut parent, k));
                    parent[a.max(b)] = a.min(b);
                }
                let next = cell.ids[(c + 1) % 4];
                let other = *at_edge.entry((id.min(next), id.max(next))).or_insert(k);
                if cells[other].half_turns * cell.half_turns < 0 {
                    let (a, b) = (root(&mut parent, other), root(&mut parent, k));
                    parent[a.max(b)] = a.min(b);
                }
            }
        }
        let mut groups: BTreeMap<usize, Vec<&Cell>> = BTreeMap::new();
        for (k, cell) in cells.iter().enumerate() {
            groups.entry(root(&mut parent, k)).or_default().push(cell);
        }
        groups.into_values().collect()
    }

    fn umbilic(
        &self,
        group: &[&Cell],
        shape_at: &impl Fn(usize, f64, f64) -> Option<(DVec3, ThirdOrder)>,
    ) -> Option<Umbilic> {
        let half_turns: i32 = group.iter().map(|c| c.half_turns).sum();
        if half_turns == 0 {
            return None;
        }
        let first = group.iter().find(|c| c.half_turns != 0)?;
        let (mut position, shape) = shape_at(first.patch, first.centre[0], first.centre[1])?;
        let round =
            group.iter().flat_map(|c| &c.ids).find_map(|&id| self.samples[id].filter(|s| s.round));
        if let Some(sample) = round {
            position = sample.position;
        }
        // The winding number tells a star; the third order tells lemon from monstar.
        let kind = match half_turns {
            -1 => Some(UmbilicKind::Star),
            1 if shape.umbilic_kind() == UmbilicKind::Monstar => Some(UmbilicKind::Monstar),
            1 => Some(UmbilicKind::Lemon),
            _ => None,
        };
        Some(Umbilic { position, half_turns, kind })
    }
}

/// `vector` carried from the tangent plane of one normal to that of another by the least rotation.
fn carried(vector: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let axis = from.cross(to);
    let cos = from.dot(to);
    // Rodrigues' formula with sin θ a unit axis = `axis`; opposite normals have no least rotation.
    let scale = 1.0 / (1.0 + cos).max(1e-12);
    vector * cos + axis.cross(vector) + axis * (axis.dot(vector) * scale)
}

/// Angle from `a` to `b` about `normal`.
fn angle(a: DVec3, b: DVec3, normal: DVec3) -> f64 {
    a.cross(b).dot(normal).atan2(a.dot(b))
}

/// Half-turns of the principal direction around a cell.
fn half_turns(around: &[Sample; 4], ids: &[usize; 4]) -> i32 {
    let mut turn = 0.0;
    let mut carried_round = around[0].direction;
    for k in 0..4 {
        let (here, next) = (&around[k], &around[(k + 1) % 4]);
        // Always from the lower number to the higher, so that both sides of an edge agree.
        let (a, b, sign) =
            if ids[k] < ids[(k + 1) % 4] { (here, next, 1.0) } else { (next, here, -1.0) };
        let from = carried(a.direction, a.normal, b.normal);
        let to = if from.dot(b.direction) < 0.0 { -b.direction } else { b.direction };
        turn += sign * angle(from, to, b.normal);
        carried_round = carried(carried_round, here.normal, next.normal);
    }
    // Carried around the cell, a vector has turned by the enclosed curvature.
    turn += angle(around[0].direction, carried_round, around[0].normal);
    (turn / std::f64::consts::PI).round() as i32
}
