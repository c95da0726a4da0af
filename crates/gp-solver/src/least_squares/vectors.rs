//! Unknowns that are components of vectors in space.

use super::normal::NormalPlan;
use crate::linear::Factor;
use crate::problem::Problem;

/// The positions of the free components of every vector, and their couplings.
#[derive(Default)]
pub(super) struct VectorPlan {
    starts: Vec<usize>,
    positions: Vec<u32>,
    /// Two components of one vector, and where the matrix has their product.
    pairs: Vec<[u32; 3]>,
    /// The products at the last linearisation.
    products: Vec<f64>,
}

impl VectorPlan {
    pub(super) fn new(problem: &Problem<'_>, plan: &NormalPlan, factor: &Factor) -> Self {
        let variables = &problem.variables;
        let mut this = Self::default();
        if variables.vectors().is_empty() {
            return this;
        }
        let mut position = vec![u32::MAX; variables.len()];
        plan.variable.iter().zip(0..).for_each(|(&variable, at)| position[variable] = at);
        this.starts.push(0);
        for group in variables.vectors() {
            for item in 0..group.len() {
                let begin = this.positions.len();
                let components = (0..group.width()).map(|c| position[group.column(item, c)]);
                this.positions.extend(components.filter(|&at| at != u32::MAX));
                this.starts.push(this.positions.len());
                let free = &this.positions[begin..];
                for (k, &a) in free.iter().enumerate() {
                    for &b in &free[..k] {
                        if let Some(slot) = factor.slot(a as usize, b as usize) {
                            this.pairs.push([a, b, slot as u32]);
                        }
                    }
                }
            }
        }
        this.products = vec![0.0; this.pairs.len()];
        this
    }

    pub(super) fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Takes up the products of a matrix.
    pub(super) fn take(&mut self, matrix: &[f64]) {
        for (product, &[.., slot]) in self.products.iter_mut().zip(&self.pairs) {
            *product = matrix[slot as usize];
        }
    }

    /// Puts the products into the matrix, times a factor.
    pub(super) fn put(&self, matrix: &mut [f64], factor: f64) {
        for (product, &[.., slot]) in self.products.iter().zip(&self.pairs) {
            matrix[slot as usize] = product * factor;
        }
    }

    /// The off-diagonal part of `vᵀ D v`, with `D` the blocks of the vectors.
    pub(super) fn cross(&self, v: &[f64]) -> f64 {
        let term =
            |(product, &[a, b, _]): (&f64, &[u32; 3])| product * v[a as usize] * v[b as usize];
        2.0 * self.products.iter().zip(&self.pairs).map(term).sum::<f64>()
    }

    /// Adds the off-diagonal part of `D v`.
    pub(super) fn add_cross(&self, v: &[f64], out: &mut [f64]) {
        for (product, &[a, b, _]) in self.products.iter().zip(&self.pairs) {
            out[a as usize] += product * v[b as usize];
            out[b as usize] += product * v[a as usize];
        }
    }

    /// Replaces the values of the components of every vector by their sum.
    pub(super) fn sum(&self, values: &mut [f64]) {
        self.merge(values, |sum, _| sum);
    }

    /// Replaces the values of the components of every vector by their mean.
    pub(super) fn average(&self, values: &mut [f64]) {
        self.merge(values, |sum, count| sum / count as f64);
    }

    fn merge(&self, values: &mut [f64], of: impl Fn(f64, usize) -> f64) {
        for ends in self.starts.windows(2) {
            let components = &self.positions[ends[0]..ends[1]];
            let sum: f64 = components.iter().map(|&at| values[at as usize]).sum();
            let value = of(sum, components.len());
            components.iter().for_each(|&at| values[at as usize] = value);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{DampingRule, Options, Problem, QuadraticBuilder, Run, Step, System, Variables};

    /// A point on two unit spheres and nearly on a third, in axes turned about z by `angle`.
    fn steps(angle: f64, damping_rule: DampingRule) -> Vec<[f64; 3]> {
        let (sin, cos) = angle.sin_cos();
        let turn = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
        let mut variables = Variables::new();
        let points = variables.add("points", 1, 3);
        variables.set_vectors(points);
        let mut problem = Problem::new(variables);
        let mut spheres = QuadraticBuilder::new("spheres");
        for (centre, weight) in
            [([0.9, 0.1, 0.0], 1.0), ([-0.2, 0.8, 0.1], 20.0), ([0.3, 0.3, 0.9], 1.0)]
        {
            let centre = turn(centre);
            let square: f64 = centre.iter().map(|c| c * c).sum();
            let equation = spheres.equation(weight).constant(square - 1.0);
            for (c, centre) in centre.into_iter().enumerate() {
                equation.product(c, c, 1.0).linear(c, -2.0 * centre);
            }
        }
        problem.add(spheres.build());
        let system = System::new(problem, crate::Factorization::Auto).unwrap();
        let start = turn([2.0, 1.5, -3.0]);
        let options = Options { damping_rule, ..Options::default() };
        let mut run = Run::new(system, &start, &options).unwrap();
        let mut seen = Vec::new();
        while seen.len() < 12 && run.step(&mut ()).unwrap() == Step::Taken {
            let x = run.x();
            seen.push([cos * x[0] + sin * x[1], -sin * x[0] + cos * x[1], x[2]]);
        }
        seen
    }

    #[test]
    fn a_turned_problem_takes_turned_steps() {
        for rule in [DampingRule::StepLength, DampingRule::Fivefold] {
            let straight = steps(0.0, rule);
            for angle in [0.7, 2.0] {
                let turned = steps(angle, rule);
                assert_eq!(turned.len(), straight.len());
                for (a, b) in straight.iter().flatten().zip(turned.iter().flatten()) {
                    assert!((a - b).abs() < 1e-9, "{a} {b}");
                }
            }
        }
    }
}
