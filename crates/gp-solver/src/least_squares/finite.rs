//! Passes over the values of a block: weights, energy, and whether all are finite.

use crate::block::Block;
use crate::error::{Quantity, SolverError};

/// `values · weight`, to the bit the same where the weight is 1.
pub(super) fn weigh(values: &mut [f64], weight: f64) {
    if weight != 1.0 {
        values.iter_mut().for_each(|value| *value *= weight);
    }
}

/// `½ Σ r²`.
pub(super) fn half_square(residuals: &[f64]) -> f64 {
    // Eight sums side by side: a fixed order that the compiler can vectorise.
    let mut sums = [0.0; 8];
    let chunks = residuals.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|r| r * r).sum();
    for chunk in chunks {
        for (sum, r) in sums.iter_mut().zip(chunk) {
            *sum += r * r;
        }
    }
    0.5 * (sums.iter().sum::<f64>() + rest)
}

/// Whether all values are finite, in one pass without branches: `0 · v` is NaN otherwise.
fn all_finite(values: &[f64]) -> bool {
    let mut sums = [0.0; 8];
    let chunks = values.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().map(|v| 0.0 * v).sum();
    for chunk in chunks {
        for (sum, v) in sums.iter_mut().zip(chunk) {
            *sum += 0.0 * v;
        }
    }
    sums.iter().sum::<f64>() + rest == 0.0
}

/// Refuses values of a block, and its energy, that are not finite.
///
/// # Errors
/// [`SolverError::NotFinite`] names row and quantity.
pub(super) fn check_finite(
    block: &Block<'_>,
    residuals: &[f64],
    derivatives: &[f64],
    energy: f64,
) -> Result<(), SolverError> {
    if energy.is_finite() && all_finite(residuals) && all_finite(derivatives) {
        return Ok(());
    }
    let elements = block.elements();
    let is_rows = matches!(block, Block::Residual(_));
    let fault = |row: usize, quantity: Quantity, value: f64| {
        Err(SolverError::NotFinite { block: block.name().to_owned(), row, quantity, value })
    };
    for e in 0..elements.len() {
        let columns = elements.columns(e);
        for (r, row) in elements.rows(e).enumerate() {
            let value = residuals[row];
            if !value.is_finite() {
                let quantity = if is_rows { Quantity::Residual } else { Quantity::Gradient };
                return fault(row, quantity, value);
            }
            let begin = elements.jacobian_range(e).start + r * columns.len();
            for (k, &column) in columns.iter().enumerate() {
                let value = derivatives[begin + k];
                if !value.is_finite() {
                    let quantity =
                        if is_rows { Quantity::Derivative(column) } else { Quantity::Hessian };
                    return fault(row, quantity, value);
                }
            }
        }
    }
    // Finite rows whose squares overflow.
    let value = |row: &usize| residuals[*row].abs();
    let row = (0..residuals.len()).max_by(|a, b| value(a).total_cmp(&value(b)));
    fault(row.unwrap_or(0), Quantity::Energy, energy)
}
