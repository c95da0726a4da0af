//! Energy, area and their gradients of one patch, a vector of samples at a time.

use crate::density::{Density, Derivatives, Shape};
use crate::lanes::{Lanes, Vec3, scaled};
use crate::rules::{SeparableRule, Table};
use pulp::{Simd, WithSimd, bytemuck};

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
    /// Where every control point's gradient goes.
    pub(crate) places: &'a [u16],
    pub(crate) per_patch: usize,
    /// `[area, integral]` per patch.
    pub(crate) integrals: &'a mut [[f64; 2]],
    /// [`GRADIENT_LEN`] values per place, the sums over all patches; empty without gradients.
    pub(crate) gradients: &'a mut [f64],
}

/// The patch's control points, together in one place.
pub(crate) fn gather(positions: &[f64], controls: &[u32], points: &mut [[f64; 3]]) {
    for (point, &v) in points.iter_mut().zip(controls) {
        point.copy_from_slice(&positions[3 * v as usize..3 * v as usize + 3]);
    }
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
    let shape = Shape::new(d);
    let area = shape.area * weight;
    if let Task::Gradient(density) = task {
        let (value, adjoint) = shape.density(density);
        let [u, v] = shape.area_adjoint(d);
        return Sampled {
            area,
            integral: value * weight,
            adjoint: shape.pull_back(d, &adjoint.scaled(weight)),
            area_adjoint: [scaled(&u, weight), scaled(&v, weight)],
        };
    }
    let integral = match task {
        Task::Energy(density) => shape.density(density).0 * weight,
        _ => Lanes::splat(weight.0, 0.0),
    };
    let nothing = zero(weight.0);
    Sampled { area, integral, adjoint: [nothing; 9], area_adjoint: [nothing; 2] }
}

/// Adds the sums over the lanes of each vector to `out`.
#[inline(always)]
fn add_lanes<S: Simd>(vectors: &[S::f64s], out: &mut [f64]) {
    let values: &[f64] = bytemuck::cast_slice(vectors);
    // One after the other they would each take as many operations as four together.
    match S::F64_LANES {
        4 => {
            for (sum, v) in out.iter_mut().zip(values.as_chunks::<4>().0) {
                *sum += (v[0] + v[1]) + (v[2] + v[3]);
            }
        }
        8 => {
            for (sum, v) in out.iter_mut().zip(values.as_chunks::<8>().0) {
                *sum += ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
            }
        }
        lanes => {
            for (sum, v) in out.iter_mut().zip(values.chunks_exact(lanes)) {
                for x in v {
                    *sum += x;
                }
            }
        }
    }
}

/// The first `3 · groups` derivatives at one vector of samples, from the table's weights (which
/// begin at `start`) and the control points.
///
/// Three derivatives at a time: nine sums hide the latency of the multiplications and still fit
/// into registers, which sums that live in memory would not.
#[inline(always)]
pub(crate) fn table_derivatives<S: Simd>(
    simd: S,
    values: &[S::f64s],
    (start, step): (usize, usize),
    points: &[[f64; 3]],
    groups: usize,
) -> Derivatives<S> {
    let count = points.len();
    let mut d: Derivatives<S> = [zero(simd); 9];
    for group in 0..groups {
        let mut sums = [zero(simd); 3];
        let begin = start + 3 * group * count * step;
        let length = count * step;
        let rows = &values[begin..begin + 3 * length - (step - 1)];
        for (k, point) in points.iter().enumerate() {
            let p = [
                Lanes::splat(simd, point[0]),
                Lanes::splat(simd, point[1]),
                Lanes::splat(simd, point[2]),
            ];
            for (order, sum) in sums.iter_mut().enumerate() {
                let t = Lanes(simd, rows[order * length + k * step]);
                *sum = [t.fma(p[0], sum[0]), t.fma(p[1], sum[1]), t.fma(p[2], sum[2])];
            }
        }
        d[3 * group..3 * group + 3].copy_from_slice(&sums);
    }
    d
}

/// Adjoint of control point `k` from those of the derivatives.
#[inline(always)]
pub(crate) fn table_adjoint<S: Simd>(
    simd: S,
    values: &[S::f64s],
    (start, step): (usize, usize),
    (k, count): (usize, usize),
    adjoint: &Derivatives<S>,
) -> Vec3<S> {
    let mut sum = zero(simd);
    for (order, a) in adjoint.iter().enumerate() {
        let t = Lanes(simd, values[start + (order * count + k) * step]);
        sum = [t.fma(a[0], sum[0]), t.fma(a[1], sum[1]), t.fma(a[2], sum[2])];
    }
    sum
}

impl WithSimd for PatchRun<'_, Table> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let count = self.per_patch;
        let rule = self.rule;
        let (values, _) = S::as_simd_f64s(&rule.values);
        let (weights, _) = S::as_simd_f64s(&rule.weights);
        let with_gradient = matches!(self.task, Task::Gradient(_));
        let mut sums = vec![[zero(simd); 2]; if with_gradient { count } else { 0 }];
        let mut points = vec![[0.0; 3]; count];
        self.gradients.fill(0.0);
        let groups = if self.task == Task::Area { 1 } else { 3 };
        for (patch, integrals) in self.integrals.iter_mut().enumerate() {
            let controls = &self.controls[patch * count..(patch + 1) * count];
            gather(self.positions, controls, &mut points);
            let mut area = Lanes::splat(simd, 0.0);
            let mut integral = area;
            sums.fill([zero(simd); 2]);
            for (chunk, &w) in weights.iter().enumerate() {
                let place = rule.chunk(chunk, S::F64_LANES);
                let d = table_derivatives(simd, values, place, &points, groups);
                let s = sample(&d, Lanes(simd, w), self.task);
                area = area + s.area;
                integral = integral + s.integral;
                if with_gradient {
                    let (start, step) = place;
                    let [au, av] = s.area_adjoint;
                    for (k, sum) in sums.iter_mut().enumerate() {
                        let g = table_adjoint(simd, values, place, (k, count), &s.adjoint);
                        let tu = Lanes(simd, values[start + k * step]);
                        let tv = Lanes(simd, values[start + (count + k) * step]);
                        let [mut now, mut now_area] = *sum;
                        for c in 0..3 {
                            now[c] = now[c] + g[c];
                            now_area[c] = tu.fma(au[c], tv.fma(av[c], now_area[c]));
                        }
                        *sum = [now, now_area];
                    }
                }
            }
            *integrals = [area.sum(), integral.sum()];
            if with_gradient {
                let places = &self.places[patch * count..(patch + 1) * count];
                for (&place, sum) in places.iter().zip(&sums) {
                    let g = &mut self.gradients[GRADIENT_LEN * place as usize..][..GRADIENT_LEN];
                    for c in 0..3 {
                        g[c] += sum[0][c].sum();
                        g[3 + c] += sum[1][c].sum();
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
        self.gradients.fill(0.0);
        // Overwritten by every patch, and so outside the loop, which would clear them each time.
        let mut rows = [[zero(simd); 4]; 4];
        let mut at = [[Lanes::splat(simd, 0.0); 4]; 4];
        let mut d: Derivatives<S> = [zero(simd); 9];
        let nothing = simd.splat_f64s(0.0);
        let mut sums = [nothing; 16 * GRADIENT_LEN];
        for (patch, integrals) in self.integrals.iter_mut().enumerate() {
            let controls: &[u32; 16] = match self.controls[16 * patch..].first_chunk() {
                Some(controls) => controls,
                None => return,
            };
            let mut points = [[0.0; 3]; 16];
            for (point, &k) in points.iter_mut().zip(&rule.order) {
                let v = 3 * controls[k] as usize;
                point.copy_from_slice(&self.positions[v..v + 3]);
            }
            let mut area = Lanes::splat(simd, 0.0);
            let mut integral = area;
            for chunk in 0..chunks {
                // Along v for every row of control points, then along u for every node.
                for order in 0..orders {
                    for i in 0..4 {
                        let mut sum = zero(simd);
                        for j in 0..4 {
                            let t = Lanes(simd, basis[(4 * order + j) * lanes_per_row + chunk]);
                            let p = &points[4 * i + j];
                            for c in 0..3 {
                                sum[c] = t.fma(Lanes::splat(simd, p[c]), sum[c]);
                            }
                        }
                        rows[order][i] = sum;
                    }
                }
                let mut back = [[zero(simd); 4]; 4];
                let mut area_back = [[zero(simd); 4]; 2];
                for node in 0..rule.nodes {
                    for (order, at) in at.iter_mut().enumerate() {
                        for (i, at) in at.iter_mut().enumerate() {
                            let value = rule.basis[(4 * order + i) * rule.padded + node];
                            *at = Lanes::splat(simd, value);
                        }
                    }
                    let needed = if self.task == Task::Area { 2 } else { 9 };
                    for k in 0..needed {
                        let mut sum = zero(simd);
                        for i in 0..4 {
                            let (t, row) = (at[ORDER_U[k]][i], &rows[ORDER_V[k]][i]);
                            for c in 0..3 {
                                sum[c] = t.fma(row[c], sum[c]);
                            }
                        }
                        d[k] = sum;
                    }
                    let weight = Lanes(simd, weights[node * lanes_per_row + chunk]);
                    let s = sample(&d, weight, self.task);
                    area = area + s.area;
                    integral = integral + s.integral;
                    if with_gradient {
                        // Collected by the order along v, so that each sum is touched once.
                        let (a, [au, av]) = (&s.adjoint, &s.area_adjoint);
                        for i in 0..4 {
                            let t = [at[0][i], at[1][i], at[2][i], at[3][i]];
                            for c in 0..3 {
                                back[0][i][c] = t[1].fma(
                                    a[0][c],
                                    t[2].fma(a[2][c], t[3].fma(a[5][c], back[0][i][c])),
                                );
                                back[1][i][c] = t[0].fma(
                                    a[1][c],
                                    t[1].fma(a[3][c], t[2].fma(a[6][c], back[1][i][c])),
                                );
                                back[2][i][c] = t[0].fma(a[4][c], t[1].fma(a[7][c], back[2][i][c]));
                                back[3][i][c] = t[0].fma(a[8][c], back[3][i][c]);
                                area_back[0][i][c] = t[1].fma(au[c], area_back[0][i][c]);
                                area_back[1][i][c] = t[0].fma(av[c], area_back[1][i][c]);
                            }
                        }
                    }
                }
                if with_gradient {
                    for j in 0..4 {
                        let mut t = [Lanes::splat(simd, 0.0); 4];
                        for (order, t) in t.iter_mut().enumerate() {
                            *t = Lanes(simd, basis[(4 * order + j) * lanes_per_row + chunk]);
                        }
                        for i in 0..4 {
                            let k = GRADIENT_LEN * (4 * i + j);
                            for c in 0..3 {
                                let before = if chunk > 0 { sums[k + c] } else { nothing };
                                let mut sum = t[0].fma(back[0][i][c], Lanes(simd, before));
                                for order in 1..4 {
                                    sum = t[order].fma(back[order][i][c], sum);
                                }
                                sums[k + c] = sum.1;
                                let before = if chunk > 0 { sums[k + 3 + c] } else { nothing };
                                let sum = t[1].fma(area_back[1][i][c], Lanes(simd, before));
                                sums[k + 3 + c] = t[0].fma(area_back[0][i][c], sum).1;
                            }
                        }
                    }
                }
            }
            *integrals = [area.sum(), integral.sum()];
            if with_gradient {
                for (&k, sums) in rule.order.iter().zip(sums.chunks_exact(GRADIENT_LEN)) {
                    let place = GRADIENT_LEN * self.places[16 * patch + k] as usize;
                    add_lanes::<S>(sums, &mut self.gradients[place..place + GRADIENT_LEN]);
                }
            }
        }
    }
}
