//! Dense quadratic programs by the dual active-set method.

use super::QpSolution;
use crate::error::SolverError;
use crate::report::Status;
use numerics::{Matrix, cholesky, dot};

/// Smallest violation, relative to the size of the constraint's numbers, that counts as one.
const VIOLATION_TOL: f64 = 1e-13;
/// Pull towards the last iterate, relative to the largest diagonal entry, that makes a singular
/// Hessian definite.
const PROXIMITY: f64 = 1e-7;
/// Rounds of the proximal iteration.
const MAX_ROUNDS: usize = 60;

/// Minimises `½ xᵀQ x + cᵀx` under `a·x = b` and `a·x ≥ b`, dense, a few hundred unknowns.
///
/// The dual active-set method of Goldfarb and Idnani (1983): starts at the free minimum and adds
/// violated constraints, so it needs no feasible start and finds infeasibility. A positive
/// semidefinite `Q` is made definite by pulling towards the last iterate, repeated until
/// that no longer matters (the proximal point method, exact in the limit).
///
/// ```
/// use gp_solver::DenseQp;
/// // The point of the half-plane x + y ≥ 2, x ≤ ½ nearest to the origin.
/// let mut qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, 1.0], vec![0.0, 0.0]);
/// qp.at_least(&[1.0, 1.0], 2.0).upper_bound(0, 0.5);
/// let solution = qp.solve()?;
/// assert!((solution.x[0] - 0.5).abs() < 1e-14 && (solution.x[1] - 1.5).abs() < 1e-14);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DenseQp {
    n: usize,
    hessian: Vec<f64>,
    linear: Vec<f64>,
    equalities: Vec<(Vec<f64>, f64)>,
    inequalities: Vec<(Vec<f64>, f64)>,
}

impl DenseQp {
    /// A program without constraints; `hessian[i * n + j]` symmetric.
    ///
    /// # Panics
    /// If the slices are not `n × n` and `n` long.
    #[must_use]
    pub fn new(n: usize, hessian: Vec<f64>, linear: Vec<f64>) -> Self {
        assert!(hessian.len() == n * n && linear.len() == n, "a hessian of n × n, n linear terms");
        Self { n, hessian, linear, equalities: Vec::new(), inequalities: Vec::new() }
    }

    /// Number of unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.n
    }

    /// Adds `a·x = b`.
    ///
    /// # Panics
    /// If `a` has the wrong length.
    pub fn equal(&mut self, a: &[f64], b: f64) -> &mut Self {
        assert_eq!(a.len(), self.n, "one coefficient per unknown");
        self.equalities.push((a.to_vec(), b));
        self
    }

    /// Adds `a·x ≥ b`.
    ///
    /// # Panics
    /// If `a` has the wrong length.
    pub fn at_least(&mut self, a: &[f64], b: f64) -> &mut Self {
        assert_eq!(a.len(), self.n, "one coefficient per unknown");
        self.inequalities.push((a.to_vec(), b));
        self
    }

    /// Adds `x[i] ≥ b`.
    pub fn lower_bound(&mut self, i: usize, b: f64) -> &mut Self {
        let mut a = vec![0.0; self.n];
        a[i] = 1.0;
        self.at_least(&a, b)
    }

    /// Adds `x[i] ≤ b`.
    pub fn upper_bound(&mut self, i: usize, b: f64) -> &mut Self {
        let mut a = vec![0.0; self.n];
        a[i] = -1.0;
        self.at_least(&a, -b)
    }

    /// Solves the program. Contradicting constraints are a status.
    ///
    /// # Errors
    /// [`SolverError::BadOption`] if a number is not finite, [`SolverError::NotPositiveDefinite`]
    /// if the Hessian has a negative eigenvalue.
    pub fn solve(&self) -> Result<QpSolution, SolverError> {
        let n = self.n;
        let constraints = || self.equalities.iter().chain(&self.inequalities);
        let numbers = constraints().flat_map(|(a, b)| a.iter().chain([b]));
        if let Some(&value) =
            self.hessian.iter().chain(&self.linear).chain(numbers).find(|v| !v.is_finite())
        {
            let name = "coefficient of the quadratic program";
            return Err(SolverError::BadOption { name, value, need: "finite" });
        }
        if let Ok(l) = factor(&self.hessian, n, 0.0) {
            return Ok(self.finish(ActiveSet::new(self, &l, &self.linear).run()));
        }
        let size = (0..n).map(|i| self.hessian[i * n + i].abs()).fold(0.0, f64::max);
        let shift = PROXIMITY * if size > 0.0 { size } else { 1.0 };
        let l = factor(&self.hessian, n, shift)?;
        let mut x = vec![0.0; n];
        let mut iterations = 0;
        for round in 1.. {
            let linear: Vec<f64> = self.linear.iter().zip(&x).map(|(c, x)| c - shift * x).collect();
            let mut result = ActiveSet::new(self, &l, &linear).run();
            iterations += result.iterations;
            let moved = result.x.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let length = result.x.iter().map(|v| v.abs()).fold(0.0, f64::max);
            x.copy_from_slice(&result.x);
            // A step that grows in proportion to the rounds is a descent without end.
            let settled = moved <= 1e-12 * length.max(f64::MIN_POSITIVE);
            if settled || result.status != Status::Converged || round == MAX_ROUNDS {
                if !settled && result.status == Status::Converged {
                    result.status = Status::IterationLimit;
                }
                result.iterations = iterations;
                return Ok(self.finish(result));
            }
        }
        unreachable!("the loop returns in its last round")
    }

    /// Fills in what is measured on the given program itself.
    fn finish(&self, mut solution: QpSolution) -> QpSolution {
        let x = &solution.x;
        let image = |i: usize| dot(&self.hessian[i * self.n..(i + 1) * self.n], x);
        solution.objective = (0..self.n).map(|i| x[i] * (0.5 * image(i) + self.linear[i])).sum();
        let equal = self.equalities.iter().map(|(a, b)| (dot(a, x) - b).abs());
        let least = self.inequalities.iter().map(|(a, b)| (b - dot(a, x)).max(0.0));
        solution.violation = equal.chain(least).fold(0.0, f64::max);
        solution
    }
}

/// Lower Cholesky factor of `hessian + shift I`.
fn factor(hessian: &[f64], n: usize, shift: f64) -> Result<Matrix, SolverError> {
    cholesky(hessian, n, shift, 1e-13)
        .map_err(|e| SolverError::NotPositiveDefinite { variable: e.row })
}

/// State of the dual method: `j` is `n × n` by columns with `Jᵀ Q J = I`, its first `q` columns
/// span the active normals, `r` is their upper triangular factor.
struct ActiveSet<'q> {
    qp: &'q DenseQp,
    n: usize,
    x: Vec<f64>,
    j: Vec<f64>,
    r: Vec<f64>,
    /// Numbers of the active constraints, equalities first.
    active: Vec<usize>,
    multipliers: Vec<f64>,
    /// +1, or −1 for an equality approached from above.
    signs: Vec<f64>,
}

impl<'q> ActiveSet<'q> {
    fn new(qp: &'q DenseQp, l: &Matrix, linear: &[f64]) -> Self {
        let n = qp.n;
        // J = L⁻ᵀ, column k solves Lᵀ J_k = e_k.
        let mut j = vec![0.0; n * n];
        for k in 0..n {
            for i in (0..=k).rev() {
                let sum: f64 = (i + 1..=k).map(|m| l[(m, i)] * j[k * n + m]).sum();
                let unit = if i == k { 1.0 } else { 0.0 };
                j[k * n + i] = (unit - sum) / l[(i, i)];
            }
        }
        // x = −J Jᵀ c.
        let mut x = vec![0.0; n];
        for column in j.chunks_exact(n.max(1)) {
            let d = dot(column, linear);
            for (x, c) in x.iter_mut().zip(column) {
                *x -= d * c;
            }
        }
        let r = vec![0.0; n * n];
        Self { qp, n, x, j, r, active: Vec::new(), multipliers: Vec::new(), signs: Vec::new() }
    }

    fn constraint(&self, k: usize) -> (&'q [f64], f64) {
        let equalities = self.qp.equalities.len();
        let (a, b) = if k < equalities {
            &self.qp.equalities[k]
        } else {
            &self.qp.inequalities[k - equalities]
        };
        (a, *b)
    }

    fn run(mut self) -> QpSolution {
        let equalities = self.qp.equalities.len();
        let total = equalities + self.qp.inequalities.len();
        let mut iterations = 0;
        let mut status = Status::Converged;
        for k in 0..equalities {
            iterations += 1;
            if !self.add(k, &mut iterations) {
                status = Status::Infeasible;
            }
        }
        let limit = 50 * (total + self.n) + 100;
        while status == Status::Converged {
            let Some(k) = self.most_violated(equalities, total) else { break };
            iterations += 1;
            if iterations > limit {
                status = Status::IterationLimit;
            } else if !self.add(k, &mut iterations) {
                status = Status::Infeasible;
            }
        }
        let mut multipliers = vec![0.0; total];
        for ((&k, &u), &sign) in self.active.iter().zip(&self.multipliers).zip(&self.signs) {
            multipliers[k] = sign * u;
        }
        QpSolution { status, x: self.x, objective: 0.0, multipliers, violation: 0.0, iterations }
    }

    /// The inequality violated most, relative to the length of its normal.
    fn most_violated(&self, first: usize, total: usize) -> Option<usize> {
        let mut worst = None;
        let mut most = 0.0;
        for k in (first..total).filter(|k| !self.active.contains(k)) {
            let (a, b) = self.constraint(k);
            let norm = dot(a, a).sqrt();
            let size = b.abs() + a.iter().zip(&self.x).map(|(a, x)| (a * x).abs()).sum::<f64>();
            let gap = b - dot(a, &self.x);
            let relative = if norm > 0.0 { gap / norm } else { gap };
            if gap > VIOLATION_TOL * size.max(norm) && relative > most {
                most = relative;
                worst = Some(k);
            }
        }
        worst
    }

    /// Moves until constraint `k` holds, dropping inequalities that stand in the way; false if
    /// nothing can make it hold.
    fn add(&mut self, k: usize, iterations: &mut usize) -> bool {
        let n = self.n;
        let (a, b) = self.constraint(k);
        let equality = k < self.qp.equalities.len();
        let sign = if equality && dot(a, &self.x) > b { -1.0 } else { 1.0 };
        let normal: Vec<f64> = a.iter().map(|a| sign * a).collect();
        let target = sign * b;
        let norm = dot(&normal, &normal).sqrt();
        let mut u = 0.0;
        loop {
            let q = self.active.len();
            let d: Vec<f64> = (0..n).map(|c| dot(&self.j[c * n..(c + 1) * n], &normal)).collect();
            // z: the step in the unknowns; t: the change of the multipliers.
            let mut z = vec![0.0; n];
            for c in q..n {
                for (z, j) in z.iter_mut().zip(&self.j[c * n..(c + 1) * n]) {
                    *z += d[c] * j;
                }
            }
            let mut t = vec![0.0; q];
            for i in (0..q).rev() {
                let sum: f64 = (i + 1..q).map(|m| self.r[m * n + i] * t[m]).sum();
                t[i] = (d[i] - sum) / self.r[i * n + i];
            }
            let free: f64 = d[q..].iter().map(|v| v * v).sum();
            let all: f64 = d.iter().map(|v| v * v).sum();
            let dependent = free <= 1e-24 * all || all == 0.0;
            let gap = target - dot(&normal, &self.x);
            if dependent && equality {
                // A repetition is harmless, a contradiction is not.
                return gap.abs() <= 1e-9 * (target.abs() + norm).max(f64::MIN_POSITIVE);
            }
            // The active inequality whose multiplier reaches zero first.
            let mut blocking = None;
            let mut dual_length = f64::INFINITY;
            for i in 0..q {
                let is_inequality = self.active[i] >= self.qp.equalities.len();
                if is_inequality && t[i] > 0.0 && self.multipliers[i] / t[i] < dual_length {
                    dual_length = self.multipliers[i] / t[i];
                    blocking = Some(i);
                }
            }
            let primal_length = if dependent { f64::INFINITY } else { gap / free };
            let length = primal_length.min(dual_length);
            if !length.is_finite() {
                return false;
            }
            for (m, t) in self.multipliers.iter_mut().zip(&t) {
                *m -= length * t;
            }
            u += length;
            if !dependent {
                for (x, z) in self.x.iter_mut().zip(&z) {
                    *x += length * z;
                }
            }
            if primal_length <= dual_length {
                self.extend(d);
                self.active.push(k);
                self.multipliers.push(u);
                self.signs.push(sign);
                return true;
            }
            *iterations += 1;
            if let Some(i) = blocking {
                self.drop_active(i);
            }
        }
    }

    /// Appends a column `d` to `R`, turning the free columns of `J` so that only one remains in
    /// its span.
    fn extend(&mut self, mut d: Vec<f64>) {
        let (n, q) = (self.n, self.active.len());
        for c in (q + 1..n).rev() {
            let (cos, sin, length) = givens(d[c - 1], d[c]);
            d[c - 1] = length;
            d[c] = 0.0;
            self.rotate_columns(c - 1, c, cos, sin);
        }
        self.r[q * n..q * n + q + 1].copy_from_slice(&d[..q + 1]);
    }

    /// Removes active constraint `i`.
    fn drop_active(&mut self, i: usize) {
        let n = self.n;
        self.active.remove(i);
        self.multipliers.remove(i);
        self.signs.remove(i);
        let q = self.active.len();
        for c in i..q {
            self.r.copy_within((c + 1) * n..(c + 1) * n + c + 2, c * n);
        }
        // The columns after the gap have one entry below the diagonal: rotate it away.
        for c in i..q {
            let (cos, sin, _) = givens(self.r[c * n + c], self.r[c * n + c + 1]);
            for m in c..q {
                let (a, b) = (self.r[m * n + c], self.r[m * n + c + 1]);
                self.r[m * n + c] = cos * a + sin * b;
                self.r[m * n + c + 1] = cos * b - sin * a;
            }
            self.rotate_columns(c, c + 1, cos, sin);
        }
    }

    fn rotate_columns(&mut self, a: usize, b: usize, cos: f64, sin: f64) {
        let n = self.n;
        for i in 0..n {
            let (p, q) = (self.j[a * n + i], self.j[b * n + i]);
            self.j[a * n + i] = cos * p + sin * q;
            self.j[b * n + i] = cos * q - sin * p;
        }
    }
}

/// Rotation that takes `(a, b)` to `(length, 0)`.
fn givens(a: f64, b: f64) -> (f64, f64, f64) {
    let length = a.hypot(b);
    if length == 0.0 { (1.0, 0.0, 0.0) } else { (a / length, b / length, length) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn contradicting_constraints_are_infeasible() {
        let mut qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, 1.0], vec![0.0; 2]);
        qp.at_least(&[1.0, 0.0], 1.0).at_least(&[-1.0, 0.0], 0.0);
        assert_eq!(qp.solve().unwrap().status, Status::Infeasible);
        let mut qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, 1.0], vec![0.0; 2]);
        qp.equal(&[1.0, 1.0], 1.0).equal(&[2.0, 2.0], 3.0);
        assert_eq!(qp.solve().unwrap().status, Status::Infeasible);
    }

    #[test]
    fn repeated_equalities_are_harmless() {
        let mut qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, 1.0], vec![0.0; 2]);
        qp.equal(&[1.0, 1.0], 2.0).equal(&[2.0, 2.0], 4.0);
        let solution = qp.solve().unwrap();
        assert_eq!(solution.status, Status::Converged);
        assert!(solution.x.iter().all(|v| (v - 1.0).abs() < 1e-14));
    }

    #[test]
    fn singular_hessian_with_bounds_is_solved() {
        // A linear program in y: min ½ (x − 1)² + y, y ≥ 3.
        let mut qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, 0.0], vec![-1.0, 1.0]);
        qp.lower_bound(1, 3.0);
        let solution = qp.solve().unwrap();
        assert_eq!(solution.status, Status::Converged);
        assert!((solution.x[0] - 1.0).abs() < 1e-9 && (solution.x[1] - 3.0).abs() < 1e-12);
    }

    #[test]
    fn an_indefinite_hessian_is_refused() {
        let qp = DenseQp::new(2, vec![1.0, 0.0, 0.0, -1.0], vec![0.0; 2]);
        assert!(matches!(qp.solve(), Err(SolverError::NotPositiveDefinite { variable: 1 })));
    }

    proptest! {
        /// Karush-Kuhn-Tucker conditions: stationary, feasible, complementary, right signs.
        #[test]
        fn solutions_meet_the_kkt_conditions(
            root in proptest::collection::vec(-1.0..1.0_f64, 36),
            linear in proptest::collection::vec(-3.0..3.0_f64, 6),
            rows in proptest::collection::vec(proptest::collection::vec(-1.0..1.0_f64, 6), 9),
        ) {
            let mut hessian = vec![0.0; 36];
            for i in 0..6 {
                for j in 0..6 {
                    hessian[i * 6 + j] = (0..6).map(|k| root[i * 6 + k] * root[j * 6 + k]).sum();
                }
                hessian[i * 6 + i] += 0.1;
            }
            let mut qp = DenseQp::new(6, hessian.clone(), linear.clone());
            qp.equal(&rows[0], 0.3);
            // The origin meets all inequalities strictly, so with one equality all is feasible.
            for row in &rows[1..] {
                qp.at_least(row, -2.0);
            }
            qp.lower_bound(2, -4.0).upper_bound(3, 5.0);
            let s = qp.solve().unwrap();
            prop_assume!(s.status == Status::Converged);
            prop_assert!(s.violation < 1e-9);
            let mut gradient: Vec<f64> = (0..6)
                .map(|i| dot(&hessian[i * 6..i * 6 + 6], &s.x) + linear[i])
                .collect();
            for (k, (a, b)) in qp.equalities.iter().chain(&qp.inequalities).enumerate() {
                let u = s.multipliers[k];
                for i in 0..6 {
                    gradient[i] -= u * a[i];
                }
                if k > 0 {
                    prop_assert!(u >= -1e-9);
                    prop_assert!((u * (dot(a, &s.x) - b)).abs() < 1e-7);
                }
            }
            let size = linear.iter().chain(&s.multipliers).fold(1.0_f64, |m, v| m.max(v.abs()));
            prop_assert!(gradient.iter().all(|g| g.abs() < 1e-8 * size), "{gradient:?}");
        }
    }
}
