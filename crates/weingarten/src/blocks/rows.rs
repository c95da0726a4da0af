//! What all terms with one row per sample share: rows of samples are evaluated in SIMD registers
//! and scattered into the elements of the solver, knot span rows in parallel.

use gp_solver::Elements;
use rayon::prelude::*;

use crate::grid::{SampleGrid, Scratch, split_runs};

/// A quantity with one value per sample and its gradient by `N` derivative vectors.
pub(crate) trait SampleTerm<const N: usize>: Sync {
    /// Puts the values of row `i` of the samples into `scratch.residual` and, if asked for, the
    /// gradients into `scratch.gradient`, one padded row of samples per vector and axis.
    fn row(
        &self,
        grid: &SampleGrid,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        with_gradient: bool,
    );
}

/// Fills residuals, and the Jacobian if given, of all elements of `grid`.
pub(crate) fn fill<const N: usize>(
    grid: &SampleGrid,
    elements: &Elements,
    term: &impl SampleTerm<N>,
    x: &[f64],
    residuals: &mut [f64],
    jacobian: Option<&mut [f64]>,
) {
    let unrolled = grid.unroll(x);
    let columns = 3 * grid.u.order * grid.v.order;
    let (m_v, runs) = (grid.v.len(), &grid.u.runs);
    debug_assert_eq!(residuals.len(), elements.rows_total());
    let sizes = |factor: usize| runs.iter().map(move |run| factor * run.len() * m_v);
    let residuals = split_runs(sizes(1), residuals);
    let jacobians: Vec<Option<&mut [f64]>> = match jacobian {
        Some(values) => split_runs(sizes(columns), values).into_iter().map(Some).collect(),
        None => runs.iter().map(|_| None).collect(),
    };
    let one_run = |scratch: &mut Scratch,
                   run: &std::ops::Range<usize>,
                   residuals: &mut [f64],
                   mut jacobian: Option<&mut [f64]>| {
        for i in run.clone() {
            term.row(grid, i, &unrolled, scratch, jacobian.is_some());
            // Elements of this knot span row follow one another, each with rows i-major.
            let mut first = 0;
            for run_v in &grid.v.runs {
                let row = first + (i - run.start) * run_v.len();
                for (k, j) in run_v.clone().enumerate() {
                    residuals[row + k] = scratch.residual[j];
                    if let Some(values) = &mut jacobian {
                        let out = &mut values[(row + k) * columns..(row + k + 1) * columns];
                        grid.expand(i, j, N, &scratch.gradient, out);
                    }
                }
                first += run.len() * run_v.len();
            }
        }
    };
    let jobs = runs.iter().zip(residuals).zip(jacobians);
    if rayon::current_num_threads() == 1 {
        let mut scratch = Scratch::default();
        for ((run, residuals), jacobian) in jobs {
            one_run(&mut scratch, run, residuals, jacobian);
        }
    } else {
        let jobs: Vec<_> = jobs.collect();
        jobs.into_par_iter()
            .for_each_init(Scratch::default, |scratch, ((run, residuals), jacobian)| {
                one_run(scratch, run, residuals, jacobian)
            });
    }
}
