//! Sparse linear least squares.

use gp_solver::{SolverError, SparseCholesky, SymmetricPattern};

/// Least squares of sparse rows `Σ a_k y_k = b`, with `shift` added to the diagonal.
pub(crate) fn solve_rows(
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
