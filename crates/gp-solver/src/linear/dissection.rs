//! Nested dissection: an order in which a factorisation falls apart into independent pieces.

use super::SymmetricPattern;
use std::ops::Range;

/// Groups are split no further once they have at most this many rows together.
const LEAF: usize = 96;
/// A separator leaves at least this share of the groups on either side, if any does.
const BALANCE: f64 = 0.3;

/// A set of rows that is eliminated together, after its children.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Its place in the order.
    pub(crate) range: Range<usize>,
    /// Parts that only this one and its ancestors touch; all come before it.
    pub(crate) children: Vec<usize>,
}

/// An elimination order with its tree of separators, children before parents.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dissection {
    /// `order[k]` is the row that comes `k`-th.
    pub(crate) order: Vec<usize>,
    pub(crate) parts: Vec<Part>,
    pub(crate) roots: Vec<usize>,
}

/// Nested dissection (George 1973) by level sets of breadth-first searches. `group[row]`, never
/// decreasing, says which rows stay together, such as the coordinates of a vertex.
///
/// On a surface mesh of `n` vertices the factor has `O(n log n)` entries and takes `O(n^1.5)`
/// multiplications, and the two sides of every separator can be factored at the same time.
pub(crate) fn nested_dissection(pattern: &SymmetricPattern, group: &[usize]) -> Dissection {
    let graph = Graph::new(pattern, group);
    let groups = graph.rows.len();
    let mut work = Work { graph, result: Dissection::default(), mark: vec![0; groups], stamp: 0 };
    work.result.roots = work.dissect((0..groups as u32).collect());
    work.result
}

/// The groups as vertices.
struct Graph {
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// Rows of every group.
    rows: Vec<Range<usize>>,
}

impl Graph {
    fn new(pattern: &SymmetricPattern, group: &[usize]) -> Self {
        let mut rows: Vec<Range<usize>> = Vec::new();
        let mut number = Vec::with_capacity(group.len());
        for (row, g) in group.iter().enumerate() {
            if row > 0 && group[row - 1] == *g {
                let last = rows.len() - 1;
                rows[last].end = row + 1;
            } else {
                rows.push(row..row + 1);
            }
            number.push(rows.len() as u32 - 1);
        }
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); rows.len()];
        let mut last = vec![u32::MAX; rows.len()];
        for (a, range) in rows.iter().enumerate() {
            let starts = pattern.column_starts();
            for &i in &pattern.rows()[starts[range.start]..starts[range.end]] {
                let b = number[i as usize] as usize;
                if b != a && last[b] != a as u32 {
                    last[b] = a as u32;
                    lists[a].push(b as u32);
                    lists[b].push(a as u32);
                }
            }
        }
        let mut starts = vec![0];
        for list in &mut lists {
            list.sort_unstable();
            list.dedup();
            starts.push(starts[starts.len() - 1] + list.len());
        }
        Self { starts, neighbours: lists.concat(), rows }
    }

    fn around(&self, v: u32) -> &[u32] {
        &self.neighbours[self.starts[v as usize]..self.starts[v as usize + 1]]
    }
}

struct Work {
    graph: Graph,
    result: Dissection,
    /// `stamp` for the vertices of the set in hand that have not been reached.
    mark: Vec<u32>,
    stamp: u32,
}

impl Work {
    /// Orders a set of groups; returns the topmost parts it became.
    fn dissect(&mut self, set: Vec<u32>) -> Vec<usize> {
        let mut tops = Vec::new();
        for piece in self.components(&set) {
            let rows: usize = piece.iter().map(|&v| self.graph.rows[v as usize].len()).sum();
            let split = if rows <= LEAF { None } else { self.split(&piece) };
            let (separator, children) = match split {
                None => (piece, Vec::new()),
                Some([first, second, separator]) => {
                    let mut children = self.dissect(first);
                    children.extend(self.dissect(second));
                    (separator, children)
                }
            };
            let begin = self.result.order.len();
            for &v in &separator {
                self.result.order.extend(self.graph.rows[v as usize].clone());
            }
            let range = begin..self.result.order.len();
            self.result.parts.push(Part { range, children });
            tops.push(self.result.parts.len() - 1);
        }
        tops
    }

    fn components(&mut self, set: &[u32]) -> Vec<Vec<u32>> {
        self.restrict(set);
        let mut pieces = Vec::new();
        for &v in set {
            if self.mark[v as usize] == self.stamp {
                let mut piece = self.levels(v).0;
                piece.sort_unstable();
                pieces.push(piece);
            }
        }
        pieces
    }

    fn restrict(&mut self, set: &[u32]) {
        self.stamp += 1;
        for &v in set {
            self.mark[v as usize] = self.stamp;
        }
    }

    /// Breadth-first search in the set in hand: the vertices in order, and where levels begin.
    fn levels(&mut self, from: u32) -> (Vec<u32>, Vec<usize>) {
        let (mut order, mut starts) = (vec![from], vec![0]);
        self.mark[from as usize] = 0;
        let mut head = 0;
        while head < order.len() {
            let end = order.len();
            starts.push(end);
            while head < end {
                let v = order[head];
                head += 1;
                for &w in &self.graph.neighbours
                    [self.graph.starts[v as usize]..self.graph.starts[v as usize + 1]]
                {
                    if self.mark[w as usize] == self.stamp {
                        self.mark[w as usize] = 0;
                        order.push(w);
                    }
                }
            }
        }
        (order, starts)
    }

    /// Two sides and what separates them, of a connected set; `None` if it is too compact.
    fn split(&mut self, set: &[u32]) -> Option<[Vec<u32>; 3]> {
        // Starting from the last vertex reached, three times, makes levels many and small.
        let mut from = set[0];
        let mut search = (Vec::new(), Vec::new());
        for _ in 0..3 {
            self.restrict(set);
            search = self.levels(from);
            from = *search.0.last()?;
        }
        let (order, starts) = search;
        let depth = starts.len() - 1;
        if depth < 3 {
            return None;
        }
        let n = set.len() as f64;
        // The smallest level in the middle; where none is, the one nearest to it.
        let cost = |&l: &usize| {
            let (before, size) = (starts[l] as f64, (starts[l + 1] - starts[l]) as f64);
            let smaller = before.min(n - before - size) / n;
            if smaller >= BALANCE { size / n } else { 2.0 - smaller }
        };
        let level = (1..depth - 1).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        let (middle, after) =
            (&order[starts[level]..starts[level + 1]], &order[starts[level + 1]..]);
        // Vertices of the level without a neighbour beyond it need not separate.
        self.restrict(after);
        let touches =
            |v: &&u32| self.graph.around(**v).iter().any(|&w| self.mark[w as usize] == self.stamp);
        let (separator, rest): (Vec<u32>, Vec<u32>) = middle.iter().partition(touches);
        let first = order[..starts[level]].iter().chain(&rest).copied().collect();
        Some([first, after.to_vec(), separator])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of `m × n` vertices of two rows each, coupled along straight lines up to two steps.
    pub(crate) fn grid(m: usize, n: usize) -> (SymmetricPattern, Vec<usize>) {
        let at = |i: usize, j: usize| i * n + j;
        let mut pairs = Vec::new();
        for i in 0..m {
            for j in 0..n {
                for (a, b) in [(0, 0), (1, 0), (2, 0), (0, 1), (0, 2), (1, 1)] {
                    if i + a < m && j + b < n {
                        for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                            pairs.push((2 * at(i, j) + p, 2 * at(i + a, j + b) + q));
                        }
                    }
                }
            }
        }
        let pattern = SymmetricPattern::new(2 * m * n, pairs).unwrap();
        (pattern, (0..2 * m * n).map(|row| row / 2).collect())
    }

    #[test]
    fn parts_are_separated_by_their_ancestors() {
        let (pattern, group) = grid(30, 23);
        let tree = nested_dissection(&pattern, &group);
        let mut seen = vec![false; group.len()];
        for &row in &tree.order {
            assert!(!std::mem::replace(&mut seen[row], true));
        }
        assert!(seen.iter().all(|&s| s) && tree.roots.len() == 1 && tree.parts.len() > 15);
        let mut part_of = vec![0; group.len()];
        let mut parent = vec![usize::MAX; tree.parts.len()];
        for (p, part) in tree.parts.iter().enumerate() {
            part.children.iter().for_each(|&c| parent[c] = p);
            part.range.clone().for_each(|k| part_of[tree.order[k]] = p);
        }
        let above = |mut low: usize, high: usize| {
            while low != high && low != usize::MAX {
                low = parent[low];
            }
            low == high
        };
        for j in 0..pattern.size() {
            for &i in &pattern.rows()[pattern.column_starts()[j]..pattern.column_starts()[j + 1]] {
                let i = i as usize;
                let (a, b) = (part_of[i].min(part_of[j]), part_of[i].max(part_of[j]));
                assert!(above(a, b), "rows {i} and {j} meet outside a separator");
            }
        }
    }

    #[test]
    fn separate_pieces_and_single_rows_are_ordered_too() {
        let pattern = SymmetricPattern::new(5, [(0, 1), (3, 4)]).unwrap();
        let tree = nested_dissection(&pattern, &[0, 1, 2, 3, 4]);
        assert_eq!(tree.roots.len(), 3);
        assert_eq!(tree.order, vec![0, 1, 2, 3, 4]);
        let none = SymmetricPattern::new(0, []).unwrap();
        assert_eq!(nested_dissection(&none, &[]), Dissection::default());
    }
}
