//! Edges of a mesh, found from its faces.

use std::collections::BTreeMap;

/// A side of a face: from corner `k` to corner `k + 1` of face `face`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Side {
    pub(crate) face: usize,
    pub(crate) k: usize,
}

/// An edge and the one or two sides that lie on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) ends: [usize; 2],
    pub(crate) first: Side,
    pub(crate) second: Option<Side>,
}

/// Edges in the order of their lower and higher end.
pub(crate) struct Edges {
    pub(crate) list: Vec<Edge>,
    /// How many edges end at each vertex.
    pub(crate) valence: Vec<usize>,
    /// Whether a vertex lies on an open edge.
    pub(crate) on_border: Vec<bool>,
}

impl Edges {
    /// `None` if an edge has three faces, or two that run the same way.
    pub(crate) fn new(faces: &[Vec<usize>], vertices: usize) -> Option<Self> {
        let mut found: BTreeMap<[usize; 2], Edge> = BTreeMap::new();
        for (face, corners) in faces.iter().enumerate() {
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                if a == b || a >= vertices || b >= vertices {
                    return None;
                }
                let side = Side { face, k };
                match found.get_mut(&[a.min(b), a.max(b)]) {
                    None => {
                        let edge = Edge { ends: [a, b], first: side, second: None };
                        found.insert([a.min(b), a.max(b)], edge);
                    }
                    Some(edge) if edge.second.is_none() && edge.ends == [b, a] => {
                        edge.second = Some(side);
                    }
                    Some(_) => return None,
                }
            }
        }
        let list: Vec<Edge> = found.into_values().collect();
        let (mut valence, mut on_border) = (vec![0; vertices], vec![false; vertices]);
        for edge in &list {
            for v in edge.ends {
                valence[v] += 1;
                on_border[v] |= edge.second.is_none();
            }
        }
        Some(Self { list, valence, on_border })
    }

    /// The neighbours of every vertex along edges.
    pub(crate) fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut out = vec![Vec::new(); self.valence.len()];
        for edge in &self.list {
            let [a, b] = edge.ends;
            out[a].push(b);
            out[b].push(a);
        }
        out
    }

    /// Mean length of the edges.
    pub(crate) fn mean_length(&self, positions: &[glam::DVec3]) -> f64 {
        let length = |e: &Edge| positions[e.ends[0]].distance(positions[e.ends[1]]);
        self.list.iter().map(length).sum::<f64>() / self.list.len().max(1) as f64
    }
}
