//! The normal matrix `JᵀJ` and gradient `Jᵀr`, formed element by element along a plan.

use std::ops::Range;

use super::gram::{AddGram, Run, Targets};
use crate::elements::Elements;
use crate::error::SolverError;
use crate::linear::{Factor, Factorization, Storage};
use crate::problem::Problem;

/// Mark of a fixed unknown.
const FIXED: u32 = u32::MAX;

/// Columns that follow one another both in the element and in a run.
#[derive(Clone, Copy)]
struct Piece {
    from: u32,
    to: u32,
    len: u32,
}

/// What is known of a block before any value is: which columns are free, in which order they
/// stand in the system, and where their products go.
#[derive(Default)]
struct BlockPlan {
    starts: Vec<usize>,
    /// Column within the element, sorted by position.
    local: Vec<u32>,
    piece_starts: Vec<usize>,
    /// How a row of the element is packed.
    pieces: Vec<Piece>,
    /// Position in the system.
    position: Vec<u32>,
    run_starts: Vec<usize>,
    runs: Vec<Run>,
    /// For compressed columns: where each (column, run) product begins.
    target_starts: Vec<usize>,
    targets: Vec<u32>,
}

/// Pattern, order and scatter of the normal equations; made once per topology.
pub(crate) struct NormalPlan {
    /// Unknown of each position.
    pub(crate) variable: Vec<usize>,
    blocks: Vec<BlockPlan>,
    stride: Option<usize>,
}

/// Memory of the element products.
#[derive(Default)]
pub(crate) struct Scratch {
    packed: Vec<f64>,
    product: Vec<f64>,
}

impl Scratch {
    /// Packs the rows of an element to a length of `stride`, zeros between the runs.
    fn pack<'r>(
        &mut self,
        pieces: &[Piece],
        rows: impl ExactSizeIterator<Item = &'r [f64]>,
        stride: usize,
    ) {
        self.packed.clear();
        self.packed.resize(stride * rows.len(), 0.0);
        for (row, packed) in rows.zip(self.packed.chunks_exact_mut(stride)) {
            for &Piece { from, to, len } in pieces {
                let (from, to, len) = (from as usize, to as usize, len as usize);
                let (from, to) = (&row[from..from + len], &mut packed[to..to + len]);
                if len == 3 {
                    // The coordinates of a point; too short for a call to copy memory.
                    (to[0], to[1], to[2]) = (from[0], from[1], from[2]);
                } else {
                    to.copy_from_slice(from);
                }
            }
        }
    }
}

impl BlockPlan {
    fn new(elements: &Elements, position: &[u32]) -> Self {
        let mut plan =
            Self { starts: vec![0], run_starts: vec![0], piece_starts: vec![0], ..Self::default() };
        let mut columns = Vec::new();
        for e in 0..elements.len() {
            columns.clear();
            for (local, &column) in elements.columns(e).iter().enumerate() {
                if position[column] != FIXED {
                    columns.push((position[column], local as u32));
                }
            }
            columns.sort_unstable();
            for (k, &(p, local)) in columns.iter().enumerate() {
                plan.position.push(p);
                plan.local.push(local);
                let k = k as u32;
                let at = match plan.runs.last_mut().filter(|_| k > 0) {
                    Some(run) if columns[k as usize - 1].0 + 1 == p => {
                        run.end += 1;
                        run.at + k - run.begin
                    }
                    last => {
                        let at = last.map_or(0, |run| run.packed_end());
                        plan.runs.push(Run { begin: k, end: k + 1, at });
                        at
                    }
                };
                match plan.pieces.last_mut().filter(|_| k > 0) {
                    Some(p) if p.from + p.len == local && p.to + p.len == at => p.len += 1,
                    _ => plan.pieces.push(Piece { from: local, to: at, len: 1 }),
                }
            }
            plan.starts.push(plan.position.len());
            plan.run_starts.push(plan.runs.len());
            plan.piece_starts.push(plan.pieces.len());
        }
        plan
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn range(&self, e: usize) -> Range<usize> {
        self.starts[e]..self.starts[e + 1]
    }

    fn positions(&self, e: usize) -> &[u32] {
        &self.position[self.range(e)]
    }

    fn pieces(&self, e: usize) -> &[Piece] {
        &self.pieces[self.piece_starts[e]..self.piece_starts[e + 1]]
    }

    fn runs(&self, e: usize) -> &[Run] {
        &self.runs[self.run_starts[e]..self.run_starts[e + 1]]
    }

    fn targets(&self, e: usize) -> &[u32] {
        &self.targets[self.target_starts[e]..self.target_starts[e + 1]]
    }

    /// Looks up where the products go in compressed columns.
    fn plan_targets(&mut self, mut slot: impl FnMut(usize, usize) -> usize) {
        self.target_starts = vec![0];
        for e in 0..self.len() {
            let positions = &self.position[self.range(e)];
            let runs = &self.runs[self.run_starts[e]..self.run_starts[e + 1]];
            for b in 0..positions.len() {
                for run in runs.iter().filter(|run| run.end as usize > b) {
                    let a = b.max(run.begin as usize);
                    self.targets.push(slot(positions[a] as usize, positions[b] as usize) as u32);
                }
            }
            self.target_starts.push(self.targets.len());
        }
    }
}

/// Position of every unknown.
fn positions(variable: &[usize], unknowns: usize) -> Vec<u32> {
    let mut position = vec![FIXED; unknowns];
    for (k, &i) in variable.iter().enumerate() {
        position[i] = k as u32;
    }
    position
}

impl NormalPlan {
    /// Plans the normal equations of a problem and chooses their factorisation.
    pub(crate) fn new(
        problem: &Problem<'_>,
        wanted: Factorization,
    ) -> Result<(Self, Factor), SolverError> {
        let (variables, unknowns) = (problem.variables(), problem.unknowns());
        let is_free = |i: &usize| !variables.fixed()[*i];
        let natural: Vec<usize> = match variables.order() {
            Some(order) => order.iter().copied().filter(is_free).collect(),
            None => (0..unknowns).filter(is_free).collect(),
        };
        let blocks_at = |variable: &[usize]| -> Vec<BlockPlan> {
            let position = positions(variable, unknowns);
            let elements = problem.slots.iter().map(|slot| slot.block.elements());
            elements.map(|elements| BlockPlan::new(elements, &position)).collect()
        };
        let mut variable = natural;
        let mut blocks = blocks_at(&variable);
        let cliques = blocks.iter().flat_map(|b| (0..b.len()).map(|e| b.positions(e)));
        // Fixed unknowns leave gaps in the numbers of the runs, which does no harm.
        let together: Option<Vec<usize>> = match (variables.order(), variables.runs()) {
            (None, Some(run)) => Some(variable.iter().map(|i| i / run).collect()),
            _ => None,
        };
        let (factor, order) = Factor::choose(variable.len(), cliques, together.as_deref(), wanted)?;
        if let Some(order) = order {
            variable = order.iter().map(|&k| variable[k]).collect();
            blocks = blocks_at(&variable);
        }
        if u32::try_from(factor.values_len()).is_err() {
            return Err(SolverError::TooLarge { entries: factor.values_len() });
        }
        let stride = match factor.storage() {
            Storage::Band { stride } => Some(stride),
            Storage::Columns(pattern) => {
                for block in &mut blocks {
                    block.plan_targets(|i, j| {
                        pattern.slot(i, j).expect("the pattern was made from these elements")
                    });
                }
                None
            }
        };
        Ok((Self { variable, blocks, stride }, factor))
    }

    /// Plans one more block in the pattern there is; `false`, and nothing is changed, if it couples
    /// unknowns that the pattern does not.
    pub(crate) fn try_add(
        &mut self,
        elements: &Elements,
        unknowns: usize,
        factor: &Factor,
    ) -> bool {
        let mut plan = BlockPlan::new(elements, &positions(&self.variable, unknowns));
        let mut fits = true;
        match factor.storage() {
            Storage::Band { .. } => {
                let reach = factor.half_bandwidth();
                let span = |p: &[u32]| p.last().zip(p.first()).map_or(0, |(b, a)| (b - a) as usize);
                fits = (0..plan.len()).all(|e| span(plan.positions(e)) <= reach);
            }
            Storage::Columns(pattern) => {
                plan.plan_targets(|i, j| {
                    pattern.slot(i, j).unwrap_or_else(|| {
                        fits = false;
                        0
                    })
                });
                // A run is scattered from its first entry on, so that all of it has to be there.
                fits &= (0..plan.len()).all(|e| {
                    let p = plan.positions(e);
                    p.iter().enumerate().all(|(b, &column)| {
                        p[b..]
                            .iter()
                            .all(|&row| pattern.slot(row as usize, column as usize).is_some())
                    })
                });
            }
        }
        if fits {
            self.blocks.push(plan);
        }
        fits
    }

    /// Forgets a block that was taken out.
    pub(crate) fn clear(&mut self, block: usize) {
        self.blocks[block] = BlockPlan::new(&Elements::none(), &[]);
    }

    /// Number of free unknowns.
    pub(crate) fn size(&self) -> usize {
        self.variable.len()
    }

    /// Adds `Jᵀr` of a block to the gradient and, if given, `JᵀJ` to the matrix values.
    pub(crate) fn add_rows(
        &self,
        block: usize,
        elements: &Elements,
        jacobian: &[f64],
        residuals: &[f64],
        gradient: &mut [f64],
        mut values: Option<&mut [f64]>,
        scratch: &mut Scratch,
    ) {
        let plan = &self.blocks[block];
        let arch = pulp::Arch::new();
        for e in 0..plan.len() {
            let range = plan.range(e);
            let local = &plan.local[range.clone()];
            let positions = &plan.position[range];
            let width = elements.columns(e).len();
            let rows = elements.rows(e);
            if local.is_empty() || rows.is_empty() {
                continue;
            }
            let jacobian = &jacobian[elements.jacobian_range(e)];
            let residuals = &residuals[rows];
            let Some(values) = values.as_deref_mut() else {
                for (row, &r) in jacobian.chunks_exact(width).zip(residuals) {
                    for (&c, &p) in local.iter().zip(positions) {
                        gradient[p as usize] += row[c as usize] * r;
                    }
                }
                continue;
            };
            let runs = plan.runs(e);
            let stride = runs[runs.len() - 1].packed_end() as usize;
            scratch.pack(plan.pieces(e), jacobian.chunks_exact(width), stride);
            let targets = match self.stride {
                Some(stride) => Targets::Band { stride, positions },
                None => Targets::Columns(plan.targets(e)),
            };
            let (x, products) = (&scratch.packed, &mut scratch.product);
            arch.dispatch(AddGram { x, stride, runs, targets, residuals, values, products });
            for run in runs {
                let first = positions[run.begin as usize] as usize;
                let sums = &scratch.product[run.at as usize..][..run.len()];
                for (to, &sum) in gradient[first..].iter_mut().zip(sums) {
                    *to += sum;
                }
            }
        }
    }

    /// Adds element gradients and Hessians of an energy block.
    pub(crate) fn add_energy(
        &self,
        block: usize,
        elements: &Elements,
        hessians: &[f64],
        gradients: &[f64],
        gradient: &mut [f64],
        values: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let plan = &self.blocks[block];
        for e in 0..plan.len() {
            let range = plan.range(e);
            let (local, positions) = (&plan.local[range.clone()], &plan.position[range]);
            let (k, width) = (local.len(), elements.columns(e).len());
            let hessian = &hessians[elements.jacobian_range(e)];
            let gradients = &gradients[elements.rows(e)];
            scratch.product.clear();
            scratch.product.resize(k * k, 0.0);
            for (b, (&cb, &p)) in local.iter().zip(positions).enumerate() {
                gradient[p as usize] += gradients[cb as usize];
                for (a, &ca) in local.iter().enumerate().skip(b) {
                    scratch.product[b * k + a] = hessian[ca as usize * width + cb as usize];
                }
            }
            self.scatter(block, e, &scratch.product, k, values);
        }
    }

    /// Adds the lower triangle of an element's product, column `b` at `product[b * stride..]`.
    fn scatter(&self, block: usize, e: usize, product: &[f64], stride: usize, values: &mut [f64]) {
        let plan = &self.blocks[block];
        let positions = plan.positions(e);
        let runs = plan.runs(e);
        let mut first = 0;
        let mut targets = match self.stride {
            Some(_) => [].iter(),
            None => plan.targets(e).iter(),
        };
        for (b, &column) in positions.iter().enumerate() {
            if runs[first].end as usize <= b {
                first += 1;
            }
            for run in &runs[first..] {
                let a = b.max(run.begin as usize);
                let target = match self.stride {
                    Some(stride) => column as usize * stride + positions[a] as usize,
                    None => targets.next().map_or(0, |&t| t as usize),
                };
                let from = &product[b * stride + a..b * stride + run.end as usize];
                for (to, &value) in values[target..target + from.len()].iter_mut().zip(from) {
                    *to += value;
                }
            }
        }
    }

    /// The Jacobian of all residual blocks over the free unknowns, as (row, position, value).
    pub(crate) fn triplets<'s>(
        &'s self,
        block: usize,
        elements: &'s Elements,
        jacobian: &'s [f64],
    ) -> impl Iterator<Item = (usize, usize, f64)> + 's {
        let plan = &self.blocks[block];
        (0..plan.len()).flat_map(move |e| {
            let range = plan.range(e);
            let width = elements.columns(e).len();
            let begin = elements.jacobian_range(e).start;
            elements.rows(e).enumerate().flat_map(move |(r, row)| {
                range.clone().map(move |k| {
                    let value = jacobian[begin + r * width + plan.local[k] as usize];
                    (row, plan.position[k] as usize, value)
                })
            })
        })
    }
}
