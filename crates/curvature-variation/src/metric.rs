//! Metrics for the descent: the Gauss-Newton Hessian and a Sobolev norm, assembled and factored.

use crate::constraints::Pull;
use crate::density::{Density, FrameAdjoint, Shape};
use crate::evaluator::SurfaceEnergy;
use crate::freedom::Freedom;
use crate::guide_block::{GuideBlock, is_guided};
use crate::kernel::{gather, table_adjoint, table_derivatives};
use crate::lanes::{Lanes, align_frame};
use crate::rules::{MAX_LANES, Quadrature, Table};
use gp_solver::{SolverError, SparseCholesky, SymmetricPattern};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use subdiv_catmull_clark::SubdivisionSurface;

/// Gauss points per side the metrics use: they need not be exact.
const NODES: Quadrature = Quadrature { regular: 4, extraordinary: 8 };
/// Element matrices computed at a time before they are added up.
const BATCH: usize = 64;
/// `ℓ²` of the Sobolev norm as a share of the area.
const LENGTH_SQUARED: f64 = 1.0 / 40.0;
/// Residuals of a sample at most: four harmonics, three of the second form, the barrier.
const RESIDUALS: usize = 8;
/// Area elements below this share of the mean are raised to it.
const LEAST_AREA: f64 = 1e-3;

/// `gauss_newton · (Gauss-Newton Hessian of a density) + sobolev · (H³ norm)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mixture {
    pub(crate) density: Density,
    pub(crate) gauss_newton: bool,
    pub(crate) sobolev: f64,
}

/// A metric on the unknowns, with the structure of its matrix worked out once.
///
/// The unknowns of a vertex form a block, and all columns of a block have the same rows, so that
/// the structure is kept by blocks, in the order in which they are eliminated.
pub(crate) struct MetricAssembly {
    // The bases at the nodes of the metrics.
    rules: Vec<Table>,
    blocks: Vec<GuideBlock>,
    cholesky: SparseCholesky,
    // Where every unknown comes in the order of elimination.
    place: Vec<u32>,
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
    ) -> Result<Self, SolverError> {
        let rules = evaluator
            .groups()
            .par_iter()
            .map(|group| {
                let nodes = NODES.nodes(surface, group.basis);
                Table::new(surface, group.basis, nodes)
            })
            .collect();
        let blocks = GuideBlock::all(evaluator);
        let cliques = Cliques { evaluator, blocks: &blocks };
        let (pattern, place) = eliminated_pattern(&cliques, freedom, pulls)?;
        let pulls = pull_entries(freedom, pulls)
            .into_iter()
            .map(|((i, j), value)| {
                let slot = pattern.slot(place[i] as usize, place[j] as usize);
                (slot.unwrap_or(0) as u32, value)
            })
            .collect();
        let mut offsets = Vec::new();
        for_pairs(&cliques, freedom, &place, |a, b| {
            let slot = pattern.slot(a, b).unwrap_or(0);
            offsets.push((slot - pattern.column_starts()[b]) as u32);
        });
        offsets.shrink_to_fit();
        let cholesky = SparseCholesky::in_given_order(pattern)?;
        Ok(Self { rules, blocks, cholesky, place, offsets, pulls })
    }

    /// Number of stored values of the factor.
    pub(crate) fn factor_len(&self) -> usize {
        self.cholesky.factor_len()
    }

    /// `A x` for the matrix with these values.
    #[cfg(test)]
    pub(crate) fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut image = vec![0.0; x.len()];
        let mut placed = vec![0.0; x.len()];
        self.place.iter().zip(x).for_each(|(&p, &x)| placed[p as usize] = x);
        self.cholesky.pattern().multiply(values, &placed, &mut image);
        self.place.iter().map(|&p| image[p as usize]).collect()
    }

    /// Assembles and factors the metric at `positions`.
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
    ) -> Result<(), SolverError> {
        let mut values = self.assemble(evaluator, freedom, positions, area, mixture);
        // Keeps unknowns that nothing sees from making the matrix singular.
        let starts = self.cholesky.pattern().column_starts();
        let size = freedom.len();
        let trace: f64 = (0..size).map(|j| values[starts[j]]).sum();
        for j in 0..size {
            values[starts[j]] += 1e-12 * trace / size as f64;
        }
        self.cholesky.factor(&values)
    }

    /// The values of the matrix.
    pub(crate) fn assemble(
        &self,
        evaluator: &SurfaceEnergy,
        freedom: &Freedom,
        positions: &[f64],
        area: f64,
        mixture: &Mixture,
    ) -> Vec<f64> {
        let mut values = vec![0.0; self.cholesky.pattern().len()];
        let mut next_pair = 0;
        let mean_area = area / evaluator.weighted_patches();
        let mut points = Vec::new();
        evaluator.guides().extend(positions, &mut points);
        let positions = &points[..];
        let element = |group: usize, controls: &[u32], matrix: &mut [f64]| {
            evaluator.arch().dispatch(ElementMatrix {
                rule: &self.rules[group],
                mixture,
                positions,
                controls,
                area,
                least_area: LEAST_AREA * mean_area,
                matrix,
            });
        };
        for (g, group) in evaluator.groups().iter().enumerate() {
            if is_guided(evaluator, group) {
                continue;
            }
            let width = element_width(group.per_patch);
            for controls in group.controls.chunks(BATCH * group.per_patch) {
                let mut matrices = vec![0.0; controls.len() / group.per_patch * width * width];
                matrices
                    .par_chunks_mut(width * width)
                    .zip(controls.par_chunks(group.per_patch))
                    .for_each(|(matrix, controls)| element(g, controls, matrix));
                for (matrix, controls) in
                    matrices.chunks(width * width).zip(controls.chunks(group.per_patch))
                {
                    next_pair = self.scatter(
                        matrix,
                        width,
                        controls,
                        group.multiplicity,
                        freedom,
                        next_pair,
                        &mut values,
                    );
                }
            }
        }
        for block in &self.blocks {
            let matrix = block.matrix(evaluator, element);
            let width = 3 * block.vertices.len();
            next_pair =
                self.scatter(&matrix, width, &block.vertices, 1.0, freedom, next_pair, &mut values);
        }
        for &(slot, value) in &self.pulls {
            values[slot as usize] += value;
        }
        values
    }

    pub(crate) fn solve_in_place(&self, rhs: &mut [f64]) {
        let mut placed = vec![0.0; rhs.len()];
        self.place.iter().zip(&*rhs).for_each(|(&p, &x)| placed[p as usize] = x);
        self.cholesky.solve_in_place(&mut placed);
        self.place.iter().zip(rhs).for_each(|(&p, x)| *x = placed[p as usize]);
    }

    fn scatter(
        &self,
        matrix: &[f64],
        width: usize,
        controls: &[u32],
        factor: f64,
        freedom: &Freedom,
        mut next_pair: usize,
        values: &mut [f64],
    ) -> usize {
        let starts = self.cholesky.pattern().column_starts();
        for (p, &a) in controls.iter().enumerate() {
            let a = a as usize;
            let rows = freedom.dim[a] as usize;
            if rows == 0 {
                continue;
            }
            let i0 = self.place[freedom.start[a] as usize] as usize;
            for (q, &b) in controls.iter().enumerate() {
                let b = b as usize;
                let columns = freedom.dim[b] as usize;
                if columns == 0 {
                    continue;
                }
                let j0 = self.place[freedom.start[b] as usize] as usize;
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

/// Structure of the matrix with the unknowns in the order of elimination, and where each comes.
fn eliminated_pattern(
    cliques: &Cliques<'_>,
    freedom: &Freedom,
    pulls: &[Pull],
) -> Result<(SymmetricPattern, Vec<u32>), SolverError> {
    let (block_of, blocks) = freedom.blocks();
    let clique = |controls: &mut dyn Iterator<Item = u32>| -> Vec<u32> {
        let mut met: Vec<u32> =
            controls.map(|v| block_of[v as usize]).filter(|&b| b != u32::MAX).collect();
        met.sort_unstable();
        met.dedup();
        met
    };
    let coupled = cliques.iter().map(|controls| clique(&mut controls.iter().copied()));
    let pulled = pulls.iter().map(|p| clique(&mut p.stencil.iter().map(|&(v, _)| v)));
    let coarse = SymmetricPattern::from_cliques(blocks.len(), coupled.chain(pulled));
    let mut place = vec![0; freedom.len()];
    let mut next = 0;
    for block in SparseCholesky::elimination_order(&coarse)? {
        let (start, dim) = blocks[block];
        for unknown in &mut place[start..start + dim] {
            *unknown = next;
            next += 1;
        }
    }
    let unknowns = |block: usize| {
        let (start, dim) = blocks[block];
        (0..dim).map(move |k| start + k)
    };
    let entries = (0..blocks.len()).flat_map(|b| {
        let rows = &coarse.rows()[coarse.column_starts()[b]..coarse.column_starts()[b + 1]];
        rows.iter().flat_map(move |&a| {
            unknowns(a as usize).flat_map(move |i| unknowns(b).map(move |j| (i, j)))
        })
    });
    let placed = entries.map(|(i, j)| (place[i] as usize, place[j] as usize));
    let pattern = SymmetricPattern::new(freedom.len(), placed)?;
    Ok((pattern, place))
}

// Ordered pairs of control points that have unknowns, the first one's not eliminated before the
// second one's: the places of their first unknowns.
fn for_pairs(
    cliques: &Cliques<'_>,
    freedom: &Freedom,
    place: &[u32],
    mut visit: impl FnMut(usize, usize),
) {
    let first = |v: u32| {
        let v = v as usize;
        (freedom.dim[v] > 0).then(|| place[freedom.start[v] as usize] as usize)
    };
    for controls in cliques.iter() {
        for a in controls.iter().filter_map(|&a| first(a)) {
            for b in controls.iter().filter_map(|&b| first(b)) {
                if a >= b {
                    visit(a, b);
                }
            }
        }
    }
}

/// Sets of control points of which all depend on one another, in the order of assembly: those of
/// the patches, then those of wide blends.
struct Cliques<'a> {
    evaluator: &'a SurfaceEnergy,
    blocks: &'a [GuideBlock],
}

impl<'a> Cliques<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u32]> {
        let evaluator = self.evaluator;
        let groups = evaluator.groups().iter().filter(move |g| !is_guided(evaluator, g));
        let patches = groups.flat_map(|g| g.controls.chunks(g.per_patch));
        patches.chain(self.blocks.iter().map(|b| &b.vertices[..]))
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

pub(crate) fn element_width(per_patch: usize) -> usize {
    (3 * per_patch).next_multiple_of(MAX_LANES)
}

/// The matrix of one patch, upper triangle, rows padded to whole vectors.
struct ElementMatrix<'a> {
    rule: &'a Table,
    mixture: &'a Mixture,
    positions: &'a [f64],
    controls: &'a [u32],
    area: f64,
    least_area: f64,
    matrix: &'a mut [f64],
}

impl WithSimd for ElementMatrix<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_frame();
        let count = self.controls.len();
        let width = element_width(count);
        let table = self.rule;
        let (values, _) = S::as_simd_f64s(&table.values);
        let (weights, _) = S::as_simd_f64s(&table.weights);
        let mut points = vec![[0.0; 3]; count];
        gather(self.positions, self.controls, &mut points);
        let mut residuals = vec![0.0; MAX_LANES * RESIDUALS * width];
        // The Sobolev part: the same for all three coordinates.
        let scalar_width = count.next_multiple_of(MAX_LANES);
        let mut scalar_rows = vec![0.0; MAX_LANES * 9 * scalar_width];
        let mut scalar = vec![0.0; count * scalar_width];
        let mut mass = 0.0;
        for chunk in 0..weights.len() {
            let place = table.chunk(chunk, S::F64_LANES);
            let d = table_derivatives(simd, values, place, &points, 3);
            let shape = Shape::new(&d);
            let weight = Lanes(simd, weights[chunk]);
            if self.mixture.sobolev > 0.0 {
                let (mut area, mut w) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
                simd.partial_store_f64s(&mut area[..S::F64_LANES], shape.area.1);
                simd.partial_store_f64s(&mut w[..S::F64_LANES], weight.1);
                for lane in 0..S::F64_LANES {
                    let j = area[lane].max(self.least_area);
                    mass += w[lane] * j;
                    let (start, step) = table.chunk(S::F64_LANES * chunk + lane, 1);
                    let to = &mut scalar_rows[lane * 9 * scalar_width..][..9 * scalar_width];
                    let factors = self.sobolev_scales(w[lane], j);
                    for (d, (row, factor)) in to.chunks_mut(scalar_width).zip(factors).enumerate() {
                        for (k, value) in row[..count].iter_mut().enumerate() {
                            *value = factor * table.values[start + (d * count + k) * step];
                        }
                    }
                }
                let rows = &scalar_rows[..S::F64_LANES * 9 * scalar_width];
                add_outer_products(simd, rows, scalar_width, count, &mut scalar);
            }
            if self.mixture.gauss_newton {
                let (adjoints, rows) =
                    residual_adjoints(simd, &shape, weight, &self.mixture.density);
                for (at, adjoint) in adjoints[..rows].iter().enumerate() {
                    let row = shape.pull_back(&d, adjoint);
                    for k in 0..count {
                        let sum = table_adjoint(simd, values, place, (k, count), &row);
                        for c in 0..3 {
                            let mut lanes = [0.0; MAX_LANES];
                            simd.partial_store_f64s(&mut lanes[..S::F64_LANES], sum[c].1);
                            for (lane, &value) in lanes[..S::F64_LANES].iter().enumerate() {
                                residuals[(at * S::F64_LANES + lane) * width + 3 * k + c] = value;
                            }
                        }
                    }
                }
                let rows = &residuals[..rows * S::F64_LANES * width];
                add_outer_products(simd, rows, width, 3 * count, self.matrix);
            }
        }
        if self.mixture.sobolev > 0.0 {
            // Order 0, lumped.
            let lumped = self.mixture.sobolev * self.area * mass
                / count as f64
                / (LENGTH_SQUARED * self.area).powi(3);
            for p in 0..count {
                scalar[p * scalar_width + p] += lumped;
                for q in p..count {
                    let value = scalar[p * scalar_width + q];
                    for c in 0..3 {
                        self.matrix[(3 * p + c) * width + 3 * q + c] += value;
                    }
                }
            }
        }
    }
}

impl ElementMatrix<'_> {
    /// Square roots of the factors of the nine squared derivatives in
    /// `A Σₖ ℓ^{2(k−3)} |∇ᵏ|²`, k = 1 to 3, with parameter derivatives scaled as if the map were
    /// conformal: `|∇ᵏ f|² ≈ J^{−k} |∂ᵏ f|²`, times `J` for the area. The order 0 is lumped, which
    /// keeps translations in.
    #[inline(always)]
    fn sobolev_scales(&self, weight: f64, j: f64) -> [f64; 9] {
        let length = LENGTH_SQUARED * self.area;
        let first = self.mixture.sobolev * self.area * weight / (length * length);
        let second = first * length / j;
        let third = second * length / j;
        let [first, second, third] = [first.sqrt(), second.sqrt(), third.sqrt()];
        let (mixed, twice) = (2.0_f64.sqrt() * second, 3.0_f64.sqrt() * third);
        [first, first, second, mixed, second, third, twice, twice, third]
    }
}

/// Adjoints of the weighted residuals `√(2 w J) f` of one vector of samples, and how many of them
/// are in use.
#[inline(always)]
fn residual_adjoints<S: Simd>(
    simd: S,
    shape: &Shape<S>,
    weight: Lanes<S>,
    w: &Density,
) -> ([FrameAdjoint<S>; RESIDUALS], usize) {
    let zero = Lanes::splat(simd, 0.0);
    let nothing = FrameAdjoint { harmonics: [zero; 4], second: [zero; 3], area: zero };
    let mut out = [nothing; RESIDUALS];
    let root_area = shape.area.sqrt();
    let half = root_area.recip() * 0.5;
    let root_weight = weight.sqrt();
    let [l, m, q] = shape.second;
    let mut rows = 0;
    // Squares of the harmonics; the coupling term is left out, the root has its own weight.
    let f = shape.harmonics;
    let slope = if w.root != 0.0 {
        let size = f[0].fma(f[0], f[1].fma(f[1], f[2].fma(f[2], f[3] * f[3])));
        // Far from zero the second derivative along the gradient vanishes; this is its mean.
        (size + Lanes::splat(simd, w.root_epsilon * w.root_epsilon)).sqrt().recip() * (0.5 * w.root)
    } else {
        zero
    };
    for k in 0..4 {
        let c = if k < 2 { w.f1 } else { w.f3 };
        if c > 0.0 || w.root > 0.0 {
            let scale = ((Lanes::splat(simd, c.max(0.0)) + slope) * 2.0).sqrt() * root_weight;
            out[rows].harmonics[k] = root_area * scale;
            out[rows].area = f[k] * half * scale;
            rows += 1;
        }
    }
    // The quadratic form in (l, m, q) along its eigenvectors: (l + q)/√2, (l − q)/√2, m.
    let r = std::f64::consts::FRAC_1_SQRT_2;
    let forms = [
        (w.square + 0.5 * w.product, [r, 0.0, r], (l + q) * r),
        (w.square - 0.5 * w.product, [r, 0.0, -r], (l - q) * r),
        (w.twist, [0.0, 1.0, 0.0], m),
    ];
    for (c, along, value) in forms {
        if c > 0.0 {
            let scale = root_weight * (2.0 * c).sqrt();
            for (second, along) in out[rows].second.iter_mut().zip(along) {
                *second = root_area * scale * along;
            }
            out[rows].area = value * half * scale;
            rows += 1;
        }
    }
    if w.barrier > 0.0 {
        // The barrier c/J curves by 2c/J³ along J.
        let curving = shape.inv_area * shape.inv_area * shape.inv_area * (2.0 * w.barrier);
        out[rows].area = root_weight * curving.sqrt();
        rows += 1;
    }
    (out, rows)
}

/// `matrix += RᵀR`, upper triangle up to whole vectors, four rows of `R` at a time.
#[inline(always)]
fn add_outer_products<S: Simd>(
    simd: S,
    rows: &[f64],
    width: usize,
    used: usize,
    matrix: &mut [f64],
) {
    let mut blocks = rows.chunks_exact(4 * width);
    for block in &mut blocks {
        let (vectors, _) = S::as_simd_f64s(block);
        let per_row = width / S::F64_LANES;
        let (r0, rest) = vectors.split_at(per_row);
        let (r1, rest) = rest.split_at(per_row);
        let (r2, r3) = rest.split_at(per_row);
        for p in 0..used {
            let from = p / S::F64_LANES;
            let a0 = simd.splat_f64s(block[p]);
            let a1 = simd.splat_f64s(block[width + p]);
            let a2 = simd.splat_f64s(block[2 * width + p]);
            let a3 = simd.splat_f64s(block[3 * width + p]);
            let (out, _) = S::as_mut_simd_f64s(&mut matrix[p * width..(p + 1) * width]);
            for q in from..per_row {
                let mut sum = simd.mul_add_e_f64s(a0, r0[q], out[q]);
                sum = simd.mul_add_e_f64s(a1, r1[q], sum);
                sum = simd.mul_add_e_f64s(a2, r2[q], sum);
                out[q] = simd.mul_add_e_f64s(a3, r3[q], sum);
            }
        }
    }
    for row in blocks.remainder().chunks_exact(width) {
        for p in 0..used {
            for q in p..width {
                matrix[p * width + q] += row[p] * row[q];
            }
        }
    }
}
