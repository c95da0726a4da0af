//! Our band Cholesky factorisation.

use crate::error::SolverError;

/// Cholesky factorisation `A = L Lᵀ` of a band matrix.
///
/// Storage is by columns: entry `(i, j)` with `j ≤ i ≤ j + half_bandwidth` stands at
/// [`slot(i, j)`](Self::slot)` = j · stride + i`, so that going down a column and going along a
/// row of the band are both unit or constant steps. A dense matrix is one with
/// `half_bandwidth = size − 1`.
#[derive(Clone, Debug)]
pub struct BandCholesky {
    size: usize,
    half_bandwidth: usize,
    stride: usize,
    factor: Vec<f64>,
}

impl BandCholesky {
    /// Room for matrices of this size and half-bandwidth.
    #[must_use]
    pub fn new(size: usize, half_bandwidth: usize) -> Self {
        let half_bandwidth = half_bandwidth.min(size.saturating_sub(1));
        let stride = half_bandwidth.next_multiple_of(8).max(8);
        Self { size, half_bandwidth, stride, factor: Vec::new() }
    }

    /// Number of rows.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Rows below the diagonal that a column reaches.
    #[must_use]
    pub fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    /// Length of the values of a matrix.
    #[must_use]
    pub fn values_len(&self) -> usize {
        (self.stride + 1) * self.size
    }

    /// Where entry `(i, j)`, `i ≥ j`, stands.
    #[must_use]
    pub fn slot(&self, i: usize, j: usize) -> usize {
        j * self.stride + i
    }

    /// Factors `A + diag(shift)`; `values` is laid out as [`slot`](Self::slot) says.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the row.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn factor(&mut self, values: &[f64], shift: &[f64]) -> Result<(), SolverError> {
        assert_eq!(values.len(), self.values_len(), "values in band storage");
        assert_eq!(shift.len(), self.size, "one shift per row");
        self.factor.clear();
        self.factor.extend_from_slice(values);
        let (n, kd, stride) = (self.size, self.half_bandwidth, self.stride);
        for j in 0..n {
            let l = &mut self.factor;
            l[j * stride + j] += shift[j];
            let end = n.min(j + kd + 1);
            for k in j.saturating_sub(kd)..j {
                let y = l[k * stride + j];
                let last = n.min(k + kd + 1).min(end);
                let (left, right) = l.split_at_mut(j * stride + j);
                let from = &left[k * stride + j..k * stride + last];
                for (t, &s) in right[..last - j].iter_mut().zip(from) {
                    *t -= y * s;
                }
            }
            let pivot = l[j * stride + j];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(SolverError::NotPositiveDefinite { variable: j });
            }
            let root = pivot.sqrt();
            l[j * stride + j] = root;
            for t in &mut l[j * stride + j + 1..j * stride + end] {
                *t /= root;
            }
        }
        Ok(())
    }

    /// Replaces `rhs` by the solution of the system factored last.
    ///
    /// # Panics
    /// If `rhs` has the wrong length or nothing was factored.
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.size, "one value per row");
        assert_eq!(self.factor.len(), self.values_len(), "factor a matrix first");
        let (n, kd, stride) = (self.size, self.half_bandwidth, self.stride);
        for j in 0..n {
            let end = n.min(j + kd + 1);
            let column = &self.factor[j * stride + j..j * stride + end];
            let x = rhs[j] / column[0];
            rhs[j] = x;
            for (t, &l) in rhs[j + 1..end].iter_mut().zip(&column[1..]) {
                *t -= l * x;
            }
        }
        for j in (0..n).rev() {
            let end = n.min(j + kd + 1);
            let column = &self.factor[j * stride + j..j * stride + end];
            let sum: f64 = rhs[j + 1..end].iter().zip(&column[1..]).map(|(&x, &l)| x * l).sum();
            rhs[j] = (rhs[j] - sum) / column[0];
        }
    }
}
