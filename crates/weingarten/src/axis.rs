//! Basis functions on the samples of one parameter direction.

use std::ops::Range;

use bspline::KnotVector;

/// Highest derivative the tables hold.
const ORDER: usize = 4;

/// Values and derivatives of the basis functions at sorted parameters, and the runs of parameters
/// that share a knot span.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// The parameters, rising.
    pub(crate) parameters: Vec<f64>,
    /// Number of different control points.
    pub(crate) control: usize,
    /// Number of basis functions before a periodic direction is wrapped.
    pub(crate) functions: usize,
    /// Degree plus one: basis functions that are not zero at a parameter.
    pub(crate) order: usize,
    /// Length of the domain.
    pub(crate) period: f64,
    /// Parameters on one knot span, one run after the other.
    pub(crate) runs: Vec<Range<usize>>,
    base: Vec<usize>,
    values: Vec<f64>,
}

impl Axis {
    /// Tables at `parameters`, which must rise and lie in the domain.
    pub(crate) fn new(knots: &KnotVector, parameters: Vec<f64>) -> Self {
        let d = knots.degree().get();
        let order = d + 1;
        let mut base = Vec::with_capacity(parameters.len());
        let mut values = Vec::with_capacity(parameters.len() * (ORDER + 1) * order);
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (s, &t) in parameters.iter().enumerate() {
            let basis = knots.basis(t, ORDER);
            let first = basis.span - d;
            match runs.last_mut() {
                Some(run) if base[run.start] == first => run.end = s + 1,
                _ => runs.push(s..s + 1),
            }
            base.push(first);
            for derivative in &basis.values {
                values.extend_from_slice(&derivative[..order]);
            }
        }
        let functions = knots.knots().len() - d - 1;
        let (start, end) = knots.domain();
        let (control, period) = (knots.control_count(), end - start);
        Self { parameters, control, functions, order, period, runs, base, values }
    }

    /// Whether the ends of the domain are joined.
    pub(crate) fn is_closed(&self) -> bool {
        self.functions != self.control
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.parameters.len()
    }

    /// The first basis function that is not zero at sample `s`, before wrapping.
    pub(crate) fn base(&self, s: usize) -> usize {
        self.base[s]
    }

    /// Derivative `k` of the basis functions at sample `s`.
    pub(crate) fn values(&self, s: usize, k: usize) -> &[f64] {
        let start = (s * (ORDER + 1) + k) * self.order;
        &self.values[start..start + self.order]
    }

    /// The control point of basis function `function`.
    pub(crate) fn wrap(&self, function: usize) -> usize {
        function % self.control
    }
}
