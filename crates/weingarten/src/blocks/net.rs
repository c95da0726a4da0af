//! Terms on the control net: fairness and shape preservation.

use bspline::BsplineSurface;
use gp_solver::{Elements, ResidualBlock};

/// Size of a control net and whether its ends are joined.
#[derive(Clone, Copy, Debug)]
pub struct Net {
    /// Control points in u.
    pub n_u: usize,
    /// Control points in v.
    pub n_v: usize,
    /// Whether the last row in u is followed by the first.
    pub closed_u: bool,
    /// The same in v.
    pub closed_v: bool,
}

impl Net {
    /// The net of a surface.
    #[must_use]
    pub fn of(surface: &BsplineSurface) -> Self {
        Self {
            n_u: surface.n_u(),
            n_v: surface.n_v(),
            closed_u: surface.knots_u().is_periodic(),
            closed_v: surface.knots_v().is_periodic(),
        }
    }

    fn index(self, i: usize, j: usize) -> usize {
        (i % self.n_u) * self.n_v + j % self.n_v
    }

    /// Second differences of the control polylines, `(before, here, after)`, only where both
    /// neighbours exist.
    fn second_differences(self) -> Vec<[usize; 3]> {
        let mut triples = Vec::new();
        for i in 0..self.n_u {
            for j in 0..self.n_v {
                if self.closed_v || (0 < j && j + 1 < self.n_v) {
                    let (before, after) = (self.index(i, j + self.n_v - 1), self.index(i, j + 1));
                    triples.push([before, self.index(i, j), after]);
                }
                if self.closed_u || (0 < i && i + 1 < self.n_u) {
                    let (before, after) = (self.index(i + self.n_u - 1, j), self.index(i + 1, j));
                    triples.push([before, self.index(i, j), after]);
                }
            }
        }
        triples
    }

    /// Edges and both diagonals of every face of the net.
    fn edges(self) -> Vec<[usize; 2]> {
        let faces_u = if self.closed_u { self.n_u } else { self.n_u - 1 };
        let faces_v = if self.closed_v { self.n_v } else { self.n_v - 1 };
        let mut edges = Vec::new();
        for i in 0..self.n_u {
            for j in 0..self.n_v {
                let here = self.index(i, j);
                if j < faces_v {
                    edges.push([here, self.index(i, j + 1)]);
                }
                if i < faces_u {
                    edges.push([here, self.index(i + 1, j)]);
                }
                if i < faces_u && j < faces_v {
                    edges.push([here, self.index(i + 1, j + 1)]);
                    edges.push([self.index(i + 1, j), self.index(i, j + 1)]);
                }
            }
        }
        edges
    }
}

/// `w (d − (d₋ + d₊)/2)` along both families of control polylines, `d` the displacement from the
/// reference net (Pellis et al. 2021, Eq. 11, there with `c` instead of `d`).
///
/// On the displacement, because fairness of the net itself slowly flattens the surface.
#[derive(Clone, Debug)]
pub struct Fairness {
    elements: Elements,
    triples: Vec<[usize; 3]>,
    /// Second differences of the reference, weighted; empty if the net itself is to be fair.
    reference: Vec<f64>,
    weight: f64,
}

impl Fairness {
    /// Fairness of the displacement from `reference`, or of the net itself without one.
    #[must_use]
    pub fn new(net: Net, reference: Option<&[f64]>, weight: f64) -> Self {
        let triples = net.second_differences();
        let mut elements = Elements::new();
        for t in &triples {
            for axis in 0..3 {
                elements.push(&t.map(|k| 3 * k + axis), 1);
            }
        }
        let mut made = Self { elements, triples, reference: Vec::new(), weight };
        if let Some(x) = reference {
            let mut values = vec![0.0; made.elements.rows_total()];
            made.residuals(x, &mut values);
            made.reference = values;
        }
        made
    }
}

impl ResidualBlock for Fairness {
    fn name(&self) -> &str {
        "fairness"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (rows, t) in residuals.chunks_exact_mut(3).zip(&self.triples) {
            for axis in 0..3 {
                let [before, here, after] = t.map(|k| x[3 * k + axis]);
                rows[axis] = self.weight * (here - 0.5 * (before + after));
            }
        }
        for (r, r0) in residuals.iter_mut().zip(&self.reference) {
            *r -= r0;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        let w = self.weight;
        for row in jacobian.chunks_exact_mut(3) {
            row.copy_from_slice(&[-0.5 * w, w, -0.5 * w]);
        }
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn set_reference(&mut self, reference: &[f64]) -> bool {
        let reads = self.triples.iter().flatten().max().map_or(0, |k| 3 * (k + 1));
        let fits = !self.reference.is_empty() && reference.len() >= reads;
        if fits {
            self.reference.fill(0.0);
            let mut values = vec![0.0; self.reference.len()];
            self.residuals(reference, &mut values);
            self.reference = values;
        }
        fits
    }
}

/// `w (l − l⁰)` for the lengths of all edges and face diagonals of the control net
/// (Pellis et al. 2021, Sec. 3.1.4).
#[derive(Clone, Debug)]
pub struct Shape {
    elements: Elements,
    edges: Vec<[usize; 2]>,
    lengths: Vec<f64>,
    weight: f64,
}

impl Shape {
    /// Keeps the lengths that `reference`, the coordinates of the control points, has.
    #[must_use]
    pub fn new(net: Net, reference: &[f64], weight: f64) -> Self {
        // An edge without length has no direction to keep.
        let mut edges = net.edges();
        edges.retain(|&e| length(reference, e).0 > 0.0);
        let lengths = edges.iter().map(|&e| length(reference, e).0).collect();
        let mut elements = Elements::new();
        for &[a, b] in &edges {
            let column = |k: usize| [3 * k, 3 * k + 1, 3 * k + 2];
            let (a, b) = (column(a), column(b));
            elements.push(&[a[0], a[1], a[2], b[0], b[1], b[2]], 1);
        }
        Self { elements, edges, lengths, weight }
    }
}

/// Length of an edge and the vector along it.
fn length(x: &[f64], [a, b]: [usize; 2]) -> (f64, [f64; 3]) {
    let d: [f64; 3] = std::array::from_fn(|axis| x[3 * b + axis] - x[3 * a + axis]);
    (d.iter().map(|d| d * d).sum::<f64>().sqrt(), d)
}

impl ResidualBlock for Shape {
    fn name(&self) -> &str {
        "shape"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for ((r, &edge), l0) in residuals.iter_mut().zip(&self.edges).zip(&self.lengths) {
            *r = self.weight * (length(x, edge).0 - l0);
        }
    }

    fn set_reference(&mut self, reference: &[f64]) -> bool {
        let reads = self.edges.iter().flatten().max().map_or(0, |k| 3 * (k + 1));
        if reference.len() < reads {
            return false;
        }
        self.lengths = self.edges.iter().map(|&e| length(reference, e).0).collect();
        true
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (row, &edge) in jacobian.chunks_exact_mut(6).zip(&self.edges) {
            let (l, d) = length(x, edge);
            for axis in 0..3 {
                let slope = if l > 0.0 { self.weight * d[axis] / l } else { 0.0 };
                row[axis] = -slope;
                row[3 + axis] = slope;
            }
        }
    }
}
