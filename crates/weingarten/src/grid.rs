//! A grid of samples on a surface, with the elements of its rows.
//!
//! The unknowns are the coordinates of the control points, `3 (i n_v + j) + axis`. Weights of a
//! rational surface stay fixed, so derivatives are linear in the unknowns there too.

use std::borrow::Cow;

use bspline::{BsplineSurface, KnotVector, Region, Trim};
use gp_solver::Elements;
use numerics::gauss_legendre;

use crate::axis::Axis;
use crate::rational::Rational;

/// Rows of samples are padded to this many, a multiple of every register's lanes.
const PAD: usize = 8;

/// Samples of a tensor-product surface with fixed knots and weights.
#[derive(Clone, Debug)]
pub(crate) struct SampleGrid {
    pub(crate) u: Axis,
    pub(crate) v: Axis,
    pub(crate) rational: Option<Rational>,
    inside: Option<Inside>,
}

/// Which samples of a grid count, if not all do.
#[derive(Clone, Debug)]
struct Inside {
    /// Their numbers, rising.
    places: Vec<usize>,
    /// The others of every row of samples, by their place in the row.
    others: Vec<Vec<usize>>,
}

impl SampleGrid {
    /// A grid at the given parameters of `surface`, which must rise and lie in its domain.
    pub(crate) fn new(surface: &BsplineSurface, u: Vec<f64>, v: Vec<f64>) -> Self {
        Self::of_axes(surface, Axis::new(surface.knots_u(), u), Axis::new(surface.knots_v(), v))
    }

    fn of_axes(surface: &BsplineSurface, u: Axis, v: Axis) -> Self {
        let rational = surface.weights().map(|weights| Rational::new(&u, &v, weights));
        Self { u, v, rational, inside: None }
    }

    /// The same grid with only the samples within `trim` counting: of the others no row asks
    /// anything, and the surface may be singular there.
    pub(crate) fn within(mut self, trim: Option<&Trim>, surface: &BsplineSurface) -> Self {
        let Some(trim) = trim else { return self };
        let region = Region::new(trim, surface);
        let mut places = Vec::with_capacity(self.len());
        let mut others = vec![Vec::new(); self.u.len()];
        for s in 0..self.len() {
            let [u, v] = self.parameters(s);
            match region.contains(u, v) {
                true => places.push(s),
                false => others[s / self.v.len()].push(s % self.v.len()),
            }
        }
        self.inside = Some(Inside { places, others });
        self
    }

    /// The number of the `k`-th sample that counts.
    pub(crate) fn place(&self, k: usize) -> usize {
        self.inside.as_ref().map_or(k, |inside| inside.places[k])
    }

    /// How many samples count.
    pub(crate) fn count(&self) -> usize {
        self.inside.as_ref().map_or(self.len(), |inside| inside.places.len())
    }

    /// The samples of row `i` that do not count.
    pub(crate) fn others(&self, i: usize) -> &[usize] {
        self.inside.as_ref().map_or(&[], |inside| &inside.others[i])
    }

    /// `m_u × m_v` samples at equal parameter distances, ends included, a period's end excluded.
    pub(crate) fn uniform(surface: &BsplineSurface, m: [usize; 2]) -> Self {
        let u = surface.knots_u().uniform_parameters(m[0]);
        let v = surface.knots_v().uniform_parameters(m[1]);
        Self::new(surface, u, v)
    }

    /// Nodes of Gauss-Legendre quadrature: in every knot span at least as many as `least` says for the
    /// order of the spline, and together at least `per_control_point` times the control points.
    pub(crate) fn quadrature(
        surface: &BsplineSurface,
        least: impl Fn(usize) -> usize,
        per_control_point: usize,
    ) -> Self {
        let axis = |knots: &KnotVector| {
            let breaks = knots.breaks();
            let spans = breaks.len() - 1;
            let enough = (per_control_point * knots.control_count()).div_ceil(spans);
            let rule = gauss_legendre(least(knots.degree().order()).max(enough));
            let span = |ends: &[f64]| {
                let (start, length) = (ends[0], ends[1] - ends[0]);
                rule.iter().map(move |(x, weight)| (start + length * x, length * weight))
            };
            let nodes: Vec<(f64, f64)> = breaks.windows(2).flat_map(span).collect();
            Axis::quadrature(knots, &nodes)
        };
        Self::of_axes(surface, axis(surface.knots_u()), axis(surface.knots_v()))
    }

    /// The middles of `m_u × m_v` equal cells.
    pub(crate) fn midpoints(surface: &BsplineSurface, m: [usize; 2]) -> Self {
        let u = surface.knots_u().cell_midpoints(m[0]);
        let v = surface.knots_v().cell_midpoints(m[1]);
        Self::new(surface, u, v)
    }

    /// The share of the domain each sample that counts stands for; together 1.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let (u, v) = (self.u.shares(), self.v.shares());
        let share = |k: usize| {
            let s = self.place(k);
            u[s / self.v.len()] * v[s % self.v.len()]
        };
        let shares: Vec<f64> = (0..self.count()).map(share).collect();
        let all: f64 = shares.iter().sum();
        shares.into_iter().map(|share| share / all).collect()
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.u.len() * self.v.len()
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        3 * self.u.control * self.v.control
    }

    /// Length of a padded row of samples.
    pub(crate) fn stride(&self) -> usize {
        self.v.len().next_multiple_of(PAD)
    }

    /// The parameter pair of a sample.
    pub(crate) fn parameters(&self, sample: usize) -> [f64; 2] {
        let (i, j) = (sample / self.v.len(), sample % self.v.len());
        [self.u.parameters[i], self.v.parameters[j]]
    }

    /// One element per pair of knot spans that hold samples, one row per sample.
    pub(crate) fn elements(&self) -> Elements {
        let mut elements = Elements::new();
        let mut columns = Vec::new();
        for run_u in &self.u.runs {
            for run_v in &self.v.runs {
                columns.clear();
                for p in 0..self.u.order {
                    let i = self.u.wrap(self.u.base(run_u.start) + p);
                    for q in 0..self.v.order {
                        let j = self.v.wrap(self.v.base(run_v.start) + q);
                        let first = 3 * (i * self.v.control + j);
                        columns.extend(first..first + 3);
                    }
                }
                elements.push(&columns, run_u.len() * run_v.len());
            }
        }
        elements
    }

    /// Control coordinates times weights, with periodic directions unrolled.
    pub(crate) fn unroll<'x>(&self, x: &'x [f64]) -> Cow<'x, [f64]> {
        let wrapped = self.u.functions != self.u.control || self.v.functions != self.v.control;
        if !wrapped && self.rational.is_none() {
            return Cow::Borrowed(x);
        }
        let mut unrolled = Vec::with_capacity(3 * self.u.functions * self.v.functions);
        for i in 0..self.u.functions {
            for j in 0..self.v.functions {
                let k = self.u.wrap(i) * self.v.control + self.v.wrap(j);
                let weight = self.rational.as_ref().map_or(1.0, |r| r.weights[k]);
                unrolled.extend((0..3).map(|axis| weight * x[3 * k + axis]));
            }
        }
        Cow::Owned(unrolled)
    }
}

/// Splits per-run slices of a residual and a Jacobian off, so that runs fill them in parallel.
pub(crate) fn split_runs(
    sizes: impl Iterator<Item = usize>,
    mut slice: &mut [f64],
) -> Vec<&mut [f64]> {
    sizes
        .map(|size| {
            let (head, tail) = std::mem::take(&mut slice).split_at_mut(size);
            slice = tail;
            head
        })
        .collect()
}
