//! Linear least squares of sparse rows.

use super::{SparseCholesky, SymmetricPattern};
use crate::error::SolverError;

/// The `y` that minimises `Σ (Σ_k a_k y_k − b)² + shift · |y|²` over rows of pairs `(k, a_k)` with
/// right-hand sides `b`, by the normal equations. A row names an unknown at most once.
///
/// ```
/// let rows = [(vec![(0, 1.0), (1, 1.0)], 3.0), (vec![(0, 1.0), (1, -1.0)], 1.0)];
/// let y = gp_solver::solve_rows(2, &rows, 0.0)?;
/// assert!((y[0] - 2.0).abs() < 1e-15 && (y[1] - 1.0).abs() < 1e-15);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
///
/// # Errors
/// [`SolverError::NotPositiveDefinite`] where the rows leave an unknown open and `shift` is zero,
/// [`SolverError::OutOfMemory`], and an index beyond `unknowns`.
pub fn solve_rows(
    unknowns: usize,
    rows: &[(Vec<(usize, f64)>, f64)],
    shift: f64,
) -> Result<Vec<f64>, SolverError> {
    let pairs = rows.iter().flat_map(|(row, _)| {
        row.iter().flat_map(move |&(i, _)| row.iter().map(move |&(j, _)| (i, j)))
    });
    let pattern = SymmetricPattern::new(unknowns, pairs)?;
    let mut values = vec![0.0; pattern.len()];
    let mut rhs = vec![0.0; unknowns];
    for &start in &pattern.column_starts()[..unknowns] {
        values[start] = shift;
    }
    for (row, b) in rows {
        for (k, &(i, a)) in row.iter().enumerate() {
            rhs[i] += a * b;
            for &(j, c) in &row[..=k] {
                values[pattern.slot(i, j).unwrap_or_default()] += a * c;
            }
        }
    }
    let mut cholesky = SparseCholesky::new(pattern)?;
    cholesky.factor(&values)?;
    cholesky.solve_in_place(&mut rhs);
    Ok(rhs)
}
