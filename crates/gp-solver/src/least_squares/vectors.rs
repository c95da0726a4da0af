//! Unknowns that are components of vectors in space.

use super::normal::NormalPlan;
use crate::problem::Problem;

/// The positions of the free components of every vector.
#[derive(Default)]
pub(super) struct VectorPlan {
    starts: Vec<usize>,
    positions: Vec<u32>,
}

impl VectorPlan {
    pub(super) fn new(problem: &Problem<'_>, plan: &NormalPlan) -> Self {
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
                let components = (0..group.width()).map(|c| position[group.column(item, c)]);
                this.positions.extend(components.filter(|&at| at != u32::MAX));
                this.starts.push(this.positions.len());
            }
        }
        this
    }

    pub(super) fn is_empty(&self) -> bool {
        self.positions.is_empty()
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
    use crate::{Options, Problem, QuadraticBuilder, Run, Step, System, Variables};

    /// A point on two unit spheres and nearly on a third, in axes turned about z by `angle`.
    fn steps(angle: f64) -> Vec<[f64; 3]> {
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
        let mut run = Run::new(system, &start, &Options::default()).unwrap();
        let mut seen = Vec::new();
        while seen.len() < 12 && run.step(&mut ()).unwrap() == Step::Taken {
            let x = run.x();
            seen.push([cos * x[0] + sin * x[1], -sin * x[0] + cos * x[1], x[2]]);
        }
        seen
    }

    #[test]
    fn a_turned_problem_takes_turned_steps() {
        let straight = steps(0.0);
        for angle in [0.7, 2.0] {
            let turned = steps(angle);
            assert_eq!(turned.len(), straight.len());
            for (a, b) in straight.iter().flatten().zip(turned.iter().flatten()) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }
    }
}
