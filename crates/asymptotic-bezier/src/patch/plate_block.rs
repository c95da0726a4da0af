//! The thin-plate energy as a block.

use gp_solver::{Elements, EnergyBlock, Group};

use crate::patch::thin_plate::thin_plate_block;

/// Half the thin-plate energy `∫∫ |R_uu|² + 2 |R_uv|² + |R_vv|²` of Bezier patches (Wang et al. 2019,
/// Eq. 4.5) as a function of their control points: `½ qᵀ K q` per patch and axis, in squared lengths.
/// Gradient `K q` and Hessian `K` are exact.
#[derive(Clone, Debug)]
pub struct ThinPlate {
    elements: Elements,
    /// `K`, row by row.
    stiffness: Vec<f64>,
    /// Control points of a patch.
    size: usize,
}

impl ThinPlate {
    /// Patches of this degree whose control points follow one another in the group, `(i, j)` being
    /// number `i (n + 1) + j`.
    ///
    /// # Panics
    /// If the degree is above 15, or the group does not hold whole patches.
    #[must_use]
    pub fn new(degree: usize, points: Group) -> Self {
        let size = (degree + 1) * (degree + 1);
        assert_eq!(points.len() % size, 0, "a group of whole patches");
        let all: Vec<(usize, usize)> =
            (0..size).map(|k| (k / (degree + 1), k % (degree + 1))).collect();
        let matrix = thin_plate_block(degree, &all, &all);
        let mut elements = Elements::new();
        for patch in 0..points.len() / size {
            for axis in 0..3 {
                let columns: Vec<usize> =
                    (0..size).map(|k| points.column(patch * size + k, axis)).collect();
                elements.push(&columns, size);
            }
        }
        let stiffness = (0..size).flat_map(|i| matrix.row(i)).copied().collect();
        Self { elements, stiffness, size }
    }

    /// `K q` of an element into `force`.
    fn force(&self, element: usize, x: &[f64], force: &mut [f64]) {
        let columns = self.elements.columns(element);
        for (f, row) in force.iter_mut().zip(self.stiffness.chunks_exact(self.size)) {
            *f = row.iter().zip(columns).map(|(k, c)| k * x[*c]).sum();
        }
    }
}

impl EnergyBlock for ThinPlate {
    fn name(&self) -> &str {
        "thin plate"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn is_quadratic(&self) -> bool {
        true
    }

    fn energy(&self, x: &[f64]) -> f64 {
        let mut force = vec![0.0; self.size];
        let mut sum = 0.0;
        for e in 0..self.elements.len() {
            self.force(e, x, &mut force);
            let columns = self.elements.columns(e);
            sum += 0.5 * force.iter().zip(columns).map(|(f, c)| f * x[*c]).sum::<f64>();
        }
        sum
    }

    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
        for e in 0..self.elements.len() {
            self.force(e, x, &mut gradients[self.elements.rows(e)]);
            hessians[self.elements.jacobian_range(e)].copy_from_slice(&self.stiffness);
        }
        self.energy(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gp_solver::{Variables, check_gradient};

    #[test]
    fn gradient_agrees_with_differences_and_a_bilinear_patch_has_its_twist() {
        let mut variables = Variables::new();
        let points = variables.add("control points", 36, 3);
        let block = ThinPlate::new(5, points);
        let x: Vec<f64> = (0..108).map(|k| (0.7 * k as f64).sin()).collect();
        let worst = check_gradient(&block, &x).unwrap().unwrap();
        assert!(worst.error < 1e-7, "{worst:?}");
        // z = u v: half of ∫∫ 2 R_uv² = 1.
        let mut x = vec![0.0; 108];
        (0..36).for_each(|k| x[points.column(k, 2)] = ((k / 6) * (k % 6)) as f64 / 25.0);
        assert!((block.energy(&x) - 1.0).abs() < 1e-12);
    }
}
