//! One of the two functions whose level lines are the lines of the net.

use geom_core::DVec3;
use gp_solver::{InequalityQp, LatticeQp, MixedQp, SolverError, Status};

use crate::surface::Surface;
use crate::whole::{Unknowns, Value};

/// Weight of the spacing of lines against their direction.
const SPACING: f64 = 0.05;
/// Rounds in which the spacing follows the lines, and how far it may go from the wanted one.
const ROUNDS: usize = 5;
const SPACING_RANGE: [f64; 2] = [0.7, 1.4];
/// Range of spacings in which a wrong one counts as its share of the right one.
const RELATIVE_RANGE: [f64; 2] = [0.25, 2.5];
/// Least rise along both principal directions, in cells per edge length: then all triangles keep
/// their orientation.
const LEAST_RISE: f64 = 0.05;
/// Share of that rise which may be missing where the steps end early.
const NEARLY: f64 = 0.1;
/// Largest move, in cells, by which the rows may want to change a value.
const REACH: f64 = 20.0;
/// Cuts of the whole numbers at most.
const MOST_CUTS: usize = 20;
/// Coefficients of a cut below this share of the largest are taken for zero.
const CUT_ZERO: f64 = 1e-4;
/// A cut is a row of whole numbers if so many times it is, to this accuracy.
const CUT_MULTIPLES: u32 = 12;
const CUT_WHOLE: f64 = 1e-4;

/// Directions and weights of every triangle.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    /// Where the function rises.
    pub(crate) along: Vec<DVec3>,
    /// Where it is to be constant.
    pub(crate) level: Vec<DVec3>,
    /// Principal directions along which it rises.
    pub(crate) rising: [Vec<DVec3>; 2],
    pub(crate) weights: Vec<f64>,
}

/// What a function is sought on.
pub(crate) struct Ground<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) sheets: &'a [[u32; 3]],
    pub(crate) unknowns: &'a Unknowns,
    /// Wanted distance of two lines along the other family.
    pub(crate) edge: f64,
}

/// A function on the cut surface.
#[derive(Clone, Debug)]
pub(crate) struct Foliation {
    pub(crate) reals: Vec<f64>,
    pub(crate) wholes: Vec<f64>,
    /// Rows of whole numbers that were needed.
    pub(crate) cuts: usize,
    /// Steps that turned triangles back over.
    pub(crate) steps: usize,
}

/// Why there is none.
#[derive(Clone, Debug)]
pub(crate) enum Missing {
    /// The triangle the contradiction is strongest at.
    Folds(usize),
    Solver(SolverError),
}

impl From<SolverError> for Missing {
    fn from(e: SolverError) -> Self {
        Self::Solver(e)
    }
}

/// A linear function of the unknowns: real ones first, then whole ones from `reals` on.
type Row = Vec<(usize, f64)>;

impl Ground<'_> {
    /// The derivative along a direction in a triangle, per edge length.
    fn derivative(&self, f: usize, direction: DVec3) -> Row {
        let gradients = self.surface.hat_gradients(f);
        let mut row = Row::new();
        for (sheet, gradient) in self.sheets[f].iter().zip(gradients) {
            let share = self.edge * gradient.dot(direction);
            let Value { real, whole } = &self.unknowns.values[*sheet as usize];
            let reals = real.iter().map(|&(i, s)| (i as usize, s * share));
            let wholes = whole.iter().map(|&(k, c)| (self.unknowns.reals + k as usize, c * share));
            for (i, c) in reals.chain(wholes) {
                match row.iter_mut().find(|(j, _)| *j == i) {
                    Some((_, sum)) => *sum += c,
                    None => row.push((i, c)),
                }
            }
        }
        row
    }

    fn rows(&self, directions: &[DVec3]) -> Vec<Row> {
        directions.iter().enumerate().map(|(f, &d)| self.derivative(f, d)).collect()
    }

    /// The value of a function at a sheet.
    pub(crate) fn value(&self, at: &Value, reals: &[f64], wholes: &[f64]) -> f64 {
        at.real.map_or(0.0, |(i, s)| s * reals[i as usize])
            + at.whole.iter().map(|&(k, c)| c * wholes[k as usize]).sum::<f64>()
    }

    /// The function with whole steps whose lines follow the directions best.
    pub(crate) fn solve(&self, frames: &Frames) -> Result<Foliation, Missing> {
        let unknowns = self.unknowns;
        let groups = self.sheets.iter().map(|sheets| {
            let reals = sheets.iter().filter_map(|s| unknowns.values[*s as usize].real);
            let mut group: Vec<u32> = reals.map(|(i, _)| i).collect();
            group.sort_unstable();
            group.dedup();
            group
        });
        let mut qp = MixedQp::new(unknowns.reals, unknowns.wholes, groups)?;
        let (along, level) = (self.rows(&frames.along), self.rows(&frames.level));
        let mut spacing = vec![[1.0; 2]; along.len()];
        for _ in 0..ROUNDS {
            fill(&mut qp, &along, &level, &spacing, &frames.weights);
            let eliminated = qp.eliminate(unknowns.held)?;
            let wholes = eliminated.lattice().relaxed();
            let reals = eliminated.reals(&wholes);
            self.follow(&along, &reals, &wholes, &mut spacing);
        }
        fill(&mut qp, &along, &level, &spacing, &frames.weights);
        let eliminated = qp.eliminate(unknowns.held)?;
        let rising = [self.rows(&frames.rising[0]), self.rows(&frames.rising[1])];
        let mut lattice = eliminated.lattice();
        for cuts in 0..=MOST_CUTS {
            let wholes = lattice.minimize();
            let reals = eliminated.reals(&wholes);
            match self.unfold(&qp, &rising, reals, wholes)? {
                Unfolded::Sound(found) => return Ok(Foliation { cuts, ..found }),
                Unfolded::Cut(coefficients, bound) => lattice.at_least(coefficients, bound),
                Unfolded::Local(f) => return Err(Missing::Folds(f)),
            }
            if cuts == MOST_CUTS || lattice.violation(&lattice.minimize()) > 1e-6 {
                break;
            }
        }
        let first = self.first_fold(&rising, &eliminated.lattice(), &eliminated);
        Err(Missing::Folds(first))
    }

    /// Lets the wanted rise follow the lines, within its range and with the same mean; and keeps
    /// the rise there is.
    fn follow(&self, along: &[Row], reals: &[f64], wholes: &[f64], spacing: &mut [[f64; 2]]) {
        for (s, row) in spacing.iter_mut().zip(along) {
            let rise = evaluate(row, reals, wholes);
            *s = [SPACING_RANGE, RELATIVE_RANGE].map(|[low, high]| rise.clamp(low, high));
        }
        let sum: f64 = spacing.iter().map(|[s, _]| s.ln()).sum();
        let mean = (sum / spacing.len().max(1) as f64).exp();
        spacing.iter_mut().for_each(|[s, _]| *s /= mean);
    }

    /// Moves the real unknowns as little as must be for all rows to rise.
    fn unfold(
        &self,
        qp: &MixedQp,
        rising: &[Vec<Row>; 2],
        mut reals: Vec<f64>,
        wholes: Vec<f64>,
    ) -> Result<Unfolded, Missing> {
        let rows = || rising.iter().flatten();
        let missing: Vec<f64> =
            rows().map(|row| LEAST_RISE - evaluate(row, &reals, &wholes)).collect();
        if missing.iter().all(|m| *m <= 0.0) {
            return Ok(Unfolded::Sound(Foliation { reals, wholes, cuts: 0, steps: 0 }));
        }
        let held = self.unknowns.held;
        let (pattern, values) = qp.real_block(held);
        let nothing = vec![0.0; reals.len()];
        let mut program = InequalityQp::new(pattern, &values, &nothing);
        program.within(REACH);
        for (row, bound) in rows().zip(&missing) {
            let is_real = |(i, _): &&(usize, f64)| *i < reals.len() && Some(*i) != held;
            let real: Row = row.iter().filter(is_real).copied().collect();
            program.at_least(&real, *bound);
        }
        let solution = program.solve()?;
        // Rounding may end the last steps early, which matters to nobody once all rows rise.
        if solution.status == Status::Converged || solution.violation < NEARLY * LEAST_RISE {
            reals.iter_mut().zip(&solution.x).for_each(|(y, d)| *y += d);
            let steps = solution.iterations;
            return Ok(Unfolded::Sound(Foliation { reals, wholes, cuts: 0, steps }));
        }
        // The rows add up, by these multipliers, to one of the whole numbers alone.
        let z = &solution.multipliers;
        let triangles = rising[0].len();
        let worst = (0..z.len()).fold(0, |best, r| if z[r] > z[best] { r } else { best });
        if solution.status != Status::Infeasible {
            return Ok(Unfolded::Local(worst % triangles));
        }
        let mut coefficients = vec![0.0; wholes.len()];
        for (row, z) in rows().zip(z) {
            for &(i, c) in row.iter().filter(|(i, _)| *i >= reals.len()) {
                coefficients[i - reals.len()] += c * z;
            }
        }
        let largest = coefficients.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        let scale = z.iter().fold(0.0_f64, |most, z| most.max(*z));
        if largest < CUT_ZERO * scale {
            return Ok(Unfolded::Local(worst % triangles));
        }
        let bound = LEAST_RISE * z.iter().sum::<f64>() / largest;
        coefficients.iter_mut().for_each(|c| {
            *c /= largest;
            if c.abs() < CUT_ZERO {
                *c = 0.0;
            }
        });
        Ok(whole_cut(coefficients, bound))
    }

    /// The triangle that folds most once everything is whole.
    fn first_fold(
        &self,
        rising: &[Vec<Row>; 2],
        lattice: &LatticeQp,
        eliminated: &gp_solver::Eliminated,
    ) -> usize {
        let wholes = lattice.minimize();
        let reals = eliminated.reals(&wholes);
        let rise = |f: usize| {
            let values = [0, 1].map(|k| evaluate(&rising[k][f], &reals, &wholes));
            values[0].min(values[1])
        };
        (0..rising[0].len()).min_by(|&a, &b| rise(a).total_cmp(&rise(b))).unwrap_or(0)
    }
}

/// A cut with whole coefficients if a small multiple has them, its bound then whole as well.
fn whole_cut(coefficients: Vec<f64>, bound: f64) -> Unfolded {
    for q in (1..=CUT_MULTIPLES).map(f64::from) {
        if coefficients.iter().all(|c| (c * q - (c * q).round()).abs() < CUT_WHOLE) {
            let whole = coefficients.iter().map(|c| (c * q).round()).collect();
            return Unfolded::Cut(whole, (bound * q - 1e-6).ceil());
        }
    }
    Unfolded::Cut(coefficients, bound)
}

enum Unfolded {
    Sound(Foliation),
    Cut(Vec<f64>, f64),
    Local(usize),
}

fn fill(qp: &mut MixedQp, along: &[Row], level: &[Row], spacing: &[[f64; 2]], weights: &[f64]) {
    qp.clear();
    for f in 0..along.len() {
        let [wanted, there] = spacing[f];
        qp.square(&level[f], 0.0, weights[f]);
        // An edge twice too long counts as much as one of half its length.
        qp.square(&along[f], wanted, SPACING * weights[f] / (there * there));
    }
}

fn evaluate(row: &Row, reals: &[f64], wholes: &[f64]) -> f64 {
    let value = |i: usize| if i < reals.len() { reals[i] } else { wholes[i - reals.len()] };
    row.iter().map(|&(i, c)| c * value(i)).sum()
}
