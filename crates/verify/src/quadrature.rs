//! Gauss-Legendre quadrature.

/// Nodes on `[0, 1]` and weights of the rule with `n` points, exact to degree `2n − 1`.
///
/// The nodes are the roots of the Legendre polynomial, found between those of the one before by
/// bisection: the roots of successive ones interlace.
#[must_use]
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let mut roots: Vec<f64> = Vec::new();
    for degree in 1..=n {
        let mut ends = vec![-1.0];
        ends.extend(&roots);
        ends.push(1.0);
        roots = ends.windows(2).map(|pair| root(degree, pair[0], pair[1])).collect();
    }
    let node = |x: &f64| {
        let (_, slope) = legendre(n, *x);
        (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    roots.iter().map(node).collect()
}

fn root(degree: usize, mut low: f64, mut high: f64) -> f64 {
    let rises = legendre(degree, high).0 > 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (legendre(degree, middle).0 > 0.0) == rises { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Value and slope of the Legendre polynomial inside `(-1, 1)`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    (now, n as f64 * (x * now - before) / (x * x - 1.0))
}

/// The rule with `n` points on every one of the intervals between `breaks`.
#[must_use]
pub fn piecewise(n: usize, breaks: &[f64]) -> Vec<(f64, f64)> {
    let rule = gauss(n);
    let on = |pair: &[f64]| {
        let (start, length) = (pair[0], pair[1] - pair[0]);
        rule.iter().map(|(x, w)| (start + length * x, length * w)).collect::<Vec<_>>()
    };
    breaks.windows(2).flat_map(on).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_exact() {
        for n in [1, 2, 5, 12] {
            for power in 0..2 * n as i32 {
                let sum: f64 = gauss(n).iter().map(|(x, w)| w * x.powi(power)).sum();
                assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-14, "{n} {power}");
            }
        }
        let sum: f64 = piecewise(3, &[1.0, 2.0, 4.0]).iter().map(|(x, w)| w * x * x).sum();
        assert!((sum - 21.0).abs() < 1e-13);
    }
}
