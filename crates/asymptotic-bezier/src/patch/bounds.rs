//! Keeps the crossing field from folding over: linear bounds on its transversal component.

use geom_core::DVec3;

use crate::boundary::four_curves::PatchBoundary;
use crate::patch::family::PatchFamily;
use gp_solver::{DenseQp, Status};
use numerics::axpy;

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
        let first = crate::curve::bernstein::derivative(boundary.curves[i].offsets());
        let across = |t: f64| {
            let normal = family.strip_normal(i, t).unwrap_or(DVec3::ZERO);
            normal.cross(crate::curve::bernstein::eval(&first, t)).normalize_or_zero()
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
            crate::curve::bernstein::bernstein_into(n, s.t, &mut basis);
            let t: DVec3 = field.iter().zip(&basis).map(|(c, b)| *c * *b).sum();
            let value = t.dot(s.across) / s.corner;
            if !(value >= worst.value) {
                worst = Worst { value, curve: s.curve, t: s.t };
            }
        }
        worst
    }

    /// Keeps every transversality at least `theta` of its corner value, in a program whose first
    /// unknowns are the freedoms.
    pub(crate) fn bound(&self, family: &PatchFamily, theta: f64, program: &mut DenseQp) {
        for s in &self.samples {
            // The corners themselves are fixed.
            if s.t == 0.0 || s.t == 1.0 {
                continue;
            }
            let (constant, row) = family.field_row(s.curve, s.t, s.across);
            // In units of the corner value all rows are comparable.
            let mut row: Vec<f64> = row.iter().map(|a| a / s.corner).collect();
            row.resize(program.unknowns(), 0.0);
            program.at_least(&row, theta - constant / s.corner);
        }
    }

    /// The minimum of the energy with every transversality at least `theta` of its corner value;
    /// `None` when that is infeasible.
    pub(crate) fn minimize(&self, family: &PatchFamily, theta: f64) -> Option<Vec<f64>> {
        let n = family.gradient.len();
        let hessian: Vec<f64> = (0..n).flat_map(|i| family.hessian.row(i)).copied().collect();
        let mut program = DenseQp::new(n, hessian, family.gradient.clone());
        self.bound(family, theta, &mut program);
        let solution = program.solve().ok()?;
        (solution.status == Status::Converged).then_some(solution.x)
    }
}
