//! The border of a display mesh as lines, and the part of them that can be seen.

use std::collections::BTreeMap;

use crate::raster::{Projected, Raster};

/// How much nearer, as a share, the surface may be than a line that still shows on it: the line
/// runs along its triangles, but not through their samples.
const BIAS: f64 = 2e-3;
/// Pixels between two tests of a line.
const STEP: f64 = 0.75;

/// Edges of one triangle only, joined to lines through vertices where no other edge branches off;
/// a closed line ends where it starts.
pub(crate) fn border_lines(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let edges = border_edges(triangles);
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, edge) in edges.iter().enumerate() {
        for v in edge {
            at.entry(*v).or_default().push(i);
        }
    }
    let mut used = vec![false; edges.len()];
    let mut lines = Vec::new();
    // Open lines are walked from their ends, then only closed ones are left.
    let ends = at.iter().filter(|(_, edges)| edges.len() != 2).map(|(v, _)| *v);
    let starts: Vec<u32> = ends.chain(edges.iter().map(|edge| edge[0])).collect();
    for start in starts {
        for &first in &at[&start] {
            let mut line = vec![start];
            let mut next = Some(first).filter(|&e| !used[e]);
            while let Some(edge) = next {
                used[edge] = true;
                let [a, b] = edges[edge];
                let v = if line.last() == Some(&a) { b } else { a };
                line.push(v);
                let around = &at[&v];
                let onward = around.iter().copied().find(|&e| !used[e]);
                next = onward.filter(|_| around.len() == 2);
            }
            if line.len() > 1 {
                lines.push(line);
            }
        }
    }
    lines
}

/// Edges of one triangle only, each once, lower vertex first.
fn border_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * triangles.len());
    for [a, b, c] in triangles {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            edges.push([*p.min(q), *p.max(q)]);
        }
    }
    edges.sort_unstable();
    let runs = edges.chunk_by(|a, b| a == b);
    runs.filter(|run| run.len() == 1).map(|run| run[0]).collect()
}

/// The pieces of a line that nothing in the picture hides.
pub(crate) fn visible_pieces(line: &[Projected], raster: &Raster) -> Vec<Vec<[f64; 2]>> {
    let (mut pieces, mut piece) = (Vec::new(), Vec::new());
    for pair in line.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let (across, down) = (b.x - a.x, b.y - a.y);
        let steps = ((across * across + down * down).sqrt() / STEP).ceil().max(1.0);
        let place = |t: f64| [a.x + t * across, a.y + t * down];
        for k in 0..steps as usize {
            let (from, middle) = (k as f64 / steps, (k as f64 + 0.5) / steps);
            let [x, y] = place(middle);
            // 1/distance changes linearly along a straight line of the picture.
            let nearness = a.nearness + middle * (b.nearness - a.nearness);
            let shows = raster.shows(Projected { x, y, nearness }, BIAS);
            if shows && piece.is_empty() {
                piece.push(place(from));
            } else if !shows && !piece.is_empty() {
                piece.push(place(from));
                pieces.push(std::mem::take(&mut piece));
            }
        }
        if !piece.is_empty() {
            piece.push(place(1.0));
        }
    }
    pieces.push(piece);
    pieces
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_border_of_a_grid_is_one_closed_line() {
        // 2 x 2 cells; vertex 4 is inside.
        let cell = |a: u32| [[a, a + 3, a + 4], [a, a + 4, a + 1]];
        let triangles = [cell(0), cell(1), cell(3), cell(4)].concat();
        let lines = border_lines(&triangles);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        let on_border: Vec<u32> = (0..9).filter(|v| *v != 4).collect();
        let mut met = lines[0][1..].to_vec();
        met.sort_unstable();
        assert_eq!(met, on_border);
    }

    #[test]
    fn lines_end_where_borders_meet() {
        // Two triangles that share a vertex alone: its four border edges belong to two loops.
        let lines = border_lines(&[[0, 1, 2], [0, 3, 4]]);
        let edges: usize = lines.iter().map(|line| line.len() - 1).sum();
        assert_eq!(edges, 6);
        assert!(lines.iter().all(|line| line[1..line.len() - 1].iter().all(|v| *v != 0)));
    }

    #[test]
    fn a_closed_mesh_has_no_border() {
        assert!(border_lines(&[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).is_empty());
    }

    #[test]
    fn what_is_behind_a_surface_is_left_out() {
        let mut raster = Raster::new(30, 10, [255; 3]);
        let near = |x: f64, y: f64| Projected { x, y, nearness: 2.0 };
        raster.triangle([near(10.0, -50.0), near(20.0, 5.0), near(10.0, 60.0)], |_| [0; 3]);
        let line = [0.0, 15.0, 30.0].map(|x| Projected { x, y: 5.0, nearness: 1.0 });
        let pieces = visible_pieces(&line, &raster);
        let ends: Vec<[f64; 2]> = pieces.iter().map(|p| [p[0][0], p[p.len() - 1][0]]).collect();
        assert_eq!(ends.len(), 2);
        // The triangle hides 10 to 20 but for a sample and a step at its rim.
        let want = [[0.0, 10.0], [20.0, 30.0]];
        for (got, want) in ends.iter().flatten().zip(want.iter().flatten()) {
            assert!((got - want).abs() <= 1.6, "{got} {want}");
        }
        let in_front = line.map(|p| Projected { nearness: 3.0, ..p });
        assert_eq!(visible_pieces(&in_front, &raster), [[[0.0, 5.0], [15.0, 5.0], [30.0, 5.0]]]);
    }

    proptest! {
        #[test]
        fn every_border_edge_is_walked_once(
            triangles in prop::collection::vec([0..12_u32, 0..12_u32, 0..12_u32], 0..20),
        ) {
            let lines = border_lines(&triangles);
            let pairs = lines.iter().flat_map(|line| line.windows(2));
            let mut walked: Vec<[u32; 2]> =
                pairs.map(|p| [p[0].min(p[1]), p[0].max(p[1])]).collect();
            walked.sort_unstable();
            prop_assert_eq!(walked, border_edges(&triangles));
        }
    }
}
