//! What is solved one after the other: the input refitted to each net, on one working scale.

use std::sync::Arc;

use bspline::{BsplineSurface, Degree, KnotError, KnotVector, Trim};
use geom_core::Normalization;
use glam::DVec3;
use gp_solver::{Counts, Stage};

use crate::error::Error;
use crate::grid::SampleGrid;
use crate::input::Input;
use crate::kind::Regressed;
use crate::level::{Asked, Level, relation_grid};
use crate::nested::{refined, with_border_of};
use crate::options::{Border, Formulation, Move, Options};
use crate::relation::Relation;
use crate::sampled::{check_smooth, curvature_size, regular_samples, sample_counts};
use crate::target::{Spread, Target};
use crate::variables::{coordinates, scaled};

/// Mean absolute principal curvature on the working scale (Pellis et al. 2021, Table 1).
const WORKING_CURVATURE: f64 = 5.0;
/// Least degree a level is refitted with: the derivatives of the curvatures are those of the
/// third derivatives of the surface.
const LEAST_DEGREE: usize = 3;

/// The levels of a run, coarse to fine.
pub(crate) struct Schedule<'a> {
    /// The reference of every level, in units of the model, centred.
    nets: Vec<BsplineSurface>,
    /// Working lengths per length of the model.
    unit: f64,
    /// The point of the model that is the origin of everything here.
    center: DVec3,
    samples: Option<Counts>,
    trim: Option<&'a Trim>,
    /// The input on the working scale.
    input: Arc<BsplineSurface>,
    target: Option<Target>,
    /// Where the way to the target begins, if it is taken in several parts.
    begin: Option<Regressed>,
    stages: Vec<Part>,
}

/// A stage: a level, and how far on the way to the relation wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    net: usize,
    /// Which part of how many.
    part: usize,
    parts: usize,
}

impl<'a> Schedule<'a> {
    /// The levels of a surface whose centre has been moved from its `place` to the origin.
    pub(crate) fn new(
        centred: Input<'a>,
        place: &Normalization,
        options: &Options,
    ) -> Result<Self, Error> {
        options.check()?;
        let Input { surface, trim, .. } = centred;
        if trim.is_some() && options.formulation == Formulation::Lifted {
            return Err(Error::NeedsReduced { what: "a trimmed surface" });
        }
        let (center, size) = (place.center(), place.size());
        let input = moved(surface, &options.moves)?;
        let nets = nets(&input, options)?;
        let unit = working_unit(&nets[0], trim, size, options.samples)?;
        let whole = |net| Part { net, part: 1, parts: 1 };
        let mut schedule = Self {
            stages: (0..nets.len()).map(whole).collect(),
            nets,
            unit,
            center,
            samples: options.samples,
            trim,
            input: Arc::new(scaled(&input, unit)?),
            target: None,
            begin: None,
        };
        if options.relation != Relation::Free {
            schedule.ask(options, centred.start, place)?;
        }
        Ok(schedule)
    }

    /// Asks for the relation of the options, in several parts if it is far from what the surface has
    /// where the run begins.
    fn ask(
        &mut self,
        options: &Options,
        start: Option<&BsplineSurface>,
        place: &Normalization,
    ) -> Result<(), Error> {
        let grid = relation_grid(&self.input, self.samples).within(self.trim, &self.input);
        let samples = regular_samples(&grid, &coordinates(&self.input))?;
        let curvature = curvature_size(&self.input, &samples).unwrap_or(1.0);
        let spread = Spread::of(&samples, curvature);
        self.target = Target::new(&options.relation, self.unit, curvature, spread);
        let Some(target) = &self.target else { return Ok(()) };
        let first = self.level(0)?;
        let x = match start {
            Some(start) => first.started(start, place)?,
            None => coordinates(&first.reference),
        };
        let here = first.sampled(&x)?;
        let Some((begin, parts)) = target.regressed(&here.samples) else { return Ok(()) };
        let on_the_way = (1..parts).map(|part| Part { net: 0, part, parts });
        self.stages.splice(0..0, on_the_way);
        self.begin = Some(begin);
        Ok(())
    }

    /// Number of stages.
    pub(crate) fn len(&self) -> usize {
        self.stages.len()
    }

    /// The relation asked for.
    pub(crate) fn target(&self) -> Option<&Target> {
        self.target.as_ref()
    }

    /// The level of a stage on the working scale.
    pub(crate) fn level(&self, number: usize) -> Result<Level, Error> {
        let Part { net, part, parts } = self.stages[number];
        let reference = scaled(&self.nets[net], self.unit)?;
        let mut name = Counts { u: reference.n_u(), v: reference.n_v() }.to_string();
        if part < parts {
            name = format!("{name} {part}/{parts}");
        }
        let stage = Stage::new(name, number, self.len()).at(self.center.to_array(), self.unit);
        let Some(target) = self.target.clone() else {
            return Level::new(reference, self.trim, self.samples, stage);
        };
        let target = match &self.begin {
            Some(begin) => target.on_the_way(begin, part as f64 / parts as f64),
            None => target,
        };
        let asked = Asked { target, input: Arc::clone(&self.input) };
        Level::asking(reference, self.trim, self.samples, stage, asked)
    }
}

/// The input with its control points moved as asked for.
fn moved(surface: &BsplineSurface, moves: &[Move]) -> Result<BsplineSurface, Error> {
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let mut points = surface.control_points().to_vec();
    for &Move { i, j, by } in moves {
        if i >= n_u || j >= n_v {
            return Err(Error::NoSuchControlPoint { i, j, n_u, n_v });
        }
        points[i * n_v + j] += DVec3::from_array(by);
    }
    Ok(surface.with_control_points(points)?)
}

/// The reference at every level: the input refitted to each net, or the input itself. Where the border is
/// held, coarse nets hold its corners and the best fit of its curves; the last one contains the input.
fn nets(input: &BsplineSurface, options: &Options) -> Result<Vec<BsplineSurface>, Error> {
    let levels = &options.levels;
    if levels.is_empty() {
        return Ok(vec![input.clone()]);
    }
    let is_held = options.border != Border::Free;
    // Closed surfaces stay closed.
    let is_open = !input.knots_u().is_periodic() && !input.knots_v().is_periodic();
    let clamped = if is_held && is_open { Some(input.clamped()?) } else { None };
    let input = clamped.as_ref().unwrap_or(input);
    // Splines of a raised degree have knots where they are less smooth than curvatures need.
    let can_nest = matches!(options.border, Border::Fixed | Border::Soft(_))
        && !input.is_rational()
        && [input.knots_u(), input.knots_v()].iter().all(|k| k.is_periodic() || k.is_clamped())
        && input.degree_u().get().min(input.degree_v().get()) >= LEAST_DEGREE;
    let level = |(number, counts): (usize, &Counts)| {
        if can_nest && number + 1 == levels.len() {
            return Ok(refined(input, [counts.u, counts.v])?);
        }
        let fitted = refit_to(input, *counts)?;
        if fitted == *input {
            return Ok(fitted);
        }
        if is_held {
            let fit = |source| Error::Level { level: counts.to_string(), source };
            return with_border_of(&fitted, input).map_err(fit);
        }
        Ok(fitted)
    };
    levels.iter().enumerate().map(level).collect()
}

/// The surface refitted to a net of so many control points; itself if it has that net.
pub(crate) fn refit_to(input: &BsplineSurface, counts: Counts) -> Result<BsplineSurface, Error> {
    let knots = |like: &KnotVector, n: usize| {
        uniform_like(like, n)
            .map_err(|source| Error::LevelKnots { level: counts.to_string(), source })
    };
    let (u, v) = (knots(input.knots_u(), counts.u)?, knots(input.knots_v(), counts.v)?);
    if !input.is_rational() && u == *input.knots_u() && v == *input.knots_v() {
        return Ok(input.clone());
    }
    input.refit(&u, &v).map_err(|source| Error::Level { level: counts.to_string(), source })
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
    trim: Option<&Trim>,
    size: f64,
    samples: Option<Counts>,
) -> Result<f64, Error> {
    check_smooth(surface, trim)?;
    let grid = SampleGrid::uniform(surface, sample_counts(surface, samples));
    let grid = grid.within(trim, surface);
    let samples = regular_samples(&grid, &coordinates(surface))?;
    let curvature = curvature_size(surface, &samples);
    Ok(curvature.map_or(1.0 / size, |curvature| curvature / WORKING_CURVATURE))
}
