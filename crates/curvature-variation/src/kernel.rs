//! Energy, area and their gradients of one patch, a vector of samples at a time.

use crate::density::{Density, Derivatives, Shape};
use crate::lanes::{Lanes, Vec3};
use crate::rules::{SeparableRule, Table};
use pulp::{Simd, WithSimd};

/// Orders of the nine derivatives.
pub(crate) const ORDER_U: [usize; 9] = [1, 0, 2, 1, 0, 3, 2, 1, 0];
pub(crate) const ORDER_V: [usize; 9] = [0, 1, 0, 1, 2, 0, 1, 2, 3];

/// What a pass computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Task<'a> {
    /// The area alone.
    Area,
    /// Area and integral of a density.
    Energy(&'a Density),
    /// The same with gradients.
    Gradient(&'a Density),
}

/// Values per control point a gradient pass fills: three of the integral, three of the area.
pub(crate) const GRADIENT_LEN: usize = 6;

/// One pass over a run of patches of one kind.
pub(crate) struct PatchRun<'a, R> {
    pub(crate) rule: &'a R,
    pub(crate) task: Task<'a>,
    pub(crate) positions: &'a [f64],
    /// Control points, patch after patch.
    pub(crate) controls: &'a [u32],
    pub(crate) per_patch: usize,
    /// `[area, integral]` per patch.
    pub(crate) integrals: &'a mut [[f64; 2]],
    /// [`GRADIENT_LEN`] values per control point, patch after patch; empty without gradients.
    pub(crate) gradients: &'a mut [f64],
}

#[inline(always)]
fn zero<S: Simd>(simd: S) -> Vec3<S> {
    [Lanes::splat(simd, 0.0); 3]
}

/// What one vector of samples adds.
struct Sampled<S: Simd> {
    area: Lanes<S>,
    integral: Lanes<S>,
    adjoint: Derivatives<S>,
    area_adjoint: [Vec3<S>; 2],
}

#[inline(always)]
fn sample<S: Simd>(d: &Derivatives<S>, weight: Lanes<S>, task: Task<'_>) -> Sampled<S> {
    let simd = weight.0;
    let nothing = zero(simd);
    let shape = Shape::new(d);
    let area = shape.area * weight;
    let mut out = Sampled {
        area,
        integral: Lanes::splat(simd, 0.0),
        adjoint: [nothing; 9],
        area_adjoint: [nothing; 2],
    };
    match task {
        Task::Area => {}
        Task::Energy(density) => out.integral = shape.density(density).0 * weight,
        Task::Gradient(density) => {
            let (value, mut adjoint) = shape.density(density);
            out.integral = value * weight;
            adjoint.harmonics = adjoint.harmonics.map(|x| x * weight);
            adjoint.second = adjoint.second.map(|x| x * weight);
            adjoint.area = adjoint.area * weight;
            out.adjoint = shape.pull_back(d, &adjoint);
            out.area_adjoint =
                shape.area_adjoint(d).map(|a| [a[0] * weight, a[1] * weight, a[2] * weight]);
        }
    }
    out
}

impl WithSimd for PatchRun<'_, Table> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let count = self.per_patch;
        let rule = self.rule;
        let (values, _) = S::as_simd_f64s(&rule.values);
        let (weights, _) = S::as_simd_f64s(&rule.weights);
        let chunks = weights.len();
        let with_gradient = matches!(self.task, Task::Gradient(_));
        let mut sums = vec![zero(simd); if with_gradient { 2 * count } else { 0 }];
        for (patch, integrals) in self.integrals.iter_mut().enumerate() {
            let controls = &self.controls[patch * count..(patch + 1) * count];
            let mut area = Lanes::splat(simd, 0.0);
            let mut integral = area;
            sums.fill(zero(simd));
            for (chunk, &w) in weights.iter().enumerate() {
                let mut d: Derivatives<S> = [zero(simd); 9];
                let needed = if self.task == Task::Area { 2 } else { 9 };
                for (order, out) in d[..needed].iter_mut().enumerate() {
                    for (k, &v) in controls.iter().enumerate() {
                        let t = Lanes(simd, values[(order * count + k) * chunks + chunk]);
                        let p = &self.positions[3 * v as usize..3 * v as usize + 3];
                        for c in 0..3 {
                            out[c] = t.fma(Lanes::splat(simd, p[c]), out[c]);
                        }
                    }
                }
                let s = sample(&d, Lanes(simd, w), self.task);
                area = area + s.area;
                integral = integral + s.integral;
                if with_gradient {
                    for (k, sum) in sums.chunks_exact_mut(2).enumerate() {
                        for (order, adjoint) in s.adjoint.iter().enumerate() {
                            let t = Lanes(simd, values[(order * count + k) * chunks + chunk]);
                            for c in 0..3 {
                                sum[0][c] = t.fma(adjoint[c], sum[0][c]);
                                if order < 2 {
                                    sum[1][c] = t.fma(s.area_adjoint[order][c], sum[1][c]);
                                }
                            }
                        }
                    }
                }
            }
            *integrals = [area.sum(), integral.sum()];
            if with_gradient {
                let start = patch * count * GRADIENT_LEN;
                let out = &mut self.gradients[start..start + count * GRADIENT_LEN];
                for (g, sum) in out.chunks_exact_mut(GRADIENT_LEN).zip(sums.chunks_exact(2)) {
                    for c in 0..3 {
                        g[c] = sum[0][c].sum();
                        g[3 + c] = sum[1][c].sum();
                    }
                }
            }
        }
    }
}

impl WithSimd for PatchRun<'_, SeparableRule> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rule = self.rule;
        let lanes_per_row = rule.padded / S::F64_LANES;
        // Whole vectors of padding are skipped.
        let chunks = rule.nodes.div_ceil(S::F64_LANES);
        let (basis, _) = S::as_simd_f64s(&rule.basis);
        let (weights, _) = S::as_simd_f64s(&rule.weights);
        let with_gradient = matches!(self.task, Task::Gradient(_));
        let orders = if self.task == Task::Area { 2 } else { 4 };
        for (patch, integrals) in self.integrals.iter_mut().enumerate() {
            let controls: &[u32; 16] = match self.controls[16 * patch..].first_chunk() {
                Some(controls) => controls,
                None => return,
            };
            let point = |i: usize, j: usize| {
                let v = 3 * controls[rule.order[4 * i + j]] as usize;
                &self.positions[v..v + 3]
            };
            let mut area = Lanes::splat(simd, 0.0);
            let mut integral = area;
            let mut out = [0.0; 16 * GRADIENT_LEN];
            for chunk in 0..chunks {
                // Along v for every row of control points, then along u for every node.
                let mut rows = [[zero(simd); 4]; 4];
                for (order, row) in rows[..orders].iter_mut().enumerate() {
                    for j in 0..4 {
                        let t = Lanes(simd, basis[(4 * order + j) * lanes_per_row + chunk]);
                        for (i, sum) in row.iter_mut().enumerate() {
                            let p = point(i, j);
                            for c in 0..3 {
                                sum[c] = t.fma(Lanes::splat(simd, p[c]), sum[c]);
                            }
                        }
                    }
                }
                let mut back = [[zero(simd); 4]; 4];
                let mut area_back = [[zero(simd); 4]; 2];
                for node in 0..rule.nodes {
                    let at = |order: usize, i: usize| {
                        Lanes::splat(simd, rule.basis[(4 * order + i) * rule.padded + node])
                    };
                    let mut d: Derivatives<S> = [zero(simd); 9];
                    let needed = if self.task == Task::Area { 2 } else { 9 };
                    for (k, sum) in d[..needed].iter_mut().enumerate() {
                        for i in 0..4 {
                            let t = at(ORDER_U[k], i);
                            for c in 0..3 {
                                sum[c] = t.fma(rows[ORDER_V[k]][i][c], sum[c]);
                            }
                        }
                    }
                    let weight = Lanes(simd, weights[node * lanes_per_row + chunk]);
                    let s = sample(&d, weight, self.task);
                    area = area + s.area;
                    integral = integral + s.integral;
                    if with_gradient {
                        for i in 0..4 {
                            for k in 0..9 {
                                let t = at(ORDER_U[k], i);
                                let sum = &mut back[ORDER_V[k]][i];
                                for c in 0..3 {
                                    sum[c] = t.fma(s.adjoint[k][c], sum[c]);
                                }
                            }
                            for k in 0..2 {
                                let t = at(ORDER_U[k], i);
                                let sum = &mut area_back[ORDER_V[k]][i];
                                for c in 0..3 {
                                    sum[c] = t.fma(s.area_adjoint[k][c], sum[c]);
                                }
                            }
                        }
                    }
                }
                if with_gradient {
                    for j in 0..4 {
                        let t: [Lanes<S>; 4] = std::array::from_fn(|order| {
                            Lanes(simd, basis[(4 * order + j) * lanes_per_row + chunk])
                        });
                        for i in 0..4 {
                            let k = GRADIENT_LEN * rule.order[4 * i + j];
                            for c in 0..3 {
                                let mut sum = t[0] * back[0][i][c];
                                for order in 1..4 {
                                    sum = t[order].fma(back[order][i][c], sum);
                                }
                                out[k + c] += sum.sum();
                                let sum = t[0].fma(area_back[0][i][c], t[1] * area_back[1][i][c]);
                                out[k + 3 + c] += sum.sum();
                            }
                        }
                    }
                }
            }
            *integrals = [area.sum(), integral.sum()];
            if with_gradient {
                let start = patch * out.len();
                self.gradients[start..start + out.len()].copy_from_slice(&out);
            }
        }
    }
}
