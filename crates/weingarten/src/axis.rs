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
    /// Where the domain begins.
    pub(crate) start: f64,
    /// Weights of the samples if they are the nodes of a quadrature rule.
    weights: Option<Vec<f64>>,
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
        Self {
            parameters,
            control,
            functions,
            order,
            period,
            start,
            weights: None,
            runs,
            base,
            values,
        }
    }

    /// The tables at the nodes of a quadrature rule, each with its weight.
    pub(crate) fn quadrature(knots: &KnotVector, nodes: &[(f64, f64)]) -> Self {
        let axis = Self::new(knots, nodes.iter().map(|(t, _)| *t).collect());
        Self { weights: Some(nodes.iter().map(|(_, weight)| *weight).collect()), ..axis }
    }

    /// Whether the ends of the domain are joined.
    pub(crate) fn is_closed(&self) -> bool {
        self.functions != self.control
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.parameters.len()
    }

    /// The length each sample stands for: the weight of the quadrature rule, or from half way to the
    /// sample before to half way to the next, and to the end of the domain beyond the last ones.
    pub(crate) fn shares(&self) -> Vec<f64> {
        if let Some(weights) = &self.weights {
            return weights.clone();
        }
        let t = &self.parameters;
        let n = t.len();
        let between = |a: f64, b: f64| 0.5 * (a + b);
        let cut = |k: usize| -> f64 {
            match k {
                0 if self.is_closed() => between(t[n - 1] - self.period, t[0]),
                0 => self.start,
                k if k == n && self.is_closed() => between(t[n - 1], t[0] + self.period),
                k if k == n => self.start + self.period,
                k => between(t[k - 1], t[k]),
            }
        };
        (0..n).map(|k| cut(k + 1) - cut(k)).collect()
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
