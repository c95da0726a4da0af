//! What is solved one after the other: the input refitted to each net, on one working scale.

use bspline::{BsplineSurface, Degree, KnotError, KnotVector, Trim};
use geom_core::Normalization;
use glam::DVec3;
use gp_solver::{Counts, Stage};

use crate::error::Error;
use crate::grid::SampleGrid;
use crate::input::Input;
use crate::level::Level;
use crate::options::{Formulation, Move, Options};
use crate::sampled::{curvature_size, regular_samples, sample_counts};
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
        let nets = nets(&input, &options.levels)?;
        let unit = working_unit(&nets[0], trim, size, options.samples)?;
        Ok(Self { nets, unit, center, samples: options.samples, trim })
    }

    /// Number of levels.
    pub(crate) fn len(&self) -> usize {
        self.nets.len()
    }

    /// A level on the working scale.
    pub(crate) fn level(&self, number: usize) -> Result<Level, Error> {
        let reference = scaled(&self.nets[number], self.unit)?;
        let name = Counts { u: reference.n_u(), v: reference.n_v() }.to_string();
        let stage = Stage::new(name, number, self.len()).at(self.center.to_array(), self.unit);
        Level::new(reference, self.trim, self.samples, stage)
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

/// The reference at every level: the input refitted to each net, or the input itself.
fn nets(input: &BsplineSurface, levels: &[Counts]) -> Result<Vec<BsplineSurface>, Error> {
    if levels.is_empty() {
        return Ok(vec![input.clone()]);
    }
    let level = |counts: &Counts| {
        let knots = |like: &KnotVector, n: usize| {
            uniform_like(like, n)
                .map_err(|source| Error::LevelKnots { level: counts.to_string(), source })
        };
        let (u, v) = (knots(input.knots_u(), counts.u)?, knots(input.knots_v(), counts.v)?);
        if !input.is_rational() && u == *input.knots_u() && v == *input.knots_v() {
            return Ok(input.clone());
        }
        input.refit(&u, &v).map_err(|source| Error::Level { level: counts.to_string(), source })
    };
    levels.iter().map(level).collect()
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
    let grid = SampleGrid::uniform(surface, sample_counts(surface, samples));
    let grid = grid.within(trim, surface);
    let samples = regular_samples(&grid, &coordinates(surface))?;
    let curvature = curvature_size(surface, &samples);
    Ok(curvature.map_or(1.0 / size, |curvature| curvature / WORKING_CURVATURE))
}
