//! Keeps the crossing field from folding over: linear bounds on its transversal component.

use geom_core::DVec3;

use crate::dense::{Cholesky, Matrix, axpy, dot};
use crate::patch::{PatchBoundary, PatchFamily};

/// Samples per curve at which the bounds are imposed.
const SAMPLES: usize = 41;

/// Transversality of the four fields at the samples, affine in the freedoms.
pub(crate) struct Strips {
    samples: Vec<Sample>,
}

struct Sample {
    curve: usize,
    t: f64,
    /// In-plane direction across the curve, signed so that the corner values are positive.
    across: DVec3,
    /// Interpolated corner value that the bound is a share of.
    corner: f64,
}

/// The sample with the least transversality relative to its corner value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worst {
    pub(crate) value: f64,
    pub(crate) curve: usize,
    pub(crate) t: f64,
}

/// Prepares the samples; lines have no known tangent plane and are left out.
pub(crate) fn strips(family: &PatchFamily, boundary: &PatchBoundary) -> Strips {
    let mut samples = Vec::with_capacity(4 * SAMPLES);
    for i in 0..4 {
        if family.strip_normal(i, 0.0).is_none() {
            continue;
        }
        let first = crate::bernstein::derivative(boundary.curves[i].points());
        let across = |t: f64| {
            let normal = family.strip_normal(i, t).unwrap_or(DVec3::ZERO);
            normal.cross(crate::bernstein::eval(&first, t)).normalize_or_zero()
        };
        let fixed = |t: f64| family.field_row(i, t, across(t)).0;
        // At the corners the field is the other curve's tangent, whatever the freedoms.
        let ends = [fixed(0.0), fixed(1.0)];
        let sign = if ends[0] < 0.0 { -1.0 } else { 1.0 };
        for k in 0..SAMPLES {
            let t = k as f64 / (SAMPLES - 1) as f64;
            let corner = ((1.0 - t) * ends[0] + t * ends[1]).abs();
            samples.push(Sample { curve: i, t, across: across(t) * sign, corner });
        }
    }
    Strips { samples }
}

impl Strips {
    /// Least transversality at the freedoms `y`.
    pub(crate) fn worst(&self, family: &PatchFamily, y: &[f64]) -> Worst {
        let mut worst = Worst { value: f64::INFINITY, curve: 0, t: 0.0 };
        let mut z = family.particular.clone();
        axpy(1.0, &family.null.apply(y), &mut z);
        let n = family.degree;
        let mut curve = usize::MAX;
        let mut field = Vec::new();
        let mut basis = vec![0.0; n + 1];
        for s in &self.samples {
            if s.curve != curve {
                curve = s.curve;
                field = vec![DVec3::ZERO; n + 1];
                for (f, basis_field) in family.spaces[curve].fields.iter().enumerate() {
                    let weight = z[family.offsets[curve] + f];
                    for (sum, c) in field.iter_mut().zip(basis_field) {
                        *sum += *c * weight;
                    }
                }
            }
            crate::bernstein::bernstein_into(n, s.t, &mut basis);
            let t: DVec3 = field.iter().zip(&basis).map(|(c, b)| *c * *b).sum();
            let value = t.dot(s.across) / s.corner;
            if !(value >= worst.value) {
                worst = Worst { value, curve: s.curve, t: s.t };
            }
        }
        worst
    }

    /// The minimum of the energy with every transversality at least `theta` of its corner value;
    /// `None` when that is infeasible.
    pub(crate) fn minimize(
        &self,
        family: &PatchFamily,
        free: &[f64],
        theta: f64,
    ) -> Option<Vec<f64>> {
        let (mut rows, mut right) = (Vec::new(), Vec::new());
        for s in &self.samples {
            // The corners themselves are fixed.
            if s.t == 0.0 || s.t == 1.0 {
                continue;
            }
            let (constant, row) = family.field_row(s.curve, s.t, s.across);
            // In units of the corner value all rows are comparable.
            rows.push(row.iter().map(|a| a / s.corner).collect::<Vec<f64>>());
            right.push(theta - constant / s.corner);
        }
        bounded_minimum(&family.hessian, free, &rows, &right)
    }
}

/// Minimises `½ (y − y₀)ᵀ H (y − y₀)` subject to `rows · y ≥ right`.
///
/// The dual, `½ λᵀ K λ − rᵀ λ` over `λ ≥ 0` with `K = A H⁻¹ Aᵀ`, is solved by the active-set
/// method of Lawson and Hanson 1974, ch. 23, written for normal equations.
pub(crate) fn bounded_minimum(
    hessian: &Matrix,
    free: &[f64],
    rows: &[Vec<f64>],
    right: &[f64],
) -> Option<Vec<f64>> {
    let factor = Cholesky::new(hessian, 1e-15)?;
    let m = rows.len();
    // Half-transformed rows L⁻¹ a, so that K is their Gram matrix.
    let half: Vec<Vec<f64>> = rows.iter().map(|a| factor.forward_substitute(a)).collect();
    let gap: Vec<f64> = rows.iter().zip(right).map(|(a, b)| b - dot(a, free)).collect();
    let mut lambda = vec![0.0; m];
    let mut passive: Vec<usize> = Vec::new();
    let mut shift = vec![0.0; free.len()];
    for _ in 0..20 * m {
        // Slack of the dual gradient: how much each bound is still violated.
        let worst = (0..m)
            .filter(|i| !passive.contains(i))
            .map(|i| (i, gap[i] - dot(&half[i], &shift)))
            .fold((usize::MAX, 1e-11), |best, item| if item.1 > best.1 { item } else { best });
        if worst.0 == usize::MAX {
            let step = factor.back_substitute(&shift);
            return Some(free.iter().zip(step).map(|(y, s)| y + s).collect());
        }
        passive.push(worst.0);
        loop {
            let trial = solve_passive(&half, &gap, &passive)?;
            if trial.iter().all(|l| *l > 0.0) {
                for (k, i) in passive.iter().enumerate() {
                    lambda[*i] = trial[k];
                }
                break;
            }
            let mut step = 1.0_f64;
            for (k, i) in passive.iter().enumerate() {
                if trial[k] <= 0.0 {
                    step = step.min(lambda[*i] / (lambda[*i] - trial[k]));
                }
            }
            for (k, i) in passive.iter().enumerate() {
                lambda[*i] += step * (trial[k] - lambda[*i]);
            }
            let before = passive.len();
            passive.retain(|i| lambda[*i] > 1e-14);
            if passive.len() == before {
                return None;
            }
            if passive.is_empty() {
                break;
            }
        }
        if lambda.iter().any(|l| !l.is_finite() || *l > 1e12) {
            return None;
        }
        shift.fill(0.0);
        for i in &passive {
            axpy(lambda[*i], &half[*i], &mut shift);
        }
    }
    None
}

/// `K_PP λ = gap_P` by Cholesky, with a whisper of ridge for neighbouring samples.
fn solve_passive(half: &[Vec<f64>], gap: &[f64], passive: &[usize]) -> Option<Vec<f64>> {
    let n = passive.len();
    let mut k = Matrix::zeros(n, n);
    for (a, i) in passive.iter().enumerate() {
        for (b, j) in passive.iter().enumerate() {
            k[(a, b)] = dot(&half[*i], &half[*j]);
        }
        k[(a, a)] *= 1.0 + 1e-13;
    }
    let right: Vec<f64> = passive.iter().map(|i| gap[*i]).collect();
    Some(Cholesky::new(&k, 0.0)?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_minimum_projects_onto_the_polygon() {
        let h = Matrix::identity(2);
        // x ≥ 1 and x + y ≥ 3 from the origin: the nearest point is (1.5, 1.5).
        let y = bounded_minimum(&h, &[0.0, 0.0], &[vec![1.0, 0.0], vec![1.0, 1.0]], &[1.0, 3.0]);
        let y = y.unwrap();
        assert!((y[0] - 1.5).abs() < 1e-12 && (y[1] - 1.5).abs() < 1e-12);
        // x ≥ 1 and −x ≥ 0 contradict.
        let none =
            bounded_minimum(&h, &[0.0, 0.0], &[vec![1.0, 0.0], vec![-1.0, 0.0]], &[1.0, 0.0]);
        assert!(none.is_none());
    }
}
