//! One level: a net of control points, optimised from a start towards a reference.

use std::sync::Arc;

use bspline::BsplineSurface;
use geom_core::FirstForm;
use gp_solver::{Closeness, DampingRule, Observer, Options, Problem, Report, Run, Stage, System};

use crate::blocks::{
    Alignment, BorderGlide, Fairness, Net, Parallel, RelationRows, Shape, border_points,
};
use crate::error::WeingartenError;
use crate::field::{Sample, samples};
use crate::grid::SampleGrid;
use crate::kernel::Field;
use crate::options::{Border, WeingartenOptions};
use crate::target::Target;

/// Weight of gliding borders against distances on the working scale: large enough that the border
/// stays on its curve to some 1e-4 of the size of the surface.
const BORDER_WEIGHT: f64 = 100.0;
/// Weight of the distance to the last iterate (Pellis et al. 2021, Table 1).
pub(crate) const LAST_ITERATE_WEIGHT: f64 = 1e-3;
/// An alignment residual of this root mean square is rounding: a surface that starts there is
/// Weingarten already and stays where it is.
const ROUNDING_RMS: f64 = 1e-8;
/// Converged if the largest cosine between the residual and a column of the Jacobian is below.
const GRADIENT_TOL: f64 = 1e-9;

/// Everything a level is made from, on the working scale.
pub(crate) struct Level {
    /// Knots and weights of the net; its control points are the reference, on the working scale.
    pub(crate) reference: BsplineSurface,
    pub(crate) grid: Arc<SampleGrid>,
    /// Mean absolute principal curvature, or 1 where nothing is curved.
    pub(crate) curvature: f64,
    /// Working lengths per length of the model.
    pub(crate) unit: f64,
}

/// The samples of a surface, each checked to be regular.
pub(crate) fn regular_samples(
    grid: &SampleGrid,
    x: &[f64],
) -> Result<Vec<Sample>, WeingartenError> {
    let samples = samples(grid, x);
    let singular = |s: &Sample| {
        let first = FirstForm { e: s.e, f: s.f, g: s.g };
        first.check().is_err() || !(s.jet.h_u.is_finite() && s.jet.k_v.is_finite())
    };
    match samples.iter().position(singular) {
        Some(k) => {
            let [u, v] = grid.parameters(k);
            Err(WeingartenError::Singular { u, v })
        }
        None => Ok(samples),
    }
}

/// The shape of the net of a surface.
pub(crate) fn net(surface: &BsplineSurface) -> Net {
    Net {
        n_u: surface.n_u(),
        n_v: surface.n_v(),
        closed_u: surface.knots_u().is_periodic(),
        closed_v: surface.knots_v().is_periodic(),
    }
}

impl Level {
    /// The target of the relation asked for, judged from the start of the level.
    pub(crate) fn target(&self, options: &WeingartenOptions, start: &[Sample]) -> Option<Target> {
        Target::new(&options.relation, self.unit, self.curvature, start)
    }

    /// The problem of the eliminated formulation; `x` is the start and `start` its samples.
    pub(crate) fn problem(
        &self,
        options: &WeingartenOptions,
        x: &[f64],
        start: &[Sample],
    ) -> Result<Problem<'static>, WeingartenError> {
        let w = options.effective_weights();
        let (net, grid) = (net(&self.reference), &self.grid);
        let reference = crate::metrics::coordinates(&self.reference);
        let mut problem = Problem::new(grid.unknowns());
        match self.target(options, start) {
            None => problem.add(Alignment::new(grid, start, self.curvature, w.alignment)),
            Some(target) => problem.add(RelationRows::new(grid, target, start, w.alignment)),
        };
        if w.parallel > 0.0 {
            for field in [Field::Mean, Field::Gauss] {
                problem.add(Parallel::new(grid, field, x, start, self.curvature, w.parallel));
            }
        }
        if w.closeness > 0.0 {
            problem.add(Closeness::new(
                "closeness",
                reference.clone(),
                vec![w.closeness; reference.len()],
            ));
        }
        if w.fairness > 0.0 {
            problem.add(Fairness::new(net, Some(&reference), w.fairness));
        }
        if w.shape > 0.0 {
            problem.add(Shape::new(net, &reference, w.shape));
        }
        add_border(&mut problem, options.border, &self.reference, &reference)?;
        problem.add(Closeness::to_last_iterate(x, LAST_ITERATE_WEIGHT));
        problem.variables_mut().set_order(order(
            net,
            self.reference.degree_u().get(),
            self.reference.degree_v().get(),
        ));
        Ok(problem)
    }

    /// Takes up to `iterations` Levenberg-Marquardt steps from `x`. `origin` is where the level
    /// began: scales come from there, and it differs from `x` only when a solve is resumed.
    pub(crate) fn solve(
        &self,
        options: &WeingartenOptions,
        origin: &[f64],
        x: &mut [f64],
        iterations: usize,
        damping: Option<f64>,
        observer: &mut dyn Observer,
    ) -> Result<Report, WeingartenError> {
        let start = regular_samples(&self.grid, origin)?;
        let system =
            System::new(self.problem(options, origin, &start)?, gp_solver::Factorization::Auto)?;
        let rounding =
            ROUNDING_RMS * options.effective_weights().alignment.max(LAST_ITERATE_WEIGHT);
        let defaults = Options::default();
        let solver = Options {
            max_iterations: iterations,
            initial_damping: damping.unwrap_or(defaults.initial_damping),
            damping_rule: DampingRule::Fivefold,
            gradient_tol: GRADIENT_TOL,
            step_tol: 1e-10,
            abs_energy_tol: 0.5 * self.grid.len() as f64 * rounding * rounding,
            ..defaults
        };
        let mut run = Run::new(system, x, &solver)?;
        let status = run.go_on(&Stage::only(self.name()), observer)?;
        x.copy_from_slice(run.x());
        Ok(run.report(status))
    }
}

/// Holds the border or lets it glide.
pub(crate) fn add_border(
    problem: &mut Problem<'static>,
    border: Border,
    surface: &BsplineSurface,
    reference: &[f64],
) -> Result<(), WeingartenError> {
    if border == Border::Free {
        return Ok(());
    }
    for (direction, knots) in [("u", surface.knots_u()), ("v", surface.knots_v())] {
        if !knots.is_periodic() && !knots.is_clamped() {
            return Err(WeingartenError::NotClamped { direction });
        }
    }
    let net = net(surface);
    if border == Border::Glide {
        problem.add(BorderGlide::new(net, reference, BORDER_WEIGHT));
        return Ok(());
    }
    for control in border_points(net).into_iter().flatten() {
        for axis in 0..3 {
            problem.variables_mut().fix_unknown(3 * control + axis);
        }
    }
    Ok(())
}

/// An ordering of the unknowns that keeps the normal matrix in a narrow band: one side of the net
/// runs fastest, and a closed slow side is folded (0, n−1, 1, n−2, …), so that its two ends, which
/// are neighbours, stay near one another.
fn order(net: Net, degree_u: usize, degree_v: usize) -> Vec<usize> {
    let Net { n_u, n_v, closed_u, closed_v } = net;
    // Half bandwidth in control points if this side is the slow one.
    let band = |degree: usize, closed: bool, fast: usize, fast_degree: usize, fast_closed: bool| {
        let slow_reach = if closed { 2 * degree } else { degree };
        slow_reach * fast + if fast_closed { fast } else { fast_degree }
    };
    let u_slow = band(degree_u, closed_u, n_v, degree_v, closed_v);
    let v_slow = band(degree_v, closed_v, n_u, degree_u, closed_u);
    let folded = |n: usize, closed: bool| -> Vec<usize> {
        if !closed {
            return (0..n).collect();
        }
        (0..n).map(|k| if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 }).collect()
    };
    let mut order = Vec::with_capacity(3 * n_u * n_v);
    let mut push = |i: usize, j: usize| {
        let first = 3 * (i * n_v + j);
        order.extend(first..first + 3);
    };
    if u_slow <= v_slow {
        for i in folded(n_u, closed_u) {
            (0..n_v).for_each(|j| push(i, j));
        }
    } else {
        for j in folded(n_v, closed_v) {
            (0..n_u).for_each(|i| push(i, j));
        }
    }
    order
}
