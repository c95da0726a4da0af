//! Energy, area and their gradients of one patch, a vector of samples or of patches at a time.

use crate::density::{Density, Derivatives, Shape};
use crate::rules::{SeparableRule, Table};
use numerics::{Aligned, Lanes, Real, Triple, align_frame};
use pulp::{Simd, WithSimd, bytemuck};

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
fn zero<S: Simd>(simd: S) -> Triple<Lanes<S>> {
    Triple::splat(Lanes::splat(simd, 0.0))
}

/// What one vector of samples adds.
struct Sampled<S: Simd> {
    area: Lanes<S>,
    integral: Lanes<S>,
    adjoint: Derivatives<S>,
    area_adjoint: [Triple<Lanes<S>>; 2],
}

#[inline(always)]
fn sample<S: Simd>(d: &Derivatives<S>, weight: Lanes<S>, task: Task<'_>) -> Sampled<S> {
    let shape = Shape::new(d);
    let area = shape.area * weight;
    if let Task::Gradient(density) = task {
        let (integral, adjoint) = shape.density(density, weight);
        return Sampled {
            area,
            integral,
            adjoint: shape.pull_back(d, &adjoint),
            area_adjoint: shape.area_adjoint(weight),
        };
    }
    let integral = match task {
        Task::Energy(density) => shape.density(density, weight).0,
        _ => Lanes::splat(weight.simd, 0.0),
    };
    let nothing = zero(weight.simd);
    Sampled { area, integral, adjoint: [nothing; 9], area_adjoint: [nothing; 2] }
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
            let p = Triple {
                x: Lanes::splat(simd, point[0]),
                y: Lanes::splat(simd, point[1]),
                z: Lanes::splat(simd, point[2]),
            };
            for (order, sum) in sums.iter_mut().enumerate() {
                let t = Lanes::new(simd, rows[order * length + k * step]);
                *sum = sum.plus(t, p);
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
) -> Triple<Lanes<S>> {
    let mut sum = zero(simd);
    for (order, a) in adjoint.iter().enumerate() {
        let t = Lanes::new(simd, values[start + (order * count + k) * step]);
        sum = sum.plus(t, *a);
    }
    sum
}

impl WithSimd for PatchRun<'_, Table> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_frame();
        let count = self.per_patch;
        let rule = self.rule;
        let (values, _) = S::as_simd_f64s(&rule.values);
        let (weights, _) = S::as_simd_f64s(&rule.weights);
        let with_gradient = matches!(self.task, Task::Gradient(_));
        let mut sums = vec![Aligned([zero(simd); 2]); if with_gradient { count } else { 0 }];
        let mut points = vec![[0.0; 3]; count];
        self.gradients.fill(0.0);
        let groups = if self.task == Task::Area { 1 } else { 3 };
        for (patch, integrals) in self.integrals.iter_mut().enumerate() {
            let controls = &self.controls[patch * count..(patch + 1) * count];
            gather(self.positions, controls, &mut points);
            let mut area = Lanes::splat(simd, 0.0);
            let mut integral = area;
            sums.fill(Aligned([zero(simd); 2]));
            for (chunk, &w) in weights.iter().enumerate() {
                let place = rule.chunk(chunk, S::F64_LANES);
                let d = table_derivatives(simd, values, place, &points, groups);
                let s = sample(&d, Lanes::new(simd, w), self.task);
                area = area + s.area;
                integral = integral + s.integral;
                if with_gradient {
                    let (start, step) = place;
                    let [au, av] = s.area_adjoint;
                    for (k, sum) in sums.iter_mut().enumerate() {
                        let g = table_adjoint(simd, values, place, (k, count), &s.adjoint);
                        let tu = Lanes::new(simd, values[start + k * step]);
                        let tv = Lanes::new(simd, values[start + (count + k) * step]);
                        let [now, now_area] = sum.0;
                        sum.0 = [now + g, now_area.plus(tv, av).plus(tu, au)];
                    }
                }
            }
            *integrals = [area.sum(), integral.sum()];
            if with_gradient {
                let places = &self.places[patch * count..(patch + 1) * count];
                for (&place, sum) in places.iter().zip(&sums) {
                    let g = &mut self.gradients[GRADIENT_LEN * place as usize..][..GRADIENT_LEN];
                    let [integral, area] = [sum.0[0].to_array(), sum.0[1].to_array()];
                    for c in 0..3 {
                        g[c] += integral[c].sum();
                        g[3 + c] += area[c].sum();
                    }
                }
            }
        }
    }
}

/// Integrals of several densities over a run of patches of a table: its derivatives, which are most
/// of the work where many control points meet, are computed once for all of them.
pub(crate) struct DensityRun<'a> {
    pub(crate) rule: &'a Table,
    pub(crate) densities: &'a [Density],
    pub(crate) positions: &'a [f64],
    /// Control points, patch after patch.
    pub(crate) controls: &'a [u32],
    pub(crate) per_patch: usize,
    /// One value per density, patch after patch.
    pub(crate) integrals: &'a mut [f64],
}

impl WithSimd for DensityRun<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_frame();
        let (count, rule) = (self.per_patch, self.rule);
        let (values, _) = S::as_simd_f64s(&rule.values);
        let (weights, _) = S::as_simd_f64s(&rule.weights);
        let mut points = vec![[0.0; 3]; count];
        let mut sums = vec![Aligned(Lanes::splat(simd, 0.0)); self.densities.len()];
        let patches = self.controls.chunks_exact(count);
        for (controls, out) in patches.zip(self.integrals.chunks_exact_mut(sums.len())) {
            gather(self.positions, controls, &mut points);
            sums.fill(Aligned(Lanes::splat(simd, 0.0)));
            for (chunk, &w) in weights.iter().enumerate() {
                let place = rule.chunk(chunk, S::F64_LANES);
                let shape = Shape::new(&table_derivatives(simd, values, place, &points, 3));
                let weight = Lanes::new(simd, w);
                for (sum, density) in sums.iter_mut().zip(self.densities) {
                    sum.0 = sum.0 + shape.density(density, weight).0;
                }
            }
            out.iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum.0.sum());
        }
    }
}

/// The values of a basis function at one node of a rule: `[order][k]`, the same in all lanes.
type Basis<S> = [[Lanes<S>; 4]; 4];

/// `Σ t_k v_k`.
#[inline(always)]
fn along<S: Simd>(t: &[Lanes<S>; 4], v: &[Triple<Lanes<S>>; 4]) -> Triple<Lanes<S>> {
    let mut sum = v[0].scale(t[0]);
    for k in 1..4 {
        sum = sum.plus(t[k], v[k]);
    }
    sum
}

/// The nine derivatives at a node from the derivatives along v (`rows[order][i]`).
#[inline(always)]
fn derivatives_along_u<S: Simd>(t: &Basis<S>, rows: &[[Triple<Lanes<S>>; 4]; 4]) -> Derivatives<S> {
    [
        along(&t[1], &rows[0]),
        along(&t[0], &rows[1]),
        along(&t[2], &rows[0]),
        along(&t[1], &rows[1]),
        along(&t[0], &rows[2]),
        along(&t[3], &rows[0]),
        along(&t[2], &rows[1]),
        along(&t[1], &rows[2]),
        along(&t[0], &rows[3]),
    ]
}

/// Adjoints at one node: of the derivatives for the integral, of the first two for the area.
#[derive(Clone, Copy)]
struct NodeAdjoint<S: Simd> {
    integral: Derivatives<S>,
    area: [Triple<Lanes<S>>; 2],
}

/// Adjoints of the derivatives along v, `[order][i]`: four orders of the integral, two of the area.
#[inline(always)]
fn back_along_u<S: Simd>(
    simd: S,
    basis: &[Aligned<Basis<S>>],
    nodes: &[Aligned<NodeAdjoint<S>>],
    back: &mut [[Triple<Lanes<S>>; 4]; 6],
) {
    for i in 0..4 {
        // In two rounds, whose sums fit into registers.
        let mut sums = [zero(simd); 2];
        for (Aligned(t), Aligned(node)) in basis.iter().zip(nodes) {
            let a = &node.integral;
            sums[0] = sums[0].plus(t[1][i], a[0]);
            sums[1] = sums[1].plus(t[1][i], node.area[0]);
            sums[0] = sums[0].plus(t[2][i], a[2]);
            sums[0] = sums[0].plus(t[3][i], a[5]);
        }
        [back[0][i], back[4][i]] = sums;
        let mut sums = [zero(simd); 4];
        for (Aligned(t), Aligned(node)) in basis.iter().zip(nodes) {
            let a = &node.integral;
            sums[0] = sums[0].plus(t[0][i], a[1]);
            sums[1] = sums[1].plus(t[0][i], a[4]);
            sums[2] = sums[2].plus(t[0][i], a[8]);
            sums[3] = sums[3].plus(t[0][i], node.area[1]);
            sums[0] = sums[0].plus(t[1][i], a[3]);
            sums[1] = sums[1].plus(t[1][i], a[7]);
            sums[0] = sums[0].plus(t[2][i], a[6]);
        }
        [back[1][i], back[2][i], back[3][i], back[5][i]] = sums;
    }
}

/// Patches side by side in the lanes: nothing has to be summed over lanes, and every table value is
/// the same in all of them.
impl WithSimd for PatchRun<'_, SeparableRule> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_frame();
        let rule = self.rule;
        let lanes = S::F64_LANES;
        let with_gradient = matches!(self.task, Task::Gradient(_));
        let nothing = zero(simd);
        let mut basis = Vec::with_capacity(rule.nodes);
        for values in &rule.basis {
            let mut t = [[nothing.x; 4]; 4];
            for order in 0..4 {
                for k in 0..4 {
                    t[order][k] = Lanes::splat(simd, values[order][k]);
                }
            }
            basis.push(Aligned(t));
        }
        self.gradients.fill(0.0);
        // Overwritten again and again, and so outside the loops, which would clear them each time.
        let mut adjoints = Vec::with_capacity(rule.nodes);
        let mut coordinates = Aligned([nothing.x.value; 48]);
        let mut points = Aligned([[nothing; 4]; 4]);
        let mut rows = Aligned([[nothing; 4]; 4]);
        let mut back = Aligned([[nothing; 4]; 6]);
        let mut sums = Aligned([nothing.x.value; 16 * GRADIENT_LEN]);
        let patches = self.integrals.len();
        for first in (0..patches).step_by(lanes) {
            // Lanes without a patch repeat the last one.
            let flat: &mut [f64] = bytemuck::cast_slice_mut(&mut coordinates.0);
            for lane in 0..lanes {
                let patch = (first + lane).min(patches - 1);
                let controls = &self.controls[16 * patch..][..16];
                for (point, &k) in flat.chunks_exact_mut(3 * lanes).zip(&rule.order) {
                    let v = 3 * controls[k] as usize;
                    let p = &self.positions[v..v + 3];
                    point[lane] = p[0];
                    point[lanes + lane] = p[1];
                    point[2 * lanes + lane] = p[2];
                }
            }
            for (k, p) in coordinates.0.as_chunks::<3>().0.iter().enumerate() {
                points.0[k / 4][k % 4] = Triple {
                    x: Lanes::new(simd, p[0]),
                    y: Lanes::new(simd, p[1]),
                    z: Lanes::new(simd, p[2]),
                };
            }
            let (mut area, mut integral) = (nothing.x, nothing.x);
            for (v, Aligned(tv)) in basis.iter().enumerate() {
                // Along v for every row of control points, then along u for every node.
                let orders = if self.task == Task::Area { 2 } else { 4 };
                for order in 0..orders {
                    for i in 0..4 {
                        rows.0[order][i] = along(&tv[order], &points.0[i]);
                    }
                }
                let weights = &rule.weights[v * rule.nodes..][..rule.nodes];
                adjoints.clear();
                for (Aligned(t), &weight) in basis.iter().zip(weights) {
                    let weight = Lanes::splat(simd, weight);
                    if self.task == Task::Area {
                        let normal = along(&t[1], &rows.0[0]).cross_fused(along(&t[0], &rows.0[1]));
                        area = normal.dot(normal).sqrt().fma(weight, area);
                        continue;
                    }
                    let s = sample(&derivatives_along_u(t, &rows.0), weight, self.task);
                    area = area + s.area;
                    integral = integral + s.integral;
                    if with_gradient {
                        adjoints.push(Aligned(NodeAdjoint {
                            integral: s.adjoint,
                            area: s.area_adjoint,
                        }));
                    }
                }
                if with_gradient {
                    back_along_u(simd, &basis, &adjoints, &mut back.0);
                    for j in 0..4 {
                        let t = [tv[0][j], tv[1][j], tv[2][j], tv[3][j]];
                        for i in 0..4 {
                            let sums = &mut sums.0[GRADIENT_LEN * (4 * i + j)..][..GRADIENT_LEN];
                            let [mut integral, mut area] = [nothing; 2];
                            if v > 0 {
                                integral.x.value = sums[0];
                                integral.y.value = sums[1];
                                integral.z.value = sums[2];
                                area.x.value = sums[3];
                                area.y.value = sums[4];
                                area.z.value = sums[5];
                            }
                            for order in 0..4 {
                                integral = integral.plus(t[order], back.0[order][i]);
                            }
                            area = area.plus(t[1], back.0[5][i]).plus(t[0], back.0[4][i]);
                            let [integral, area] = [integral.to_array(), area.to_array()];
                            for c in 0..3 {
                                sums[c] = integral[c].value;
                                sums[3 + c] = area[c].value;
                            }
                        }
                    }
                }
            }
            let (area, integral) = ([area.value], [integral.value]);
            let (areas, values): (&[f64], &[f64]) =
                (bytemuck::cast_slice(&area), bytemuck::cast_slice(&integral));
            let flat: &[f64] = bytemuck::cast_slice(&sums.0);
            for lane in 0..lanes.min(patches - first) {
                let patch = first + lane;
                self.integrals[patch] = [areas[lane], values[lane]];
                if with_gradient {
                    let places = &self.places[16 * patch..][..16];
                    for (sums, &k) in flat.chunks_exact(GRADIENT_LEN * lanes).zip(&rule.order) {
                        let place = GRADIENT_LEN * places[k] as usize;
                        let out = &mut self.gradients[place..][..GRADIENT_LEN];
                        for (out, sums) in out.iter_mut().zip(sums.chunks_exact(lanes)) {
                            *out += sums[lane];
                        }
                    }
                }
            }
        }
    }
}
