//! Jacobians against central differences, for any block.

use crate::block::{EnergyBlock, ResidualBlock};
use crate::error::{Quantity, SolverError};

/// The entry where a derivative disagrees most with differences.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeCheck {
    /// Name of the block.
    pub block: String,
    /// Row (of the residuals, or of the gradient of an energy).
    pub row: usize,
    /// Unknown.
    pub unknown: usize,
    /// What the block says.
    pub analytic: f64,
    /// Central difference.
    pub difference: f64,
    /// `|analytic − difference|` relative to the largest derivative of the row and to the accuracy
    /// a difference can have there.
    pub error: f64,
}

/// Compares the Jacobian of a block at `x` with central differences and returns the worst entry,
/// or `None` for a block without derivatives. An [`error`](DerivativeCheck::error) below about
/// 10⁻⁶ is what right derivatives give; a wrong one is of the order of 1.
///
/// Also finds unknowns that a row reads without listing them: every unknown of the block's
/// elements is moved.
///
/// # Errors
/// [`SolverError::NotFinite`] if a residual or derivative is not finite at `x` or next to it.
///
/// # Example
/// ```
/// use gp_solver::{QuadraticBuilder, check_jacobian};
/// let mut rows = QuadraticBuilder::new("hyperbola");
/// rows.equation(1.0).product(0, 1, 1.0).constant(-1.0);
/// let worst = check_jacobian(&rows.build(), &[0.5, 3.0])?.expect("it has derivatives");
/// assert!(worst.error < 1e-8);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub fn check_jacobian(
    block: &dyn ResidualBlock,
    x: &[f64],
) -> Result<Option<DerivativeCheck>, SolverError> {
    let elements = block.elements();
    let rows = elements.rows_total();
    let mut here = vec![0.0; rows];
    let mut values = vec![0.0; elements.jacobian_len()];
    block.linearize(x, &mut here, &mut values);
    let mut alone = vec![0.0; rows];
    block.residuals(x, &mut alone);
    finite(block.name(), &here)?;
    // The two ways of asking for residuals must agree: their difference counts as an error.
    let mut worst: Option<DerivativeCheck> = None;
    let mut dense = vec![Vec::new(); rows];
    for e in 0..elements.len() {
        let columns = elements.columns(e);
        for (r, row) in elements.rows(e).enumerate() {
            let begin = elements.jacobian_range(e).start + r * columns.len();
            for (k, &unknown) in columns.iter().enumerate() {
                let value = values[begin + k];
                if !value.is_finite() {
                    return Err(SolverError::NotFinite {
                        block: block.name().to_owned(),
                        row,
                        quantity: Quantity::Derivative(unknown),
                        value,
                    });
                }
                dense[row].push((unknown, value));
            }
        }
    }
    let mut unknowns: Vec<usize> =
        (0..elements.len()).flat_map(|e| elements.columns(e).to_vec()).collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    let mut moved = x.to_vec();
    let (mut ahead, mut behind) = (vec![0.0; rows], vec![0.0; rows]);
    for unknown in unknowns {
        let step = f64::EPSILON.cbrt() * x[unknown].abs().max(1e-2);
        moved[unknown] = x[unknown] + step;
        block.residuals(&moved, &mut ahead);
        moved[unknown] = x[unknown] - step;
        block.residuals(&moved, &mut behind);
        moved[unknown] = x[unknown];
        finite(block.name(), &ahead)?;
        finite(block.name(), &behind)?;
        for row in 0..rows {
            let listed = dense[row].iter().find(|(u, _)| *u == unknown);
            let analytic = listed.map_or(0.0, |&(_, value)| value);
            let difference = (ahead[row] - behind[row]) / (2.0 * step);
            let largest = dense[row].iter().fold(0.0_f64, |m, (_, v)| m.max(v.abs()));
            let size = largest.max(difference.abs());
            let rounding = f64::EPSILON.cbrt() * (here[row].abs() + ahead[row].abs());
            let scale = size.max(rounding).max(f64::MIN_POSITIVE);
            let mismatch = (here[row] - alone[row]).abs() / here[row].abs().max(f64::MIN_POSITIVE);
            let error = ((analytic - difference).abs() / scale).max(mismatch.min(1.0));
            if worst.as_ref().is_none_or(|w| error > w.error) {
                let block = block.name().to_owned();
                worst = Some(DerivativeCheck { block, row, unknown, analytic, difference, error });
            }
        }
    }
    Ok(worst)
}

/// Compares the gradient of an energy block with central differences of its energy.
///
/// # Errors
/// [`SolverError::NotFinite`].
pub fn check_gradient(
    block: &dyn EnergyBlock,
    x: &[f64],
) -> Result<Option<DerivativeCheck>, SolverError> {
    let elements = block.elements();
    let mut gradients = vec![0.0; elements.rows_total()];
    let mut hessians = vec![0.0; elements.jacobian_len()];
    let energy = block.quadratic_model(x, &mut gradients, &mut hessians);
    finite(block.name(), &gradients)?;
    finite(block.name(), &[energy])?;
    let mut total = vec![0.0; x.len()];
    for e in 0..elements.len() {
        for (&unknown, row) in elements.columns(e).iter().zip(elements.rows(e)) {
            total[unknown] += gradients[row];
        }
    }
    let largest = total.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut moved = x.to_vec();
    let mut worst: Option<DerivativeCheck> = None;
    for unknown in 0..x.len() {
        let step = f64::EPSILON.cbrt() * x[unknown].abs().max(1e-2);
        moved[unknown] = x[unknown] + step;
        let ahead = block.energy(&moved);
        moved[unknown] = x[unknown] - step;
        let behind = block.energy(&moved);
        moved[unknown] = x[unknown];
        finite(block.name(), &[ahead, behind])?;
        let (analytic, difference) = (total[unknown], (ahead - behind) / (2.0 * step));
        let rounding = f64::EPSILON.cbrt() * energy.abs();
        let scale = largest.max(difference.abs()).max(rounding).max(f64::MIN_POSITIVE);
        let error = (analytic - difference).abs() / scale;
        if worst.as_ref().is_none_or(|w| error > w.error) {
            let (block, row) = (block.name().to_owned(), unknown);
            worst = Some(DerivativeCheck { block, row, unknown, analytic, difference, error });
        }
    }
    Ok(worst)
}

fn finite(block: &str, values: &[f64]) -> Result<(), SolverError> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(row) => Err(SolverError::NotFinite {
            block: block.to_owned(),
            row,
            quantity: Quantity::Residual,
            value: values[row],
        }),
    }
}
