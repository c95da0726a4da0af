//! Basis functions tabulated at many parameters, and sample grids evaluated by sum factorisation.

use crate::basis::MAX_DERIVATIVE;
use crate::knots::{Degree, KnotVector};
use crate::surface::BsplineSurface;
use geom_core::SurfaceJet;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The samples that lie in one knot span; they share their basis functions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpanSamples {
    /// Index of the knot span.
    pub span: usize,
    /// The samples in it.
    pub samples: Range<usize>,
}

/// Values of the basis functions of a knot vector at a list of parameters, with derivatives.
///
/// Per sample there are `degree + 1` functions that are not zero; `derivative(s, k)` holds their
/// k-th derivatives in one slice and `control(s)` the control points they belong to. Samples in
/// the same knot span have the same `control`.
///
/// # Example
/// ```
/// use bspline::{BasisTable, Degree, KnotVector};
/// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 4)?;
/// let table = BasisTable::new(&knots, &[0.0, 0.25, 0.75, 1.0], 1);
/// assert_eq!(table.control(2), [1, 2, 3]);
/// assert_eq!(table.derivative(3, 0), [0.0, 0.0, 1.0]);
/// assert_eq!(table.spans().len(), 2);
/// # Ok::<(), bspline::KnotError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BasisTable {
    order: usize,
    max_derivative: usize,
    control_count: usize,
    parameters: Vec<f64>,
    spans: Vec<usize>,
    control: Vec<usize>,
    values: Vec<f64>,
}

impl BasisTable {
    /// Tabulates the basis functions and their derivatives up to `max_derivative`.
    ///
    /// # Panics
    /// If `max_derivative` exceeds [`MAX_DERIVATIVE`].
    #[must_use]
    pub fn new(knots: &KnotVector, parameters: &[f64], max_derivative: usize) -> Self {
        let order = knots.degree().order();
        let mut table = Self {
            order,
            max_derivative,
            control_count: knots.control_count(),
            parameters: parameters.to_vec(),
            spans: Vec::with_capacity(parameters.len()),
            control: Vec::with_capacity(parameters.len() * order),
            values: Vec::with_capacity(parameters.len() * order * (max_derivative + 1)),
        };
        for &t in parameters {
            let basis = knots.basis(t, max_derivative);
            table.spans.push(basis.span);
            table.control.extend((0..order).map(|r| knots.control_index(basis.span, r)));
            for row in &basis.values[..=max_derivative] {
                table.values.extend_from_slice(&row[..order]);
            }
        }
        table
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.spans.len()
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// Number of basis functions per sample, degree + 1.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Highest derivative in the table.
    #[must_use]
    pub fn max_derivative(&self) -> usize {
        self.max_derivative
    }

    /// Number of control points of the knot vector.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.control_count
    }

    /// The parameters of the samples.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Knot span of sample `s`.
    #[must_use]
    pub fn span(&self, s: usize) -> usize {
        self.spans[s]
    }

    /// The control points whose basis functions are not zero at sample `s`.
    #[must_use]
    pub fn control(&self, s: usize) -> &[usize] {
        &self.control[s * self.order..(s + 1) * self.order]
    }

    /// The k-th derivatives of the basis functions of `control(s)` at sample `s`.
    ///
    /// # Panics
    /// If `k` exceeds the order of the table.
    #[must_use]
    pub fn derivative(&self, s: usize, k: usize) -> &[f64] {
        assert!(k <= self.max_derivative, "derivative {k} is not in the table");
        let at = (s * (self.max_derivative + 1) + k) * self.order;
        &self.values[at..at + self.order]
    }

    /// Runs of successive samples in one knot span; for samples in rising order there is one run
    /// per span that holds samples.
    #[must_use]
    pub fn spans(&self) -> Vec<SpanSamples> {
        let mut runs: Vec<SpanSamples> = Vec::new();
        for (s, &span) in self.spans.iter().enumerate() {
            match runs.last_mut() {
                Some(run) if run.span == span => run.samples.end = s + 1,
                _ => runs.push(SpanSamples { span, samples: s..s + 1 }),
            }
        }
        runs
    }
}

/// A sample grid over a tensor-product surface: all pairs of the samples of two tables, sample
/// `i * v.len() + j`.
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector, SampleGrid};
/// use geom_core::DVec3;
/// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
/// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
/// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
/// // Made once, applied to the control points of every iterate.
/// let samples = SampleGrid::new(&saddle, &[0.25, 0.5], &[0.0, 0.5, 1.0], 2);
/// let jets = samples.jets(saddle.control_points(), 2);
/// assert_eq!(jets[3 + 1].position(), DVec3::new(0.5, 0.5, 0.25));
/// assert_eq!(jets[3 + 1].d(1, 1), DVec3::Z);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SampleGrid {
    /// Basis functions in u.
    pub u: BasisTable,
    /// Basis functions in v.
    pub v: BasisTable,
}

impl SampleGrid {
    /// The grid of the parameters `u` times `v` over the knots of `surface`.
    ///
    /// # Panics
    /// If `max_derivative` exceeds [`MAX_DERIVATIVE`].
    #[must_use]
    pub fn new(surface: &BsplineSurface, u: &[f64], v: &[f64], max_derivative: usize) -> Self {
        Self {
            u: BasisTable::new(surface.knots_u(), u, max_derivative),
            v: BasisTable::new(surface.knots_v(), v, max_derivative),
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.u.len() * self.v.len()
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Jets up to the total order `order` of the polynomial surface with these control points.
    ///
    /// The sums over the two directions are taken one after the other: per row of samples the
    /// control net is contracted in u once, which leaves `degree + 1` instead of
    /// `(degree + 1)²` terms per sample and derivative. Rows run in parallel.
    ///
    /// # Panics
    /// If the number of control points or of outputs does not fit, or the tables lack the order.
    pub fn jets_into(&self, control_points: &[DVec3], order: usize, out: &mut [SurfaceJet]) {
        let n_v = self.v.control_count();
        assert_eq!(control_points.len(), self.u.control_count() * n_v, "control points");
        assert_eq!(out.len(), self.len(), "one jet per sample");
        assert!(order <= self.u.max_derivative().min(self.v.max_derivative()), "order {order}");
        if self.is_empty() {
            return;
        }
        out.par_chunks_mut(self.v.len()).enumerate().with_min_len(4).for_each_init(
            || vec![[DVec3::ZERO; MAX_DERIVATIVE + 1]; n_v],
            |contracted, (i, row)| {
                contracted.fill([DVec3::ZERO; MAX_DERIVATIVE + 1]);
                for (r, &c) in self.u.control(i).iter().enumerate() {
                    let mut factors = [0.0; MAX_DERIVATIVE + 1];
                    for a in 0..=order {
                        factors[a] = self.u.derivative(i, a)[r];
                    }
                    for (sums, &p) in
                        contracted.iter_mut().zip(&control_points[c * n_v..(c + 1) * n_v])
                    {
                        for a in 0..=order {
                            sums[a] += factors[a] * p;
                        }
                    }
                }
                for (j, jet) in row.iter_mut().enumerate() {
                    *jet = self.jet_from(contracted, j, order);
                }
            },
        );
    }

    /// As [`SampleGrid::jets_into`], with a fresh vector.
    ///
    /// # Panics
    /// As [`SampleGrid::jets_into`].
    #[must_use]
    pub fn jets(&self, control_points: &[DVec3], order: usize) -> Vec<SurfaceJet> {
        let mut out = vec![SurfaceJet::default(); self.len()];
        self.jets_into(control_points, order, &mut out);
        out
    }

    fn jet_from(
        &self,
        contracted: &[[DVec3; MAX_DERIVATIVE + 1]],
        j: usize,
        order: usize,
    ) -> SurfaceJet {
        let mut jet = SurfaceJet::default();
        debug_assert!(self.v.order() <= Degree::MAX + 1);
        for (s, &c) in self.v.control(j).iter().enumerate() {
            for b in 0..=order {
                let factor = self.v.derivative(j, b)[s];
                for a in 0..=order - b {
                    jet.derivatives[SurfaceJet::index(a, b)] += factor * contracted[c][a];
                }
            }
        }
        jet
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    #[test]
    fn grid_jets_agree_with_single_evaluation() {
        let ku = KnotVector::periodic_uniform(Degree::new(4).unwrap(), 6).unwrap();
        let kv = KnotVector::clamped_uniform(Degree::new(3).unwrap(), 7).unwrap();
        let point = |k: usize| {
            let t = k as f64;
            DVec3::new((t * 0.3).sin(), (t * 0.7).cos(), (t * 1.1).sin())
        };
        let surface = BsplineSurface::new(ku, kv, (0..42).map(point).collect(), None).unwrap();
        let (u, v) = (surface.knots_u().uniform_parameters(9), [0.0, 0.24, 0.25, 0.9, 1.0]);
        let grid = SampleGrid::new(&surface, &u, &v, 4);
        let got = grid.jets(surface.control_points(), 4);
        for (i, &u) in u.iter().enumerate() {
            for (j, &v) in v.iter().enumerate() {
                let want = surface.jet(u, v, 4);
                for k in 0..SurfaceJet::LEN {
                    let error = got[i * 5 + j].derivatives[k] - want.derivatives[k];
                    let scale = want.derivatives[k].length().max(1.0);
                    assert_close(error.length() / scale, 0.0, 1e-13);
                }
            }
        }
    }

    #[test]
    fn spans_cover_all_samples_once() {
        let knots = KnotVector::clamped_uniform(Degree::new(4).unwrap(), 9).unwrap();
        let table = BasisTable::new(&knots, &knots.uniform_parameters(18), 3);
        let runs = table.spans();
        assert_eq!(runs.len(), 5);
        assert_eq!(runs.iter().map(|r| r.samples.len()).sum::<usize>(), table.len());
        for run in runs {
            for s in run.samples.clone() {
                assert_eq!(table.span(s), run.span);
                assert_eq!(table.control(s), table.control(run.samples.start));
            }
        }
    }
}
