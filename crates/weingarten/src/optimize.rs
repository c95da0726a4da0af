//! The whole run: scale, levels, solve, measure.

use std::ops::ControlFlow;
use std::sync::Arc;

use bspline::{BsplineSurface, Degree, KnotError, KnotVector};
use geom_core::BoundingBox;
use glam::DVec3;
use gp_solver::{Observer, Report, Status};

use crate::checkpoint::{Checkpoint, fingerprint};
use crate::error::WeingartenError;
use crate::field::Sample;
use crate::grid::SampleGrid;
use crate::level::{Level, regular_samples};
use crate::lifted;
use crate::locus::RelationLocus;
use crate::metrics::{Meter, Metrics, control_points, coordinates};
use crate::options::{Formulation, WeingartenOptions};

/// Mean absolute principal curvature on the working scale (Pellis et al. 2021, Table 1).
const WORKING_CURVATURE: f64 = 5.0;
/// A surface whose mean absolute principal curvature times its bounding-box diagonal is below
/// this is flat: its working scale is bounding-box diagonal = 1.
const FLAT_RATIO: f64 = 1e-9;
/// Least degree a level is refitted with: the derivatives of the curvatures are those of the
/// third derivatives of the surface.
const LEAST_DEGREE: usize = 3;

/// What an observer sees after every step (and at the start of every level).
#[derive(Clone, Copy, Debug)]
pub struct Progress<'s> {
    /// Number of the level, from 0.
    pub level: usize,
    /// Number of levels.
    pub levels: usize,
    /// Steps taken at this level.
    pub iteration: usize,
    /// Steps allowed at each level.
    pub iterations: usize,
    /// Energy of the iterate.
    pub energy: f64,
    state: &'s State<'s>,
}

/// What a checkpoint needs.
#[derive(Clone, Copy, Debug)]
struct State<'s> {
    fingerprint: u64,
    start: &'s [f64],
    x: &'s [f64],
    damping: f64,
}

impl Progress<'_> {
    /// Everything needed to go on from here and end with the same bytes.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            schema: Checkpoint::SCHEMA,
            fingerprint: self.state.fingerprint,
            level: self.level,
            iteration: self.iteration,
            damping: self.state.damping,
            start: self.state.start.to_vec(),
            x: self.state.x.to_vec(),
        }
    }
}

/// One level of a run.
#[derive(Clone, Debug)]
pub struct LevelReport {
    /// Control points in u and v.
    pub control: (usize, usize),
    /// Samples in u and v.
    pub samples: (usize, usize),
    /// What the solver did; the history of a resumed level begins where it was resumed.
    pub solver: Report,
}

/// What a run did.
#[derive(Clone, Debug)]
pub struct WeingartenReport {
    /// How the last level ended.
    pub status: Status,
    /// Steps taken, all levels together.
    pub iterations: usize,
    /// Every level.
    pub levels: Vec<LevelReport>,
    /// Working lengths per length of the model: the optimiser's surface has mean absolute
    /// principal curvature 5.
    pub unit: f64,
}

impl WeingartenReport {
    /// Wall-clock milliseconds per step of the last level.
    #[must_use]
    pub fn ms_per_iteration(&self) -> f64 {
        self.levels.last().map_or(0.0, |l| l.solver.ms_per_iteration())
    }

    /// Matrix factorisations, refused trials included.
    #[must_use]
    pub fn factorizations(&self) -> usize {
        self.levels.iter().map(|l| l.solver.factorizations).sum()
    }

    /// Unknowns of the last level.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.levels.last().map_or(0, |l| l.solver.variables)
    }
}

/// An optimised surface with what is to be said about it.
#[derive(Clone, Debug)]
pub struct Optimized {
    /// The result, in units of the model.
    pub surface: BsplineSurface,
    /// How Weingarten the input is, with the samples of the last level.
    pub before: Metrics,
    /// How Weingarten the result is.
    pub after: Metrics,
    /// Where the relation asked for holds in the curvature diagram, with the coefficients it ended
    /// with; none for [`crate::Relation::Free`].
    pub relation: Option<RelationLocus>,
    /// What the solver did.
    pub report: WeingartenReport,
}

/// Optimises `surface` towards a Weingarten surface near to it.
///
/// # Errors
/// [`WeingartenError`] for what cannot be attempted. Not converging is a [`Status`] of the report.
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector};
/// use geom_core::DVec3;
/// use weingarten::{WeingartenOptions, optimize};
/// let knots = KnotVector::clamped_uniform(Degree::new(4)?, 8)?;
/// let point = |i: usize, j: usize| {
///     let (x, y) = (i as f64 / 7.0, j as f64 / 7.0);
///     DVec3::new(x, y, 0.4 * x * x + 0.3 * x * y * y - 0.2 * y * y)
/// };
/// let net = (0..64).map(|k| point(k / 8, k % 8)).collect();
/// let surface = BsplineSurface::new(knots.clone(), knots, net, None)?;
/// let result = optimize(&surface, &WeingartenOptions::default())?;
/// assert!(result.after.alignment_rms < 0.1 * result.before.alignment_rms);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn optimize(
    surface: &BsplineSurface,
    options: &WeingartenOptions,
) -> Result<Optimized, WeingartenError> {
    optimize_observed(surface, options, None, |_| ControlFlow::Continue(()))
}

/// As [`optimize`], from a checkpoint if there is one, calling `observer` at the start of every
/// level and after every step; it can stop the run, which keeps the surface it was shown.
///
/// # Errors
/// As [`optimize`], and [`WeingartenError::ForeignCheckpoint`].
pub fn optimize_observed(
    surface: &BsplineSurface,
    options: &WeingartenOptions,
    resume: Option<&Checkpoint>,
    mut observer: impl FnMut(&Progress<'_>) -> ControlFlow<()>,
) -> Result<Optimized, WeingartenError> {
    options.check()?;
    let fingerprint = fingerprint(surface, options);
    let input = moved(surface, options)?;
    let nets = nets(&input, options)?;
    let unit = working_unit(&nets[0], options)?;
    let mut levels: Vec<LevelReport> = Vec::new();
    let mut current: Option<BsplineSurface> = None;
    let mut level = None;
    let mut start_samples = Vec::new();
    for (number, reference) in nets.iter().enumerate() {
        let resumed = resume.filter(|c| c.level == number);
        if resume.is_some_and(|c| number < c.level) {
            continue;
        }
        let reference = scaled(reference, unit)?;
        let this = Level::new(reference, options, unit)?;
        let origin = match (&current, resumed) {
            (_, Some(checkpoint)) => {
                checkpoint.check(fingerprint, this.grid.unknowns())?;
                checkpoint.start.clone()
            }
            (None, None) => coordinates(&this.reference),
            (Some(previous), None) => {
                let fitted = previous
                    .refit(this.reference.knots_u(), this.reference.knots_v())
                    .map_err(|source| WeingartenError::Level { level: this.name(), source })?;
                coordinates(&fitted)
            }
        };
        let mut x = resumed.map_or_else(|| origin.clone(), |c| c.x.clone());
        let taken = resumed.map_or(0, |c| c.iteration);
        let mut watch = Watch {
            damping: 0.0,
            show: |iteration: &gp_solver::Progress<'_>, damping: f64| {
                let state = State { fingerprint, start: &origin, x: iteration.x, damping };
                observer(&Progress {
                    level: number,
                    levels: nets.len(),
                    iteration: taken + iteration.iteration,
                    iterations: options.iterations,
                    energy: iteration.energy,
                    state: &state,
                })
            },
        };
        let left = options.iterations.saturating_sub(taken);
        let solver = match options.formulation {
            Formulation::Reduced => {
                let damping = resumed.map(|c| c.damping);
                this.solve(options, &origin, &mut x, left, damping, &mut watch)?
            }
            Formulation::Lifted => lifted::solve(&this, options, &mut x, left, &mut watch)?,
        };
        let interrupted = solver.status == Status::Interrupted;
        levels.push(LevelReport {
            control: (this.reference.n_u(), this.reference.n_v()),
            samples: (this.grid.u.len(), this.grid.v.len()),
            solver,
        });
        start_samples = regular_samples(&this.grid, &origin)?;
        current = Some(this.reference.with_control_points(control_points(&x))?);
        level = Some(this);
        if interrupted {
            break;
        }
    }
    let (Some(level), Some(working)) = (level, current) else {
        return Err(WeingartenError::ForeignCheckpoint { what: "a run with more levels" });
    };
    finish(surface, options, &level, &start_samples, &working, levels)
}

/// Shows steps with the damping of the state behind them.
struct Watch<F> {
    damping: f64,
    show: F,
}

impl<F: FnMut(&gp_solver::Progress<'_>, f64) -> ControlFlow<()>> Observer for Watch<F> {
    fn checkpoint(&mut self, state: &dyn Fn() -> gp_solver::Checkpoint) {
        self.damping = state().numbers("damping", 1).map_or(0.0, |d| d[0]);
    }

    fn step(&mut self, progress: &gp_solver::Progress<'_>) -> ControlFlow<()> {
        (self.show)(progress, self.damping)
    }
}

/// Back to the model's units, measured and put together.
fn finish(
    input: &BsplineSurface,
    options: &WeingartenOptions,
    level: &Level,
    start: &[Sample],
    working: &BsplineSurface,
    levels: Vec<LevelReport>,
) -> Result<Optimized, WeingartenError> {
    let status = levels.last().map_or(Status::Converged, |l| l.solver.status);
    let iterations = levels.iter().map(|l| l.solver.iterations).sum();
    // A net nothing has moved is the input itself, to the last bit.
    let surface = if iterations == 0 && options.levels.is_empty() && options.moves.is_empty() {
        input.clone()
    } else {
        scaled(working, 1.0 / level.unit)?
    };
    let target = level.target(options, start);
    let meter = Meter::new(input, [level.grid.u.len(), level.grid.v.len()], level.unit);
    Ok(Optimized {
        before: meter.measure(input, target.as_ref()),
        after: meter.measure(&surface, target.as_ref()),
        relation: target.as_ref().map(|target| meter.locus(&surface, target)),
        report: WeingartenReport { status, iterations, levels, unit: level.unit },
        surface,
    })
}

impl Level {
    /// Samples of a level: as asked for, or twice its control points.
    pub(crate) fn new(
        reference: BsplineSurface,
        options: &WeingartenOptions,
        unit: f64,
    ) -> Result<Self, WeingartenError> {
        let grid = Arc::new(SampleGrid::uniform(&reference, sample_counts(&reference, options)));
        let samples = regular_samples(&grid, &coordinates(&reference))?;
        let curvature = mean_absolute_curvature(&samples);
        let flat = curvature * extent(&reference)? <= FLAT_RATIO;
        Ok(Self { reference, grid, curvature: if flat { 1.0 } else { curvature }, unit })
    }

    /// The size of the net, for messages.
    pub(crate) fn name(&self) -> String {
        format!("{}x{}", self.reference.n_u(), self.reference.n_v())
    }
}

fn sample_counts(surface: &BsplineSurface, options: &WeingartenOptions) -> [usize; 2] {
    options.samples.map_or([2 * surface.n_u(), 2 * surface.n_v()], |(u, v)| [u, v])
}

/// The input with its control points moved as asked for.
fn moved(
    surface: &BsplineSurface,
    options: &WeingartenOptions,
) -> Result<BsplineSurface, WeingartenError> {
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let mut points = surface.control_points().to_vec();
    for m in &options.moves {
        let &crate::options::Move { i, j, by } = m;
        if i >= n_u || j >= n_v {
            return Err(WeingartenError::NoSuchControlPoint { i, j, n_u, n_v });
        }
        points[i * n_v + j] += DVec3::from_array(by);
    }
    Ok(surface.with_control_points(points)?)
}

/// The reference at every level: the input refitted to each net, or the input itself.
fn nets(
    input: &BsplineSurface,
    options: &WeingartenOptions,
) -> Result<Vec<BsplineSurface>, WeingartenError> {
    if options.levels.is_empty() {
        return Ok(vec![input.clone()]);
    }
    let level = |&(n_u, n_v): &(usize, usize)| {
        let name = || format!("{n_u}x{n_v}");
        let knots = |like: &KnotVector, n: usize| {
            uniform_like(like, n)
                .map_err(|source| WeingartenError::LevelKnots { level: name(), source })
        };
        let (u, v) = (knots(input.knots_u(), n_u)?, knots(input.knots_v(), n_v)?);
        if !input.is_rational() && u == *input.knots_u() && v == *input.knots_v() {
            return Ok(input.clone());
        }
        input.refit(&u, &v).map_err(|source| WeingartenError::Level { level: name(), source })
    };
    options.levels.iter().map(level).collect()
}

/// Uniform knots of `n` control points with degree, domain and closedness of `like`.
fn uniform_like(like: &KnotVector, n: usize) -> Result<KnotVector, KnotError> {
    let degree = Degree::new(like.degree().get().max(LEAST_DEGREE))?;
    let (start, end) = like.domain();
    let at = |t: f64| {
        if t >= 1.0 { end } else { start + (end - start) * t }
    };
    if like.is_periodic() {
        let period: Vec<f64> = (0..=n).map(|i| at(i as f64 / n as f64)).collect();
        return KnotVector::periodic(degree, &period);
    }
    let unit = KnotVector::clamped_uniform(degree, n)?;
    KnotVector::new(degree, unit.knots().iter().map(|&t| at(t)).collect())
}

/// Working lengths per length of the model.
fn working_unit(
    surface: &BsplineSurface,
    options: &WeingartenOptions,
) -> Result<f64, WeingartenError> {
    let extent = extent(surface)?;
    let grid = SampleGrid::uniform(surface, sample_counts(surface, options));
    let samples = regular_samples(&grid, &coordinates(surface))?;
    let curvature = mean_absolute_curvature(&samples);
    let flat = curvature * extent <= FLAT_RATIO;
    Ok(if flat { 1.0 / extent } else { curvature / WORKING_CURVATURE })
}

/// Diagonal of the bounding box of the control points.
fn extent(surface: &BsplineSurface) -> Result<f64, WeingartenError> {
    let diagonal = BoundingBox::of(surface.control_points().iter().copied())
        .map_or(0.0, BoundingBox::diagonal);
    if diagonal > 0.0 { Ok(diagonal) } else { Err(WeingartenError::NoExtent) }
}

fn mean_absolute_curvature(samples: &[Sample]) -> f64 {
    let mean = |s: &Sample| {
        let (k1, k2) = s.principal();
        0.5 * (k1.abs() + k2.abs())
    };
    samples.iter().map(mean).sum::<f64>() / samples.len() as f64
}

fn scaled(surface: &BsplineSurface, factor: f64) -> Result<BsplineSurface, WeingartenError> {
    let points = surface.control_points().iter().map(|p| *p * factor).collect();
    Ok(surface.with_control_points(points)?)
}
