//! Sparse quadratic programs with simple bounds, by a primal-dual active set.

use super::{LinearEquation, QpSolution, QuadraticTerm};
use crate::error::SolverError;
use crate::linear::{SparseCholesky, SymmetricPattern};
use crate::report::Status;
use numerics::{Matrix, axpy, minimize_quadratic};

/// Up to this many free unknowns the system is solved densely.
const DENSE_LIMIT: usize = 64;
/// Changes of the active set at most.
const ROUNDS: usize = 100;
/// Weight of equations against the largest diagonal entry.
const PENALTY: f64 = 1e4;
/// Defects relative to the numbers of an equation at which the steps end, and at which it counts as
/// met.
const MET: f64 = 1e-13;
const NEARLY: f64 = 1e-9;
/// Steps of the multipliers at most.
const STEPS: usize = 100;

/// Minimises `½ xᵀA x + gᵀx` within `lower ≤ x ≤ upper`, sparse, `A` positive semidefinite.
///
/// A primal-dual active set (Hintermüller, Ito and Kunisch 2002): each round solves for the free
/// unknowns, holds those that leave their bounds and frees those whose multiplier has the wrong sign;
/// for weakly coupled systems it ends after a few rounds. Unknowns without energy stay at zero or
/// at the bound next to it. Equations, if any, are met by the method of multipliers around it.
///
/// ```
/// use gp_solver::BoundedQp;
/// let mut qp = BoundedQp::new(2);
/// qp.quadratic(0, 0, 2.0).quadratic(1, 1, 2.0).quadratic(0, 1, 1.0);
/// qp.linear(0, -4.0).linear(1, -5.0).bounds(1, 0.0, 1.0);
/// let x = qp.solve()?.x; // free: (1, 2)
/// assert!((x[0] - 1.5).abs() < 1e-15 && x[1] == 1.0);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct BoundedQp {
    diagonal: Vec<f64>,
    couplings: Vec<(usize, usize, f64)>,
    gradient: Vec<f64>,
    bounds: Vec<[f64; 2]>,
    equations: Vec<LinearEquation>,
}

impl BoundedQp {
    /// A program of `n` unknowns without energy or bounds.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            diagonal: vec![0.0; n],
            couplings: Vec::new(),
            gradient: vec![0.0; n],
            bounds: vec![[f64::NEG_INFINITY, f64::INFINITY]; n],
            equations: Vec::new(),
        }
    }

    /// Adds to entry `(i, j)` of the symmetric `A` and, off the diagonal, to its mirror image.
    pub fn quadratic(&mut self, i: usize, j: usize, value: f64) -> &mut Self {
        if i == j {
            self.diagonal[i] += value;
        } else {
            self.couplings.push((i, j, value));
        }
        self
    }

    /// Adds `value · x[i]`.
    pub fn linear(&mut self, i: usize, value: f64) -> &mut Self {
        self.gradient[i] += value;
        self
    }

    /// Adds a share of the energy.
    pub fn term(&mut self, term: &QuadraticTerm) -> &mut Self {
        let m = term.unknowns.len();
        for (a, &i) in term.unknowns.iter().enumerate() {
            self.linear(i, term.gradient[a]);
            for (b, &j) in term.unknowns[..=a].iter().enumerate() {
                self.quadratic(i, j, term.hessian[a * m + b]);
            }
        }
        self
    }

    /// Keeps `lower ≤ x[i] ≤ upper`.
    pub fn bounds(&mut self, i: usize, lower: f64, upper: f64) -> &mut Self {
        self.bounds[i] = [lower, upper];
        self
    }

    /// Adds the equation `Σ a x = b`.
    pub fn equal(&mut self, equation: LinearEquation) -> &mut Self {
        self.equations.push(equation);
        self
    }

    /// Solves the program. Crossing bounds and contradicting equations are a status. Multipliers
    /// are those of the equations, then one for each unknown: the slope of the energy where a
    /// bound holds it (positive at the lower one, negative at the upper).
    ///
    /// # Errors
    /// [`SolverError::BadOption`] if a number is not finite (bounds may be infinite, not NaN).
    pub fn solve(&self) -> Result<QpSolution, SolverError> {
        self.check()?;
        if self.equations.is_empty() {
            return Ok(self.finish(self.active_set(), Vec::new()));
        }
        let size = self.diagonal.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        let squares: Vec<QuadraticTerm> =
            self.equations.iter().map(|e| e.square(PENALTY * size)).collect();
        let mut penalised = Self { equations: Vec::new(), ..self.clone() };
        squares.iter().for_each(|t| _ = penalised.term(t));
        let gradient = penalised.gradient.clone();
        let mut multipliers = vec![0.0; self.equations.len()];
        let mut run = Run { x: Vec::new(), settled: false, rounds: 0 };
        for _ in 0..STEPS {
            penalised.gradient.clone_from(&gradient);
            for (e, u) in self.equations.iter().zip(&multipliers) {
                e.entries.iter().for_each(|(i, a)| penalised.gradient[*i] -= u * a);
            }
            let rounds = run.rounds;
            run = penalised.active_set();
            run.rounds += rounds;
            for ((e, t), u) in self.equations.iter().zip(&squares).zip(&mut multipliers) {
                *u += e.force(t, &run.x);
            }
            if self.equations.iter().all(|e| e.is_met(&run.x, MET)) {
                break;
            }
        }
        Ok(self.finish(run, multipliers))
    }

    fn check(&self) -> Result<(), SolverError> {
        let equations =
            self.equations.iter().flat_map(|e| e.entries.iter().map(|(_, a)| *a).chain([e.value]));
        let numbers = self.diagonal.iter().chain(&self.gradient).copied();
        let couplings = self.couplings.iter().map(|(.., a)| *a);
        let not_finite = numbers.chain(couplings).chain(equations).find(|v| !v.is_finite());
        let not_a_number = self.bounds.iter().flatten().copied().find(|b| b.is_nan());
        match not_finite.or(not_a_number) {
            Some(value) => {
                let name = "coefficient of the quadratic program";
                Err(SolverError::BadOption { name, value, need: "finite" })
            }
            None => Ok(()),
        }
    }

    fn finish(&self, run: Run, mut multipliers: Vec<f64>) -> QpSolution {
        let x = run.x;
        let mut slope = self.slopes(&x);
        let objective =
            x.iter().zip(&slope).zip(&self.gradient).map(|((x, s), g)| 0.5 * x * (s + g)).sum();
        for (e, u) in self.equations.iter().zip(&multipliers) {
            e.entries.iter().for_each(|(i, a)| slope[*i] -= u * a);
        }
        let held = |v: usize| x[v] == self.bounds[v][0] || x[v] == self.bounds[v][1];
        multipliers.extend((0..x.len()).map(|v| if held(v) { slope[v] } else { 0.0 }));
        let outside = |(x, b): (&f64, &[f64; 2])| (b[0] - x).max(x - b[1]).max(0.0);
        let bounds = x.iter().zip(&self.bounds).map(outside);
        let equations = self.equations.iter().map(|e| e.defect(&x).abs());
        let violation = bounds.chain(equations).fold(0.0, f64::max);
        let crossing = self.bounds.iter().any(|b| b[0] > b[1]);
        let status = if crossing || !self.equations.iter().all(|e| e.is_met(&x, NEARLY)) {
            Status::Infeasible
        } else if run.settled {
            Status::Converged
        } else {
            Status::IterationLimit
        };
        QpSolution { status, x, objective, multipliers, violation, iterations: run.rounds }
    }

    /// `A x + g`.
    fn slopes(&self, x: &[f64]) -> Vec<f64> {
        let mut slope: Vec<f64> =
            (0..x.len()).map(|v| self.gradient[v] + self.diagonal[v] * x[v]).collect();
        for &(i, j, a) in &self.couplings {
            slope[i] += a * x[j];
            slope[j] += a * x[i];
        }
        slope
    }

    fn active_set(&self) -> Run {
        let (n, bounds) = (self.diagonal.len(), &self.bounds);
        // 0 free, −1 at the lower bound, +1 at the upper, 2 fixed for good.
        let mut state: Vec<i8> = (0..n)
            .map(|v| if bounds[v][0] == bounds[v][1] || self.diagonal[v] == 0.0 { 2 } else { 0 })
            .collect();
        let nearest = |v: f64, b: &[f64; 2]| if b[0] <= b[1] { v.clamp(b[0], b[1]) } else { v };
        let mut x: Vec<f64> =
            bounds.iter().map(|b| if b[0] == b[1] { b[0] } else { nearest(0.0, b) }).collect();
        let (mut settled, mut rounds) = (false, 0);
        while !settled && rounds < ROUNDS {
            rounds += 1;
            for v in 0..n {
                match state[v] {
                    -1 => x[v] = bounds[v][0],
                    1 => x[v] = bounds[v][1],
                    _ => {}
                }
            }
            self.solve_free(&state, &mut x);
            let slope = self.slopes(&x);
            settled = true;
            for v in 0..n {
                let next = match state[v] {
                    0 if x[v] < bounds[v][0] => -1,
                    0 if x[v] > bounds[v][1] => 1,
                    -1 if slope[v] < 0.0 => 0,
                    1 if slope[v] > 0.0 => 0,
                    same => same,
                };
                settled &= next == state[v];
                state[v] = next;
            }
        }
        x.iter_mut().zip(bounds).for_each(|(x, b)| *x = nearest(*x, b));
        Run { x, settled, rounds }
    }

    /// Solves for the unknowns in state 0, the others as they stand in `x`.
    fn solve_free(&self, state: &[i8], x: &mut [f64]) {
        let free: Vec<usize> = (0..state.len()).filter(|v| state[*v] == 0).collect();
        let mut index = vec![usize::MAX; state.len()];
        for (k, v) in free.iter().enumerate() {
            index[*v] = k;
        }
        let mut right: Vec<f64> = free.iter().map(|v| self.gradient[*v]).collect();
        for &(i, j, a) in &self.couplings {
            if state[i] == 0 && state[j] != 0 {
                right[index[i]] += a * x[j];
            }
            if state[j] == 0 && state[i] != 0 {
                right[index[j]] += a * x[i];
            }
        }
        let inner: Vec<(usize, usize, f64)> = self
            .couplings
            .iter()
            .filter(|(i, j, _)| state[*i] == 0 && state[*j] == 0)
            .map(|(i, j, a)| (index[*i], index[*j], *a))
            .collect();
        let own: Vec<f64> = free.iter().map(|v| self.diagonal[*v]).collect();
        let sparse = (free.len() > DENSE_LIMIT).then(|| sparse_minimum(&own, &inner, &right));
        let solution = if let Some(Ok(solution)) = sparse {
            solution
        } else {
            // Few unknowns, or a matrix singular to rounding, which the shifts in here can take.
            let n = free.len();
            let mut a = Matrix::zeros(n, n);
            for (k, d) in own.iter().enumerate() {
                a[(k, k)] = *d;
            }
            for (i, j, value) in &inner {
                a[(*i, *j)] += value;
                a[(*j, *i)] += value;
            }
            minimize_quadratic(&a, &right)
        };
        for (k, v) in free.iter().enumerate() {
            x[*v] = solution[k];
        }
    }
}

/// Where the active set ended.
struct Run {
    x: Vec<f64>,
    settled: bool,
    rounds: usize,
}

/// The free minimum by a sparse Cholesky factor.
fn sparse_minimum(
    diagonal: &[f64],
    couplings: &[(usize, usize, f64)],
    gradient: &[f64],
) -> Result<Vec<f64>, SolverError> {
    let n = diagonal.len();
    let entries = couplings.iter().map(|(i, j, _)| (*i, *j));
    let pattern = SymmetricPattern::new(n, entries.chain((0..n).map(|i| (i, i))))?;
    let mut values = vec![0.0; pattern.len()];
    let own = diagonal.iter().enumerate().map(|(i, d)| (i, i, *d));
    for (i, j, a) in own.chain(couplings.iter().copied()) {
        let slot = pattern.slot(i, j).expect("the pattern has every entry");
        values[slot] += a;
    }
    let mut factor = SparseCholesky::new(pattern)?;
    factor.factor(&values)?;
    let mut x: Vec<f64> = gradient.iter().map(|g| -g).collect();
    factor.solve_in_place(&mut x);
    // One step of refinement, as the dense solution has.
    let mut image = vec![0.0; n];
    factor.pattern().multiply(&values, &x, &mut image);
    let mut step: Vec<f64> = gradient.iter().zip(&image).map(|(g, y)| -g - y).collect();
    factor.solve_in_place(&mut step);
    axpy(1.0, &step, &mut x);
    Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: usize) -> BoundedQp {
        let mut qp = BoundedQp::new(n);
        for i in 0..n {
            qp.quadratic(i, i, 3.0 + (i % 5) as f64).linear(i, (i as f64 * 0.7).sin());
            if i > 0 {
                qp.quadratic(i - 1, i, 1.0);
            }
        }
        qp
    }

    #[test]
    fn sparse_and_dense_solves_agree() {
        let qp = chain(60);
        let dense = qp.solve().unwrap().x;
        let sparse = sparse_minimum(&qp.diagonal, &qp.couplings, &qp.gradient).unwrap();
        for (a, b) in dense.iter().zip(sparse) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn bounded_minimum_satisfies_its_conditions() {
        let mut qp = chain(30);
        (0..30).for_each(|v| _ = qp.bounds(v, -0.05, 0.1));
        let x = qp.solve().unwrap().x;
        for (x, slope) in x.iter().zip(qp.slopes(&x)) {
            match *x {
                -0.05 => assert!(slope >= 0.0),
                0.1 => assert!(slope <= 0.0),
                _ => assert!(slope.abs() < 1e-13),
            }
        }
    }
}
