//! Shortest steps onto constraints.

use crate::block::ResidualBlock;
use crate::clock::Instant;
use crate::error::{Quantity, SolverError};
use crate::linear::{MultifrontalCholesky, SymmetricPattern};
use crate::observer::{Observer, Progress};
use crate::report::{IterationRecord, Report, Status, Term, Timings};
use crate::schedule::Stage;

/// A factorisation serves for another step if the last one left at most this share of `max |C|`.
const KEEP: f64 = 0.1;
/// The shift falls after a step that leaves more than this share of `max |C|`.
const SLOW: f64 = 0.5;
/// The shift falls no further than this.
const LEAST_SHIFT: f64 = 1e-14;

/// Settings of [`MinNormProjection::project`].
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectionOptions {
    /// Added to the diagonal of `J S Sᵀ Jᵀ`, as a fraction of its largest entry; keeps redundant
    /// constraints solvable. It also holds back directions in which the constraints hardly change,
    /// so it falls to a tenth after every step that leaves more than half of `max |C|`, for as
    /// long as the matrix can be factored.
    pub shift: f64,
    /// Converged if `max |C| ≤ tolerance`.
    pub tolerance: f64,
    /// [`IterationLimit`](Status::IterationLimit) once the number of steps `≥ max_iterations`.
    pub max_iterations: usize,
}

impl Default for ProjectionOptions {
    fn default() -> Self {
        Self { shift: 1e-12, tolerance: 1e-12, max_iterations: 20 }
    }
}

/// Newton's method for `C(z) = 0` with steps of least `|S⁻¹ s|`:
/// `z ← z − S Sᵀ Jᵀ (J S Sᵀ Jᵀ + shift I)⁻¹ C`, with the pattern of the matrix analysed once and
/// its factorisation kept (with its `J`) as long as every step leaves at most a tenth of `max |C|`.
///
/// Made to polish a solution: constraints that least squares left at 10⁻⁶ go to rounding level,
/// and the unknowns move no farther than they must.
pub struct MinNormProjection {
    unknowns: usize,
    cholesky: MultifrontalCholesky,
    /// For each unknown its (row, place in the Jacobian values), in the order of rows.
    entries: Vec<(usize, usize)>,
    starts: Vec<usize>,
    /// Where the products of the pairs of each unknown's entries go.
    targets: Vec<usize>,
    /// Time the plan took.
    plan: std::time::Duration,
}

impl MinNormProjection {
    /// Plans the projection onto the zero set of `constraints` in a space of `unknowns` unknowns.
    /// Rows come in runs of `run` that concern the same thing, such as the coordinates of an edge;
    /// nested dissection keeps them together.
    ///
    /// # Errors
    /// [`SolverError::ColumnOutOfRange`] or [`SolverError::TooLarge`].
    ///
    /// # Panics
    /// If `run` is zero.
    pub fn new(
        constraints: &dyn ResidualBlock,
        unknowns: usize,
        run: usize,
    ) -> Result<Self, SolverError> {
        let begin = Instant::now();
        let elements = constraints.elements();
        let mut lists = vec![Vec::new(); unknowns];
        for e in 0..elements.len() {
            let columns = elements.columns(e);
            if let Some(&column) = columns.iter().find(|&&c| c >= unknowns) {
                let block = constraints.name().to_owned();
                return Err(SolverError::ColumnOutOfRange { block, element: e, column, unknowns });
            }
            let begin = elements.jacobian_range(e).start;
            for (r, row) in elements.rows(e).enumerate() {
                for (k, &column) in columns.iter().enumerate() {
                    lists[column].push((row, begin + r * columns.len() + k));
                }
            }
        }
        let pairs = lists.iter().flat_map(|list| {
            list.iter()
                .enumerate()
                .flat_map(move |(k, &(i, _))| list[..=k].iter().map(move |&(j, _)| (i, j)))
        });
        let pattern = SymmetricPattern::new(elements.rows_total(), pairs.clone())?;
        let targets =
            pairs.map(|(i, j)| pattern.slot(i, j).expect("the pattern has every pair")).collect();
        let mut starts = vec![0];
        for list in &lists {
            starts.push(starts[starts.len() - 1] + list.len());
        }
        let together: Vec<usize> = (0..pattern.size()).map(|row| row / run).collect();
        let cholesky = MultifrontalCholesky::new(pattern, &together)?;
        let (entries, plan) = (lists.concat(), begin.elapsed());
        Ok(Self { unknowns, cholesky, entries, starts, targets, plan })
    }

    /// Projects `z`; `scale[i]` is how willingly unknown `i` moves (0 holds it). `observer` is asked
    /// between factorisations whether to stop and shown the start and every step; there is no
    /// checkpoint within a projection, which is repeated from its start.
    ///
    /// The report's energy is `½ |C|²`; its gradient norms are `max |C|`: the first record has that
    /// of the start, [`Report::gradient_norm`] that of the result. The status is
    /// [`Stalled`](Status::Stalled) if the constraints stopped shrinking.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`] names a row, [`SolverError::NotPositiveDefinite`] the constraint
    /// (by its row) that contradicts or repeats others when `shift` is too small.
    ///
    /// # Panics
    /// If the slices do not have one value per unknown.
    pub fn project(
        &mut self,
        constraints: &dyn ResidualBlock,
        z: &mut [f64],
        scale: &[f64],
        options: &ProjectionOptions,
        stage: &Stage,
        observer: &mut dyn Observer,
    ) -> Result<Report, SolverError> {
        assert!(z.len() == self.unknowns && scale.len() == self.unknowns, "one value per unknown");
        let begin = Instant::now();
        let mut timings = Timings { plan: self.plan, ..Timings::default() };
        let elements = constraints.elements();
        let mut residuals = vec![0.0; elements.rows_total()];
        let mut next_residuals = residuals.clone();
        let mut jacobian = vec![0.0; elements.jacobian_len()];
        let mut values = vec![0.0; self.cholesky.pattern().len()];
        let mut trial = z.to_vec();
        constraints.linearize(z, &mut residuals, &mut jacobian);
        let mut violation = largest(constraints.name(), &residuals)?;
        let (mut shift, mut least_shift) = (options.shift, LEAST_SHIFT);
        // Whether there is a factorisation, and whether it was made at `z`.
        let (mut usable, mut fresh) = (false, false);
        let (mut factorizations, mut evaluations, mut factorizations_before) = (0, 1, 0);
        let mut history = vec![record(half_square(&residuals), violation)];
        let mut shown = None;
        let status = loop {
            let iterations = history.len() - 1;
            if shown != Some(iterations) {
                shown = Some(iterations);
                let flow = observer.step(&Progress {
                    stage,
                    iteration: iterations,
                    max_iterations: options.max_iterations,
                    energy: history[iterations].energy,
                    gradient_norm: violation,
                    x: z,
                    system: None,
                });
                if flow.is_break() {
                    break Status::Interrupted;
                }
            }
            if violation <= options.tolerance {
                break Status::Converged;
            }
            if iterations >= options.max_iterations {
                break Status::IterationLimit;
            }
            if observer.stop_requested() {
                break Status::Interrupted;
            }
            if !usable {
                let linearizing = Instant::now();
                if !fresh && iterations > 0 {
                    constraints.linearize(z, &mut residuals, &mut jacobian);
                }
                timings.linearize += linearizing.elapsed();
                fresh = true;
                let forming = Instant::now();
                self.fill(&jacobian, scale, shift, &mut values);
                timings.normal += forming.elapsed();
                let factoring = Instant::now();
                let factored = self.cholesky.factor(&values);
                timings.factor += factoring.elapsed();
                factorizations += 1;
                match factored {
                    Ok(()) => {}
                    Err(SolverError::NotPositiveDefinite { .. }) if shift < options.shift => {
                        // Back to the last shift that was large enough.
                        shift *= 10.0;
                        least_shift = shift;
                        continue;
                    }
                    Err(error) => return Err(error),
                }
            }
            let solving = Instant::now();
            let mut multipliers = residuals.clone();
            self.cholesky.solve_in_place(&mut multipliers);
            for i in 0..self.unknowns {
                let entries = &self.entries[self.starts[i]..self.starts[i + 1]];
                let sum: f64 = entries.iter().map(|&(r, k)| jacobian[k] * multipliers[r]).sum();
                trial[i] = z[i] - scale[i] * scale[i] * sum;
            }
            timings.solve += solving.elapsed();
            let evaluating = Instant::now();
            constraints.residuals(&trial, &mut next_residuals);
            timings.residuals += evaluating.elapsed();
            evaluations += 1;
            let next = largest(constraints.name(), &next_residuals)?;
            let used = shift;
            usable = next <= KEEP * violation;
            if fresh && next > SLOW * violation {
                shift = least_shift.max(0.1 * shift).min(shift);
            }
            if next < violation {
                let energy = half_square(&next_residuals);
                let square: f64 = trial.iter().zip(&*z).map(|(a, b)| (a - b).powi(2)).sum();
                history.push(IterationRecord {
                    decrease: history[iterations].energy - energy,
                    damping: used,
                    step_norm: square.sqrt(),
                    factorizations: factorizations - factorizations_before,
                    ..record(energy, violation)
                });
                factorizations_before = factorizations;
                z.copy_from_slice(&trial);
                std::mem::swap(&mut residuals, &mut next_residuals);
                violation = next;
                fresh = false;
            } else if fresh {
                break Status::Stalled;
            }
        };
        timings.total = begin.elapsed();
        let final_energy = history[history.len() - 1].energy;
        Ok(Report {
            status,
            iterations: history.len() - 1,
            initial_energy: history[0].energy,
            final_energy,
            terms: vec![Term { name: constraints.name().to_owned(), energy: final_energy }],
            history,
            factorizations,
            evaluations,
            gradient_norm: violation,
            damping: shift,
            variables: scale.iter().filter(|s| **s != 0.0).count(),
            rows: elements.rows_total(),
            timings,
        })
    }

    /// `J S Sᵀ Jᵀ + shift · max diagonal`.
    fn fill(&self, jacobian: &[f64], scale: &[f64], shift: f64, values: &mut [f64]) {
        values.fill(0.0);
        let mut targets = self.targets.iter();
        for i in 0..self.unknowns {
            let entries = &self.entries[self.starts[i]..self.starts[i + 1]];
            let square = scale[i] * scale[i];
            for (k, &(_, a)) in entries.iter().enumerate() {
                for (&(_, b), &to) in entries[..=k].iter().zip(&mut targets) {
                    values[to] += square * jacobian[a] * jacobian[b];
                }
            }
        }
        let diagonal = &self.cholesky.pattern().column_starts()[..self.cholesky.pattern().size()];
        let largest = diagonal.iter().map(|&d| values[d]).fold(0.0, f64::max);
        let shift = if largest > 0.0 { shift * largest } else { 1.0 };
        for &d in diagonal {
            values[d] += shift;
        }
    }
}

/// A record of no step yet; `violation` is `max |C|` where it began.
fn record(energy: f64, violation: f64) -> IterationRecord {
    IterationRecord {
        energy,
        terms: vec![energy],
        decrease: 0.0,
        damping: 0.0,
        step_norm: 0.0,
        gradient_norm: violation,
        factorizations: 0,
    }
}

fn half_square(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}

fn largest(block: &str, residuals: &[f64]) -> Result<f64, SolverError> {
    match residuals.iter().position(|r| !r.is_finite()) {
        None => Ok(residuals.iter().fold(0.0, |m, r| m.max(r.abs()))),
        Some(row) => Err(SolverError::NotFinite {
            block: block.to_owned(),
            row,
            quantity: Quantity::Residual,
            value: residuals[row],
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadratic::QuadraticBuilder;

    #[test]
    fn nearest_point_of_a_sphere_is_along_the_radius() {
        let mut rows = QuadraticBuilder::new("sphere");
        let row = rows.equation(1.0).constant(-1.0);
        for i in 0..3 {
            row.product(i, i, 1.0);
        }
        // Redundant: the same equation again; the shift keeps the system solvable.
        let row = rows.equation(1.0).constant(-1.0);
        for i in 0..3 {
            row.product(i, i, 1.0);
        }
        let sphere = rows.build();
        let mut projection = MinNormProjection::new(&sphere, 3, 1).unwrap();
        let mut z = [1.02, 2.04, -2.04];
        let options = ProjectionOptions { tolerance: 1e-14, ..ProjectionOptions::default() };
        let stage = Stage::only("polish");
        let mut steps = Vec::new();
        let mut watch = |progress: &Progress<'_>| {
            steps.push((progress.iteration, progress.gradient_norm));
            std::ops::ControlFlow::Continue(())
        };
        let report =
            projection.project(&sphere, &mut z, &[1.0; 3], &options, &stage, &mut watch).unwrap();
        assert_eq!(report.status, Status::Converged, "{report:?}");
        assert_eq!(steps.len(), report.iterations + 1);
        assert_eq!(steps[0], (0, report.history[0].gradient_norm));
        assert_eq!(steps[report.iterations], (report.iterations, report.gradient_norm));
        assert!((z[1] - 2.0 * z[0]).abs() < 1e-12 && (z[2] + 2.0 * z[0]).abs() < 1e-12, "{z:?}");
        let mut held = [0.6, 0.7, 0.1];
        let scale = [0.0, 1.0, 0.0];
        let report =
            projection.project(&sphere, &mut held, &scale, &options, &stage, &mut ()).unwrap();
        assert_eq!(report.status, Status::Converged);
        assert!(held[0] == 0.6 && held[2] == 0.1 && (held[1] - 0.63_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_projection_is_stopped_before_it_factors() {
        struct Stop;
        impl Observer for Stop {
            fn stop_requested(&mut self) -> bool {
                true
            }
        }
        let mut rows = QuadraticBuilder::new("circle");
        rows.equation(1.0).product(0, 0, 1.0).product(1, 1, 1.0).constant(-1.0);
        let circle = rows.build();
        let mut projection = MinNormProjection::new(&circle, 2, 1).unwrap();
        let (mut z, options) = ([2.0, 0.0], ProjectionOptions::default());
        let stage = Stage::only("polish");
        let report =
            projection.project(&circle, &mut z, &[1.0; 2], &options, &stage, &mut Stop).unwrap();
        assert_eq!((report.status, report.factorizations), (Status::Interrupted, 0));
        assert_eq!((z, report.gradient_norm), ([2.0, 0.0], 3.0));
    }
}
