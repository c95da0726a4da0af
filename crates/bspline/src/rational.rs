//! Derivatives of a quotient from those of numerator and denominator.

use crate::basis::MAX_DERIVATIVE;
use geom_core::SurfaceJet;
use glam::{DVec3, DVec4};

/// Binomial coefficients `n` over `k` at `[n][k]`, for the product rule up to fourth derivatives.
pub const BINOMIAL: [[f64; MAX_DERIVATIVE + 1]; MAX_DERIVATIVE + 1] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

/// Derivatives of `A/w` for a curve (Piegl and Tiller 1997, Eq. 4.8).
pub(crate) fn curve(
    homogeneous: &[DVec4; MAX_DERIVATIVE + 1],
    order: usize,
) -> [DVec3; MAX_DERIVATIVE + 1] {
    let mut out = [DVec3::ZERO; MAX_DERIVATIVE + 1];
    for k in 0..=order {
        let mut sum = homogeneous[k].truncate();
        for i in 1..=k {
            sum -= BINOMIAL[k][i] * homogeneous[i].w * out[k - i];
        }
        out[k] = sum / homogeneous[0].w;
    }
    out
}

/// Derivatives of `A/w` for a surface (Piegl and Tiller 1997, Eq. 4.20).
pub(crate) fn surface(homogeneous: &[DVec4; SurfaceJet::LEN], order: usize) -> SurfaceJet {
    let mut jet = SurfaceJet::default();
    for total in 0..=order {
        for b in 0..=total {
            let a = total - b;
            let mut sum = homogeneous[SurfaceJet::index(a, b)].truncate();
            for i in 0..=a {
                for j in 0..=b {
                    if i + j > 0 {
                        let w = homogeneous[SurfaceJet::index(i, j)].w;
                        sum -= BINOMIAL[a][i] * BINOMIAL[b][j] * w * jet.d(a - i, b - j);
                    }
                }
            }
            jet.derivatives[SurfaceJet::index(a, b)] = sum / homogeneous[0].w;
        }
    }
    jet
}
