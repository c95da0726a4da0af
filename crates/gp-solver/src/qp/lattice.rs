//! Small dense quadratic programs of whole numbers.

use numerics::solve_semidefinite;

/// Share of the largest diagonal entry below which a direction counts as flat.
const FLAT: f64 = 1e-11;
/// A move must lower the energy by this share of the largest diagonal entry.
const GAIN: f64 = 1e-9;
/// Weight of a violated row against the largest diagonal entry.
const PENALTY: f64 = 1e3;
/// Moves at most.
const MOST_MOVES: usize = 5_000;

/// Minimises `½ kᵀS k + gᵀk` over whole numbers `k`, with rows `c·k ≥ r`; near enough for hundreds
/// of unknowns.
///
/// Rounded one after the other, each to the nearest with the later ones still real (Babai 1986);
/// then single numbers and pairs go up or down by one as long as that lowers the energy, violated
/// rows weighing a thousandfold.
///
/// # Example
/// ```
/// use gp_solver::LatticeQp;
/// // (k₀ − 0.6)² + (k₀ + k₁ − 1.4)²
/// let mut qp = LatticeQp::new(vec![4.0, 2.0, 2.0, 2.0], vec![-4.0, -2.8]);
/// assert_eq!(qp.minimize(), [1.0, 0.0]);
/// qp.at_least(vec![0.0, 1.0], 1.0);
/// assert_eq!(qp.minimize()[1], 1.0);
/// ```
#[derive(Clone, Debug)]
pub struct LatticeQp {
    n: usize,
    matrix: Vec<f64>,
    linear: Vec<f64>,
    rows: Vec<(Vec<f64>, f64)>,
}

impl LatticeQp {
    /// A program without rows; `matrix` is row-major, symmetric and positive semidefinite.
    ///
    /// # Panics
    /// If the matrix is not as large as `linear` is long.
    #[must_use]
    pub fn new(matrix: Vec<f64>, linear: Vec<f64>) -> Self {
        let n = linear.len();
        assert_eq!(matrix.len(), n * n, "a square matrix");
        Self { n, matrix, linear, rows: Vec::new() }
    }

    /// Adds the row `coefficients · k ≥ bound`.
    ///
    /// # Panics
    /// If there is not one coefficient per unknown.
    pub fn at_least(&mut self, coefficients: Vec<f64>, bound: f64) {
        assert_eq!(coefficients.len(), self.n, "one coefficient per unknown");
        self.rows.push((coefficients, bound));
    }

    /// The minimiser over real numbers, without the rows; flat directions stay at zero.
    #[must_use]
    pub fn relaxed(&self) -> Vec<f64> {
        let mut k: Vec<f64> = self.linear.iter().map(|g| -g).collect();
        let mut factor: Vec<Vec<f64>> =
            self.matrix.chunks(self.n.max(1)).map(<[f64]>::to_vec).collect();
        numerics::factor_semidefinite(&mut factor, FLAT);
        solve_semidefinite(&factor, &mut k);
        k
    }

    /// Half the quadratic form plus the linear one at `k`, rows aside.
    #[must_use]
    pub fn energy(&self, k: &[f64]) -> f64 {
        let image = |i: usize| -> f64 {
            self.matrix[i * self.n..(i + 1) * self.n].iter().zip(k).map(|(s, k)| s * k).sum()
        };
        (0..self.n).map(|i| k[i] * (0.5 * image(i) + self.linear[i])).sum()
    }

    /// Largest amount by which `k` violates a row.
    #[must_use]
    pub fn violation(&self, k: &[f64]) -> f64 {
        let missing = |(c, r): &(Vec<f64>, f64)| r - dot(c, k);
        self.rows.iter().map(missing).fold(0.0, f64::max)
    }

    /// Whole numbers of low energy.
    #[must_use]
    pub fn minimize(&self) -> Vec<f64> {
        self.improved(self.rounded())
    }

    /// Rounded one after the other, the stiffest first.
    fn rounded(&self) -> Vec<f64> {
        let n = self.n;
        let mut order: Vec<usize> = (0..n).collect();
        let stiffness = |i: usize| self.matrix[i * n + i];
        // Back substitution ends with the first, so the stiffest comes last.
        order.sort_by(|&a, &b| stiffness(a).total_cmp(&stiffness(b)).then(b.cmp(&a)));
        let entry = |i: usize, j: usize| self.matrix[order[i] * n + order[j]];
        let mut factor: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
        numerics::factor_semidefinite(&mut factor, FLAT);
        let mut real: Vec<f64> = order.iter().map(|&i| -self.linear[i]).collect();
        solve_semidefinite(&factor, &mut real);
        let mut whole = vec![0.0; n];
        for i in (0..n).rev() {
            let pivot = factor[i][i];
            let pull: f64 = (i + 1..n).map(|j| factor[j][i] * (whole[j] - real[j])).sum();
            let aim = if pivot > 0.0 { real[i] - pull / pivot } else { 0.0 };
            whole[i] = aim.round();
        }
        let mut k = vec![0.0; n];
        order.iter().zip(whole).for_each(|(&i, w)| k[i] = w);
        k
    }

    /// Steps of one, single or in pairs, as long as they gain.
    fn improved(&self, mut k: Vec<f64>) -> Vec<f64> {
        let n = self.n;
        let s = |i: usize, j: usize| self.matrix[i * n + j];
        let largest = (0..n).map(|i| s(i, i)).fold(f64::MIN_POSITIVE, f64::max);
        let mut slope: Vec<f64> =
            (0..n).map(|i| dot(&self.matrix[i * n..(i + 1) * n], &k) + self.linear[i]).collect();
        let mut slack: Vec<f64> = self.rows.iter().map(|(c, r)| r - dot(c, &k)).collect();
        let penalty = PENALTY * largest;
        for _ in 0..MOST_MOVES {
            let missing: f64 = slack.iter().map(|v| v.max(0.0)).sum();
            let rows = |moves: &[(usize, f64)]| -> f64 {
                let change = |c: &[f64]| moves.iter().map(|&(i, t)| t * c[i]).sum::<f64>();
                let left = self.rows.iter().zip(&slack);
                let left: f64 = left.map(|((c, _), v)| (v - change(c)).max(0.0)).sum();
                penalty * (left - missing)
            };
            let mut best = (-GAIN * largest, (0, 0.0), None);
            for i in 0..n {
                for t in [1.0, -1.0] {
                    let single = t * slope[i] + 0.5 * s(i, i);
                    let change = single + rows(&[(i, t)]);
                    if change < best.0 {
                        best = (change, (i, t), None);
                    }
                    for j in 0..i {
                        for u in [1.0, -1.0] {
                            let pair = single + u * slope[j] + 0.5 * s(j, j) + t * u * s(i, j);
                            // Without rows there is nothing to add to it.
                            if !self.rows.is_empty() || pair < best.0 {
                                let change = pair + rows(&[(i, t), (j, u)]);
                                if change < best.0 {
                                    best = (change, (i, t), Some((j, u)));
                                }
                            }
                        }
                    }
                }
            }
            if best.1.1 == 0.0 {
                break;
            }
            for (i, t) in [Some(best.1), best.2].into_iter().flatten() {
                k[i] += t;
                for j in 0..n {
                    slope[j] += t * s(j, i);
                }
                for (v, (c, _)) in slack.iter_mut().zip(&self.rows) {
                    *v -= t * c[i];
                }
            }
        }
        k
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All whole numbers of a box.
    fn best_of_box(qp: &LatticeQp, reach: i32) -> f64 {
        let width = (2 * reach + 1) as usize;
        let point = |at: usize| -> Vec<f64> {
            let digit = |i: usize| (at / width.pow(i as u32) % width) as f64 - f64::from(reach);
            (0..qp.n).map(digit).collect()
        };
        let allowed = (0..width.pow(qp.n as u32)).map(point).filter(|k| qp.violation(k) < 1e-9);
        allowed.map(|k| qp.energy(&k)).fold(f64::INFINITY, f64::min)
    }

    fn random(seed: u64) -> LatticeQp {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let n = 4;
        let rows: Vec<f64> = (0..n * (n + 2)).map(|_| next()).collect();
        let gram = |i: usize, j: usize| -> f64 {
            (0..n + 2).map(|r| rows[r * n + i] * rows[r * n + j]).sum()
        };
        let matrix = (0..n * n).map(|at| gram(at / n, at % n)).collect();
        LatticeQp::new(matrix, (0..n).map(|_| 2.0 * next()).collect())
    }

    #[test]
    fn the_found_point_is_the_best_of_a_box_or_close_to_it() {
        let mut exact = 0;
        for seed in 1..=40 {
            let mut qp = random(seed);
            if seed % 2 == 0 {
                qp.at_least(vec![1.0, -1.0, 0.0, 1.0], 2.0);
            }
            let k = qp.minimize();
            assert!(k.iter().all(|x| x.fract() == 0.0) && qp.violation(&k) < 1e-9);
            let (got, best) = (qp.energy(&k), best_of_box(&qp, 6));
            assert!(got < best + 0.3, "{seed}: {got} {best}");
            exact += usize::from(got < best + 1e-9);
        }
        assert!(exact >= 32, "{exact} of 40");
    }

    #[test]
    fn flat_directions_stay_at_zero() {
        let qp = LatticeQp::new(vec![1.0, 1.0, 1.0, 1.0], vec![-2.6, -2.6]);
        let k = qp.minimize();
        assert_eq!(k[0] + k[1], 3.0);
        assert_eq!(LatticeQp::new(vec![], vec![]).minimize(), Vec::<f64>::new());
    }
}
