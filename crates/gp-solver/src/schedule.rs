//! Stages of a run: what is solved one after the other.

use crate::problem::Problem;
use crate::report::{Report, Status};
use crate::variables::Variables;

/// What a caller adds to the problem of every stage of a method: called whenever a stage has built
/// its problem, so that added blocks survive levels, subdivision and alternation.
pub type Extra<'e, E> =
    dyn for<'a> FnMut(&Stage, &Variables, &mut Problem<'a>) -> Result<(), E> + 'e;

/// A stage of a run: a level of refinement, a set of weights, a phase of a method.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// What the method calls it, such as `25x18` or `polish`.
    pub name: String,
    /// Number of the stage, from 0.
    pub number: usize,
    /// Number of stages in all, as far as it is known beforehand.
    pub count: usize,
    /// The point of the model that is the origin of the stage's unknowns.
    pub origin: [f64; 3],
    /// Lengths of the stage's unknowns per length of the model.
    pub unit: f64,
}

impl Stage {
    /// The stage of a run that has just one.
    #[must_use]
    pub fn only(name: impl Into<String>) -> Self {
        Self::new(name, 0, 1)
    }

    /// A stage whose unknowns have the model's own coordinates.
    #[must_use]
    pub fn new(name: impl Into<String>, number: usize, count: usize) -> Self {
        Self { name: name.into(), number, count, origin: [0.0; 3], unit: 1.0 }
    }

    /// The same stage with unknowns counted from `origin` in `unit` lengths per length of the model.
    #[must_use]
    pub fn at(self, origin: [f64; 3], unit: f64) -> Self {
        Self { origin, unit, ..self }
    }

    /// Where a point of the model stands among the stage's unknowns: `(p − origin) · unit`.
    ///
    /// ```
    /// use gp_solver::Stage;
    /// let stage = Stage::only("25x18").at([1.0, 0.0, 0.0], 2.0);
    /// assert_eq!(stage.place([3.0, 0.5, 0.0]), [4.0, 1.0, 0.0]);
    /// assert_eq!(stage.length(0.25), 0.5);
    /// ```
    #[must_use]
    pub fn place(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| (point[c] - self.origin[c]) * self.unit)
    }

    /// A length of the model among the stage's unknowns.
    #[must_use]
    pub fn length(&self, length: f64) -> f64 {
        length * self.unit
    }
}

/// A stage and what happened in it.
#[derive(Clone, Debug, PartialEq)]
pub struct StageReport {
    /// The stage.
    pub stage: Stage,
    /// What the solver did; the history of a resumed stage begins where it was resumed.
    pub solver: Report,
}

/// What a run of several stages did.
///
/// # Example
/// ```
/// use gp_solver::{
///     Closeness, Options, Problem, RunReport, SolverError, Stage, StageReport, solve,
/// };
/// let stage = |number: usize| {
///     let mut problem = Problem::new(1);
///     problem.add(Closeness::new("target", vec![number as f64], vec![1.0]));
///     let solver = solve(problem, &mut [7.0], &Options::default())?;
///     let stage = Stage::new(format!("level {number}"), number, 2);
///     Ok::<_, SolverError>(StageReport { stage, solver })
/// };
/// let run = RunReport::of_stages(vec![stage(0)?, stage(1)?]);
/// assert_eq!(run.status, run.stages[1].solver.status);
/// assert_eq!(run.iterations, run.stages.iter().map(|s| s.solver.iterations).sum::<usize>());
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RunReport {
    /// How the run ended.
    pub status: Status,
    /// Steps taken, all stages together.
    pub iterations: usize,
    /// Every stage.
    pub stages: Vec<StageReport>,
}

impl RunReport {
    /// The report of these stages, with the status of the last one.
    #[must_use]
    pub fn of_stages(stages: Vec<StageReport>) -> Self {
        let status = stages.last().map_or(Status::Converged, |s| s.solver.status);
        let iterations = stages.iter().map(|s| s.solver.iterations).sum();
        Self { status, iterations, stages }
    }

    /// Wall-clock milliseconds per step of the last stage.
    #[must_use]
    pub fn ms_per_iteration(&self) -> f64 {
        self.stages.last().map_or(0.0, |s| s.solver.ms_per_iteration())
    }

    /// Matrix factorisations, refused trials included.
    #[must_use]
    pub fn factorizations(&self) -> usize {
        self.stages.iter().map(|s| s.solver.factorizations).sum()
    }

    /// Free unknowns of the last stage.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.stages.last().map_or(0, |s| s.solver.variables)
    }
}
