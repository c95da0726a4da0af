//! Unknowns that are components of vectors in space.

use super::normal::NormalPlan;
use crate::linear::Factor;
use crate::problem::Problem;

/// The positions of the free components of every vector, and their couplings.
///
/// Of a vector's block `B` of the normal matrix, over `k` components, this makes the block
/// `D = (2 B + tr B · I)/(k + 2)`: the mean of `diag B` over all systems of axes, so that it depends
/// on none. (For a unit vector `q`, the mean of `q qᵀ B q qᵀ` over the sphere is
/// `(2 B + tr B · I)/(k (k + 2))`, and `diag B` in the axes `q` is the sum of `k` of these.)
#[derive(Default)]
pub(super) struct VectorPlan {
    starts: Vec<usize>,
    positions: Vec<u32>,
    /// Two components of one vector, and where the matrix has their product.
    pairs: Vec<[u32; 3]>,
    /// The products at the last linearisation.
    products: Vec<f64>,
    /// What of a product is in `D`.
    shares: Vec<f64>,
}

/// Share of a block of so many components in `D`.
fn share_of(components: usize) -> f64 {
    2.0 / (components as f64 + 2.0)
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
                this.shares.resize(this.pairs.len(), share_of(free.len()));
            }
        }
        this.products = vec![0.0; this.pairs.len()];
        this
    }

    pub(super) fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Takes up the products of a matrix, and makes of its diagonal that of `D`.
    pub(super) fn take(&mut self, matrix: &[f64], diagonal: &mut [f64]) {
        for (product, &[.., slot]) in self.products.iter_mut().zip(&self.pairs) {
            *product = matrix[slot as usize];
        }
        self.merge(diagonal, |value, sum, count| {
            let share = share_of(count);
            share * value + (1.0 - share) * (sum / count as f64)
        });
    }

    /// Puts the matrix with `damping` times `D` into the places of the products.
    pub(super) fn put(&self, matrix: &mut [f64], damping: f64) {
        let entries = self.products.iter().zip(&self.shares).zip(&self.pairs);
        for ((product, share), &[.., slot]) in entries {
            matrix[slot as usize] = product + damping * (share * product);
        }
    }

    /// The off-diagonal entries of `D`.
    fn couplings(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let entries =
            self.products.iter().zip(&self.shares).map(|(product, share)| share * product);
        entries.zip(&self.pairs).map(|(entry, &[a, b, _])| (a as usize, b as usize, entry))
    }

    /// The off-diagonal part of `vᵀ D v`.
    pub(super) fn cross(&self, v: &[f64]) -> f64 {
        2.0 * self.couplings().map(|(a, b, entry)| entry * v[a] * v[b]).sum::<f64>()
    }

    /// Adds the off-diagonal part of `D v`.
    pub(super) fn add_cross(&self, v: &[f64], out: &mut [f64]) {
        for (a, b, entry) in self.couplings() {
            out[a] += entry * v[b];
            out[b] += entry * v[a];
        }
    }

    /// Replaces the values of the components of every vector by their sum.
    pub(super) fn sum(&self, values: &mut [f64]) {
        self.merge(values, |_, sum, _| sum);
    }

    /// Replaces the values of the components of every vector by their mean.
    pub(super) fn average(&self, values: &mut [f64]) {
        self.merge(values, |_, sum, count| sum / count as f64);
    }

    /// Replaces every value by what `of` makes of it, the sum over its vector and their number.
    fn merge(&self, values: &mut [f64], of: impl Fn(f64, f64, usize) -> f64) {
        for ends in self.starts.windows(2) {
            let components = &self.positions[ends[0]..ends[1]];
            let sum: f64 = components.iter().map(|&at| values[at as usize]).sum();
            for &at in components {
                values[at as usize] = of(values[at as usize], sum, components.len());
            }
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
    fn blocks_are_the_mean_of_the_diagonal_over_all_axes() {
        // Springs of stiffness 1, 3 and 9 along the coordinates: (2 B + 13 I) / 5.
        let mut variables = Variables::new();
        let points = variables.add("points", 1, 3);
        variables.set_vectors(points);
        let mut problem = Problem::new(variables);
        let mut rows = QuadraticBuilder::new("springs");
        let stiffness = [1.0_f64, 3.0, 9.0];
        for (c, k) in stiffness.into_iter().enumerate() {
            rows.equation(1.0).linear(c, k.sqrt());
        }
        problem.add(rows.build());
        let options = Options { damping_rule: DampingRule::Fivefold, ..Options::default() };
        let mut run = Run::new(
            System::new(problem, crate::Factorization::Auto).unwrap(),
            &[1.0; 3],
            &Options { initial_damping: 1.0, ..options },
        )
        .unwrap();
        assert_eq!(run.step(&mut ()).unwrap(), Step::Taken);
        for (x, k) in run.x().iter().zip(stiffness) {
            let damped = (2.0 * k + 13.0) / 5.0;
            assert!((x - damped / (k + damped)).abs() < 1e-14, "{x}");
        }
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
