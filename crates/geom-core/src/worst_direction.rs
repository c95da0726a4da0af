//! How uncertain the curvatures of a fitted piece are in the worst direction, which does not depend on
//! the axes it was fitted along.

use std::f64::consts::TAU;

/// Directions tried before the worst is sought from the best of them. In twice the angle the product
/// below has at most four waves.
const TRIED: usize = 16;
/// Newton steps to the top of a wave.
const STEPS: usize = 8;

/// Products of pairs of the three terms of a quadratic form in two variables.
pub(crate) type Pairs = [[f64; 3]; 3];

/// Adds the products of a triple to a sum of such.
pub(crate) fn add_pairs(sum: &mut Pairs, of: [f64; 3]) {
    for (row, a) in sum.iter_mut().zip(of) {
        row.iter_mut().zip(of).for_each(|(s, b)| *s += a * b);
    }
}

/// A function of the angle `θ` with waves `cos 2θ`, `sin 2θ`, `cos 4θ` and `sin 4θ`.
#[derive(Clone, Copy)]
struct Wave {
    mean: f64,
    once: [f64; 2],
    twice: [f64; 2],
}

impl Wave {
    const ONE: Self = Self { mean: 1.0, once: [0.0; 2], twice: [0.0; 2] };

    /// `aᵀ S a` for `a = (cos²θ, k sin 2θ, sin²θ)`.
    fn of(s: &Pairs, k: f64) -> Self {
        let (ends, cross) = (s[0][0] + s[2][2], k * k * s[1][1]);
        Self {
            mean: 0.375 * ends + 0.25 * s[0][2] + 0.5 * cross,
            once: [0.5 * (s[0][0] - s[2][2]), k * (s[0][1] + s[1][2])],
            twice: [0.125 * ends - 0.25 * s[0][2] - 0.5 * cross, 0.5 * k * (s[0][1] - s[1][2])],
        }
    }

    /// Value and two derivatives by `2θ`.
    fn at(&self, double_angle: f64) -> [f64; 3] {
        let (s1, c1) = double_angle.sin_cos();
        let (s2, c2) = (2.0 * double_angle).sin_cos();
        let ([a, b], [c, d]) = (self.once, self.twice);
        [
            self.mean + a * c1 + b * s1 + c * c2 + d * s2,
            -a * s1 + b * c1 + 2.0 * (d * c2 - c * s2),
            -a * c1 - b * s1 - 4.0 * (c * c2 + d * s2),
        ]
    }
}

/// Standard deviation of the curvature in the direction where it is largest, for heights of standard
/// deviation 1; `covariance` is that of the coefficients `c, d, e` of `(c x² + 2 d x y + e y²) / 2`.
pub(crate) fn deviation(covariance: &Pairs) -> f64 {
    largest(&Wave::of(covariance, 1.0), &Wave::ONE).sqrt()
}

/// The largest factor by which the term of a direction magnifies an error of the heights, times the
/// length of its column of the matrix; `moments` are the products of the columns `x²/2, x y, y²/2`.
pub(crate) fn gain(covariance: &Pairs, moments: &Pairs) -> f64 {
    // A direction's term is (x cos θ + y sin θ)² / 2.
    largest(&Wave::of(covariance, 1.0), &Wave::of(moments, 0.5)).sqrt()
}

/// The largest product of two waves.
fn largest(a: &Wave, b: &Wave) -> f64 {
    let product = |at: f64| {
        let ([a, a1, a2], [b, b1, b2]) = (a.at(at), b.at(at));
        [a * b, a1 * b + a * b1, a2 * b + 2.0 * a1 * b1 + a * b2]
    };
    let tried = (0..TRIED).map(|k| TAU * k as f64 / TRIED as f64);
    let mut at = tried.fold((0.0, f64::NEG_INFINITY), |best, at| {
        let value = product(at)[0];
        if value > best.1 { (at, value) } else { best }
    });
    for _ in 0..STEPS {
        let [_, slope, bend] = product(at.0);
        if !(bend < 0.0) {
            break;
        }
        let next = at.0 - slope / bend;
        let value = product(next)[0];
        if !(value > at.1) {
            break;
        }
        at = (next, value);
    }
    at.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    /// Pairs of the triples of some points, seen along axes that are turned.
    fn moments(turn: f64) -> Pairs {
        let mut sum = Pairs::default();
        for k in 0..12 {
            let (angle, far) = (0.9 * f64::from(k) + turn, 1.0 + 0.2 * f64::from(k % 5));
            let (x, y) = (far * angle.cos(), far * angle.sin());
            add_pairs(&mut sum, [0.5 * x * x, x * y, 0.5 * y * y]);
        }
        sum
    }

    #[test]
    fn axes_do_not_matter() {
        let want = largest(&Wave::of(&moments(0.0), 0.5), &Wave::ONE);
        for turn in [0.1, 0.7, 1.9] {
            let got = largest(&Wave::of(&moments(turn), 0.5), &Wave::ONE);
            assert_close(got, want, 1e-13 * want);
        }
    }

    #[test]
    fn it_is_the_largest_over_all_directions() {
        let (a, b) = (Wave::of(&moments(0.3), 1.0), Wave::of(&moments(1.1), 0.5));
        let most = (0..100_000)
            .map(|k| f64::from(k) * 1e-5 * TAU)
            .map(|at| a.at(at)[0] * b.at(at)[0])
            .fold(0.0, f64::max);
        let got = largest(&a, &b);
        assert!(got >= most && got <= most * (1.0 + 1e-8), "{got} and {most}");
    }

    #[test]
    fn a_wave_is_its_quadratic_form() {
        let pairs = [[2.0, 0.3, -0.4], [0.3, 1.5, 0.2], [-0.4, 0.2, 0.9]];
        let angle = 0.4_f64;
        let (s, c) = angle.sin_cos();
        let a = [c * c, 2.0 * s * c, s * s];
        let mut want = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                want += a[i] * pairs[i][j] * a[j];
            }
        }
        assert_close(Wave::of(&pairs, 1.0).at(2.0 * angle)[0], want, 1e-14);
    }
}
