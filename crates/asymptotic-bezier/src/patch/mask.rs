//! Inner control points by masks: each is a weighted mean of its eight neighbours.
//!
//! The two outer rings stay, so the boundary stays asymptotic. The masks are solved as one linear
//! system; marching them inwards from the corners, the reverse use of Wang et al. 2019, Remark 4.1,
//! amplifies errors and folds the patch (their Fig. 4.2b), so it is not offered.

use gp_solver::choices;
use serde::{Deserialize, Serialize};

use crate::curve::bernstein::gram;
use crate::patch::surface::Patch;
use numerics::{Matrix, affine_space, dot};

/// How the inner control points are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interior {
    /// Least thin-plate energy (Wang et al. 2019, Eq. 4.5), together with the tangent fields.
    #[default]
    ThinPlate,
    /// Corners 1/4 each.
    Harmonic,
    /// Least `∫∫ |ΔR|²` of a biquadratic patch.
    QuasiHarmonic,
    /// Least `∫∫ |R_u|² + |R_v|²` of a biquadratic patch.
    Dirichlet,
    /// Least thin-plate energy of a biquadratic patch.
    Bending,
    /// The discrete Coons patch of Farin and Hansford 1999.
    Coons,
}

choices!(Interior {
    ThinPlate = "thin_plate",
    Harmonic = "harmonic",
    QuasiHarmonic = "quasi_harmonic",
    Dirichlet = "dirichlet",
    Bending = "bending",
    Coons = "coons",
});

impl Interior {
    /// Weights of the four edge neighbours and the four corner neighbours, which sum to one.
    fn weights(self) -> Option<[f64; 2]> {
        Some(match self {
            Self::ThinPlate => return None,
            Self::Harmonic => [0.0, 0.25],
            Self::QuasiHarmonic => [-2.0 / 11.0, 19.0 / 44.0],
            Self::Dirichlet => [-0.125, 0.375],
            Self::Bending => [7.0 / 44.0, 1.0 / 11.0],
            Self::Coons => [0.5, -0.25],
        })
    }
}

/// `patch` with its inner points by the mask, and its thin-plate energy; `None` for thin plates,
/// whose points are there already.
pub(crate) fn masked(patch: &Patch, interior: Interior) -> Option<(Patch, f64)> {
    let [edge, corner] = interior.weights()?;
    let n = patch.degree();
    let side = n - 3;
    let index = |i: usize, j: usize| (i - 2) * side + (j - 2);
    let is_inner = |i: usize, j: usize| (2..=n - 2).contains(&i) && (2..=n - 2).contains(&j);
    let mut matrix = Matrix::identity(side * side);
    let mut right = vec![geom_core::DVec3::ZERO; side * side];
    let origin = patch.point(0, 0);
    for i in 2..=n - 2 {
        for j in 2..=n - 2 {
            for (di, dj) in (0..9).map(|k| (k / 3, k % 3)).filter(|d| *d != (1, 1)) {
                let weight = if di == 1 || dj == 1 { edge } else { corner };
                let (k, l) = (i + di - 1, j + dj - 1);
                if is_inner(k, l) {
                    matrix[(index(i, j), index(k, l))] -= weight;
                } else {
                    right[index(i, j)] += (patch.point(k, l) - origin) * weight;
                }
            }
        }
    }
    let mut points = patch.points().to_vec();
    for axis in 0..3 {
        let b: Vec<f64> = right.iter().map(|r| r[axis]).collect();
        let scale = vec![1.0; b.len()];
        let x = affine_space(&matrix, &b, &scale, 1e-14).particular;
        for i in 2..=n - 2 {
            for j in 2..=n - 2 {
                points[i * (n + 1) + j][axis] = x[index(i, j)] + origin[axis];
            }
        }
    }
    let patch = Patch::new(n, points);
    let energy = thin_plate_energy(&patch);
    Some((patch, energy))
}

/// `∫∫ |R_uu|² + 2 |R_uv|² + |R_vv|²`.
pub(crate) fn thin_plate_energy(patch: &Patch) -> f64 {
    let n = patch.degree();
    let (g0, g1, g2) = (gram(n, 0), gram(n, 1), gram(n, 2));
    let origin = patch.point(0, 0);
    let mut energy = 0.0;
    for axis in 0..3 {
        let mut q = Matrix::zeros(n + 1, n + 1);
        for i in 0..=n {
            for j in 0..=n {
                q[(i, j)] = (patch.point(i, j) - origin)[axis];
            }
        }
        // Sum over (A Q B) ∘ Q for the three pairs of Gram matrices.
        for (a, b, weight) in [(&g2, &g0, 1.0), (&g1, &g1, 2.0), (&g0, &g2, 1.0)] {
            let aqb = a.product(&q).product(b);
            energy += weight * (0..=n).map(|i| dot(aqb.row(i), q.row(i))).sum::<f64>();
        }
    }
    energy
}
