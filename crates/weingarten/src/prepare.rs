//! A level made ready for the solver in the formulation asked for.

use gp_solver::{DampingRule, Extra, Options as SolverOptions, Problem};

use crate::error::Error;
use crate::level::{LAST_ITERATE_WEIGHT, Level};
use crate::lifted;
use crate::options::{Formulation, Options};

/// An alignment residual of this root mean square is rounding: a surface that starts there is
/// Weingarten already and stays where it is.
const ROUNDING_RMS: f64 = 1e-8;
/// Converged if the largest cosine between the residual and a column of the Jacobian is below.
const GRADIENT_TOL: f64 = 1e-9;
/// Converged if a step is below this share of the unknowns.
const STEP_TOL: f64 = 1e-10;
/// Damping of the first step of a level, by far starts and near ones alike (`docs/methods`).
const INITIAL_DAMPING: f64 = 3e-4;

/// A level ready to be solved.
pub(crate) struct Prepared {
    pub(crate) problem: Problem<'static>,
    /// All unknowns at the start.
    pub(crate) x: Vec<f64>,
    pub(crate) options: SolverOptions,
    /// Whether the caller has blocks of its own, which the measures of a surface know nothing of.
    pub(crate) has_extra: bool,
}

/// Problem, start and settings of the formulation asked for, with the caller's own blocks.
/// Scales come from `origin`, where the level would begin; it begins at `x`.
pub(crate) fn prepared(
    level: &Level,
    options: &Options,
    origin: &[f64],
    x: &[f64],
    extra: &mut Extra<'_, Error>,
) -> Result<Prepared, Error> {
    let mut prepared = match options.formulation {
        Formulation::Reduced => reduced(level, options, origin, x)?,
        Formulation::Lifted => auxiliary(level, options, origin)?,
    };
    let variables = prepared.problem.variables().clone();
    let own = prepared.problem.blocks().count();
    extra(&level.stage, &variables, &mut prepared.problem)?;
    prepared.has_extra = prepared.problem.blocks().count() != own
        || prepared.problem.variables().fixed() != variables.fixed();
    Ok(prepared)
}

/// The eliminated formulation.
fn reduced(level: &Level, options: &Options, origin: &[f64], x: &[f64]) -> Result<Prepared, Error> {
    let start = level.sampled(origin)?;
    let rounding = ROUNDING_RMS * options.alignment_weight().max(LAST_ITERATE_WEIGHT);
    Ok(Prepared {
        has_extra: false,
        problem: level.problem(options, &start, x)?,
        x: x.to_vec(),
        options: SolverOptions {
            max_iterations: options.iterations,
            damping_rule: DampingRule::Fivefold,
            initial_damping: INITIAL_DAMPING,
            gradient_tol: GRADIENT_TOL,
            step_tol: STEP_TOL,
            abs_energy_tol: 0.5 * level.grid.count() as f64 * rounding * rounding,
            ..SolverOptions::default()
        },
    })
}

/// The lifted formulation, with auxiliary variables computed from the surface.
fn auxiliary(level: &Level, options: &Options, origin: &[f64]) -> Result<Prepared, Error> {
    let x = lifted::start(&level.grid, origin)?;
    Ok(Prepared {
        has_extra: false,
        problem: lifted::problem(level, options, &x)?,
        options: SolverOptions {
            max_iterations: options.iterations,
            ..SolverOptions::guided_projection(LAST_ITERATE_WEIGHT)
        },
        x,
    })
}
