//! A metric on unknowns in small blocks, assembled by its owner and factored here.

use super::{SparseCholesky, SymmetricPattern};
use crate::error::SolverError;

/// A sparse symmetric matrix over unknowns in blocks (the coordinates of a point, say), kept in the
/// order in which the blocks are eliminated, with its factor.
///
/// All unknowns of a block have the same neighbours, so the order is found among the blocks, which
/// is quicker and keeps them together.
///
/// ```
/// use gp_solver::SparseMetric;
/// // Two points in the plane and a number, the points not coupled with each other.
/// let blocks = [(0, 2), (2, 2), (4, 1)];
/// let mut metric = SparseMetric::new(&blocks, [vec![0, 2], vec![1, 2]].into_iter())?;
/// let mut values = vec![0.0; metric.len()];
/// for i in 0..5 {
///     values[metric.slot(i, i).unwrap()] = 2.0;
/// }
/// values[metric.slot(1, 4).unwrap()] = 1.0;
/// metric.factor(&mut values, 0.0)?;
/// let mut x = [2.0, 3.0, 4.0, 6.0, 3.0];
/// metric.solve_in_place(&mut x);
/// for (x, wanted) in x.into_iter().zip([1.0, 1.0, 2.0, 3.0, 1.0]) {
///     assert!((x - wanted).abs() < 1e-15);
/// }
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct SparseMetric {
    cholesky: SparseCholesky,
    /// Where every unknown comes in the order of elimination.
    place: Vec<u32>,
}

impl SparseMetric {
    /// Works out order and structure. `blocks` has the first unknown and the number of unknowns of
    /// every block, and each clique names blocks that are pairwise coupled, in rising order.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    ///
    /// # Panics
    /// If a clique is not sorted or names a block there is not, or if the blocks do not cover the
    /// unknowns.
    pub fn new<G: AsRef<[u32]>>(
        blocks: &[(usize, usize)],
        cliques: impl Iterator<Item = G>,
    ) -> Result<Self, SolverError> {
        let size = blocks.iter().map(|(_, dim)| dim).sum();
        let coarse = SymmetricPattern::from_cliques(blocks.len(), cliques);
        let mut place = vec![0; size];
        let mut next = 0;
        for block in SparseCholesky::elimination_order(&coarse)? {
            let (start, dim) = blocks[block];
            for unknown in &mut place[start..start + dim] {
                *unknown = next;
                next += 1;
            }
        }
        let unknowns = |block: usize| {
            let (start, dim) = blocks[block];
            (0..dim).map(move |k| start + k)
        };
        let entries = (0..blocks.len()).flat_map(|b| {
            let rows = &coarse.rows()[coarse.column_starts()[b]..coarse.column_starts()[b + 1]];
            rows.iter().flat_map(move |&a| {
                unknowns(a as usize).flat_map(move |i| unknowns(b).map(move |j| (i, j)))
            })
        });
        let placed = entries.map(|(i, j)| (place[i] as usize, place[j] as usize));
        let pattern = SymmetricPattern::new(size, placed)?;
        Ok(Self { cholesky: SparseCholesky::in_given_order(pattern)?, place })
    }

    /// Number of stored values.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a matrix has a diagonal")]
    pub fn len(&self) -> usize {
        self.cholesky.pattern().len()
    }

    /// Number of stored values of the factor.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.cholesky.factor_len()
    }

    /// Where an unknown comes in the order of elimination.
    #[must_use]
    pub fn place(&self, unknown: usize) -> usize {
        self.place[unknown] as usize
    }

    /// Where the columns begin among the values, by place; a column begins with its diagonal and
    /// has only what comes later.
    #[must_use]
    pub fn column_starts(&self) -> &[usize] {
        self.cholesky.pattern().column_starts()
    }

    /// Which value stands for two coupled unknowns, in either order.
    #[must_use]
    pub fn slot(&self, a: usize, b: usize) -> Option<usize> {
        self.cholesky.pattern().slot(self.place(a), self.place(b))
    }

    /// Factors the matrix with these values after adding `share` of its mean diagonal to the
    /// diagonal, which keeps unknowns that nothing sees from making it singular.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`].
    ///
    /// # Panics
    /// If the number of values is another.
    pub fn factor(&mut self, values: &mut [f64], share: f64) -> Result<(), SolverError> {
        let size = self.place.len();
        let starts = &self.cholesky.pattern().column_starts()[..size];
        let trace: f64 = starts.iter().map(|&start| values[start]).sum();
        starts.iter().for_each(|&start| values[start] += share * trace / size as f64);
        self.cholesky.factor(values)
    }

    /// Replaces a vector by its image under the inverse of the matrix factored last.
    ///
    /// # Panics
    /// If the length is another.
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        let mut placed = vec![0.0; rhs.len()];
        self.place.iter().zip(&*rhs).for_each(|(&p, &x)| placed[p as usize] = x);
        self.cholesky.solve_in_place(&mut placed);
        self.place.iter().zip(rhs).for_each(|(&p, x)| *x = placed[p as usize]);
    }

    /// `A x` for the matrix with these values.
    ///
    /// # Panics
    /// If a length is another.
    #[must_use]
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut image = vec![0.0; x.len()];
        let mut placed = vec![0.0; x.len()];
        self.place.iter().zip(x).for_each(|(&p, &x)| placed[p as usize] = x);
        self.cholesky.pattern().multiply(values, &placed, &mut image);
        self.place.iter().map(|&p| image[p as usize]).collect()
    }
}
