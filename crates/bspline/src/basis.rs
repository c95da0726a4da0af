//! Values and derivatives of the basis functions at one parameter.

use crate::knots::{Degree, KnotVector};
use geom_core::SurfaceJet;

/// Highest order of derivatives that is computed.
pub const MAX_DERIVATIVE: usize = SurfaceJet::ORDER;

/// The `degree + 1` basis functions that are not zero at a parameter, with derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BasisValues {
    /// The knot span the parameter lies in.
    pub span: usize,
    /// `values[k][r]` is the k-th derivative of basis function `r`, which belongs to control
    /// point [`KnotVector::control_index`]`(span, r)`.
    pub values: [[f64; Degree::MAX + 1]; MAX_DERIVATIVE + 1],
}

impl KnotVector {
    /// Basis functions and their derivatives up to `order` at `t` (clamped or wrapped into the
    /// domain; one-sided from the right at knots, from the left at the end of an open domain).
    ///
    /// Piegl and Tiller 1997, Algorithm A2.3.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`].
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?; // Bernstein polynomials
    /// let basis = knots.basis(0.5, 1);
    /// assert_eq!(basis.values[0][..3], [0.25, 0.5, 0.25]);
    /// assert_eq!(basis.values[1][..3], [-1.0, 0.0, 1.0]);
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    #[must_use]
    pub fn basis(&self, t: f64, order: usize) -> BasisValues {
        assert!(order <= MAX_DERIVATIVE, "derivatives of order {order} are not supported");
        let t = self.normalize(t);
        let span = self.span(t);
        basis_on_span(self.knots(), self.degree().get(), span, t, order)
    }

    /// As [`KnotVector::basis`], but on the polynomial piece of `span` whatever `t` is: the
    /// one-sided limit at the end of a span, or the piece continued beyond it.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`] or the span is empty or outside the domain.
    #[must_use]
    pub fn basis_on_span(&self, span: usize, t: f64, order: usize) -> BasisValues {
        assert!(order <= MAX_DERIVATIVE, "derivatives of order {order} are not supported");
        let (d, knots) = (self.degree().get(), self.knots());
        assert!(
            span >= d && span + d + 1 < knots.len() && knots[span] < knots[span + 1],
            "span {span} is empty or outside the domain"
        );
        basis_on_span(knots, d, span, t, order)
    }
}

fn basis_on_span(knots: &[f64], d: usize, span: usize, t: f64, order: usize) -> BasisValues {
    const N: usize = Degree::MAX + 1;
    // `triangle[j][r]`, r <= j: basis functions of degree j; below the diagonal, the knot
    // differences the derivatives divide by.
    let mut triangle = [[0.0; N]; N];
    let mut left = [0.0; N];
    let mut right = [0.0; N];
    triangle[0][0] = 1.0;
    for j in 1..=d {
        left[j] = t - knots[span + 1 - j];
        right[j] = knots[span + j] - t;
        let mut saved = 0.0;
        for r in 0..j {
            let difference = right[r + 1] + left[j - r];
            triangle[j][r] = difference;
            let term = triangle[r][j - 1] / difference;
            triangle[r][j] = saved + right[r + 1] * term;
            saved = left[j - r] * term;
        }
        triangle[j][j] = saved;
    }
    let mut values = [[0.0; N]; MAX_DERIVATIVE + 1];
    for r in 0..=d {
        values[0][r] = triangle[r][d];
    }
    let order = order.min(d);
    for r in 0..=d {
        let mut coefficients = [[0.0; MAX_DERIVATIVE + 1]; 2];
        coefficients[0][0] = 1.0;
        let (mut now, mut next) = (0, 1);
        for k in 1..=order {
            let p = d - k;
            let mut sum = 0.0;
            if r >= k {
                coefficients[next][0] = coefficients[now][0] / triangle[p + 1][r - k];
                sum = coefficients[next][0] * triangle[r - k][p];
            }
            let first = if r + 1 >= k { 1 } else { k - r };
            let last = if r <= p + 1 { k - 1 } else { d - r };
            for j in first..=last {
                coefficients[next][j] =
                    (coefficients[now][j] - coefficients[now][j - 1]) / triangle[p + 1][r + j - k];
                sum += coefficients[next][j] * triangle[r + j - k][p];
            }
            if r <= p {
                coefficients[next][k] = -coefficients[now][k - 1] / triangle[p + 1][r];
                sum += coefficients[next][k] * triangle[r][p];
            }
            values[k][r] = sum;
            (now, next) = (next, now);
        }
    }
    let mut factor = d as f64;
    for k in 1..=order {
        for value in &mut values[k][..=d] {
            *value *= factor;
        }
        factor *= (d - k) as f64;
    }
    BasisValues { span, values }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn vectors() -> Vec<KnotVector> {
        let mut result = Vec::new();
        for d in [1, 2, 3, 4, 5, 9, 15] {
            let degree = Degree::new(d).unwrap();
            result.push(KnotVector::clamped_uniform(degree, d + 4).unwrap());
            result.push(KnotVector::periodic_uniform(degree, d + 3).unwrap());
            let uneven: Vec<f64> =
                (0..2 * d + 5).map(|i| (f64::from(i as u32)).powf(1.3)).collect();
            result.push(KnotVector::new(degree, uneven).unwrap());
        }
        result
    }

    #[test]
    fn values_sum_to_one_and_derivatives_to_zero() {
        for knots in vectors() {
            let (a, b) = knots.domain();
            for i in 0..=20 {
                let basis = knots.basis(a + (b - a) * f64::from(i) / 20.0, MAX_DERIVATIVE);
                let d = knots.degree().get();
                assert_close(basis.values[0].iter().sum(), 1.0, 1e-14);
                for k in 1..=MAX_DERIVATIVE {
                    let size: f64 = basis.values[k].iter().map(|x| x.abs()).sum();
                    assert_close(basis.values[k].iter().sum::<f64>() / size.max(1.0), 0.0, 1e-13);
                    assert!(k <= d || size == 0.0);
                }
            }
        }
    }

    #[test]
    fn derivatives_follow_from_the_recursion_of_lower_degree() {
        // N'_{i,d} = d (N_{i,d-1}/(t_{i+d} - t_i) - N_{i+1,d-1}/(t_{i+d+1} - t_{i+1})), twice.
        for knots in vectors() {
            let d = knots.degree().get();
            let (a, b) = knots.domain();
            let t = a + 0.37 * (b - a);
            let full = |deg: usize, i: usize| cox_de_boor(knots.knots(), deg, i, t);
            let got = knots.basis(t, 1);
            for r in 0..=d {
                let i = got.span - d + r;
                assert_close(got.values[0][r], full(d, i), 1e-13);
                let ratio = |i: usize| {
                    let width = knots.knots()[i + d] - knots.knots()[i];
                    if width > 0.0 { full(d - 1, i) / width } else { 0.0 }
                };
                assert_close(got.values[1][r], d as f64 * (ratio(i) - ratio(i + 1)), 1e-12);
            }
        }
    }

    /// The defining recursion, slow and plain.
    fn cox_de_boor(knots: &[f64], d: usize, i: usize, t: f64) -> f64 {
        if d == 0 {
            return f64::from(u8::from(knots[i] <= t && t < knots[i + 1]));
        }
        let mut sum = 0.0;
        if knots[i + d] > knots[i] {
            sum += (t - knots[i]) / (knots[i + d] - knots[i]) * cox_de_boor(knots, d - 1, i, t);
        }
        if knots[i + d + 1] > knots[i + 1] {
            sum += (knots[i + d + 1] - t) / (knots[i + d + 1] - knots[i + 1])
                * cox_de_boor(knots, d - 1, i + 1, t);
        }
        sum
    }

    #[test]
    fn derivatives_of_order_four_match_differences_of_order_three() {
        for knots in vectors() {
            let (a, b) = knots.domain();
            let (t, h) = (a + 0.41 * (b - a), 1e-5 * (b - a));
            let span = knots.span(t);
            let at = |t| knots.basis_on_span(span, t, MAX_DERIVATIVE).values;
            let (lower, upper, here) = (at(t - h), at(t + h), at(t));
            for k in 1..=MAX_DERIVATIVE {
                let size = here[k].iter().fold(1.0_f64, |s, x| s.max(x.abs()));
                for r in 0..=knots.degree().get() {
                    let difference = (upper[k - 1][r] - lower[k - 1][r]) / (2.0 * h);
                    assert_close(here[k][r] / size, difference / size, 1e-6);
                }
            }
        }
    }
}
