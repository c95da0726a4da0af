//! Derivatives of dual numbers against closed forms.

use numerics::{Dual, Number, Real, Series, Taylor};
use proptest::prelude::*;

fn close(got: f64, want: f64, bound: f64) -> bool {
    (got - want).abs() <= bound * want.abs().max(1.0)
}

type Function = fn(Dual<1>) -> Dual<1>;

/// Value and slope of a function of one variable.
fn slope(f: impl Fn(Dual<1>) -> Dual<1>, x: f64) -> (f64, f64) {
    let y = f(Dual::variable(x, 0));
    (y.value, y.partials[0])
}

/// A formula with every operation, as a user writes it: once.
fn formula<T: Number>(x: &[T; 4]) -> T {
    let [a, b, c, d] = *x;
    let mut sum = (a * b).sin() * 2.0 + (c - d).cos() / 3.0 - (b * 0.1).exp();
    sum += (a * a + 1.0).ln() * (b * b + c * c + d * d + 1.0).sqrt();
    sum -= (a / (d * d + 2.0)).abs() + c.powi(3) + d.atan2(c * c + 1.0) + (b - 4.0).recip();
    -sum.fma(a, b) + (a * a + 0.5).powf(c) + b.atan()
}

proptest! {
    #[test]
    fn elementary_functions_have_their_textbook_slopes(x in 0.1..3.0_f64) {
        let expected: [(Function, f64, f64); 9] = [
            (Number::sin, x.sin(), x.cos()),
            (Number::cos, x.cos(), -x.sin()),
            (Number::exp, x.exp(), x.exp()),
            (Number::ln, x.ln(), 1.0 / x),
            (Number::atan, x.atan(), 1.0 / (1.0 + x * x)),
            (Real::sqrt, x.sqrt(), 0.5 / x.sqrt()),
            (Real::recip, 1.0 / x, -1.0 / (x * x)),
            (|x| (-x).abs(), x, 1.0),
            (|x| x.powi(-3), x.powi(-3), -3.0 * x.powi(-4)),
        ];
        for (k, (f, value, derivative)) in expected.into_iter().enumerate() {
            let (v, d) = slope(f, x);
            prop_assert!(close(v, value, 1e-15), "function {k}: {v} against {value}");
            prop_assert!(close(d, derivative, 1e-14), "function {k}: {d} against {derivative}");
        }
    }

    #[test]
    fn powers_have_slopes_by_base_and_exponent(x in 0.1..3.0_f64, e in -3.0..3.0_f64) {
        let [base, exponent] = Dual::variables([x, e]);
        let y = base.powf(exponent);
        prop_assert_eq!(y.value, x.powf(e));
        prop_assert!(close(y.partials[0], e * x.powf(e - 1.0), 1e-14));
        prop_assert!(close(y.partials[1], x.powf(e) * x.ln(), 1e-14));
    }

    #[test]
    fn the_angle_of_a_vector_turns_with_it(length in 0.1..10.0_f64, angle in -3.1..3.1_f64) {
        let [x, y] = Dual::variables([length * angle.cos(), length * angle.sin()]);
        let got = y.atan2(x);
        prop_assert!(close(got.value, angle, 1e-14));
        prop_assert!(close(got.partials[0], -angle.sin() / length, 1e-13));
        prop_assert!(close(got.partials[1], angle.cos() / length, 1e-13));
    }

    #[test]
    fn quotients_and_products_obey_leibniz(a in -3.0..3.0_f64, b in 0.2..3.0_f64, c in -3.0..3.0_f64) {
        let [x, y, z, _] = Dual::variables([a, b, c, 0.0]);
        let f = x * z / y + 2.0 / y - (1.0 - x) * z;
        prop_assert!(close(f.value, a * c / b + 2.0 / b - (1.0 - a) * c, 1e-14));
        prop_assert!(close(f.partials[0], c / b + c, 1e-14));
        prop_assert!(close(f.partials[1], -(a * c + 2.0) / (b * b), 1e-13));
        prop_assert!(close(f.partials[2], a / b - 1.0 + a, 1e-14));
        prop_assert_eq!(f.partials[3], 0.0);
    }

    #[test]
    fn values_do_not_depend_on_the_derivatives_carried(x in proptest::array::uniform4(0.2..2.0_f64)) {
        let plain = formula(&x);
        let four = formula(&Dual::variables(x));
        let one = formula(&x.map(Dual::<1>::from));
        let eight = formula(&x.map(Dual::<8>::from));
        // Division and powers of the same numbers by the same operations: the same bits.
        prop_assert_eq!([four.value, one.value, eight.value].map(f64::to_bits), [plain.to_bits(); 3]);
        prop_assert_eq!(eight.partials, [0.0; 8]);
    }

    #[test]
    fn partials_together_give_the_derivative_along_a_direction(
        x in proptest::array::uniform4(0.2..2.0_f64),
        direction in proptest::array::uniform4(-1.0..1.0_f64),
    ) {
        let all = formula(&Dual::variables(x));
        let along = formula(&std::array::from_fn(|k| Dual { value: x[k], partials: [direction[k]] }));
        let sum: f64 = all.partials.iter().zip(&direction).map(|(p, d)| p * d).sum();
        prop_assert!(close(along.partials[0], sum, 1e-12));
    }

    #[test]
    fn partials_are_limits_of_differences(x in proptest::array::uniform4(0.2..2.0_f64)) {
        let exact = formula(&Dual::variables(x)).partials;
        for k in 0..4 {
            let shifted = |h: f64| {
                let mut y = x;
                y[k] += h;
                formula(&y)
            };
            // Fourth-order central differences.
            let h = 1e-3;
            let central = (8.0 * (shifted(h) - shifted(-h)) - (shifted(2.0 * h) - shifted(-2.0 * h))) / (12.0 * h);
            prop_assert!(close(central, exact[k], 1e-8), "{central} against {}", exact[k]);
        }
    }

    #[test]
    fn homogeneous_functions_obey_euler(x in proptest::array::uniform8(-2.0..2.0_f64), degree in 1..5_i32) {
        let length = Dual::variables(x).into_iter().map(|c| c * c).sum::<Dual<8>>().sqrt();
        let f = length.powi(degree);
        let sum: f64 = x.iter().zip(&f.partials).map(|(x, p)| x * p).sum();
        prop_assert!(close(sum, f64::from(degree) * f.value, 1e-13));
    }

    #[test]
    fn duals_of_duals_are_second_derivatives(x in 0.2..2.0_f64) {
        // f = x³ ln x: f″ = 6 x ln x + 5 x.
        let inner = Dual { value: Dual { value: x, partials: [1.0] }, partials: [Dual::<1>::from(1.0)] };
        let f: Dual<1, Dual<1>> = inner.powi(3) * inner.ln();
        prop_assert!(close(f.partials[0].partials[0], 6.0 * x * x.ln() + 5.0 * x, 1e-13));
        prop_assert!(close(f.partials[0].value, f.value.partials[0], 1e-15));
    }

    #[test]
    fn taylor_expansions_agree_with_duals_of_duals(x in 0.3..2.0_f64, y in -2.0..2.0_f64) {
        let [p, q] = Taylor::variables([x, y]);
        let f = (p * p + q * q).sqrt() / (Taylor::constant(3.0) - q) + q * p;
        let seed = |at: f64, k: usize| Dual {
            value: Dual::<2>::variable(at, k),
            partials: std::array::from_fn(|i| Dual::<2>::from(if i == k { 1.0 } else { 0.0 })),
        };
        let (p, q): (Dual<2, Dual<2>>, _) = (seed(x, 0), seed(y, 1));
        let g = (p * p + q * q).sqrt() / (-q + 3.0) + q * p;
        prop_assert!(close(f.value, g.value(), 1e-15));
        for i in 0..2 {
            prop_assert!(close(f.first[i], g.value.partials[i], 1e-14));
            for j in 0..2 {
                prop_assert!(close(f.second[i][j], g.partials[i].partials[j], 1e-13));
            }
        }
    }

    #[test]
    fn series_of_a_rational_exponential_match_duals(t in 0.2..2.0_f64) {
        // f = exp(−1/x) / (3 − x) at x = t + s.
        let x = Series([t, 1.0, 0.0]);
        let f = (-x.recip()).exp() * (Series::constant(3.0) - x).recip();
        let x = Dual { value: Dual::<1>::variable(t, 0), partials: [Dual::<1>::from(1.0)] };
        let g: Dual<1, Dual<1>> = (-x.recip()).exp() / (-x + 3.0);
        prop_assert!(close(f.0[0], g.value(), 1e-14));
        prop_assert!(close(f.0[1], g.value.partials[0], 1e-13));
        prop_assert!(close(2.0 * f.0[2], g.partials[0].partials[0], 1e-12));
    }
}
