//! Metrics for the descent: the Gauss-Newton Hessian and a Sobolev norm, assembled and factored.

use crate::element::Mixture;
use crate::evaluator::SurfaceEnergy;
use crate::freedom::Freedom;
use crate::limits::Pull;
use crate::surface_matrix::{Matrix, Stop, SurfaceMatrix};
use gp_solver::{Problem, SolverError, SparseMetric};
use subdiv_catmull_clark::SubdivisionSurface;

/// Share of the mean diagonal that keeps unknowns that nothing sees from making a matrix singular.
const UNSEEN: f64 = 1e-12;

/// A metric on the unknowns, with the structure of its matrix worked out once. The unknowns of a
/// vertex form a block.
pub(crate) struct MetricAssembly {
    surface: SurfaceMatrix,
    matrix: SparseMetric,
    // For every ordered pair of a patch's control points how far down in the columns of the second
    // one the first unknown of the first one stands; patch after patch.
    offsets: Vec<u32>,
    // What the pulls add: constant, so kept as slots and values.
    pulls: Vec<(u32, f64)>,
}

impl MetricAssembly {
    /// Works out the structure.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    pub(crate) fn new(
        surface: &SubdivisionSurface,
        evaluator: &SurfaceEnergy,
        freedom: &Freedom,
        pulls: &[Pull],
        extra: Option<&Problem<'_>>,
    ) -> Result<Self, SolverError> {
        let surface = SurfaceMatrix::new(surface, evaluator);
        let matrix = structure(&surface, evaluator, freedom, pulls, extra)?;
        let pulls = pull_entries(freedom, pulls)
            .into_iter()
            .map(|((i, j), value)| (matrix.slot(i, j).unwrap_or(0) as u32, value))
            .collect();
        let mut offsets = Vec::new();
        for_pairs(surface.cliques(evaluator), freedom, &matrix, |a, b| {
            let slot = matrix.slot(a, b).unwrap_or(0);
            offsets.push((slot - matrix.column_starts()[matrix.place(b)]) as u32);
        });
        offsets.shrink_to_fit();
        Ok(Self { surface, matrix, offsets, pulls })
    }

    /// Number of stored values of the factor.
    pub(crate) fn factor_len(&self) -> usize {
        self.matrix.factor_len()
    }

    /// `A x` for the matrix with these values.
    #[cfg(test)]
    pub(crate) fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        self.matrix.multiply(values, x)
    }

    /// Assembles and factors the metric at `positions`; false if it was stopped before the end.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`].
    pub(crate) fn factor(
        &mut self,
        evaluator: &SurfaceEnergy,
        freedom: &Freedom,
        positions: &[f64],
        area: f64,
        mixture: &Mixture,
        extra: Option<&Problem<'_>>,
        stop: Stop<'_>,
    ) -> Result<bool, SolverError> {
        let assembled = self.assemble(evaluator, freedom, positions, area, mixture, stop);
        let Some(mut values) = assembled else { return Ok(false) };
        if let Some(extra) = extra {
            self.add_extra(extra, freedom, positions, &mut values);
        }
        if stop() {
            return Ok(false);
        }
        self.matrix.factor(&mut values, UNSEEN)?;
        Ok(true)
    }

    /// The values of the matrix; `None` if it was stopped before the end.
    pub(crate) fn assemble(
        &self,
        evaluator: &SurfaceEnergy,
        freedom: &Freedom,
        positions: &[f64],
        area: f64,
        mixture: &Mixture,
        stop: Stop<'_>,
    ) -> Option<Vec<f64>> {
        let mut values = vec![0.0; self.matrix.len()];
        let mut next_pair = 0;
        let add = &mut |matrix: &Matrix<'_>| {
            next_pair = self.scatter(matrix, freedom, next_pair, &mut values);
        };
        self.surface.visit(evaluator, positions, area, mixture, stop, add)?;
        for &(slot, value) in &self.pulls {
            values[slot as usize] += value;
        }
        Some(values)
    }

    /// Adds `Bᵀ H B`, `H` the Hessians of further blocks and `B` how control points depend on the
    /// unknowns.
    fn add_extra(
        &self,
        extra: &Problem<'_>,
        freedom: &Freedom,
        positions: &[f64],
        values: &mut [f64],
    ) {
        extra.quadratic_models(positions, &mut |columns, _, hessian| {
            for (k, &column) in columns.iter().enumerate() {
                for (i, a) in unknowns_of(freedom, column) {
                    let row = self.matrix.place(i);
                    for (l, &other) in columns.iter().enumerate() {
                        let h = hessian[k * columns.len() + l];
                        for (j, b) in unknowns_of(freedom, other) {
                            if row >= self.matrix.place(j)
                                && let Some(slot) = self.matrix.slot(i, j)
                            {
                                values[slot] += a * b * h;
                            }
                        }
                    }
                }
            }
        });
    }

    pub(crate) fn solve_in_place(&self, rhs: &mut [f64]) {
        self.matrix.solve_in_place(rhs);
    }

    fn scatter(
        &self,
        &Matrix { values: matrix, width, controls, factor }: &Matrix<'_>,
        freedom: &Freedom,
        mut next_pair: usize,
        values: &mut [f64],
    ) -> usize {
        let starts = self.matrix.column_starts();
        for (p, &a) in controls.iter().enumerate() {
            let a = a as usize;
            let rows = freedom.dim[a] as usize;
            if rows == 0 {
                continue;
            }
            let i0 = self.matrix.place(freedom.start[a] as usize);
            for (q, &b) in controls.iter().enumerate() {
                let b = b as usize;
                let columns = freedom.dim[b] as usize;
                if columns == 0 {
                    continue;
                }
                let j0 = self.matrix.place(freedom.start[b] as usize);
                if i0 < j0 {
                    continue;
                }
                let offset = self.offsets[next_pair] as usize;
                next_pair += 1;
                for j in 0..columns {
                    let direction = freedom.frame[b].col(j).to_array();
                    let image: [f64; 3] = std::array::from_fn(|c| {
                        (0..3)
                            .map(|d| {
                                // Only the upper triangle of the element is filled.
                                let (r, s) = (3 * p + c, 3 * q + d);
                                matrix[r.min(s) * width + r.max(s)] * direction[d]
                            })
                            .sum()
                    });
                    // A column begins with its own row, so the block's later ones are shorter at
                    // the top.
                    let first = if i0 == j0 { j } else { 0 };
                    let slot = starts[j0 + j] + offset - j;
                    for i in first..rows {
                        let row = freedom.frame[a].col(i).to_array();
                        let value = row[0] * image[0] + row[1] * image[1] + row[2] * image[2];
                        values[slot + i] += factor * value;
                    }
                }
            }
        }
        next_pair
    }
}

/// The structure of the matrix: a block for the unknowns of every vertex.
fn structure(
    surface: &SurfaceMatrix,
    evaluator: &SurfaceEnergy,
    freedom: &Freedom,
    pulls: &[Pull],
    extra: Option<&Problem<'_>>,
) -> Result<SparseMetric, SolverError> {
    let (block_of, blocks) = freedom.blocks();
    let clique = |controls: &mut dyn Iterator<Item = u32>| -> Vec<u32> {
        let mut met: Vec<u32> =
            controls.map(|v| block_of[v as usize]).filter(|&b| b != u32::MAX).collect();
        met.sort_unstable();
        met.dedup();
        met
    };
    let coupled = surface.cliques(evaluator).map(|controls| clique(&mut controls.iter().copied()));
    let pulled = pulls.iter().map(|p| clique(&mut p.stencil.iter().map(|&(v, _)| v)));
    let added = extra.into_iter().flat_map(Problem::elements);
    let added = added.map(|columns| clique(&mut columns.iter().map(|&c| (c / 3) as u32)));
    SparseMetric::new(&blocks, coupled.chain(pulled).chain(added))
}

// Ordered pairs of control points that have unknowns, the first one's not eliminated before the
// second one's: their first unknowns.
fn for_pairs<'a>(
    cliques: impl Iterator<Item = &'a [u32]>,
    freedom: &Freedom,
    matrix: &SparseMetric,
    mut visit: impl FnMut(usize, usize),
) {
    let first = |v: u32| {
        let v = v as usize;
        (freedom.dim[v] > 0).then(|| freedom.start[v] as usize)
    };
    for controls in cliques {
        for a in controls.iter().filter_map(|&a| first(a)) {
            for b in controls.iter().filter_map(|&b| first(b)) {
                if matrix.place(a) >= matrix.place(b) {
                    visit(a, b);
                }
            }
        }
    }
}

/// Hessian of the pulls, lower triangle, as `((row, column), value)`.
fn pull_entries(freedom: &Freedom, pulls: &[Pull]) -> Vec<((usize, usize), f64)> {
    let unknowns = |&(v, w): &(u32, f64)| {
        let v = v as usize;
        (0..freedom.dim[v] as usize)
            .map(move |k| (freedom.start[v] as usize + k, w * freedom.frame[v].col(k)))
    };
    let mut out = Vec::new();
    for pull in pulls {
        let all: Vec<_> = pull.stencil.iter().flat_map(unknowns).collect();
        for &(i, a) in &all {
            for &(j, b) in all.iter().filter(|(j, _)| *j <= i) {
                out.push(((i, j), 2.0 * pull.factor * a.dot(b)));
            }
        }
    }
    out
}

/// The unknowns a coordinate of the control points depends on, with the derivatives by them.
fn unknowns_of(freedom: &Freedom, coordinate: usize) -> impl Iterator<Item = (usize, f64)> {
    let (v, c) = (coordinate / 3, coordinate % 3);
    (0..freedom.dim[v] as usize)
        .map(move |k| (freedom.start[v] as usize + k, freedom.frame[v].col(k)[c]))
        .filter(|(_, derivative)| *derivative != 0.0)
}
