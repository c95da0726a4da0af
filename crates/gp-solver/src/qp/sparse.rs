//! Sparse quadratic programs with equalities.

use super::QpSolution;
use crate::error::SolverError;
use crate::lbfgs::dot;
use crate::linear::{SparseCholesky, SymmetricPattern};
use crate::report::Status;

/// Weight of the constraints against the Hessian in the augmented matrix.
const PENALTY: f64 = 1e4;
/// Pull towards the last iterate, relative to the largest diagonal entry.
const PROXIMITY: f64 = 1e-9;
/// Constraints count as met if `|A x − b| ≤ FEASIBILITY · (|A| |x| + |b|)`.
const FEASIBILITY: f64 = 1e-12;
/// Multiplier steps after which constraints that are not met are called contradictory.
const MAX_STEPS: usize = 100;

/// Minimises `½ xᵀQ x + cᵀx` under `A x = b`, sparse, `Q` positive semidefinite.
///
/// The method of multipliers with a proximal term: each step factors nothing and solves one
/// system with `Q + ϱ AᵀA + δ I`, which is positive definite whatever the rank of `A`.
/// Redundant equations are allowed; contradicting ones end as
/// [`Infeasible`](Status::Infeasible).
#[derive(Clone, Debug)]
pub struct SparseEqualityQp {
    n: usize,
    /// Entries of `Q`, both triangles or one: `(i, j)` and `(j, i)` are the same entry.
    hessian: Vec<(usize, usize, f64)>,
    linear: Vec<f64>,
    rows: Vec<(Vec<(usize, f64)>, f64)>,
}

impl SparseEqualityQp {
    /// A program of `n` unknowns, all zero.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { n, hessian: Vec::new(), linear: vec![0.0; n], rows: Vec::new() }
    }

    /// Adds to entry `(i, j)` of the symmetric `Q` and, off the diagonal, to its mirror image.
    pub fn quadratic(&mut self, i: usize, j: usize, value: f64) -> &mut Self {
        self.hessian.push((i.max(j), i.min(j), value));
        self
    }

    /// Adds the energy `½ (Σ a x − b)²` of a row, weight included.
    pub fn square(&mut self, row: &[(usize, f64)], b: f64) -> &mut Self {
        let row = merged(row);
        for (k, &(i, a)) in row.iter().enumerate() {
            for &(j, c) in &row[..=k] {
                self.quadratic(i, j, a * c);
            }
            self.linear[i] -= a * b;
        }
        self
    }

    /// Adds `value · x[i]`.
    pub fn linear(&mut self, i: usize, value: f64) -> &mut Self {
        self.linear[i] += value;
        self
    }

    /// Adds the constraint `Σ a x = b`.
    pub fn equal(&mut self, row: &[(usize, f64)], b: f64) -> &mut Self {
        self.rows.push((merged(row), b));
        self
    }

    /// Solves the program.
    ///
    /// # Errors
    /// [`SolverError::EntryOutOfRange`], [`SolverError::NotPositiveDefinite`] if `Q` has a
    /// negative eigenvalue on the feasible set.
    pub fn solve(&self) -> Result<QpSolution, SolverError> {
        let n = self.n;
        let pairs = |row: &[(usize, f64)]| -> Vec<(usize, usize)> {
            row.iter().flat_map(|&(i, _)| row.iter().map(move |&(j, _)| (i, j))).collect()
        };
        let entries = self.hessian.iter().map(|&(i, j, _)| (i, j));
        let pattern = SymmetricPattern::new(
            n,
            entries.chain(self.rows.iter().flat_map(|(row, _)| pairs(row))),
        )?;
        let slot = |i, j| pattern.slot(i, j).expect("the pattern has every entry");
        let mut hessian = vec![0.0; pattern.len()];
        for &(i, j, value) in &self.hessian {
            hessian[slot(i, j)] += value;
        }
        let diagonal: Vec<usize> = pattern.column_starts()[..n].to_vec();
        let largest = diagonal.iter().map(|&d| hessian[d].abs()).fold(0.0, f64::max);
        let size = if largest > 0.0 { largest } else { 1.0 };
        // Rows are scaled to unit length, so that one penalty suits them all.
        let lengths: Vec<f64> = self
            .rows
            .iter()
            .map(|(row, _)| row.iter().map(|(_, a)| a * a).sum::<f64>().sqrt())
            .map(|length| if length > 0.0 { length } else { 1.0 })
            .collect();
        let mut matrix = hessian.clone();
        for ((row, _), length) in self.rows.iter().zip(&lengths) {
            let weight = PENALTY * size / (length * length);
            for (k, &(i, a)) in row.iter().enumerate() {
                for &(j, c) in &row[..=k] {
                    matrix[slot(i, j)] += weight * a * c;
                }
            }
        }
        for &d in &diagonal {
            matrix[d] += PROXIMITY * size;
        }
        let mut cholesky = SparseCholesky::new(pattern)?;
        cholesky.factor(&matrix)?;
        let mut x = vec![0.0; n];
        let mut multipliers = vec![0.0; self.rows.len()];
        let mut status = Status::Infeasible;
        let mut iterations = 0;
        let mut image = vec![0.0; n];
        while iterations < MAX_STEPS {
            iterations += 1;
            // (Q + ϱ AᵀA + δ I) x⁺ = −c + Aᵀ(λ + ϱ b) + δ x.
            let mut rhs: Vec<f64> =
                x.iter().zip(&self.linear).map(|(x, c)| PROXIMITY * size * x - c).collect();
            for (((row, b), length), u) in self.rows.iter().zip(&lengths).zip(&multipliers) {
                let weight = PENALTY * size / (length * length);
                for &(i, a) in row {
                    rhs[i] += a * (u + weight * b);
                }
            }
            cholesky.solve_in_place(&mut rhs);
            let moved = rhs.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let reach = rhs.iter().map(|v| v.abs()).fold(0.0, f64::max);
            x = rhs;
            let mut met = true;
            for (((row, b), length), u) in self.rows.iter().zip(&lengths).zip(&mut multipliers) {
                let value: f64 = row.iter().map(|&(i, a)| a * x[i]).sum();
                let bulk: f64 = row.iter().map(|&(i, a)| (a * x[i]).abs()).sum();
                *u += PENALTY * size / (length * length) * (b - value);
                met &= (value - b).abs() <= FEASIBILITY * (bulk + b.abs());
            }
            if met && moved <= 1e-11 * reach {
                status = Status::Converged;
                break;
            }
        }
        let residual = |(row, b): &(Vec<(usize, f64)>, f64)| {
            (row.iter().map(|&(i, a)| a * x[i]).sum::<f64>() - b).abs()
        };
        let violation = self.rows.iter().map(residual).fold(0.0, f64::max);
        cholesky.pattern().multiply(&hessian, &x, &mut image);
        let objective = 0.5 * dot(&x, &image) + dot(&x, &self.linear);
        let size_of_rows =
            self.rows.iter().map(|(_, b)| b.abs()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        if status == Status::Infeasible && violation <= 1e-9 * size_of_rows {
            // The constraints hold; only the last digits of the minimum were still moving.
            status = Status::IterationLimit;
        }
        Ok(QpSolution { status, x, objective, multipliers, violation, iterations })
    }
}

/// A row with the coefficients of each unknown added up.
fn merged(row: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let mut out: Vec<(usize, f64)> = Vec::with_capacity(row.len());
    for &(i, a) in row {
        match out.iter_mut().find(|(j, _)| *j == i) {
            Some((_, sum)) => *sum += a,
            None => out.push((i, a)),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qp::DenseQp;

    /// A chain of 40 points with fixed ends and a fixed mean, as smooth as possible.
    fn chain() -> SparseEqualityQp {
        let mut qp = SparseEqualityQp::new(40);
        for i in 1..39 {
            qp.square(&[(i - 1, 1.0), (i, -2.0), (i + 1, 1.0)], 0.0);
        }
        qp.equal(&[(0, 1.0)], 0.0).equal(&[(39, 3.0)], 3.0);
        qp.equal(&(0..40).map(|i| (i, 0.025)).collect::<Vec<_>>(), 2.0);
        qp
    }

    #[test]
    fn sparse_agrees_with_dense() {
        let qp = chain();
        let sparse = qp.solve().unwrap();
        assert_eq!(sparse.status, Status::Converged, "{sparse:?}");
        let mut hessian = vec![0.0; 1600];
        for &(i, j, value) in &qp.hessian {
            hessian[i * 40 + j] += value;
            if i != j {
                hessian[j * 40 + i] += value;
            }
        }
        let mut dense = DenseQp::new(40, hessian, qp.linear.clone());
        for (row, b) in &qp.rows {
            let mut a = vec![0.0; 40];
            row.iter().for_each(|&(i, v)| a[i] += v);
            dense.equal(&a, *b);
        }
        let dense = dense.solve().unwrap();
        for (s, d) in sparse.x.iter().zip(&dense.x) {
            assert!((s - d).abs() < 1e-7, "{s} {d}");
        }
        assert!(sparse.violation < 1e-11);
    }

    #[test]
    fn redundant_equations_are_harmless_and_contradictions_found() {
        let mut qp = chain();
        qp.equal(&[(0, 2.0)], 0.0);
        assert_eq!(qp.solve().unwrap().status, Status::Converged);
        qp.equal(&[(0, 1.0)], 0.5);
        assert_eq!(qp.solve().unwrap().status, Status::Infeasible);
    }
}
