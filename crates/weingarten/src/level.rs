//! One level: a net of control points, optimised from a start towards a reference.

use std::sync::Arc;

use bspline::{BsplineSurface, Trim};
use geom_core::Normalization;
use gp_solver::{Closeness, Problem, Stage};

use crate::blocks::{Alignment, BorderGlide, Fairness, Net, Parallel, RelationRows, Shape};
use crate::error::Error;
use crate::grid::SampleGrid;
use crate::kernel::Field;
use crate::options::{Border, Options};
use crate::sampled::{SampledSurface, curvature_size, regular_samples, sample_counts};
use crate::target::Target;
use crate::variables::{control_points, coordinates, scaled, variables};

/// Weight of gliding borders against distances on the working scale: large enough that the border
/// stays on its curve to some 1e-4 of the size of the surface.
const BORDER_WEIGHT: f64 = 100.0;
/// Weight of the distance to the last iterate (Pellis et al. 2021, Table 1).
pub(crate) const LAST_ITERATE_WEIGHT: f64 = 1e-3;
/// Everything a level is made from, on the working scale.
pub(crate) struct Level {
    /// Knots and weights of the net; its control points are the reference, on the working scale.
    pub(crate) reference: BsplineSurface,
    pub(crate) grid: Arc<SampleGrid>,
    /// Mean absolute principal curvature, or 1 where nothing is curved.
    pub(crate) curvature: f64,
    /// The level's name, number and scale.
    pub(crate) stage: Stage,
}

impl Level {
    /// The level of a reference on the working scale, of which the part within `trim` counts.
    pub(crate) fn new(
        reference: BsplineSurface,
        trim: Option<&Trim>,
        samples: Option<gp_solver::Counts>,
        stage: Stage,
    ) -> Result<Self, Error> {
        let grid = SampleGrid::uniform(&reference, sample_counts(&reference, samples));
        let grid = Arc::new(grid.within(trim, &reference));
        let samples = regular_samples(&grid, &coordinates(&reference))?;
        let curvature = curvature_size(&reference, &samples).unwrap_or(1.0);
        Ok(Self { reference, grid, curvature, stage })
    }

    /// Number of coordinates of control points.
    pub(crate) fn unknowns(&self) -> usize {
        self.grid.unknowns()
    }

    /// The target of the relation asked for, judged from the start of the level.
    pub(crate) fn target(&self, options: &Options, start: &SampledSurface) -> Option<Target> {
        Target::new(&options.relation, self.stage.unit, self.curvature, &start.samples)
    }

    /// A surface of another net as one of this level's.
    pub(crate) fn refitted(&self, surface: &BsplineSurface) -> Result<BsplineSurface, Error> {
        surface
            .refit(self.reference.knots_u(), self.reference.knots_v())
            .map_err(|source| Error::Level { level: self.stage.name.clone(), source })
    }

    /// The control points of a start, given where the model stands, as this level's.
    pub(crate) fn started(
        &self,
        start: &BsplineSurface,
        place: &Normalization,
    ) -> Result<Vec<f64>, Error> {
        let start = scaled(&start.translated(-place.center()), self.stage.unit)?;
        let is_level = start.knots_u() == self.reference.knots_u()
            && start.knots_v() == self.reference.knots_v()
            && start.weights() == self.reference.weights();
        Ok(coordinates(&if is_level { start } else { self.refitted(&start)? }))
    }

    /// The surface with these coordinates.
    pub(crate) fn surface(&self, x: &[f64]) -> Result<BsplineSurface, Error> {
        Ok(self.reference.with_control_points(control_points(x))?)
    }

    /// The surface with these control points on the grid of the level.
    pub(crate) fn sampled(&self, x: &[f64]) -> Result<SampledSurface, Error> {
        SampledSurface::at(&self.grid, x, self.curvature)
    }

    /// The problem of the eliminated formulation.
    pub(crate) fn problem(
        &self,
        options: &Options,
        start: &SampledSurface,
    ) -> Result<Problem<'static>, Error> {
        let mut problem = Problem::new(variables(&self.reference, options.border)?);
        match self.target(options, start) {
            None => problem.add(Alignment::new(start, options.alignment_weight())),
            Some(target) => {
                problem.add(RelationRows::of_target(start, target, options.alignment_weight()))
            }
        };
        if options.parallel > 0.0 {
            for field in [Field::Mean, Field::Gauss] {
                problem.add(Parallel::new(start, field, options.parallel));
            }
        }
        let reference = coordinates(&self.reference);
        self.add_net_terms(&mut problem, options, &reference, Some(&reference));
        problem.add(Closeness::to_last_iterate(&start.x, LAST_ITERATE_WEIGHT));
        Ok(problem)
    }

    /// The terms on the control net that both formulations have; `fair` is what the fairness
    /// compares with, if not the net itself is to be fair.
    pub(crate) fn add_net_terms(
        &self,
        problem: &mut Problem<'static>,
        options: &Options,
        reference: &[f64],
        fair: Option<&[f64]>,
    ) {
        let net = Net::of(&self.reference);
        if options.closeness > 0.0 {
            let weights = vec![options.closeness; reference.len()];
            problem.add(Closeness::new("closeness", reference.to_vec(), weights));
        }
        if options.fairness > 0.0 {
            problem.add(Fairness::new(net, fair, options.fairness));
        }
        if options.shape > 0.0 {
            problem.add(Shape::new(net, reference, options.shape));
        }
        if options.border == Border::Glide {
            problem.add(BorderGlide::new(net, reference, BORDER_WEIGHT));
        }
    }
}
