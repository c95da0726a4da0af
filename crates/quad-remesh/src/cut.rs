//! Cutting a surface open so that its directions are consistent, and naming the cuts.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::singular::{Matching, Singular};
use crate::surface::{NONE, Surface};

/// A surface cut open to a disc with all singular vertices on its border.
#[derive(Clone, Debug)]
pub(crate) struct Cut {
    /// `1` or `−1` per triangle: with these the directions agree across all sides that are not cut.
    pub(crate) combing: Vec<f64>,
    /// For every corner the number of its vertex on the cut surface.
    pub(crate) sheets: Vec<[u32; 3]>,
    pub(crate) sheet_count: usize,
    /// The sides of each piece of the cuts, each from the triangle on the left of its direction.
    pub(crate) segments: Vec<Segment>,
}

/// A piece of the cuts between two nodes (ends, branchings, singular vertices, the border).
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// Whether directions agree across it (`1`) or are opposite (`−1`).
    pub(crate) sign: i8,
    /// `(triangle, side)` on its left.
    pub(crate) sides: Vec<(u32, u8)>,
}

impl Cut {
    pub(crate) fn new(surface: &Surface, matching: &Matching, singular: &[Singular]) -> Self {
        let (combing, in_tree) = comb(surface, matching);
        let is_singular: BTreeSet<u32> = singular.iter().map(|s| s.vertex as u32).collect();
        let graph = cut_graph(surface, &in_tree, &is_singular);
        let mut is_cut = vec![[false; 3]; surface.triangles.len()];
        for (f, k) in graph.values().flat_map(|ends| ends.values()) {
            is_cut[*f as usize][*k as usize] = true;
        }
        let sign = |f: u32, k: u8| {
            let (f, k) = (f as usize, k as usize);
            let g = surface.across[f][k] as usize;
            let agree = combing[f] * combing[g] > 0.0;
            if agree { matching.signs[f][k] } else { -matching.signs[f][k] }
        };
        let segments = segments(surface, &graph, &is_singular)
            .into_iter()
            .map(|sides| Segment { sign: sign(sides[0].0, sides[0].1), sides })
            .collect();
        let (sheets, sheet_count) = sheets(surface, &is_cut);
        Self { combing, sheets, sheet_count, segments }
    }
}

/// Signs along a tree over all triangles, breadth first, and the sides the tree crosses.
fn comb(surface: &Surface, matching: &Matching) -> (Vec<f64>, Vec<[bool; 3]>) {
    let n = surface.triangles.len();
    let (mut combing, mut in_tree) = (vec![0.0; n], vec![[false; 3]; n]);
    combing[0] = 1.0;
    let mut open = VecDeque::from([0_usize]);
    while let Some(f) = open.pop_front() {
        for k in 0..3 {
            let g = surface.across[f][k];
            if g != NONE && combing[g as usize] == 0.0 {
                combing[g as usize] = combing[f] * f64::from(matching.signs[f][k]);
                in_tree[f][k] = true;
                in_tree[g as usize][surface.same_side(f, k, g as usize)] = true;
                open.push_back(g as usize);
            }
        }
    }
    (combing, in_tree)
}

/// Per vertex of the cuts its neighbours on them, each with the side on the left of the way there.
type Graph = BTreeMap<u32, BTreeMap<u32, (u32, u8)>>;

/// The edges no tree side crosses, without twigs that end at nothing.
fn cut_graph(surface: &Surface, in_tree: &[[bool; 3]], is_singular: &BTreeSet<u32>) -> Graph {
    let mut graph = Graph::new();
    for (f, sides) in in_tree.iter().enumerate() {
        for k in 0..3 {
            if surface.across[f][k] != NONE && !sides[k] {
                let t = surface.triangles[f];
                graph.entry(t[k]).or_default().insert(t[(k + 1) % 3], (f as u32, k as u8));
            }
        }
    }
    let ends = |graph: &Graph, v: u32| {
        let twig = graph.get(&v).is_some_and(|ends| ends.len() == 1);
        twig && !is_singular.contains(&v) && !surface.on_border[v as usize]
    };
    let mut twigs: Vec<u32> = graph.keys().copied().filter(|&v| ends(&graph, v)).collect();
    while let Some(v) = twigs.pop() {
        let Some(w) = graph.remove(&v).and_then(|ends| ends.keys().next().copied()) else {
            continue;
        };
        if let Some(back) = graph.get_mut(&w) {
            back.remove(&v);
            if back.is_empty() {
                graph.remove(&w);
            }
        }
        if ends(&graph, w) {
            twigs.push(w);
        }
    }
    graph
}

/// Splits the cuts at their nodes; loops without a node are one piece each.
fn segments(surface: &Surface, graph: &Graph, is_singular: &BTreeSet<u32>) -> Vec<Vec<(u32, u8)>> {
    let is_node =
        |v: u32| graph[&v].len() != 2 || is_singular.contains(&v) || surface.on_border[v as usize];
    let mut done: BTreeSet<(u32, u32)> = BTreeSet::new();
    let mut out = Vec::new();
    let starts = graph.keys().copied();
    let nodes = starts.clone().filter(|&v| is_node(v));
    // Nodes first, so that what is left are loops.
    for from in nodes.chain(starts.clone().filter(|&v| !is_node(v))) {
        for (&to, &side) in &graph[&from] {
            if done.contains(&(from.min(to), from.max(to))) {
                continue;
            }
            let (mut sides, mut at, mut next, mut side) = (Vec::new(), from, to, side);
            loop {
                sides.push(side);
                done.insert((at.min(next), at.max(next)));
                if next == from || is_node(next) {
                    break;
                }
                let Some((&onward, &way)) = graph[&next].iter().find(|(v, _)| **v != at) else {
                    break;
                };
                (at, next, side) = (next, onward, way);
            }
            out.push(sides);
        }
    }
    out
}

/// Numbers the wedges between cuts around every vertex.
fn sheets(surface: &Surface, is_cut: &[[bool; 3]]) -> (Vec<[u32; 3]>, usize) {
    let mut sheets = vec![[0; 3]; surface.triangles.len()];
    let mut count = 0_u32;
    for v in 0..surface.positions.len() {
        let star = surface.star(v);
        let Some(&(last, corner)) = star.last() else { continue };
        let first = count;
        for (at, &(f, k)) in star.iter().enumerate() {
            sheets[f as usize][k as usize] = count;
            // The side through which the star goes on.
            if at + 1 < star.len() && is_cut[f as usize][(k as usize + 2) % 3] {
                count += 1;
            }
        }
        let side = (corner as usize + 2) % 3;
        let closed = surface.across[last as usize][side] != NONE;
        if closed && !is_cut[last as usize][side] && count > first {
            // The last wedge goes on into the first.
            for &(f, k) in star {
                let slot = &mut sheets[f as usize][k as usize];
                if *slot == count {
                    *slot = first;
                }
            }
            count -= 1;
        }
        count += 1;
    }
    (sheets, count as usize)
}
