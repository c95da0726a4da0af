//! Self-intersection of a patch by its triangulation.

use geom_core::DVec3;

use crate::patch::surface::{BasisTable, Patch};
use crate::watch::Stop;

/// Number of crossing pairs of triangles, which share no corner, in a triangulation of
/// `cells × cells × 2` triangles. The count means nothing once `stop` is set.
pub(crate) fn self_intersections(patch: &Patch, cells: usize, stop: &Stop) -> usize {
    let table = BasisTable::uniform(patch.degree(), cells + 1);
    let mut points = Vec::with_capacity((cells + 1) * (cells + 1));
    for iu in 0..=cells {
        patch.positions_row(&table, iu, &mut points);
    }
    let mut tree = Tree { cells, points, nodes: Vec::with_capacity(2 * cells * cells) };
    let root = tree.build([0, cells, 0, cells]);
    let mut count = 0;
    tree.inside(root, &mut count, stop);
    count
}

/// Binary box tree over the cells, split along the parameters.
struct Tree {
    cells: usize,
    points: Vec<DVec3>,
    nodes: Vec<Node>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// `[i0, i1, j0, j1)`.
    range: [usize; 4],
    /// Children, absent in a leaf of one cell.
    children: Option<[usize; 2]>,
}

impl Tree {
    fn build(&mut self, range: [usize; 4]) -> usize {
        let [i0, i1, j0, j1] = range;
        let node = if i1 - i0 == 1 && j1 - j0 == 1 {
            let corners = [(i0, j0), (i1, j0), (i1, j1), (i0, j1)].map(|c| self.point(c));
            Node {
                low: corners.into_iter().reduce(DVec3::min).unwrap_or(DVec3::ZERO),
                high: corners.into_iter().reduce(DVec3::max).unwrap_or(DVec3::ZERO),
                range,
                children: None,
            }
        } else {
            let halves = if i1 - i0 >= j1 - j0 {
                let m = (i0 + i1) / 2;
                [[i0, m, j0, j1], [m, i1, j0, j1]]
            } else {
                let m = (j0 + j1) / 2;
                [[i0, i1, j0, m], [i0, i1, m, j1]]
            };
            let [a, b] = halves.map(|half| self.build(half));
            Node {
                low: self.nodes[a].low.min(self.nodes[b].low),
                high: self.nodes[a].high.max(self.nodes[b].high),
                range,
                children: Some([a, b]),
            }
        };
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    fn point(&self, (i, j): (usize, usize)) -> DVec3 {
        self.points[i * (self.cells + 1) + j]
    }

    fn inside(&self, node: usize, count: &mut usize, stop: &Stop) {
        if let Some([a, b]) = self.nodes[node].children {
            self.inside(a, count, stop);
            self.inside(b, count, stop);
            self.between(a, b, count, stop);
        }
    }

    fn between(&self, a: usize, b: usize, count: &mut usize, stop: &Stop) {
        let (na, nb) = (&self.nodes[a], &self.nodes[b]);
        if na.low.cmpgt(nb.high).any() || nb.low.cmpgt(na.high).any() || stop.is_set() {
            return;
        }
        match (na.children, nb.children) {
            (None, None) => *count += self.leaves(na, nb),
            (Some([x, y]), None) => {
                self.between(x, b, count, stop);
                self.between(y, b, count, stop);
            }
            (None, Some([x, y])) => {
                self.between(a, x, count, stop);
                self.between(a, y, count, stop);
            }
            (Some(xs), Some(ys)) => {
                for x in xs {
                    for y in ys {
                        self.between(x, y, count, stop);
                    }
                }
            }
        }
    }

    fn leaves(&self, a: &Node, b: &Node) -> usize {
        let triangles = |node: &Node| {
            let [i, k, j, l] = node.range;
            [[(i, j), (k, j), (k, l)], [(i, j), (k, l), (i, l)]]
        };
        let mut count = 0;
        for s in triangles(a) {
            for t in triangles(b) {
                if s.iter().any(|corner| t.contains(corner)) {
                    continue;
                }
                let (s, t) = (s.map(|c| self.point(c)), t.map(|c| self.point(c)));
                count += usize::from(triangles_cross(&s, &t));
            }
        }
        count
    }
}

/// Whether an edge of one triangle passes through the inside of the other.
fn triangles_cross(s: &[DVec3; 3], t: &[DVec3; 3]) -> bool {
    // Most candidates lie on one side of the other's plane.
    let one_side = |a: &[DVec3; 3], b: &[DVec3; 3]| {
        let n = (a[1] - a[0]).cross(a[2] - a[0]);
        let d = b.map(|p| n.dot(p - a[0]));
        (d[0] > 0.0 && d[1] > 0.0 && d[2] > 0.0) || (d[0] < 0.0 && d[1] < 0.0 && d[2] < 0.0)
    };
    if one_side(s, t) || one_side(t, s) {
        return false;
    }
    (0..3).any(|e| {
        segment_crosses(s[e], s[(e + 1) % 3], t) || segment_crosses(t[e], t[(e + 1) % 3], s)
    })
}

/// Whether the open segment passes through the open triangle (Möller and Trumbore 1997).
fn segment_crosses(from: DVec3, to: DVec3, triangle: &[DVec3; 3]) -> bool {
    let (e1, e2) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
    let d = to - from;
    let h = d.cross(e2);
    let det = e1.dot(h);
    // Parallel up to rounding: coplanar triangles do not cross.
    if det.abs() <= 1e-14 * e1.length() * e2.length() * d.length() {
        return false;
    }
    let s = from - triangle[0];
    let u = s.dot(h) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    let t = e2.dot(q) / det;
    u > 0.0 && v > 0.0 && u + v < 1.0 && t > 0.0 && t < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curled_sheet_meets_itself_and_a_saddle_does_not() {
        let sheet = |f: &dyn Fn(f64, f64) -> DVec3| {
            let at = |i: usize| i as f64 / 5.0;
            Patch::new(5, (0..36).map(|k| f(at(k / 6), at(k % 6))).collect())
        };
        let saddle = sheet(&|u, v| DVec3::new(u, v, (u - 0.5) * (v - 0.5)));
        assert_eq!(self_intersections(&saddle, 36, &Stop::default()), 0);
        // The control polygon in u makes a loop, so the cylinder over it crosses itself.
        let loops = [(0.0, 0.0), (3.0, 1.0), (3.0, 3.0), (-2.0, 3.0), (-2.0, 1.0), (1.0, 0.0)];
        let curled = Patch::new(
            5,
            (0..36)
                .map(|k| {
                    let (x, y) = loops[k / 6];
                    DVec3::new(x, y, (k % 6) as f64)
                })
                .collect(),
        );
        assert!(self_intersections(&curled, 36, &Stop::default()) > 30);
    }
}
