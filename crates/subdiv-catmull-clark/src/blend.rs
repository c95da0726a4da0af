//! Weights that fade an extraordinary vertex's own surface into the subdivision surface.

use crate::jet::{Jet, separable_jet};
use numerics::Series;

/// How the surface is repaired around extraordinary vertices, where Catmull-Clark surfaces have
/// unbounded or discontinuous curvature.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Blend {
    /// A polynomial of degree five in the characteristic coordinates, fitted to the two-ring and
    /// faded out over the whole ring by a C³ step; the surface is C² and can have any curvature.
    #[default]
    Smooth,
    /// The flat spot of Joshi 2008, Eq. 5.1: the tangent plane, faded out at half the edges. The
    /// curvature vanishes at the extraordinary vertex.
    Flat,
    /// The Catmull-Clark surface as it is.
    None,
}

/// Value and three derivatives of the C³ step `1 − (35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷)`, from 1 at
/// `s = 0` to 0 at `s = 1`.
///
/// # Example
/// ```
/// use subdiv_catmull_clark::septic_step;
/// assert_eq!(septic_step(0.0), [1.0, 0.0, 0.0, 0.0]);
/// assert_eq!((septic_step(0.5)[0], septic_step(1.0)), (0.5, [0.0; 4]));
/// ```
#[must_use]
pub fn septic_step(s: f64) -> [f64; 4] {
    if s >= 1.0 {
        return [0.0; 4];
    }
    let s2 = s * s;
    let s3 = s2 * s;
    [
        1.0 - s3 * s * (35.0 - 84.0 * s + 70.0 * s2 - 20.0 * s3),
        -140.0 * s3 * (1.0 - s).powi(3),
        -420.0 * s2 * (1.0 - s).powi(2) * (1.0 - 2.0 * s),
        -840.0 * s * (1.0 - s) * (1.0 - 5.0 * s + 5.0 * s2),
    ]
}

/// Value and three derivatives of the C^∞ step of Joshi 2008, Eq. 5.1, from 1 at `t = 0` to 0 at
/// `t = 1/2`.
///
/// With `s = 2t`, `A = 2 e^(−1/s)/(s − 1)` and `B = −2 e^(−1/(1−s))/s` the printed quotient is
/// `1 / (1 + e^(B−A))`; it is evaluated in this form because `e^A / (e^A + e^B)` is ∞/∞ in floating
/// point near the ends.
#[must_use]
pub fn flat_step(t: f64) -> [f64; 4] {
    let s = 2.0 * t;
    // Nearer to the ends the derivatives are below e^(−200) times a polynomial.
    if s < 5e-3 {
        return [1.0, 0.0, 0.0, 0.0];
    }
    if s > 1.0 - 5e-3 {
        return [0.0; 4];
    }
    let one = Series::constant(1.0);
    let x = Series([s, 2.0, 0.0, 0.0]);
    let rest = one - x;
    let a = (-x.recip()).exp() * rest.recip() * -2.0;
    let b = (-rest.recip()).exp() * x.recip() * -2.0;
    let d = b - a;
    // 1/(1 + e^d) = 1 − 1/(1 + e^(−d)): take the exponential that cannot overflow.
    let value =
        if d.0[0] > 0.0 { one - (one + (-d).exp()).recip() } else { (one + d.exp()).recip() };
    [value.0[0], value.0[1], 2.0 * value.0[2], 6.0 * value.0[3]]
}

/// Jet of the product weight `step(u) step(v)`.
pub(crate) fn weight_jet(step: impl Fn(f64) -> [f64; 4], u: f64, v: f64) -> Jet {
    separable_jet(&step(u), &step(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_derivatives(step: impl Fn(f64) -> [f64; 4], at: f64, scale: f64) {
        let h = 1e-5;
        for d in 0..3 {
            let central = (step(at + h)[d] - step(at - h)[d]) / (2.0 * h);
            assert!(
                (central - step(at)[d + 1]).abs() < 1e-6 * scale,
                "derivative {} at {at}: {central} against {}",
                d + 1,
                step(at)[d + 1]
            );
        }
    }

    #[test]
    fn steps_have_the_stated_derivatives() {
        for k in 1..20 {
            check_derivatives(septic_step, 0.05 * f64::from(k), 50.0);
            check_derivatives(flat_step, 0.025 * f64::from(k), 1330.0 * 50.0);
        }
    }

    #[test]
    fn flat_step_is_symmetric_and_as_steep_as_published() {
        let mut largest = [0.0_f64; 4];
        for k in 1..2000 {
            let t = 0.5 * f64::from(k) / 2000.0;
            let (a, b) = (flat_step(t), flat_step(0.5 - t));
            assert!((a[0] + b[0] - 1.0).abs() < 1e-14);
            for d in 0..4 {
                largest[d] = largest[d].max(a[d].abs());
            }
        }
        assert!((largest[1] - 3.25).abs() < 0.01, "{largest:?}");
        assert!((largest[2] - 40.6).abs() < 0.1, "{largest:?}");
        assert!((largest[3] - 1340.0).abs() < 10.0, "{largest:?}");
    }

    #[test]
    fn flat_step_is_finite_up_to_the_ends() {
        for t in [0.0, 1e-300, 1e-4, 2.5e-3, 0.4975, 0.499_999, 0.5, 0.7] {
            assert!(flat_step(t).iter().all(|x| x.is_finite()), "{t}");
        }
    }
}
