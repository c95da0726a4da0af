//! Eigenstructure of Catmull-Clark subdivision around an interior vertex.

use numerics::gauss_jordan_rows;
use std::f64::consts::{PI, TAU};

/// Subdominant eigenvalue of the subdivision matrix of valence `n`
/// (Ball and Storry 1988): `(5 + c + cos(π/n) √(2(9 + c)))/16`, `c = cos(2π/n)`.
#[must_use]
pub fn subdominant_eigenvalue(n: usize) -> f64 {
    let c = (TAU / n as f64).cos();
    (5.0 + c + (PI / n as f64).cos() * (2.0 * (9.0 + c)).sqrt()) / 16.0
}

/// Linear functionals of a vertex and its ring (centre, then edge and face neighbours in turn,
/// counter-clockwise) that give limit position and tangents (Halstead, Kass and DeRose 1993).
#[derive(Clone, Debug, PartialEq)]
pub struct LimitMasks {
    /// Limit position; sums to one.
    pub position: Vec<f64>,
    /// Derivatives along the two characteristic coordinates.
    pub tangents: [Vec<f64>; 2],
}

/// Limit masks of valence `n`.
///
/// The tangents are the derivatives of the limit surface by the characteristic coordinates, which
/// are scaled so that the edge neighbours stand at distance one.
///
/// # Panics
/// If `n < 3`.
///
/// # Example
/// ```
/// let regular = subdiv_catmull_clark::limit_masks(4);
/// // The weights of cubic B-splines, (1, 4, 1) / 6, times themselves.
/// assert!((regular.position[0] - 16.0 / 36.0).abs() < 1e-15);
/// assert!((regular.position[1] - 4.0 / 36.0).abs() < 1e-15);
/// assert!((regular.position[2] - 1.0 / 36.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn limit_masks(n: usize) -> LimitMasks {
    assert!(n >= 3, "an interior vertex has at least three edges");
    let m = n as f64;
    let mut position = vec![0.0; 2 * n + 1];
    let total = m * (m + 5.0);
    position[0] = m * m / total;
    let c = (TAU / m).cos();
    let a = 1.0 + c + (PI / m).cos() * (2.0 * (9.0 + c)).sqrt();
    let mut tangents = [vec![0.0; 2 * n + 1], vec![0.0; 2 * n + 1]];
    for j in 0..n {
        let (now, next) = (TAU * j as f64 / m, TAU * (j + 1) as f64 / m);
        position[2 * j + 1] = 4.0 / total;
        position[2 * j + 2] = 1.0 / total;
        tangents[0][2 * j + 1] = a * now.cos();
        tangents[0][2 * j + 2] = now.cos() + next.cos();
        tangents[1][2 * j + 1] = a * now.sin();
        tangents[1][2 * j + 2] = now.sin() + next.sin();
    }
    // Normalised on the characteristic map itself, whose tangents must come out as the identity.
    let map = characteristic_ring(n);
    for (axis, mask) in tangents.iter_mut().enumerate() {
        let length: f64 = mask.iter().zip(&map).map(|(w, p)| w * p[axis]).sum();
        mask.iter_mut().for_each(|w| *w /= length);
    }
    LimitMasks { position, tangents }
}

/// Characteristic map of a vertex and its ring, the edge neighbours on the unit circle.
pub(crate) fn characteristic_ring(n: usize) -> Vec<[f64; 2]> {
    let lambda = subdominant_eigenvalue(n);
    let edge = |j: usize| {
        let angle = TAU * j as f64 / n as f64;
        [angle.cos(), angle.sin()]
    };
    let mut map = vec![[0.0; 2]];
    for j in 0..n {
        let (a, b) = (edge(j), edge(j + 1));
        map.push(a);
        // A face neighbour f becomes (centre + e_j + e_{j+1} + f)/4 = λ f.
        map.push([0, 1].map(|k| (a[k] + b[k]) / (4.0 * lambda - 1.0)));
    }
    map
}

/// Characteristic map on the `2n + 8` control points of a patch, from its subdivision matrix.
pub(crate) fn characteristic_map(n: usize, subdivision: &[f64]) -> Vec<[f64; 2]> {
    let count = 2 * n + 8;
    let ring = 2 * n + 1;
    let lambda = subdominant_eigenvalue(n);
    let mut map = characteristic_ring(n);
    // The seven outer points follow from (λ I − A₂₂) x = A₂₁ · ring.
    let mut system = [[0.0; 9]; 7];
    for (i, row) in system.iter_mut().enumerate() {
        let a = &subdivision[(ring + i) * count..(ring + i + 1) * count];
        for j in 0..7 {
            row[j] = f64::from(u8::from(i == j)) * lambda - a[ring + j];
        }
        for axis in 0..2 {
            row[7 + axis] = a[..ring].iter().zip(&map).map(|(w, p)| w * p[axis]).sum();
        }
    }
    gauss_jordan_rows(&mut system);
    map.extend(system.iter().map(|row| [row[7], row[8]]));
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_vertex_has_the_b_spline_masks() {
        assert!((subdominant_eigenvalue(4) - 0.5).abs() < 1e-15);
        let masks = limit_masks(4);
        assert!((masks.position[0] - 16.0 / 36.0).abs() < 1e-15);
        // d/dx of the bi-cubic B-spline at a knot: (1/2) (1/6, 4/6, 1/6) across.
        assert!((masks.tangents[0][1] - 0.5 * 4.0 / 6.0).abs() < 1e-14);
        assert!((masks.tangents[0][2] - 0.5 / 6.0).abs() < 1e-14);
    }

    #[test]
    fn masks_are_dual_to_the_characteristic_map() {
        for n in 3..=20 {
            let masks = limit_masks(n);
            let map = characteristic_ring(n);
            let apply = |mask: &[f64], axis: usize| -> f64 {
                mask.iter().zip(&map).map(|(w, p)| w * p[axis]).sum()
            };
            for a in 0..2 {
                assert!(apply(&masks.position, a).abs() < 1e-14);
                for b in 0..2 {
                    let want = f64::from(u8::from(a == b));
                    assert!((apply(&masks.tangents[a], b) - want).abs() < 1e-13, "valence {n}");
                }
            }
        }
    }
}
