//! Dense linear least squares by Householder reflections.
//!
//! [`least_squares`] leaves known zeros alone and works column by column; [`householder`] reflects
//! whole rows at a time, which is faster on full matrices of hundreds of columns. Their sums run
//! in different orders, and callers compare bits, so both stay.

/// Columns whose remainder falls below this share of their length depend on the columns before.
pub const RANK_RATIO: f64 = 1e-12;

/// The first column that depends on the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown {column} is not determined by the equations; add equations or drop the unknown")]
pub struct RankError {
    /// Index of the unknown.
    pub column: usize,
}

/// Minimises `|A x − b|` for each of several right-hand sides at once.
///
/// `a` is row-major, `rows × columns` with `rows ≥ columns`; `b` is row-major,
/// `rows × right_hand_sides`. Both are overwritten; the first `columns` rows of `b` hold the
/// solutions afterwards. Reflections run from the first to the last nonzero of a column only, so
/// a banded matrix costs what a banded factorisation costs.
///
/// # Errors
/// [`RankError`] names the first unknown that is not determined, that is whose column has a part
/// independent of the columns before it of at most [`RANK_RATIO`] of its length.
///
/// # Panics
/// If the lengths of the slices do not fit, or there are more columns than rows.
///
/// # Example
/// ```
/// // The line through (0, 1), (1, 3), (2, 5).
/// let mut a = [1.0, 0.0, 1.0, 1.0, 1.0, 2.0];
/// let mut b = [1.0, 3.0, 5.0];
/// numerics::least_squares(&mut a, 2, &mut b, 1)?;
/// numerics::assert_close(b[0], 1.0, 1e-14);
/// numerics::assert_close(b[1], 2.0, 1e-14);
/// # Ok::<(), numerics::RankError>(())
/// ```
pub fn least_squares(
    a: &mut [f64],
    columns: usize,
    b: &mut [f64],
    right_hand_sides: usize,
) -> Result<(), RankError> {
    assert!(columns > 0 && a.len().is_multiple_of(columns), "the matrix has ragged rows");
    let rows = a.len() / columns;
    assert!(rows >= columns, "{rows} equations are too few for {columns} unknowns");
    assert_eq!(b.len(), rows * right_hand_sides, "one right-hand side entry per row");
    // Rows where a column may be nonzero; reflections fill in, so both change on the way.
    let mut first: Vec<usize> = vec![rows; columns];
    let mut last: Vec<usize> = vec![0; columns];
    let mut lengths = vec![0.0_f64; columns];
    for i in 0..rows {
        for j in 0..columns {
            let value = a[i * columns + j];
            if value != 0.0 {
                first[j] = first[j].min(i);
                last[j] = i;
                lengths[j] += value * value;
            }
        }
    }
    let mut v = vec![0.0; rows];
    for j in 0..columns {
        let end = last[j].max(j) + 1;
        let norm = (j..end).map(|i| a[i * columns + j].powi(2)).sum::<f64>().sqrt();
        if !(norm > RANK_RATIO * lengths[j].sqrt()) {
            return Err(RankError { column: j });
        }
        let head = a[j * columns + j];
        let diagonal = if head > 0.0 { -norm } else { norm };
        for i in j..end {
            v[i] = a[i * columns + j];
        }
        v[j] -= diagonal;
        // |v|² / 2, without cancellation because diagonal and head differ in sign.
        let scale = 1.0 / (norm * (norm + head.abs()));
        for k in j + 1..columns {
            if first[k] >= end || last[k] < j {
                continue;
            }
            let dot = (j..end).map(|i| v[i] * a[i * columns + k]).sum::<f64>() * scale;
            for i in j..end {
                a[i * columns + k] -= dot * v[i];
            }
            first[k] = first[k].min(j);
            last[k] = last[k].max(end - 1);
        }
        for k in 0..right_hand_sides {
            let dot = (j..end).map(|i| v[i] * b[i * right_hand_sides + k]).sum::<f64>() * scale;
            for i in j..end {
                b[i * right_hand_sides + k] -= dot * v[i];
            }
        }
        a[j * columns + j] = diagonal;
    }
    for j in (0..columns).rev() {
        for k in 0..right_hand_sides {
            let known: f64 =
                (j + 1..columns).map(|i| a[j * columns + i] * b[i * right_hand_sides + k]).sum();
            let at = j * right_hand_sides + k;
            b[at] = (b[at] - known) / a[j * columns + j];
        }
    }
    Ok(())
}

/// Householder QR of the first `pivots` columns of a row-major matrix of full rows, applied to
/// all of them in place. The triangle ends up in the first rows; below it stand remainders of the
/// reflections.
///
/// # Example
/// ```
/// // Both columns lie in one direction: the second row of the triangle vanishes.
/// let mut matrix = [3.0, 6.0, 4.0, 8.0];
/// numerics::householder(&mut matrix, 2, 1);
/// assert_eq!([matrix[0], matrix[1]], [-5.0, -10.0]);
/// assert!(matrix[3].abs() < 1e-15);
/// ```
pub fn householder(matrix: &mut [f64], width: usize, pivots: usize) {
    let rows = matrix.len() / width;
    let mut reflector = vec![0.0; rows];
    let mut products = vec![0.0; width];
    for k in 0..pivots {
        let mut norm = 0.0;
        for i in k..rows {
            reflector[i] = matrix[i * width + k];
            norm += reflector[i] * reflector[i];
        }
        let alpha = -reflector[k].signum() * norm.sqrt();
        reflector[k] -= alpha;
        let length = norm - matrix[k * width + k].powi(2) + reflector[k].powi(2);
        if length == 0.0 {
            continue;
        }
        products[k..].fill(0.0);
        for i in k..rows {
            let row = &matrix[i * width..(i + 1) * width];
            for j in k..width {
                products[j] += reflector[i] * row[j];
            }
        }
        for i in k..rows {
            let factor = 2.0 * reflector[i] / length;
            let row = &mut matrix[i * width..(i + 1) * width];
            for j in k..width {
                row[j] -= factor * products[j];
            }
        }
    }
}

/// The first `unknowns` columns' coefficients that minimise the squares of the rows, as linear
/// functions of the coefficients of the other columns: `unknowns × (width − unknowns)`, row-major.
/// Overwrites the rows.
///
/// # Example
/// ```
/// // Rows x − p and x − q: the best x is the mean of p and q.
/// let map = numerics::minimizers(&mut [1.0, -1.0, 0.0, 1.0, 0.0, -1.0], 3, 1);
/// assert!((map[0] - 0.5).abs() < 1e-15 && (map[1] - 0.5).abs() < 1e-15);
/// ```
#[must_use]
pub fn minimizers(rows: &mut [f64], width: usize, unknowns: usize) -> Vec<f64> {
    householder(rows, width, unknowns);
    let others = width - unknowns;
    let mut out = vec![0.0; unknowns * others];
    for i in (0..unknowns).rev() {
        for c in 0..others {
            let mut value = -rows[i * width + unknowns + c];
            for k in i + 1..unknowns {
                value -= rows[i * width + k] * out[k * others + c];
            }
            out[i * others + c] = value / rows[i * width + i];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    #[test]
    fn residual_is_orthogonal_to_the_columns() {
        let (rows, columns) = (9, 4);
        // Banded, with one entry far off the band as periodic splines have.
        let entry = |i: usize, j: usize| {
            if i / 2 == j || i / 2 == j + 1 || (i == 8 && j == 0) {
                1.0 + ((3 * i + 5 * j) as f64).sin()
            } else {
                0.0
            }
        };
        let a: Vec<f64> = (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect();
        let b: Vec<f64> = (0..rows * 2).map(|k| (k as f64 * 0.7).cos()).collect();
        let (mut a2, mut x) = (a.clone(), b.clone());
        least_squares(&mut a2, columns, &mut x, 2).unwrap();
        for k in 0..2 {
            let residual: Vec<f64> = (0..rows)
                .map(|i| {
                    let ax: f64 = (0..columns).map(|j| a[i * columns + j] * x[j * 2 + k]).sum();
                    b[i * 2 + k] - ax
                })
                .collect();
            for j in 0..columns {
                let dot: f64 = (0..rows).map(|i| a[i * columns + j] * residual[i]).sum();
                assert_close(dot, 0.0, 1e-14);
            }
        }
    }

    #[test]
    fn undetermined_unknowns_are_named() {
        let mut a = [1.0, 1.0, 2.0, 2.0, 3.0, 3.0];
        let error = least_squares(&mut a, 2, &mut [1.0, 2.0, 3.0], 1).unwrap_err();
        assert_eq!(error, RankError { column: 1 });
        let mut a = [1.0, 0.0, 2.0, 0.0];
        let error = least_squares(&mut a, 2, &mut [1.0, 2.0], 1).unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown 1 is not determined by the equations; add equations or drop the unknown"
        );
    }
}
