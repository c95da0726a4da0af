//! The paper's own formulation: guided projection with auxiliary variables (Pellis et al. 2021,
//! Sec. 3.1 and Eq. 11), kept to compare with.
//!
//! Unknowns are the control points and, per sample, `n, E, F, G, Δ, L, M, N, K, H`. Derivatives of
//! `H` and `K` are central differences on the sample grid, one-sided at open ends. Auxiliary
//! variables start from the surface and are carried from step to step.
//!
//! The scheme takes every step undamped, and in our reading of the paper it is erratic: the
//! auxiliary `H` and `K` satisfy the alignment long before the surface does. Metrics are therefore
//! always measured on the surface.

use std::sync::Arc;

use gp_solver::{Elements, Problem, QuadraticBuilder, QuadraticConstraints, ResidualBlock};
use numerics::{Lanes, Triple};
use rayon::prelude::*;

use crate::error::Error;
use crate::grid::{SampleGrid, split_runs};
use crate::kernel::SECOND;
use crate::level::Level;
use crate::options::Options;
use crate::sampled::regular_samples;
use crate::sweep::{LaneKernel, Scratch, store};
use crate::variables::{bordered, coordinates};

/// Auxiliary variables of a sample.
const AUXILIARY: usize = 12;
const N: usize = 0;
const E: usize = 3;
const F: usize = 4;
const G: usize = 5;
const D: usize = 6;
const L: usize = 7;
const M: usize = 8;
const NN: usize = 9;
const K: usize = 10;
const H: usize = 11;

/// Number of unknowns: `3 n_u n_v + 12 m_u m_v`.
#[cfg(test)]
pub(crate) fn unknowns(grid: &SampleGrid) -> usize {
    grid.unknowns() + AUXILIARY * grid.len()
}

/// The unknown of auxiliary variable `which` of a sample.
fn auxiliary(grid: &SampleGrid, sample: usize, which: usize) -> usize {
    grid.unknowns() + AUXILIARY * sample + which
}

/// The unknowns with auxiliary variables computed from the surface.
pub(crate) fn start(grid: &SampleGrid, x: &[f64]) -> Result<Vec<f64>, Error> {
    regular_samples(grid, x)?;
    let mut all = x.to_vec();
    let unrolled = grid.unroll(x);
    let (stride, mut scratch) = (grid.stride(), Scratch::default());
    let mut rows = vec![0.0; 15 * stride];
    for i in 0..grid.u.len() {
        grid.sweep(i, &unrolled, &mut scratch, &mut Vectors { out: &mut rows, stride });
        for j in 0..grid.v.len() {
            let [a, b, c, d, w] = vectors(&rows, stride, j);
            let n = a.cross(b);
            let (e, f, g) = (a.dot(a), a.dot(b), b.dot(b));
            let delta = e * g - f * f;
            let root = delta.sqrt();
            let (l, m, nn) = (c.dot(n) / root, d.dot(n) / root, w.dot(n) / root);
            let k = (l * nn - m * m) / delta;
            let h = (l * g - 2.0 * m * f + nn * e) / (2.0 * delta);
            all.extend([n.x, n.y, n.z, e, f, g, delta, l, m, nn, k, h]);
        }
    }
    Ok(all)
}

/// The lifted problem of a level; `x` are all unknowns.
pub(crate) fn problem(
    level: &Level,
    options: &Options,
    x: &[f64],
) -> Result<Problem<'static>, Error> {
    let grid = &level.grid;
    let (mut variables, _) = bordered(&level.reference, options.border)?;
    variables.add("auxiliary", grid.len(), AUXILIARY);
    // Control points and the auxiliary variables of a sample both come in threes.
    variables.set_runs(3);
    let mut problem = Problem::new(variables);
    problem.add(alignment(grid, options.alignment_weight()));
    problem.add(Definitions::new(grid, x));
    problem.add(curvature_definitions(grid));
    level.add_net_terms(&mut problem, options, &coordinates(&level.reference), None);
    Ok(problem)
}

/// `Δ = E G − F²`, `K Δ = L N − M²`, `2 H Δ = L G − 2 M F + N E`.
fn curvature_definitions(grid: &SampleGrid) -> QuadraticConstraints {
    let mut equations = QuadraticBuilder::new("curvature_definitions");
    for s in 0..grid.len() {
        let x = |which: usize| auxiliary(grid, s, which);
        let delta = equations.equation(1.0);
        delta.linear(x(D), 1.0).product(x(E), x(G), -1.0).product(x(F), x(F), 1.0);
        let gauss = equations.equation(1.0);
        gauss.product(x(K), x(D), 1.0).product(x(L), x(NN), -1.0).product(x(M), x(M), 1.0);
        let mean = equations.equation(1.0);
        mean.product(x(H), x(D), 2.0).product(x(L), x(G), -1.0);
        mean.product(x(M), x(F), 2.0).product(x(NN), x(E), -1.0);
    }
    equations.build()
}

/// `H_u K_v − H_v K_u = 0` by differences on the grid (Pellis et al. 2021, Eq. 10).
fn alignment(grid: &SampleGrid, weight: f64) -> QuadraticConstraints {
    let (m_u, m_v) = (grid.u.len(), grid.v.len());
    let step_u = differences(&grid.u.parameters, grid.u.is_closed().then_some(grid.u.period));
    let step_v = differences(&grid.v.parameters, grid.v.is_closed().then_some(grid.v.period));
    let mut equations = QuadraticBuilder::new("alignment");
    for i in 0..m_u {
        for j in 0..m_v {
            let (u, v) = (&step_u[i], &step_v[j]);
            let at = |i: usize, j: usize, which: usize| auxiliary(grid, i * m_v + j, which);
            let by_u = |which: usize| {
                [(at(u.next, j, which), 1.0 / u.step), (at(u.previous, j, which), -1.0 / u.step)]
            };
            let by_v = |which: usize| {
                [(at(i, v.next, which), 1.0 / v.step), (at(i, v.previous, which), -1.0 / v.step)]
            };
            let row = equations.equation(weight);
            for (first, second, sign) in [(by_u(H), by_v(K), 1.0), (by_v(H), by_u(K), -1.0)] {
                for (a, ca) in first {
                    for (b, cb) in second {
                        row.product(a, b, sign * ca * cb);
                    }
                }
            }
        }
    }
    equations.build()
}

/// Neighbours of a sample and the parameter distance between them.
struct Difference {
    previous: usize,
    next: usize,
    step: f64,
}

fn differences(parameters: &[f64], period: Option<f64>) -> Vec<Difference> {
    let n = parameters.len();
    (0..n)
        .map(|i| match period {
            Some(period) => {
                let (previous, next) = ((i + n - 1) % n, (i + 1) % n);
                let step = (parameters[next] - parameters[previous]).rem_euclid(period);
                Difference { previous, next, step }
            }
            None => {
                let (previous, next) = (i.saturating_sub(1), (i + 1).min(n - 1));
                Difference { previous, next, step: parameters[next] - parameters[previous] }
            }
        })
        .collect()
}

/// The nine rows of a sample that read its control points: `n = s_u × s_v`, `E, F, G`, and
/// `L = ⟨s_uu, n⟩ / √Δᵏ` and so on with the determinant of the last iterate.
pub(crate) struct Definitions {
    grid: Arc<SampleGrid>,
    elements: Elements,
    /// `1/√Δᵏ` of every sample.
    inverse_root: Vec<f64>,
}

/// Rows of [`Definitions`] per sample.
const ROWS: usize = 9;
/// Auxiliary columns of [`Definitions`]: `n, E, F, G, L, M, N`.
const COLUMNS: [usize; 9] = [N, N + 1, N + 2, E, F, G, L, M, NN];

impl Definitions {
    pub(crate) fn new(grid: &Arc<SampleGrid>, x: &[f64]) -> Self {
        let spans = grid.elements();
        let m_v = grid.v.len();
        let mut elements = Elements::new();
        // Sample by sample, so that a row of samples is one contiguous piece.
        for i in 0..grid.u.len() {
            let run_u = grid.u.runs.iter().position(|r| r.contains(&i)).unwrap_or(0);
            for j in 0..m_v {
                let run_v = grid.v.runs.iter().position(|r| r.contains(&j)).unwrap_or(0);
                let mut columns = spans.columns(run_u * grid.v.runs.len() + run_v).to_vec();
                columns.extend(COLUMNS.map(|which| auxiliary(grid, i * m_v + j, which)));
                elements.push(&columns, ROWS);
            }
        }
        let inverse_root = vec![0.0; grid.len()];
        let mut made = Self { grid: Arc::clone(grid), elements, inverse_root };
        made.refresh(x);
        made
    }

    fn fill(&self, x: &[f64], residuals: &mut [f64], jacobian: Option<&mut [f64]>) {
        let grid = &*self.grid;
        let unrolled = grid.unroll(&x[..grid.unknowns()]);
        let (m_u, m_v, stride) = (grid.u.len(), grid.v.len(), grid.stride());
        let width = 3 * grid.u.order * grid.v.order + COLUMNS.len();
        let residuals = split_runs((0..m_u).map(|_| m_v * ROWS), residuals);
        let jacobians: Vec<Option<&mut [f64]>> = match jacobian {
            Some(values) => {
                let sizes = (0..m_u).map(|_| m_v * ROWS * width);
                split_runs(sizes, values).into_iter().map(Some).collect()
            }
            None => (0..m_u).map(|_| None).collect(),
        };
        let jobs: Vec<_> = residuals.into_iter().zip(jacobians).enumerate().collect();
        jobs.into_par_iter().with_min_len(4).for_each_init(
            || (Scratch::default(), vec![0.0; 15 * stride]),
            |(scratch, rows), (i, (residuals, mut jacobian))| {
                grid.sweep(i, &unrolled, scratch, &mut Vectors { out: rows, stride });
                for j in 0..m_v {
                    let sample = i * m_v + j;
                    let p = vectors(rows, stride, j);
                    let values = &x[auxiliary(grid, sample, 0)..auxiliary(grid, sample, AUXILIARY)];
                    let inverse = self.inverse_root[sample];
                    let out = &mut residuals[j * ROWS..(j + 1) * ROWS];
                    residual(&p, values, inverse, out);
                    if let Some(jacobian) = &mut jacobian {
                        let out = &mut jacobian[j * ROWS * width..(j + 1) * ROWS * width];
                        self.derivatives(i, j, &p, values, inverse, out);
                    }
                }
            },
        );
    }

    /// The nine Jacobian rows of sample `(i, j)`.
    fn derivatives(
        &self,
        i: usize,
        j: usize,
        p: &[Triple<f64>; 5],
        values: &[f64],
        inverse: f64,
        out: &mut [f64],
    ) {
        let grid = &*self.grid;
        let control = 3 * grid.u.order * grid.v.order;
        let width = control + COLUMNS.len();
        out.fill(0.0);
        let n = Triple { x: values[N], y: values[N + 1], z: values[N + 2] };
        // Gradients of the nine rows by s_u, s_v, s_uu, s_uv, s_vv.
        let [a, b, c, d, w] = *p;
        let zero = Triple { x: 0.0, y: 0.0, z: 0.0 };
        let unit = [
            Triple { x: 1.0, y: 0.0, z: 0.0 },
            Triple { x: 0.0, y: 1.0, z: 0.0 },
            Triple { x: 0.0, y: 0.0, z: 1.0 },
        ];
        let scaled = |t: Triple<f64>, s: f64| t.scale(s);
        let mut gradients = [[zero; 5]; ROWS];
        for k in 0..3 {
            // −e_k · (s_u × s_v): by s_u it is −(s_v × e_k), by s_v −(e_k × s_u).
            gradients[k][0] = scaled(b.cross(unit[k]), -1.0);
            gradients[k][1] = scaled(unit[k].cross(a), -1.0);
        }
        gradients[3][0] = scaled(a, -2.0);
        gradients[4][0] = scaled(b, -1.0);
        gradients[4][1] = scaled(a, -1.0);
        gradients[5][1] = scaled(b, -2.0);
        for (k, row) in gradients[6..].iter_mut().enumerate() {
            row[2 + k] = scaled(n, -inverse);
        }
        for (r, gradient) in gradients.iter().enumerate() {
            let mut vectors = [[0.0; 4]; SECOND];
            for (slot, g) in vectors[1..].iter_mut().zip(gradient) {
                *slot = [g.x, g.y, g.z, 0.0];
            }
            let row = &mut out[r * width..(r + 1) * width];
            grid.expand(i, j, &mut vectors, &mut row[..control]);
            row[control + r] = 1.0;
        }
        // L, M, N also read n.
        for (r, second) in [c, d, w].into_iter().enumerate() {
            let row = &mut out[(6 + r) * width + control..(7 + r) * width];
            for (axis, value) in [second.x, second.y, second.z].into_iter().enumerate() {
                row[axis] = -value * inverse;
            }
        }
    }
}

fn residual(p: &[Triple<f64>; 5], values: &[f64], inverse: f64, out: &mut [f64]) {
    let [a, b, c, d, w] = *p;
    let cross = a.cross(b);
    let n = Triple { x: values[N], y: values[N + 1], z: values[N + 2] };
    out.copy_from_slice(&[
        n.x - cross.x,
        n.y - cross.y,
        n.z - cross.z,
        values[E] - a.dot(a),
        values[F] - a.dot(b),
        values[G] - b.dot(b),
        values[L] - c.dot(n) * inverse,
        values[M] - d.dot(n) * inverse,
        values[NN] - w.dot(n) * inverse,
    ]);
}

impl ResidualBlock for Definitions {
    fn name(&self) -> &str {
        "definitions"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        for (s, value) in self.inverse_root.iter_mut().enumerate() {
            // An auxiliary determinant may turn negative under the undamped scheme.
            let delta = x[auxiliary(&self.grid, s, D)];
            *value = if delta > 0.0 { 1.0 / delta.sqrt() } else { *value };
        }
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.fill(x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.fill(x, residuals, Some(jacobian));
    }
}

/// Stores `s_u, s_v, s_uu, s_uv, s_vv`.
struct Vectors<'a> {
    out: &'a mut [f64],
    stride: usize,
}

impl LaneKernel<SECOND> for Vectors<'_> {
    #[inline(always)]
    fn run<S: pulp::Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; SECOND]) {
        for (rows, vector) in self.out.chunks_exact_mut(3 * self.stride).zip(&d[1..]) {
            for (row, value) in
                rows.chunks_exact_mut(self.stride).zip([vector.x, vector.y, vector.z])
            {
                store(row, at, value);
            }
        }
    }
}

fn vectors(rows: &[f64], stride: usize, j: usize) -> [Triple<f64>; 5] {
    let at = |row: usize| rows[row * stride + j];
    std::array::from_fn(|o| Triple { x: at(3 * o), y: at(3 * o + 1), z: at(3 * o + 2) })
}
