//! Polynomials in Bernstein form on `[0, 1]`: products, degree elevation, Gram matrices.

use geom_core::DVec3;

use numerics::Matrix;

/// Highest degree the binomial table holds: products of two derivatives of bi-15 fields.
const MAX_DEGREE: usize = 64;

/// `n` over `k` as a float (exact up to 2⁵³).
pub(crate) fn binomial(n: usize, k: usize) -> f64 {
    debug_assert!(n <= MAX_DEGREE, "degree {n} within the table");
    if k > n {
        return 0.0;
    }
    let k = k.min(n - k);
    let mut value = 1.0;
    for i in 0..k {
        value = value * (n - i) as f64 / (i + 1) as f64;
    }
    value.round()
}

/// All `B_j^n(t)`, `j = 0..=n`, by the triangular recurrence (no cancellation, ends exact).
pub(crate) fn bernstein_into(n: usize, t: f64, out: &mut [f64]) {
    out[0] = 1.0;
    for d in 1..=n {
        raise(d, t, out);
    }
}

/// All `B_j^d(t)` from those of degree `d − 1` in their place.
fn raise(d: usize, t: f64, basis: &mut [f64]) {
    let s = 1.0 - t;
    basis[d] = t * basis[d - 1];
    for j in (1..d).rev() {
        basis[j] = s * basis[j] + t * basis[j - 1];
    }
    basis[0] *= s;
}

/// Values of polynomials whose degrees rise by one from each to the next, as those of a polynomial
/// and its derivatives do, the highest derivative first: one recurrence serves all.
pub(crate) fn eval_rising<const K: usize>(coefficients: [&[DVec3]; K], t: f64) -> [DVec3; K] {
    let mut basis = [0.0; MAX_DEGREE + 1];
    let lowest = coefficients[0].len() - 1;
    bernstein_into(lowest, t, &mut basis);
    std::array::from_fn(|k| {
        if k > 0 {
            raise(lowest + k, t, &mut basis);
        }
        debug_assert_eq!(coefficients[k].len(), lowest + k + 1);
        coefficients[k].iter().zip(&basis).map(|(c, b)| *c * *b).sum()
    })
}

/// All `B_j^n(t)` as a fresh vector.
pub(crate) fn bernstein(n: usize, t: f64) -> Vec<f64> {
    let mut out = vec![0.0; n + 1];
    bernstein_into(n, t, &mut out);
    out
}

/// Value of a vector polynomial by de Casteljau's weights.
pub(crate) fn eval(coefficients: &[DVec3], t: f64) -> DVec3 {
    let mut basis = [0.0; MAX_DEGREE + 1];
    let n = coefficients.len() - 1;
    bernstein_into(n, t, &mut basis[..=n]);
    coefficients.iter().zip(&basis).map(|(c, b)| *c * *b).sum()
}

/// Derivative coefficients: `n (c_{j+1} − c_j)`.
pub(crate) fn derivative(coefficients: &[DVec3]) -> Vec<DVec3> {
    let n = (coefficients.len() - 1) as f64;
    coefficients.windows(2).map(|w| (w[1] - w[0]) * n).collect()
}

/// The same polynomial written in degree `m`.
pub(crate) fn elevate(coefficients: &[DVec3], m: usize) -> Vec<DVec3> {
    let n = coefficients.len() - 1;
    (0..=m)
        .map(|i| {
            let low = (i + n).saturating_sub(m);
            (low..=n.min(i))
                .map(|j| {
                    coefficients[j] * (binomial(n, j) * binomial(m - n, i - j) / binomial(m, i))
                })
                .sum()
        })
        .collect()
}

/// Product of a scalar Bernstein basis function `B_j^d` with a vector polynomial.
pub(crate) fn times_basis(d: usize, j: usize, coefficients: &[DVec3]) -> Vec<DVec3> {
    let q = coefficients.len() - 1;
    let mut out = vec![DVec3::ZERO; d + q + 1];
    for (i, c) in coefficients.iter().enumerate() {
        out[i + j] = *c * (binomial(d, j) * binomial(q, i) / binomial(d + q, i + j));
    }
    out
}

/// Cross product of two vector polynomials.
pub(crate) fn cross(a: &[DVec3], b: &[DVec3]) -> Vec<DVec3> {
    let (p, q) = (a.len() - 1, b.len() - 1);
    let mut out = vec![DVec3::ZERO; p + q + 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x.cross(*y) * (binomial(p, i) * binomial(q, j) / binomial(p + q, i + j));
        }
    }
    out
}

/// Quotient of a vector polynomial by `t − root`; the remainder (zero when `root` is a common
/// root of the three coordinates) is dropped.
///
/// Solves `c_k = (k/n)(1−root) q_{k−1} − (1−k/n) root q_k` from the end where the division is
/// by the larger of `root` and `1 − root`.
pub(crate) fn divide_by_root(coefficients: &[DVec3], root: f64) -> Vec<DVec3> {
    let n = coefficients.len() - 1;
    let nf = n as f64;
    let mut quotient = vec![DVec3::ZERO; n];
    if root > 0.5 {
        for k in 0..n {
            let previous = if k > 0 { quotient[k - 1] } else { DVec3::ZERO };
            let kf = k as f64 / nf;
            quotient[k] = (previous * (kf * (1.0 - root)) - coefficients[k]) / ((1.0 - kf) * root);
        }
    } else {
        for k in (1..=n).rev() {
            let next = if k < n { quotient[k] } else { DVec3::ZERO };
            let kf = k as f64 / nf;
            quotient[k - 1] = (coefficients[k] + next * ((1.0 - kf) * root)) / (kf * (1.0 - root));
        }
    }
    quotient
}

/// Gram matrix of the `k`-th derivatives of the Bernstein basis of degree `n` on `[0, 1]`.
pub(crate) fn gram(n: usize, k: usize) -> Matrix {
    let mut difference = Matrix::identity(n + 1);
    for step in 0..k {
        let m = n - step;
        let mut next = Matrix::zeros(m, n + 1);
        for i in 0..m {
            for j in 0..=n {
                next[(i, j)] = m as f64 * (difference[(i + 1, j)] - difference[(i, j)]);
            }
        }
        difference = next;
    }
    let m = n - k;
    let mut mass = Matrix::zeros(m + 1, m + 1);
    for i in 0..=m {
        for j in 0..=m {
            mass[(i, j)] =
                binomial(m, i) * binomial(m, j) / binomial(2 * m, i + j) / (2 * m + 1) as f64;
        }
    }
    difference.transpose_product(&mass.product(&difference))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<DVec3> {
        vec![
            DVec3::new(0.0, 1.0, 2.0),
            DVec3::new(1.0, -1.0, 0.5),
            DVec3::new(2.0, 0.5, -1.0),
            DVec3::new(3.0, 2.0, 1.0),
        ]
    }

    #[test]
    fn elevation_and_products_keep_the_values() {
        let c = sample();
        let other = vec![DVec3::X, DVec3::new(0.3, 0.2, -1.0), DVec3::Y];
        for t in [0.0, 0.2, 0.77, 1.0] {
            assert!((eval(&elevate(&c, 9), t) - eval(&c, t)).length() < 1e-14);
            let want = eval(&c, t).cross(eval(&other, t));
            assert!((eval(&cross(&c, &other), t) - want).length() < 1e-14);
            let want = eval(&c, t) * bernstein(4, t)[2];
            assert!((eval(&times_basis(4, 2, &c), t) - want).length() < 1e-14);
        }
    }

    #[test]
    fn division_undoes_multiplication_by_a_root() {
        let c = sample();
        for root in [0.0, 0.1, 0.5, 0.93, 1.0] {
            // (t − root) in degree one: −root, 1 − root.
            let product: Vec<DVec3> = times_basis(1, 0, &c)
                .iter()
                .zip(times_basis(1, 1, &c))
                .map(|(a, b)| *a * -root + b * (1.0 - root))
                .collect();
            for (q, w) in divide_by_root(&product, root).iter().zip(&c) {
                assert!((*q - *w).length() < 1e-12, "root {root}");
            }
        }
    }

    #[test]
    fn gram_matrix_integrates_second_derivatives() {
        // x(t) = t³ has x″ = 6t, so ∫ x″² = 12.
        let g = gram(3, 2);
        let x = [0.0, 0.0, 0.0, 1.0];
        let value: f64 = g.apply(&x).iter().zip(x).map(|(a, b)| a * b).sum();
        assert!((value - 12.0).abs() < 1e-13);
    }
}
