//! Cholesky factorisation along a nested dissection, both sides of a separator at the same time.

use super::SymmetricPattern;
use super::dense::{Product, eliminate_leading, subtract_lower};
use super::dissection::{Dissection, nested_dissection};
use crate::error::SolverError;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Subtrees with at least this many multiplications are split over the threads.
const PARALLEL_WORK: f64 = 5e5;

/// Multifrontal Cholesky factorisation `A = L Lᵀ` (Duff and Reid 1983) in nested dissection order,
/// made for the unknowns of surface meshes.
///
/// Every separator and every leaf is one dense front: its own rows and all later ones they touch.
/// A front collects its entries of the matrix and the updates of its children in fixed order,
/// eliminates its own rows and leaves an update to its parent. Subtrees are independent, so they
/// run on different threads and the result is the same bit for bit.
///
/// ```
/// use gp_solver::{MultifrontalCholesky, SymmetricPattern};
/// let pattern = SymmetricPattern::new(2, [(1, 0)])?;
/// let mut cholesky = MultifrontalCholesky::new(pattern, &[0, 1])?;
/// cholesky.factor(&[4.0, 2.0, 3.0])?; // columns (4, 2) and (3)
/// let mut x = [8.0, 8.0];
/// cholesky.solve_in_place(&mut x);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct MultifrontalCholesky {
    pattern: SymmetricPattern,
    /// Row of the matrix at every place of the order.
    order: Vec<usize>,
    fronts: Vec<Front>,
    roots: Vec<usize>,
    /// Per front its columns of `L`, each as long as the front.
    panels: Vec<Vec<f64>>,
    spare: Spare,
}

/// Memory of updates to be used again: giving it back to the system would make every thread wait.
#[derive(Default)]
struct Spare(Mutex<Vec<Vec<f64>>>);

impl Spare {
    /// A vector with anything in it.
    fn take(&self, len: usize) -> Vec<f64> {
        let mut taken = self.lock().pop().unwrap_or_default();
        if taken.capacity() < len {
            // What is in it is not worth a copy.
            return vec![0.0; len];
        }
        taken.resize(len, 0.0);
        taken
    }

    fn give(&self, memory: Vec<f64>) {
        self.lock().push(memory);
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Vec<f64>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What is known of a front before any value is.
struct Front {
    /// First of its own places in the order, and their number.
    begin: usize,
    own: usize,
    /// Later places it touches, sorted.
    later: Vec<u32>,
    /// (entry of the pattern, place in the panel).
    entries: Vec<(u32, u32)>,
    children: Vec<usize>,
    /// Fronts `first..=` itself are its subtree.
    first: usize,
    /// Where the rows of `later` stand in the parent's front, in runs.
    in_parent: Vec<Run>,
    /// Multiplications of the subtree.
    work: f64,
}

/// `len` rows from `from` on in an update that go to rows from `to` on in the parent's front.
#[derive(Clone, Copy)]
struct Run {
    from: u32,
    to: u32,
    len: u32,
}

fn runs(places: impl Iterator<Item = u32>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (from, to) in (0..).zip(places) {
        match runs.last_mut() {
            Some(run) if run.to + run.len == to => run.len += 1,
            _ => runs.push(Run { from, to, len: 1 }),
        }
    }
    runs
}

impl Front {
    fn size(&self) -> usize {
        self.own + self.later.len()
    }

    /// Multiplications of one front.
    fn own_work(&self) -> f64 {
        let (k, m) = (self.own as f64, self.later.len() as f64);
        k * k * k / 6.0 + k * k * m / 2.0 + k * m * m / 2.0
    }
}

impl MultifrontalCholesky {
    /// Analyses a pattern. `group[row]`, never decreasing, says which rows stay together, such
    /// as the coordinates of a vertex.
    ///
    /// # Errors
    /// [`SolverError::TooLarge`].
    ///
    /// # Panics
    /// If there is not one group for every row.
    pub fn new(pattern: SymmetricPattern, group: &[usize]) -> Result<Self, SolverError> {
        assert_eq!(group.len(), pattern.size(), "one group for every row");
        let Dissection { order, parts, roots } = nested_dissection(&pattern, group);
        let mut place = vec![0_u32; order.len()];
        for (k, &row) in order.iter().enumerate() {
            place[row] = k as u32;
        }
        // Entries by the earlier of their two places.
        let mut starts = vec![0_usize; order.len() + 1];
        let places = |j: usize, i: usize| {
            let (a, b) = (place[j], place[i]);
            (a.min(b) as usize, a.max(b))
        };
        let columns = pattern.column_starts();
        for j in 0..order.len() {
            for &i in &pattern.rows()[columns[j]..columns[j + 1]] {
                starts[places(j, i as usize).0 + 1] += 1;
            }
        }
        for k in 0..order.len() {
            starts[k + 1] += starts[k];
        }
        let mut by_column = vec![(0_u32, 0_u32); pattern.len()];
        let mut next = starts.clone();
        for j in 0..order.len() {
            for entry in columns[j]..columns[j + 1] {
                let (low, high) = places(j, pattern.rows()[entry] as usize);
                by_column[next[low]] = (entry as u32, high);
                next[low] += 1;
            }
        }
        let mut fronts: Vec<Front> = Vec::with_capacity(parts.len());
        let mut mark = vec![u32::MAX; order.len()];
        for (p, part) in parts.into_iter().enumerate() {
            let (begin, end) = (part.range.start, part.range.end);
            let mut later = Vec::new();
            let mut see = |place: u32| {
                if place as usize >= end && mark[place as usize] != p as u32 {
                    mark[place as usize] = p as u32;
                    later.push(place);
                }
            };
            by_column[starts[begin]..starts[end]].iter().for_each(|&(_, high)| see(high));
            for &child in &part.children {
                fronts[child].later.iter().for_each(|&place| see(place));
            }
            later.sort_unstable();
            let (own, size) = (end - begin, end - begin + later.len());
            if u32::try_from(own * size).is_err() || u32::try_from(pattern.len()).is_err() {
                return Err(SolverError::TooLarge { entries: own * size });
            }
            let local = |place: u32| match (place as usize) < end {
                true => place - begin as u32,
                false => (own + later.partition_point(|&l| l < place)) as u32,
            };
            let entries = (begin..end)
                .flat_map(|low| {
                    let offset = ((low - begin) * size) as u32;
                    by_column[starts[low]..starts[low + 1]]
                        .iter()
                        .map(move |&(entry, high)| (entry, offset + local(high)))
                })
                .collect();
            for &child in &part.children {
                fronts[child].in_parent = runs(fronts[child].later.iter().map(|&l| local(l)));
            }
            let first = part.children.first().map_or(p, |&c| fronts[c].first);
            let work = part.children.iter().map(|&c| fronts[c].work).sum();
            let in_parent = Vec::new();
            let mut front = Front {
                begin,
                own,
                later,
                entries,
                children: part.children,
                first,
                in_parent,
                work,
            };
            front.work += front.own_work();
            fronts.push(front);
        }
        let panels = vec![Vec::new(); fronts.len()];
        Ok(Self { pattern, order, fronts, roots, panels, spare: Spare::default() })
    }

    /// The pattern the values belong to.
    #[must_use]
    pub fn pattern(&self) -> &SymmetricPattern {
        &self.pattern
    }

    /// Number of stored values of the factor.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.fronts.iter().map(|f| f.own * f.size()).sum()
    }

    /// Multiplications one factorisation takes, as foreseen from the pattern.
    #[must_use]
    pub fn flops(&self) -> f64 {
        self.roots.iter().map(|&r| self.fronts[r].work).sum()
    }

    /// Factors the matrix with the given values, one per entry of the pattern.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the unknown (in the caller's numbering) whose
    /// pivot failed.
    ///
    /// # Panics
    /// If `values` does not match the pattern.
    pub fn factor(&mut self, values: &[f64]) -> Result<(), SolverError> {
        assert_eq!(values.len(), self.pattern.len(), "one value per entry of the pattern");
        let eliminate = Eliminate { fronts: &self.fronts, values, spare: &self.spare };
        match eliminate.siblings(&self.roots, &mut self.panels) {
            Ok(_) => Ok(()),
            Err(place) => Err(SolverError::NotPositiveDefinite { variable: self.order[place] }),
        }
    }

    /// Replaces `rhs` by the solution of `A x = rhs` for the matrix factored last.
    ///
    /// # Panics
    /// If `rhs` has the wrong length.
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.pattern.size(), "one value per row");
        // The wider vectors of the machine at hand; products and sums stay separate operations,
        // so the bits are those of any other machine.
        pulp::Arch::new().dispatch(|| self.solve(rhs));
    }

    #[inline(always)]
    fn solve(&self, rhs: &mut [f64]) {
        let mut x: Vec<f64> = self.order.iter().map(|&row| rhs[row]).collect();
        let mut local = Vec::new();
        for (front, panel) in self.fronts.iter().zip(&self.panels) {
            local.clear();
            local.extend_from_slice(&x[front.begin..front.begin + front.own]);
            local.resize(front.size(), 0.0);
            for (c, column) in panel.chunks_exact(front.size()).enumerate() {
                let (head, below) = local.split_at_mut(c + 1);
                head[c] /= column[c];
                for (to, l) in below.iter_mut().zip(&column[c + 1..]) {
                    *to -= head[c] * l;
                }
            }
            x[front.begin..front.begin + front.own].copy_from_slice(&local[..front.own]);
            for (&place, add) in front.later.iter().zip(&local[front.own..]) {
                x[place as usize] += add;
            }
        }
        for (front, panel) in self.fronts.iter().zip(&self.panels).rev() {
            local.clear();
            local.extend_from_slice(&x[front.begin..front.begin + front.own]);
            local.extend(front.later.iter().map(|&place| x[place as usize]));
            for (c, column) in panel.chunks_exact(front.size()).enumerate().rev() {
                let sum = dot(&column[c + 1..], &local[c + 1..]);
                local[c] = (local[c] - sum) / column[c];
            }
            x[front.begin..front.begin + front.own].copy_from_slice(&local[..front.own]);
        }
        for (&row, value) in self.order.iter().zip(x) {
            rhs[row] = value;
        }
    }
}

/// Eight sums side by side: a fixed order that the compiler can vectorise.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let ((a8, a), (b8, b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    for (x, y) in a8.iter().zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>()
}

/// One factorisation under way.
#[derive(Clone, Copy)]
struct Eliminate<'s> {
    fronts: &'s [Front],
    values: &'s [f64],
    spare: &'s Spare,
}

impl Eliminate<'_> {
    /// Factors subtrees that do not touch one another; `panels` are those of all their fronts.
    /// Returns their updates in order, or the first place whose pivot failed.
    fn siblings(self, nodes: &[usize], panels: &mut [Vec<f64>]) -> Result<Vec<Vec<f64>>, usize> {
        match nodes {
            [] => Ok(Vec::new()),
            [node] => Ok(vec![self.subtree(*node, panels)?]),
            _ => {
                let (left, right) = nodes.split_at(nodes.len() / 2);
                let count = self.fronts[right[0]].first - self.fronts[left[0]].first;
                let (a, b) = panels.split_at_mut(count);
                let work =
                    |side: &[usize]| -> f64 { side.iter().map(|&n| self.fronts[n].work).sum() };
                let (mut first, second) = if work(left).min(work(right)) >= PARALLEL_WORK {
                    let (a, b) = rayon::join(|| self.siblings(left, a), || self.siblings(right, b));
                    (a?, b?)
                } else {
                    (self.siblings(left, a)?, self.siblings(right, b)?)
                };
                first.extend(second);
                Ok(first)
            }
        }
    }

    /// Factors a subtree and returns the update it leaves: the lower triangle of a square by
    /// columns, over the later places of its topmost front.
    fn subtree(self, node: usize, panels: &mut [Vec<f64>]) -> Result<Vec<f64>, usize> {
        let front = &self.fronts[node];
        let (own, size, rest) = (front.own, front.size(), front.later.len());
        let Some((panel, below)) = panels.split_last_mut() else { return Ok(Vec::new()) };
        let updates = self.siblings(&front.children, below)?;
        panel.clear();
        panel.resize(own * size, 0.0);
        for &(entry, at) in &front.entries {
            panel[at as usize] = self.values[entry as usize];
        }
        let mut update = self.spare.take(rest * rest);
        if !updates.is_empty() {
            update.fill(0.0);
        }
        for (&child, from) in front.children.iter().zip(&updates) {
            let child = &self.fronts[child];
            for (r, run) in child.in_parent.iter().enumerate() {
                for b in run.from..run.from + run.len {
                    let to = (run.to + b - run.from) as usize;
                    let (target, skip) = if to < own {
                        (&mut panel[to * size..(to + 1) * size], 0)
                    } else {
                        (&mut update[(to - own) * rest..(to - own + 1) * rest], own)
                    };
                    let column = &from[b as usize * child.later.len()..];
                    for below in &child.in_parent[r..] {
                        // The upper triangle is not meant to be read.
                        let first = below.from.max(b);
                        let (count, at) = (below.from + below.len - first, below.to - below.from);
                        let values = &column[first as usize..][..count as usize];
                        let target = &mut target[(first + at) as usize - skip..][..values.len()];
                        target.iter_mut().zip(values).for_each(|(t, v)| *t += v);
                    }
                }
            }
        }
        let fresh = updates.is_empty();
        updates.into_iter().for_each(|memory| self.spare.give(memory));
        eliminate_leading(panel, own, size).map_err(|k| front.begin + k)?;
        let product = if fresh { Product::Replaces } else { Product::IsAdded };
        subtract_lower(&mut update, panel, own, size, product);
        Ok(update)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::SparseCholesky;

    /// A grid of `n × n` vertices with three rows each, coupled up to two steps along the grid;
    /// diagonally dominant values without a pattern.
    fn grid(n: usize) -> (SymmetricPattern, Vec<f64>, Vec<usize>) {
        let at = |i: usize, j: usize| i * n + j;
        let mut pairs = Vec::new();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            for (a, b) in [(0, 0), (1, 0), (2, 0), (0, 1), (0, 2), (1, 1)] {
                if i + a < n && j + b < n {
                    let (v, w) = (at(i, j), at(i + a, j + b));
                    pairs.extend((0..9).map(|k| (3 * v + k / 3, 3 * w + k % 3)));
                }
            }
        }
        let pattern = SymmetricPattern::new(3 * n * n, pairs).unwrap();
        let mut values: Vec<f64> =
            (0..pattern.len()).map(|k| (1.7 * k as f64).sin() * 0.1).collect();
        for &start in &pattern.column_starts()[..pattern.size()] {
            values[start] = 4.0;
        }
        let group = (0..pattern.size()).map(|row| row / 3).collect();
        (pattern, values, group)
    }

    #[test]
    fn solutions_agree_with_the_supernodal_factorisation() {
        for n in [1, 3, 13, 24] {
            let (pattern, values, group) = grid(n);
            let rhs: Vec<f64> = (0..pattern.size()).map(|k| (0.3 * k as f64).cos()).collect();
            let (mut ours, mut theirs) = (rhs.clone(), rhs.clone());
            let mut cholesky = MultifrontalCholesky::new(pattern.clone(), &group).unwrap();
            cholesky.factor(&values).unwrap();
            cholesky.solve_in_place(&mut ours);
            let mut faer = SparseCholesky::new(pattern.clone()).unwrap();
            faer.factor(&values).unwrap();
            faer.solve_in_place(&mut theirs);
            let mut back = vec![0.0; rhs.len()];
            pattern.multiply(&values, &ours, &mut back);
            for k in 0..rhs.len() {
                assert!((ours[k] - theirs[k]).abs() < 1e-13, "{n}: {} {}", ours[k], theirs[k]);
                assert!((back[k] - rhs[k]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn bits_do_not_depend_on_threads_or_on_what_was_factored_before() {
        let (pattern, values, group) = grid(30);
        let run = |threads: usize, twice: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut cholesky = MultifrontalCholesky::new(pattern.clone(), &group).unwrap();
                assert!(cholesky.flops() > 4.0 * PARALLEL_WORK);
                if twice {
                    let other: Vec<f64> = values.iter().map(|v| 2.0 * v).collect();
                    cholesky.factor(&other).unwrap();
                }
                cholesky.factor(&values).unwrap();
                let mut x: Vec<f64> = (0..pattern.size()).map(|k| k as f64).collect();
                cholesky.solve_in_place(&mut x);
                x
            })
        };
        let one = run(1, false);
        assert!(one == run(3, false) && one == run(2, true));
    }

    #[test]
    fn failed_pivots_are_named_in_the_callers_numbers() {
        let (pattern, mut values, group) = grid(12);
        let mut cholesky = MultifrontalCholesky::new(pattern.clone(), &group).unwrap();
        for bad in [-1.0, f64::NAN] {
            let start = pattern.column_starts()[77];
            let old = std::mem::replace(&mut values[start], bad);
            let error = cholesky.factor(&values).unwrap_err();
            assert_eq!(error, SolverError::NotPositiveDefinite { variable: 77 }, "{bad}");
            values[start] = old;
        }
        assert_eq!(cholesky.factor(&values), Ok(()));
    }
}
