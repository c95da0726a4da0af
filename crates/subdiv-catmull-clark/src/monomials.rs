//! Polynomials in the characteristic coordinates.

use crate::jet::{JET_LEN, Jet, jet_index, jet_product};

/// Total degree of the guide.
pub(crate) const DEGREE: usize = 5;
/// Number of monomials up to that degree.
pub(crate) const MONOMIALS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;

/// Exponents of monomial `k`: by total degree, falling in the first.
pub(crate) fn exponents() -> [(usize, usize); MONOMIALS] {
    let mut out = [(0, 0); MONOMIALS];
    for total in 0..=DEGREE {
        for j in 0..=total {
            out[jet_index(total - j, j)] = (total - j, j);
        }
    }
    out
}

/// Jets of all monomials, from those of the coordinates.
pub(crate) fn monomial_jets(coordinates: &[Jet; 2]) -> [Jet; MONOMIALS] {
    let mut out = [[0.0; JET_LEN]; MONOMIALS];
    out[0][0] = 1.0;
    for (k, (i, j)) in exponents().into_iter().enumerate().skip(1) {
        out[k] = if i > 0 {
            jet_product(&out[jet_index(i - 1, j)], &coordinates[0])
        } else {
            jet_product(&out[jet_index(0, j - 1)], &coordinates[1])
        };
    }
    out
}

/// Row `k`: the monomial `k` of the rotated coordinates as a combination of monomials.
pub(crate) fn rotated_monomials(angle: f64) -> Vec<f64> {
    let (s, c) = angle.sin_cos();
    let mut out = vec![0.0; MONOMIALS * MONOMIALS];
    out[0] = 1.0;
    for (k, (i, j)) in exponents().into_iter().enumerate().skip(1) {
        // ξ' = c ξ − s η, η' = s ξ + c η.
        let (before, factors) =
            if i > 0 { (jet_index(i - 1, j), [c, -s]) } else { (jet_index(0, j - 1), [s, c]) };
        for (m, (p, q)) in exponents().into_iter().enumerate() {
            let value = out[before * MONOMIALS + m];
            if value != 0.0 {
                out[k * MONOMIALS + jet_index(p + 1, q)] += factors[0] * value;
                out[k * MONOMIALS + jet_index(p, q + 1)] += factors[1] * value;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotated_monomials_agree_with_rotated_points() {
        let angle = 0.7_f64;
        let (s, c) = angle.sin_cos();
        let (x, y) = (0.3, -0.8);
        let (rx, ry) = (c * x - s * y, s * x + c * y);
        let value = |x: f64, y: f64| exponents().map(|(i, j)| x.powi(i as i32) * y.powi(j as i32));
        let matrix = rotated_monomials(angle);
        let (plain, rotated) = (value(x, y), value(rx, ry));
        for k in 0..MONOMIALS {
            let sum: f64 = (0..MONOMIALS).map(|m| matrix[k * MONOMIALS + m] * plain[m]).sum();
            assert!((sum - rotated[k]).abs() < 1e-14, "monomial {k}");
        }
    }
}
