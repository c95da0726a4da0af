//! Metrics restricted to the directions that keep linear conditions.

use numerics::{dot, factor_semidefinite, solve_semidefinite};

/// Share of a condition's own size below which a pivot is a rounding error.
const LEAST_PIVOT: f64 = 1e-12;

/// The conditions' images under the inverse of a metric `M`, and the Cholesky factor of the Schur
/// complement `C M⁻¹ Cᵀ`.
#[derive(Clone, Debug, Default)]
pub(super) struct Projected {
    rows: Vec<Vec<f64>>,
    /// `M⁻¹ Cᵀ`.
    images: Vec<Vec<f64>>,
    schur: Vec<Vec<f64>>,
}

impl Projected {
    /// Of the conditions `rows`; `solve` replaces a vector by its image under `M⁻¹`.
    pub(super) fn new(rows: Vec<Vec<f64>>, solve: impl Fn(&mut [f64])) -> Self {
        let images: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| {
                let mut image = row.clone();
                solve(&mut image);
                image
            })
            .collect();
        let n = rows.len();
        let mut schur = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                schur[i][j] = dot(&rows[i], &images[j]);
            }
        }
        // Conditions that follow from others leave a pivot of rounding errors; they are skipped.
        factor_semidefinite(&mut schur, LEAST_PIVOT);
        Self { rows, images, schur }
    }

    /// Moves `y` to the conditions by the shortest way in the metric.
    pub(super) fn restore(&self, targets: &[f64], y: &mut [f64]) {
        let mut gap: Vec<f64> =
            self.rows.iter().zip(targets).map(|(row, t)| t - dot(row, y)).collect();
        solve_semidefinite(&self.schur, &mut gap);
        for (image, g) in self.images.iter().zip(&gap) {
            y.iter_mut().zip(image).for_each(|(y, i)| *y += g * i);
        }
    }

    /// Takes out of `image = M⁻¹ g` what would leave the conditions.
    pub(super) fn keep(&self, image: &mut [f64]) {
        let mut multipliers: Vec<f64> = self.rows.iter().map(|row| dot(row, image)).collect();
        solve_semidefinite(&self.schur, &mut multipliers);
        for (row, m) in self.images.iter().zip(&multipliers) {
            image.iter_mut().zip(row).for_each(|(g, i)| *g -= m * i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_stay_on_the_conditions_and_restoring_meets_them() {
        // The metric diag(1, 2, 4); the third condition follows from the others.
        let solve = |v: &mut [f64]| v.iter_mut().zip([1.0, 2.0, 4.0]).for_each(|(v, d)| *v /= d);
        let rows = vec![vec![1.0, 1.0, 0.0], vec![0.0, 1.0, -1.0], vec![1.0, 2.0, -1.0]];
        let projected = Projected::new(rows.clone(), solve);
        let mut y = vec![0.3, -0.2, 0.9];
        let targets = [1.0, 0.5, 1.5];
        projected.restore(&targets, &mut y);
        for (row, target) in rows.iter().zip(targets) {
            assert!((dot(row, &y) - target).abs() < 1e-12);
        }
        let mut step = vec![0.7, 0.1, -0.4];
        solve(&mut step);
        projected.keep(&mut step);
        for row in &rows {
            assert!(dot(row, &step).abs() < 1e-12);
        }
    }
}
