//! Sparse quadratic programs with equations, and with equations to be met as well as can be.

use super::{LinearEquation, QpSolution, QuadraticTerm};
use crate::error::SolverError;
use crate::linear::{SparseCholesky, SymmetricPattern};
use crate::report::Status;

/// Share of the diagonal that keeps flat directions near zero; refinement takes it out of the others.
const SHIFT: f64 = 1e-13;
/// Rounds of multipliers for equations to be met as well as can be: each acts like more weight in
/// the directions that need it.
const ROUNDS: usize = 20;
/// Rounds at most until equations are met.
const MOST_ROUNDS: usize = 100;
/// Weight of an equation against the largest diagonal entry.
const PENALTY: f64 = 1e2;
/// Defects relative to the numbers of an equation at which the rounds end, and at which it counts
/// as met.
const MET: f64 = 1e-13;
const NEARLY: f64 = 1e-9;

/// Minimises `½ xᵀQ x + gᵀx`, sparse and positive semidefinite, under `A x = b`.
///
/// One Cholesky factor of energy and penalised equations, then the method of multipliers.
/// Besides equations there are [wishes](Self::wish): squares that are to be as small as they can be
/// at all, zero where that is possible, before the energy is.
///
/// ```
/// use gp_solver::{LinearEquation, SparseQp};
/// let mut qp = SparseQp::new(2);
/// qp.quadratic(0, 0, 1.0).quadratic(1, 1, 1.0);
/// qp.equal(LinearEquation { entries: vec![(0, 1.0), (1, 1.0)], value: 2.0 });
/// let x = qp.solve()?.x;
/// assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SparseQp {
    n: usize,
    terms: Vec<QuadraticTerm>,
    wishes: Vec<QuadraticTerm>,
    equations: Vec<LinearEquation>,
}

impl SparseQp {
    /// A program of `n` unknowns without energy.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { n, ..Self::default() }
    }

    /// Adds a share of the energy.
    pub fn term(&mut self, term: QuadraticTerm) -> &mut Self {
        self.terms.push(term);
        self
    }

    /// Adds to entry `(i, j)` of the symmetric `Q` and, off the diagonal, to its mirror image.
    pub fn quadratic(&mut self, i: usize, j: usize, value: f64) -> &mut Self {
        self.term(if i == j {
            QuadraticTerm { unknowns: vec![i], hessian: vec![value], gradient: vec![0.0] }
        } else {
            let hessian = vec![0.0, value, value, 0.0];
            QuadraticTerm { unknowns: vec![i, j], hessian, gradient: vec![0.0; 2] }
        })
    }

    /// Adds `value · x[i]`.
    pub fn linear(&mut self, i: usize, value: f64) -> &mut Self {
        self.term(QuadraticTerm { unknowns: vec![i], hessian: vec![0.0], gradient: vec![value] })
    }

    /// Adds squares that are to be as small as they can be, whatever the energy. Their weight
    /// decides how fast: larger ones cost digits.
    pub fn wish(&mut self, squares: QuadraticTerm) -> &mut Self {
        self.wishes.push(squares);
        self
    }

    /// Adds the equation `Σ a x = b`.
    pub fn equal(&mut self, equation: LinearEquation) -> &mut Self {
        self.equations.push(equation);
        self
    }

    /// Solves the program; unknowns without energy stay at zero. Contradicting equations are a
    /// status. The objective is that of the terms; multipliers are those of the equations.
    ///
    /// # Errors
    /// [`SolverError::EntryOutOfRange`], [`SolverError::NotPositiveDefinite`].
    pub fn solve(&self) -> Result<QpSolution, SolverError> {
        let n = self.n;
        let squares: Vec<QuadraticTerm> = self.penalties();
        let all = || self.terms.iter().chain(&self.wishes).chain(&squares);
        let pairs = |t: &QuadraticTerm| {
            let u = t.unknowns.clone();
            (0..u.len()).flat_map(move |a| {
                let u = u.clone();
                (0..=a).map(move |b| (u[a], u[b]))
            })
        };
        let diagonal = (0..n).map(|i| (i, i));
        let pattern = SymmetricPattern::new(n, all().flat_map(pairs).chain(diagonal))?;
        let mut values = vec![0.0; pattern.len()];
        let mut x = vec![0.0; n];
        for t in all() {
            let m = t.unknowns.len();
            for (a, i) in t.unknowns.iter().enumerate() {
                x[*i] -= t.gradient[a];
                for (b, j) in t.unknowns[..=a].iter().enumerate() {
                    let slot = pattern.slot(*i, *j).expect("the pattern has every entry");
                    values[slot] += t.hessian[a * m + b];
                }
            }
        }
        let mut right = x.clone();
        let mut shifted = values.clone();
        for i in 0..n {
            let slot = pattern.slot(i, i).expect("the pattern has the diagonal");
            // Flat directions stay near zero; refinement below takes the shift out of the others.
            shifted[slot] += SHIFT * values[slot] + f64::MIN_POSITIVE;
            if shifted[slot] == f64::MIN_POSITIVE {
                shifted[slot] = 1.0;
            }
        }
        let mut factor = SparseCholesky::new(pattern)?;
        factor.factor(&shifted)?;
        factor.solve_in_place(&mut x);
        let mut image = vec![0.0; n];
        let pushed = || self.wishes.iter().chain(&squares);
        let rounds = match (pushed().next(), self.equations.is_empty()) {
            (None, _) => 1,
            (Some(_), true) => ROUNDS,
            (Some(_), false) => MOST_ROUNDS,
        };
        let (mut done, mut multipliers) = (0, vec![0.0; self.equations.len()]);
        for round in 0..rounds {
            if round > 0 {
                // Multipliers: the forces of what is pushed stay on, whatever is left of them.
                for ((e, t), u) in self.equations.iter().zip(&squares).zip(&mut multipliers) {
                    *u += e.force(t, &x);
                }
                for t in pushed() {
                    let m = t.unknowns.len();
                    let own: Vec<f64> = t.unknowns.iter().map(|i| x[*i]).collect();
                    for (a, i) in t.unknowns.iter().enumerate() {
                        let row = &t.hessian[a * m..(a + 1) * m];
                        let force: f64 = row.iter().zip(&own).map(|(h, y)| h * y).sum();
                        right[*i] -= force + t.gradient[a];
                    }
                }
            }
            let met = !self.equations.is_empty()
                && round + 1 >= ROUNDS
                && self.equations.iter().all(|e| e.is_met(&x, MET));
            let last = round + 1 == rounds || met;
            // The last round is refined once more.
            for _ in 0..1 + usize::from(last) {
                factor.pattern().multiply(&values, &x, &mut image);
                let mut step: Vec<f64> = right.iter().zip(&image).map(|(r, y)| r - y).collect();
                factor.solve_in_place(&mut step);
                x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
            }
            done = round + 1;
            if last {
                break;
            }
        }
        for ((e, t), u) in self.equations.iter().zip(&squares).zip(&mut multipliers) {
            *u += e.force(t, &x);
        }
        Ok(self.finish(x, multipliers, done))
    }

    /// Equations as squares, of one weight in units of the energy.
    fn penalties(&self) -> Vec<QuadraticTerm> {
        let diagonal = |t: &QuadraticTerm| {
            let m = t.unknowns.len();
            (0..m).map(|a| t.hessian[a * m + a].abs()).fold(0.0, f64::max)
        };
        let largest = self.terms.iter().map(diagonal).fold(0.0, f64::max);
        let size = PENALTY * if largest > 0.0 { largest } else { 1.0 };
        self.equations.iter().map(|e| e.square(size)).collect()
    }

    fn finish(&self, x: Vec<f64>, multipliers: Vec<f64>, rounds: usize) -> QpSolution {
        let mut objective = 0.0;
        for t in &self.terms {
            let m = t.unknowns.len();
            for (a, i) in t.unknowns.iter().enumerate() {
                let row = &t.hessian[a * m..(a + 1) * m];
                let image: f64 = row.iter().zip(&t.unknowns).map(|(h, j)| h * x[*j]).sum();
                objective += x[*i] * (0.5 * image + t.gradient[a]);
            }
        }
        let violation = self.equations.iter().map(|e| e.defect(&x).abs()).fold(0.0, f64::max);
        let status = if self.equations.iter().all(|e| e.is_met(&x, NEARLY)) {
            Status::Converged
        } else {
            Status::Infeasible
        };
        QpSolution { status, x, objective, multipliers, violation, iterations: rounds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of 40 points with fixed ends and a fixed mean, as smooth as possible.
    fn chain() -> SparseQp {
        let mut qp = SparseQp::new(40);
        for i in 1..39 {
            let row = [1.0, -2.0, 1.0];
            qp.term(QuadraticTerm {
                unknowns: vec![i - 1, i, i + 1],
                hessian: row.iter().flat_map(|a| row.map(|b| a * b)).collect(),
                gradient: vec![0.0; 3],
            });
        }
        let equal = |entries: Vec<(usize, f64)>, value: f64| LinearEquation { entries, value };
        qp.equal(equal(vec![(0, 1.0)], 0.0)).equal(equal(vec![(39, 3.0)], 3.0));
        qp.equal(equal((0..40).map(|i| (i, 0.025)).collect(), 2.0));
        qp
    }

    #[test]
    fn repeated_equations_are_harmless_and_contradictions_found() {
        let mut qp = chain();
        let once = qp.solve().unwrap();
        assert_eq!(once.status, Status::Converged, "{once:?}");
        qp.equal(LinearEquation { entries: vec![(0, 2.0)], value: 0.0 });
        let twice = qp.solve().unwrap();
        assert_eq!(twice.status, Status::Converged);
        for (a, b) in once.x.iter().zip(&twice.x) {
            assert!((a - b).abs() < 1e-7, "{a} {b}");
        }
        qp.equal(LinearEquation { entries: vec![(0, 1.0)], value: 0.5 });
        assert_eq!(qp.solve().unwrap().status, Status::Infeasible);
    }

    #[test]
    fn wishes_go_before_the_energy_where_they_can_be_had() {
        // Two wishes that contradict one another for x₀, one for x₁ that can be had.
        let square = |i: usize, b: f64| QuadraticTerm {
            unknowns: vec![i],
            hessian: vec![1.0],
            gradient: vec![-b],
        };
        let mut qp = SparseQp::new(2);
        qp.quadratic(0, 0, 0.01).quadratic(1, 1, 0.01).quadratic(0, 1, 0.005);
        qp.wish(square(0, 1.0)).wish(square(0, 3.0)).wish(square(1, 5.0));
        let x = qp.solve().unwrap().x;
        assert!((x[0] - 2.0).abs() < 1e-12 && (x[1] - 5.0).abs() < 1e-12, "{x:?}");
    }
}
