//! The rows of a net of curves from normals: fairness of every curve, and what has to hold exactly.

use std::sync::Arc;

use gp_solver::{Elements, ResidualBlock};
use rayon::prelude::*;

use crate::boundary::normals::curve::{COLUMNS, Continuation, FAIR_ROWS};
use crate::boundary::normals::curves::NormalCurves;

fn gather(x: &[f64], columns: &[usize]) -> [f64; COLUMNS] {
    std::array::from_fn(|k| x[columns[k]])
}

/// Fourth differences of the control points of every curve, in chords, and third differences of its
/// normals, in their length: 18 rows a curve in its 15 unknowns. Zero for cubics with quadratic
/// normals; they have no unit.
///
/// Curves and normals follow Lelieuvre's formula `r′ = ± N × N′` (Bobenko and Suris 2008), so the
/// rows are quadratic and quintic polynomials of the unknowns; derivatives are exact.
#[derive(Clone, Debug)]
pub struct Fairness {
    curves: Arc<NormalCurves>,
    elements: Elements,
}

impl Fairness {
    /// The rows of all curves.
    #[must_use]
    pub fn new(curves: &Arc<NormalCurves>) -> Self {
        let mut elements = Elements::new();
        curves.columns.iter().for_each(|c| elements.push(c, FAIR_ROWS));
        Self { curves: Arc::clone(curves), elements }
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
        let each = residuals.par_chunks_exact_mut(FAIR_ROWS).zip(&self.curves.curves).enumerate();
        each.for_each(|(e, (out, curve))| {
            curve.fairness(&gather(x, self.elements.columns(e)), out, None);
        });
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let jacobians = jacobian.par_chunks_exact_mut(FAIR_ROWS * COLUMNS);
        let rows = residuals.par_chunks_exact_mut(FAIR_ROWS).zip(jacobians);
        rows.zip(&self.curves.curves).enumerate().for_each(|(e, ((out, jacobian), curve))| {
            curve.fairness(&gather(x, self.elements.columns(e)), out, Some(jacobian));
        });
    }
}

/// What has to hold: every curve reaches its end (the gap over the chord, three rows, or for a line
/// one row along it and one for each normal), and the curvature is continuous along lines that go on
/// at a vertex (its jump times the mean chord). No unit; times the weight.
///
/// The sign is that of the gap itself, what the curve reaches less where it should end.
#[derive(Clone, Debug)]
pub struct Exactness {
    curves: Arc<NormalCurves>,
    /// For each continuation, which of its columns the second curve's unknowns are.
    second: Vec<[usize; COLUMNS]>,
    elements: Elements,
    weight: f64,
    /// Added to every row: the multiplier over the square of the weight.
    shift: Vec<f64>,
}

impl Exactness {
    /// The bare equations of all curves.
    #[must_use]
    pub fn new(curves: &Arc<NormalCurves>) -> Self {
        let mut elements = Elements::new();
        for (curve, columns) in curves.curves.iter().zip(&curves.columns) {
            elements.push(columns, curve.exact_rows());
        }
        let mut second = Vec::with_capacity(curves.continued.len());
        for [(a, _), (b, _)] in &curves.continued {
            let mut all = curves.columns[*a].to_vec();
            second.push(curves.columns[*b].map(|c| {
                all.iter().position(|known| *known == c).unwrap_or_else(|| {
                    all.push(c);
                    all.len() - 1
                })
            }));
            elements.push(&all, 1);
        }
        let shift = vec![0.0; elements.rows_total()];
        Self { curves: Arc::clone(curves), second, elements, weight: 1.0, shift }
    }

    /// The method of multipliers: what the last weight left at `x` sets the multipliers, so
    /// that the next solve leaves far less of it.
    pub fn reweight(&mut self, weight: f64, x: &[f64]) {
        if self.weight != 1.0 {
            let mut rows = vec![0.0; self.shift.len()];
            self.residuals(x, &mut rows);
            let share = self.weight / (weight * weight);
            self.shift = rows.iter().map(|r| share * r).collect();
        }
        self.weight = weight;
    }

    /// The bare equations.
    pub fn release(&mut self) {
        self.weight = 1.0;
        self.shift.fill(0.0);
    }

    fn fill(&self, x: &[f64], residuals: &mut [f64], mut jacobian: Option<&mut [f64]>) {
        let unknowns = |i: usize| self.curves.unknowns(x, i);
        for (e, curve) in self.curves.curves.iter().enumerate() {
            let range = self.elements.jacobian_range(e);
            let slopes = jacobian.as_deref_mut().map(|j| &mut j[range]);
            curve.exactness(&unknowns(e), &mut residuals[self.elements.rows(e)], slopes);
        }
        for (k, [(a, e), (b, f)]) in self.curves.continued.iter().enumerate() {
            let element = self.curves.curves.len() + k;
            let lines = Continuation {
                curves: [(&self.curves.curves[*a], *e), (&self.curves.curves[*b], *f)],
            };
            let mut slopes = [[0.0; COLUMNS]; 2];
            let wanted = jacobian.is_some().then_some(&mut slopes);
            let row = self.elements.rows(element).start;
            residuals[row] = lines.jump([&unknowns(*a), &unknowns(*b)], wanted);
            if let Some(jacobian) = jacobian.as_deref_mut() {
                let out = &mut jacobian[self.elements.jacobian_range(element)];
                out.fill(0.0);
                out[..COLUMNS].copy_from_slice(&slopes[0]);
                for (place, slope) in self.second[k].iter().zip(slopes[1]) {
                    out[*place] += slope;
                }
            }
        }
        residuals.iter_mut().zip(&self.shift).for_each(|(r, shift)| *r += shift);
        residuals.iter_mut().chain(jacobian.into_iter().flatten()).for_each(|r| *r *= self.weight);
    }
}

impl ResidualBlock for Exactness {
    fn name(&self) -> &str {
        "closing"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.fill(x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.fill(x, residuals, Some(jacobian));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::corners::AsymptoticNet;
    use geom_core::{DVec3, PolyMesh};
    use gp_solver::check_jacobian;

    /// Two by two quads on Enneper's surface: one line goes on through every inner edge.
    fn curves() -> Arc<NormalCurves> {
        let point = |k: usize| {
            let (p, q) = (0.2 + 0.4 * (k / 3) as f64, 0.1 + 0.4 * (k % 3) as f64);
            let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
            let cubic = |a: f64, b: f64| a - a.powi(3) / 3.0 + a * b * b;
            DVec3::new(cubic(u, v), cubic(v, u), u * u - v * v)
        };
        let faces = [0, 1, 3, 4].map(|a: u32| [a, a + 3, a + 4, a + 1]);
        let mesh = PolyMesh::new((0..9).map(point).collect(), &faces).unwrap();
        let net = AsymptoticNet::from_mesh(&mesh).unwrap();
        Arc::new(NormalCurves::of_net(&net).unwrap())
    }

    #[test]
    fn derivatives_of_the_blocks_agree_with_differences() {
        let curves = curves();
        assert!(!curves.continued.is_empty());
        let moved = |(k, x): (usize, &f64)| x + 0.05 * (1.3 * k as f64).sin();
        let x: Vec<f64> = curves.start().iter().enumerate().map(moved).collect();
        let mut exact = Exactness::new(&curves);
        exact.reweight(10.0, &x);
        // With multipliers from another place.
        exact.reweight(30.0, curves.start());
        for block in [&Fairness::new(&curves) as &dyn ResidualBlock, &exact, &curves.closeness()] {
            let worst = check_jacobian(block, &x).unwrap().unwrap();
            assert!(worst.error < 1e-6, "{worst:?}");
        }
    }
}
