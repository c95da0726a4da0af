//! What one patch adds to a metric.

use crate::density::{Density, FrameAdjoint, Shape};
use crate::kernel::{gather, table_adjoint, table_derivatives};
use crate::rules::{MAX_LANES, Table};
use numerics::{Lanes, Real, align_frame};
use pulp::{Simd, WithSimd};

/// `ℓ²` of the Sobolev norm as a share of the area.
const LENGTH_SQUARED: f64 = 1.0 / 40.0;
/// Residuals of a sample at most: four harmonics, three of the second form, the barrier.
const RESIDUALS: usize = 8;

/// `gauss_newton · (Gauss-Newton Hessian of a density) + sobolev · (H³ norm)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mixture {
    pub(crate) density: Density,
    pub(crate) gauss_newton: bool,
    pub(crate) sobolev: f64,
}

/// Length of a row of the matrix of a patch with this many control points.
pub(crate) fn element_width(per_patch: usize) -> usize {
    (3 * per_patch).next_multiple_of(MAX_LANES)
}

/// The matrix of one patch, upper triangle, rows padded to whole vectors.
pub(crate) struct ElementMatrix<'a> {
    pub(crate) rule: &'a Table,
    pub(crate) mixture: &'a Mixture,
    pub(crate) positions: &'a [f64],
    pub(crate) controls: &'a [u32],
    pub(crate) area: f64,
    pub(crate) least_area: f64,
    pub(crate) matrix: &'a mut [f64],
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
            let weight = Lanes::new(simd, weights[chunk]);
            if self.mixture.sobolev > 0.0 {
                let (mut area, mut w) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
                simd.partial_store_f64s(&mut area[..S::F64_LANES], shape.area.value);
                simd.partial_store_f64s(&mut w[..S::F64_LANES], weight.value);
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
                        let sum = sum.to_array();
                        for c in 0..3 {
                            let mut lanes = [0.0; MAX_LANES];
                            simd.partial_store_f64s(&mut lanes[..S::F64_LANES], sum[c].value);
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
