//! Sparse quadratic programs with inequalities, by an interior point method.

use super::QpSolution;
use crate::error::SolverError;
use crate::linear::{SparseCholesky, SymmetricPattern};
use crate::report::Status;

/// Largest sum of slacks times multipliers at the end, as a share of the energy.
const GAP: f64 = 1e-12;
/// Steps at most.
const MOST_STEPS: usize = 80;
/// Share of the way to the nearest bound a step goes.
const SHORT_OF_BOUND: f64 = 0.995;
/// Least slack at the start, as a share of the largest bound, and first multipliers, as a share of
/// the mean diagonal of the quadratic form.
const FIRST_SLACK: f64 = 0.05;
const FIRST_MULTIPLIER: f64 = 0.01;
/// Added to the diagonal, as a share of its mean.
const SHIFT: f64 = 1e-12;
/// Shifts that are tried, each so many times as large as the one before.
const SHIFTS: usize = 4;
const SHIFT_GROWTH: f64 = 1e3;
/// Steps before the multipliers are looked at for a proof that no point fulfils the rows.
const STEPS_BEFORE_PROOF: usize = 5;

/// Minimises `½ xᵀQ x + gᵀx`, sparse and positive semidefinite, under `a·x ≥ b` for any number of
/// rows each of which couples few unknowns.
///
/// Mehrotra's predictor and corrector (Mehrotra 1992), started at `x = 0`: write programs so that
/// zero is a good guess. The normal matrix `Q + AᵀDA` is factored with one pattern throughout.
///
/// # Example
/// ```
/// use gp_solver::{InequalityQp, Status, SymmetricPattern};
/// // ½(x² + y²) − x with x + y ≥ 2
/// let pattern = SymmetricPattern::new(2, [(1, 0)])?;
/// let mut qp = InequalityQp::new(&pattern, &[1.0, 0.0, 1.0], &[-1.0, 0.0]);
/// qp.at_least(&[(0, 1.0), (1, 1.0)], 2.0);
/// let solution = qp.solve()?;
/// assert_eq!(solution.status, Status::Converged);
/// assert!((solution.x[0] - 1.5).abs() < 1e-7 && (solution.x[1] - 0.5).abs() < 1e-7);
/// assert!((solution.multipliers[0] - 0.5).abs() < 1e-6);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct InequalityQp<'a> {
    pattern: &'a SymmetricPattern,
    values: &'a [f64],
    gradient: &'a [f64],
    /// Where the entries of each row begin, and the total at the end.
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
    bounds: Vec<f64>,
    reach: f64,
    tolerance: f64,
}

impl<'a> InequalityQp<'a> {
    /// A program without rows; `values` are those of `Q` on the pattern, which must have a place for
    /// every pair of unknowns of a row.
    ///
    /// # Panics
    /// If there is not one value per entry and one gradient per unknown.
    #[must_use]
    pub fn new(pattern: &'a SymmetricPattern, values: &'a [f64], gradient: &'a [f64]) -> Self {
        assert_eq!(values.len(), pattern.len(), "one value per entry of the pattern");
        assert_eq!(gradient.len(), pattern.size(), "one gradient per unknown");
        let (starts, entries, bounds) = (vec![0], Vec::new(), Vec::new());
        let (reach, tolerance) = (1e3, 1e-8);
        Self { pattern, values, gradient, starts, entries, bounds, reach, tolerance }
    }

    /// Adds the row `Σ a x ≥ bound`; an empty one is left alone.
    pub fn at_least(&mut self, entries: &[(usize, f64)], bound: f64) -> &mut Self {
        self.entries.extend(entries.iter().map(|&(i, a)| (i as u32, a)));
        self.starts.push(self.entries.len());
        self.bounds.push(bound);
        self
    }

    /// Largest `|x|` that counts: a program is [`Status::Infeasible`] once it is proven that no `x`
    /// within it fulfils the rows (1000 without this).
    pub fn within(&mut self, reach: f64) -> &mut Self {
        self.reach = reach;
        self
    }

    /// Solves the program. If it is infeasible, the multipliers `z ≥ 0` are the proof: with them the
    /// rows add up to `(Aᵀz)·x ≥ bᵀz`, which no `x` within the reach fulfils.
    ///
    /// # Errors
    /// [`SolverError::EntryOutOfRange`] for a row the pattern has no place for,
    /// [`SolverError::OutOfMemory`].
    pub fn solve(&self) -> Result<QpSolution, SolverError> {
        let (n, m) = (self.pattern.size(), self.bounds.len());
        let places = self.places()?;
        let starts = self.pattern.column_starts();
        let mean = starts[..n].iter().map(|&s| self.values[s]).sum::<f64>() / n.max(1) as f64;
        let mean = if mean > 0.0 { mean } else { 1.0 };
        let largest = self.bounds.iter().fold(0.0_f64, |most, b| most.max(b.abs()));
        let mut cholesky = SparseCholesky::new(self.pattern.clone())?;
        let mut x = vec![0.0; n];
        let least = FIRST_SLACK * if largest > 0.0 { largest } else { 1.0 };
        let mut slack: Vec<f64> = self.bounds.iter().map(|b| (-b).max(least)).collect();
        let mut z = vec![FIRST_MULTIPLIER * mean; m];
        let (mut image, mut forces) = (vec![0.0; m], vec![0.0; n]);
        let (mut normal, mut quadratic) = (vec![0.0; self.pattern.len()], vec![0.0; n]);
        let mut predicted = Direction::new(n, m);
        let mut step = Direction::new(n, m);
        let mut status = Status::IterationLimit;
        let mut done = 0;
        while done < MOST_STEPS {
            self.pattern.multiply(self.values, &x, &mut quadratic);
            self.forces(&z, &mut forces);
            self.images(&x, &mut image);
            let dual: Vec<f64> =
                (0..n).map(|i| quadratic[i] + self.gradient[i] - forces[i]).collect();
            let primal: Vec<f64> = (0..m).map(|r| image[r] - slack[r] - self.bounds[r]).collect();
            let gap: f64 = slack.iter().zip(&z).map(|(s, z)| s * z).sum();
            let energy: f64 = (0..n).map(|i| x[i] * (0.5 * quadratic[i] + self.gradient[i])).sum();
            let most = |list: &[f64]| list.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            let tol = self.tolerance;
            if most(&dual) <= tol * mean
                && most(&primal) <= tol * largest.max(1.0)
                && gap <= GAP * energy.abs().max(mean)
            {
                status = Status::Converged;
                break;
            }
            if done > STEPS_BEFORE_PROOF {
                let scale = most(&z);
                let bound: f64 = self.bounds.iter().zip(&z).map(|(b, z)| b * (z / scale)).sum();
                let pull: f64 = forces.iter().map(|f| (f / scale).abs()).sum();
                if bound > self.reach * pull {
                    status = Status::Infeasible;
                    break;
                }
            }
            normal.copy_from_slice(self.values);
            self.add_rows(&places, &slack, &z, &mut normal);
            if !self.factored(&mut cholesky, &mut normal, SHIFT * mean)? {
                status = Status::Stalled;
                break;
            }
            let residuals = Residuals { dual: &dual, primal: &primal, slack: &slack, z: &z };
            let complement: Vec<f64> = (0..m).map(|r| slack[r] * z[r]).collect();
            self.direction(&cholesky, &residuals, &complement, &mut predicted);
            let (own, other) = (length(&slack, &predicted.slack), length(&z, &predicted.z));
            let mu = gap / m.max(1) as f64;
            let ahead: f64 = (0..m)
                .map(|r| (slack[r] + own * predicted.slack[r]) * (z[r] + other * predicted.z[r]))
                .sum::<f64>()
                / m.max(1) as f64;
            let aim = (ahead / mu).powi(3) * mu;
            let complement: Vec<f64> = (0..m)
                .map(|r| slack[r] * z[r] + predicted.slack[r] * predicted.z[r] - aim)
                .collect();
            self.direction(&cholesky, &residuals, &complement, &mut step);
            let length = length(&slack, &step.slack).min(length(&z, &step.z));
            x.iter_mut().zip(&step.x).for_each(|(x, d)| *x += length * d);
            slack.iter_mut().zip(&step.slack).for_each(|(s, d)| *s += length * d);
            z.iter_mut().zip(&step.z).for_each(|(z, d)| *z += length * d);
            done += 1;
        }
        self.pattern.multiply(self.values, &x, &mut quadratic);
        self.images(&x, &mut image);
        let missing = image.iter().zip(&self.bounds).map(|(a, b)| b - a);
        Ok(QpSolution {
            status,
            objective: (0..n).map(|i| x[i] * (0.5 * quadratic[i] + self.gradient[i])).sum(),
            violation: missing.fold(0.0, f64::max),
            multipliers: z,
            x,
            iterations: done,
        })
    }

    /// Factors the normal matrix with a shift, a larger one where rounding asks for it; `false` if
    /// none helps.
    fn factored(
        &self,
        cholesky: &mut SparseCholesky,
        normal: &mut [f64],
        shift: f64,
    ) -> Result<bool, SolverError> {
        let diagonals = &self.pattern.column_starts()[..self.pattern.size()];
        let mut added = shift;
        for _ in 0..SHIFTS {
            diagonals.iter().for_each(|&slot| normal[slot] += added);
            match cholesky.factor(normal) {
                Ok(()) => return Ok(true),
                Err(SolverError::NotPositiveDefinite { .. }) => added *= SHIFT_GROWTH,
                Err(e) => return Err(e),
            }
        }
        Ok(false)
    }

    fn row(&self, r: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[r]..self.starts[r + 1]]
    }

    /// Where the products of each row's entries stand in the pattern, row after row.
    fn places(&self) -> Result<Vec<usize>, SolverError> {
        let mut places = Vec::with_capacity(2 * self.entries.len());
        for r in 0..self.bounds.len() {
            for (at, &(i, _)) in self.row(r).iter().enumerate() {
                for &(j, _) in &self.row(r)[..=at] {
                    let (row, column, size) = (i as usize, j as usize, self.pattern.size());
                    let inside = row < size && column < size;
                    let place = if inside { self.pattern.slot(row, column) } else { None };
                    places.push(place.ok_or(SolverError::EntryOutOfRange { row, column, size })?);
                }
            }
        }
        Ok(places)
    }

    /// Adds `Aᵀ diag(z / s) A`.
    fn add_rows(&self, places: &[usize], slack: &[f64], z: &[f64], normal: &mut [f64]) {
        let mut next = places.iter();
        for r in 0..self.bounds.len() {
            let weight = z[r] / slack[r];
            for (at, &(_, a)) in self.row(r).iter().enumerate() {
                for &(_, b) in &self.row(r)[..=at] {
                    if let Some(&place) = next.next() {
                        normal[place] += weight * a * b;
                    }
                }
            }
        }
    }

    /// `Aᵀz`
    fn forces(&self, z: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (r, z) in z.iter().enumerate() {
            for &(i, a) in self.row(r) {
                out[i as usize] += a * z;
            }
        }
    }

    /// `A x`
    fn images(&self, x: &[f64], out: &mut [f64]) {
        for (r, out) in out.iter_mut().enumerate() {
            *out = self.row(r).iter().map(|&(i, a)| a * x[i as usize]).sum();
        }
    }

    /// The Newton step for which `z ds + s dz = −complement`.
    fn direction(
        &self,
        cholesky: &SparseCholesky,
        at: &Residuals<'_>,
        complement: &[f64],
        out: &mut Direction,
    ) {
        let m = self.bounds.len();
        for r in 0..m {
            out.z[r] = (-complement[r] - at.z[r] * at.primal[r]) / at.slack[r];
        }
        self.forces(&out.z, &mut out.x);
        out.x.iter_mut().zip(at.dual).for_each(|(x, d)| *x -= d);
        cholesky.solve_in_place(&mut out.x);
        self.images(&out.x, &mut out.slack);
        for r in 0..m {
            out.slack[r] += at.primal[r];
            out.z[r] = (-complement[r] - at.z[r] * out.slack[r]) / at.slack[r];
        }
    }
}

struct Residuals<'a> {
    dual: &'a [f64],
    primal: &'a [f64],
    slack: &'a [f64],
    z: &'a [f64],
}

struct Direction {
    x: Vec<f64>,
    slack: Vec<f64>,
    z: Vec<f64>,
}

impl Direction {
    fn new(n: usize, m: usize) -> Self {
        Self { x: vec![0.0; n], slack: vec![0.0; m], z: vec![0.0; m] }
    }
}

/// The longest step, 1 at most, that keeps positive values positive.
fn length(values: &[f64], step: &[f64]) -> f64 {
    let falling = values.iter().zip(step).filter(|(_, d)| **d < 0.0);
    falling.map(|(v, d)| SHORT_OF_BOUND * v / -d).fold(1.0, f64::min)
}
