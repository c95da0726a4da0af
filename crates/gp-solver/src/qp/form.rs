//! Problems whose blocks are quadratic energies and linear rows, as numbers.

use crate::block::Block;
use crate::error::SolverError;
use crate::problem::Problem;

/// A share `½ yᵀ H y + gᵀ y` of a quadratic energy in a few of the unknowns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuadraticTerm {
    /// The unknowns `y`, each once.
    pub unknowns: Vec<usize>,
    /// `H`, row by row, symmetric.
    pub hessian: Vec<f64>,
    /// `g`.
    pub gradient: Vec<f64>,
}

/// A linear equation `Σ a x = b`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearEquation {
    /// Unknowns with their coefficients `a`.
    pub entries: Vec<(usize, f64)>,
    /// `b`.
    pub value: f64,
}

#[cfg(feature = "sparse")]
impl LinearEquation {
    /// `b − Σ a x`.
    pub(super) fn defect(&self, x: &[f64]) -> f64 {
        self.value - self.entries.iter().map(|(i, a)| a * x[*i]).sum::<f64>()
    }

    /// Whether `|Σ a x − b| ≤ tolerance · (Σ |a| max |x| + |b|)`: relative to all unknowns, since an
    /// equation whose own unknowns come out as zero has no size of its own.
    pub(super) fn is_met(&self, x: &[f64], tolerance: f64) -> bool {
        let largest = x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let size = self.entries.iter().map(|(_, a)| a.abs()).sum::<f64>() * largest;
        self.defect(x).abs() <= tolerance * (size + self.value.abs())
    }

    /// `½ w (Σ a x − b)²` with `w Σ a² = size`.
    pub(super) fn square(&self, size: f64) -> QuadraticTerm {
        let mut entries = std::collections::BTreeMap::new();
        self.entries.iter().for_each(|(i, a)| *entries.entry(*i).or_insert(0.0) += a);
        let length: f64 = entries.values().map(|a: &f64| a * a).sum();
        let weight = if length > 0.0 { size / length } else { 0.0 };
        let row: Vec<f64> = entries.values().copied().collect();
        QuadraticTerm {
            unknowns: entries.into_keys().collect(),
            hessian: row.iter().flat_map(|a| row.iter().map(move |b| weight * a * b)).collect(),
            gradient: row.iter().map(|a| -weight * a * self.value).collect(),
        }
    }

    /// `w (b − Σ a x)`: how hard its [`square`](Self::square) pulls.
    pub(super) fn force(&self, square: &QuadraticTerm, x: &[f64]) -> f64 {
        let trace: f64 = (0..square.unknowns.len())
            .map(|a| square.hessian[a * (square.unknowns.len() + 1)])
            .sum();
        let length: f64 = {
            let mut entries = std::collections::BTreeMap::new();
            self.entries.iter().for_each(|(i, a)| *entries.entry(*i).or_insert(0.0) += a);
            entries.values().map(|a: &f64| a * a).sum()
        };
        if length > 0.0 { trace / length * self.defect(x) } else { 0.0 }
    }
}

/// What the blocks of a problem are if all of them are quadratic: linear rows are squares
/// `½ w² |J x + r|²`, or equations where the block [says so](crate::ResidualBlock::is_equation).
///
/// ```
/// use gp_solver::{Closeness, Problem, QuadraticBuilder, QuadraticForm};
/// let mut problem = Problem::new(2);
/// problem.add(Closeness::new("near", vec![1.0, 2.0], vec![1.0, 1.0]));
/// let mut sum = QuadraticBuilder::new("sum");
/// sum.equation(1.0).linear(0, 1.0).linear(1, 1.0).constant(-5.0);
/// problem.add(sum.build_exact());
/// let x = QuadraticForm::of(&problem)?.dense(2).solve()?.x;
/// assert!((x[0] - 2.0).abs() < 1e-12 && (x[1] - 3.0).abs() < 1e-12);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuadraticForm {
    /// Shares of the energy.
    pub terms: Vec<QuadraticTerm>,
    /// What holds exactly.
    pub equations: Vec<LinearEquation>,
}

impl QuadraticForm {
    /// Reads the blocks of a problem. Fixed unknowns are not looked at.
    ///
    /// # Errors
    /// [`SolverError::NotQuadratic`] names a block that is neither linear rows
    /// ([`is_linear`](crate::ResidualBlock::is_linear)) nor a quadratic energy
    /// ([`is_quadratic`](crate::EnergyBlock::is_quadratic)); those of the check of a problem.
    pub fn of(problem: &Problem<'_>) -> Result<Self, SolverError> {
        problem.check()?;
        let mut out = Self::default();
        // All derivatives are constant, so any place will do.
        let x = vec![0.0; problem.unknowns()];
        for slot in &problem.slots {
            let elements = slot.block.elements();
            let mut rows = vec![0.0; elements.rows_total()];
            let mut values = vec![0.0; elements.jacobian_len()];
            let refused = |name: &str| SolverError::NotQuadratic { block: name.to_owned() };
            match &slot.block {
                Block::Removed => {}
                Block::Residual(block) if !block.is_linear() => return Err(refused(block.name())),
                Block::Residual(block) => {
                    block.linearize(&x, &mut rows, &mut values);
                    let exact = block.is_equation();
                    for e in 0..elements.len() {
                        let columns = elements.columns(e);
                        let jacobian = &values[elements.jacobian_range(e)];
                        let rows = &rows[elements.rows(e)];
                        out.push_rows(columns, jacobian, rows, slot.weight, exact);
                    }
                }
                Block::Energy(block) if !block.is_quadratic() => {
                    return Err(refused(block.name()));
                }
                Block::Energy(block) => {
                    block.quadratic_model(&x, &mut rows, &mut values);
                    for e in 0..elements.len() {
                        let weighed = |v: &f64| slot.weight * v;
                        out.terms.push(QuadraticTerm {
                            unknowns: elements.columns(e).to_vec(),
                            hessian: values[elements.jacobian_range(e)]
                                .iter()
                                .map(weighed)
                                .collect(),
                            gradient: rows[elements.rows(e)].iter().map(weighed).collect(),
                        });
                    }
                }
            }
        }
        Ok(out)
    }

    fn push_rows(
        &mut self,
        columns: &[usize],
        jacobian: &[f64],
        rows: &[f64],
        weight: f64,
        exact: bool,
    ) {
        let m = columns.len();
        if exact {
            let each = jacobian.chunks_exact(m.max(1)).zip(rows);
            self.equations.extend(each.map(|(row, value)| LinearEquation {
                entries: columns.iter().copied().zip(row.iter().copied()).collect(),
                value: -value,
            }));
            return;
        }
        let (mut hessian, mut gradient) = (vec![0.0; m * m], vec![0.0; m]);
        for (row, value) in jacobian.chunks_exact(m.max(1)).zip(rows) {
            for a in 0..m {
                gradient[a] += weight * weight * row[a] * value;
                for b in 0..m {
                    hessian[a * m + b] += weight * weight * row[a] * row[b];
                }
            }
        }
        self.terms.push(QuadraticTerm { unknowns: columns.to_vec(), hessian, gradient });
    }

    /// The same in other unknowns `u` with `x = A u + b`: `rows[i]` has the entries of row `i` of
    /// `A`, `constants[i]` is `b_i`. Constants of the energy fall away.
    ///
    /// # Panics
    /// If there is not one row and one constant for each unknown of the form.
    #[must_use]
    pub fn in_terms_of(&self, rows: &[Vec<(usize, f64)>], constants: &[f64]) -> Self {
        let term = |t: &QuadraticTerm| {
            let m = t.unknowns.len();
            let mut unknowns: Vec<usize> =
                t.unknowns.iter().flat_map(|i| rows[*i].iter().map(|(u, _)| *u)).collect();
            unknowns.sort_unstable();
            unknowns.dedup();
            let k = unknowns.len();
            let local: Vec<Vec<(usize, f64)>> = t
                .unknowns
                .iter()
                .map(|i| {
                    let place = |u: &usize| unknowns.binary_search(u).unwrap_or_default();
                    rows[*i].iter().map(|(u, a)| (place(u), *a)).collect()
                })
                .collect();
            let b: Vec<f64> = t.unknowns.iter().map(|i| constants[*i]).collect();
            let (mut hessian, mut gradient) = (vec![0.0; k * k], vec![0.0; k]);
            let mut image = vec![0.0; k];
            for (i, own) in local.iter().enumerate() {
                let row = &t.hessian[i * m..(i + 1) * m];
                // Row i of H A, and of H b + g.
                image.fill(0.0);
                let mut force = t.gradient[i];
                for ((h, other), b) in row.iter().zip(&local).zip(&b) {
                    force += h * b;
                    other.iter().for_each(|(u, a)| image[*u] += h * a);
                }
                for (u, a) in own {
                    gradient[*u] += a * force;
                    let target = &mut hessian[u * k..(u + 1) * k];
                    target.iter_mut().zip(&image).for_each(|(t, v)| *t += a * v);
                }
            }
            QuadraticTerm { unknowns, hessian, gradient }
        };
        let equation = |e: &LinearEquation| {
            let mut entries = std::collections::BTreeMap::new();
            let mut value = e.value;
            for (i, a) in &e.entries {
                value -= a * constants[*i];
                rows[*i].iter().for_each(|(u, c)| *entries.entry(*u).or_insert(0.0) += a * c);
            }
            LinearEquation { entries: entries.into_iter().collect(), value }
        };
        Self {
            terms: self.terms.iter().map(term).collect(),
            equations: self.equations.iter().map(equation).collect(),
        }
    }

    /// The program of all terms and equations in `unknowns` unknowns, dense.
    #[must_use]
    pub fn dense(&self, unknowns: usize) -> super::DenseQp {
        let mut hessian = vec![0.0; unknowns * unknowns];
        let mut linear = vec![0.0; unknowns];
        for t in &self.terms {
            for (a, i) in t.unknowns.iter().enumerate() {
                linear[*i] += t.gradient[a];
                for (b, j) in t.unknowns.iter().enumerate() {
                    hessian[i * unknowns + j] += t.hessian[a * t.unknowns.len() + b];
                }
            }
        }
        let mut qp = super::DenseQp::new(unknowns, hessian, linear);
        for e in &self.equations {
            let mut row = vec![0.0; unknowns];
            e.entries.iter().for_each(|(i, a)| row[*i] += a);
            qp.equal(&row, e.value);
        }
        qp
    }
}
