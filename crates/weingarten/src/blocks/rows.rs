//! What all terms with one row per sample share: rows of samples are evaluated in SIMD registers
//! and scattered into the elements of the solver, knot span rows in parallel.

use gp_solver::Elements;
use rayon::prelude::*;

use crate::grid::{SampleGrid, split_runs};
use crate::sweep::Scratch;

/// Where the values of one row of samples go.
pub(crate) struct RowValues<'a> {
    /// One value per sample, padded.
    pub(crate) residual: &'a mut [f64],
    /// One padded row of samples per derivative vector and axis; empty if not wanted.
    pub(crate) gradient: &'a mut [f64],
}

/// A quantity with one value per sample and its gradient by `N` derivative vectors.
pub(crate) trait SampleTerm<const N: usize>: Sync {
    /// Evaluates row `i` of the samples.
    fn row(
        &self,
        grid: &SampleGrid,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        values: RowValues<'_>,
    );
}

/// Buffers of one worker.
#[derive(Default)]
struct Buffers {
    scratch: Scratch,
    residual: Vec<f64>,
    gradient: Vec<f64>,
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
    let stride = grid.stride();
    let one_run = |buffers: &mut Buffers,
                   run: &std::ops::Range<usize>,
                   residuals: &mut [f64],
                   mut jacobian: Option<&mut [f64]>| {
        let Buffers { scratch, residual, gradient } = buffers;
        residual.resize(stride, 0.0);
        gradient.resize(if jacobian.is_some() { 3 * N * stride } else { 0 }, 0.0);
        for i in run.clone() {
            term.row(grid, i, &unrolled, scratch, RowValues { residual, gradient });
            for &j in grid.others(i) {
                residual[j] = 0.0;
                gradient.iter_mut().skip(j).step_by(stride).for_each(|value| *value = 0.0);
            }
            // Elements of this knot span row follow one another, each with rows i-major.
            let mut first = 0;
            for run_v in &grid.v.runs {
                let row = first + (i - run.start) * run_v.len();
                residuals[row..row + run_v.len()].copy_from_slice(&residual[run_v.clone()]);
                first += run.len() * run_v.len();
            }
            if let Some(values) = &mut jacobian {
                grid.expand_row(i, run, N, gradient, values);
            }
        }
    };
    let jobs = runs.iter().zip(residuals).zip(jacobians);
    if rayon::current_num_threads() == 1 {
        let mut buffers = Buffers::default();
        for ((run, residuals), jacobian) in jobs {
            one_run(&mut buffers, run, residuals, jacobian);
        }
    } else {
        let jobs: Vec<_> = jobs.collect();
        jobs.into_par_iter()
            .for_each_init(Buffers::default, |buffers, ((run, residuals), jacobian)| {
                one_run(buffers, run, residuals, jacobian)
            });
    }
}
