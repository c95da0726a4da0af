//! Quadrature rules.

/// Nodes and weights of the `n`-point Gauss-Legendre rule on `[0, 1]`, exact for polynomials of degree
/// `2 n − 1`.
///
/// # Example
/// ```
/// let rule = numerics::gauss_legendre(3);
/// let fifth: f64 = rule.iter().map(|(x, weight)| weight * x.powi(5)).sum();
/// numerics::assert_close(fifth, 1.0 / 6.0, 1e-15);
/// ```
#[must_use]
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule = Vec::with_capacity(n);
    for k in 0..n {
        // Newton's iteration on the Legendre polynomial from the usual first guess.
        let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (mut before, mut now) = (1.0, x);
            for i in 2..=n {
                let i = i as f64;
                (before, now) = (now, ((2.0 * i - 1.0) * x * now - (i - 1.0) * before) / i);
            }
            slope = n as f64 * (x * now - before) / (x * x - 1.0);
            let step = now / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        rule.push((0.5 - 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope)));
    }
    rule
}
