//! One level: a net of control points, optimised from a start towards a reference.

use std::sync::Arc;

use bspline::{BsplineSurface, Trim};
use geom_core::Normalization;
use gp_solver::{Closeness, Problem, Stage};

use crate::area::CheckGrid;
use crate::blocks::{
    Alignment, BorderGlide, BorderSpacing, Fairness, Net, Parallel, Regularity, RelationRows,
    Shape, border_points, reference_rows,
};
use crate::error::Error;
use crate::grid::SampleGrid;
use crate::kernel::Field;
use crate::options::{Border, Options};
use crate::sampled::{SampledSurface, curvature_size, regular_samples, sample_counts};
use crate::stall::Recent;
use crate::target::Target;
use crate::variables::{control_points, coordinates, scaled, variables};

/// Weight of gliding borders against distances on the working scale: large enough that the border
/// stays on its curve to some 1e-4 of the size of the surface.
const BORDER_WEIGHT: f64 = 100.0;
/// Weight of the spacing of gliding border points: against a relation held to a percent it keeps them from
/// bunching, and it hardly weighs against one that is not held yet.
const SPACING_WEIGHT: f64 = 0.3;
/// Weight of the distance to the last iterate (Pellis et al. 2021, Table 1).
pub(crate) const LAST_ITERATE_WEIGHT: f64 = 1e-3;
/// Nodes per knot span and direction of the barrier on the area element, which varies less than
/// curvatures do.
const BARRIER_NODES: usize = 3;
/// Weight of that barrier against a relation missed by as much as the curvatures are.
const BARRIER_WEIGHT: f64 = 1.0;

/// Everything a level is made from, on the working scale.
pub(crate) struct Level {
    /// Knots and weights of the net; its control points are the reference, on the working scale.
    pub(crate) reference: BsplineSurface,
    pub(crate) grid: Arc<SampleGrid>,
    /// Mean absolute principal curvature, or 1 where nothing is curved.
    pub(crate) curvature: f64,
    /// The level's name, number and scale.
    pub(crate) stage: Stage,
    trim: Option<Trim>,
    asked: Option<Asked>,
}

/// What a level asks for in place of the alignment.
#[derive(Clone)]
pub(crate) struct Asked {
    pub(crate) target: Target,
    /// The input on the working scale, which the area elements are compared with.
    pub(crate) input: Arc<BsplineSurface>,
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
        Self::sampled_by(reference, grid, trim, stage, None)
    }

    /// The level that asks for a relation. Its samples are those of quadrature if no counts are given.
    pub(crate) fn asking(
        reference: BsplineSurface,
        trim: Option<&Trim>,
        samples: Option<gp_solver::Counts>,
        stage: Stage,
        asked: Asked,
    ) -> Result<Self, Error> {
        let grid = relation_grid(&reference, samples);
        Self::sampled_by(reference, grid, trim, stage, Some(asked))
    }

    fn sampled_by(
        reference: BsplineSurface,
        grid: SampleGrid,
        trim: Option<&Trim>,
        stage: Stage,
        asked: Option<Asked>,
    ) -> Result<Self, Error> {
        let grid = Arc::new(grid.within(trim, &reference));
        let samples = regular_samples(&grid, &coordinates(&reference))?;
        let curvature = curvature_size(&reference, &samples).unwrap_or(1.0);
        Ok(Self { reference, grid, curvature, stage, trim: trim.cloned(), asked })
    }

    /// Number of coordinates of control points.
    pub(crate) fn unknowns(&self) -> usize {
        self.grid.unknowns()
    }

    /// A surface as one of this level's net.
    pub(crate) fn refitted(&self, surface: &BsplineSurface) -> Result<BsplineSurface, Error> {
        let is_level = surface.knots_u() == self.reference.knots_u()
            && surface.knots_v() == self.reference.knots_v()
            && surface.weights() == self.reference.weights();
        if is_level {
            return Ok(surface.clone());
        }
        surface
            .refit(self.reference.knots_u(), self.reference.knots_v())
            .map_err(|source| Error::Level { level: self.stage.name.clone(), source })
    }

    /// The control points of where a run of the level begins, with a fixed border where it belongs.
    pub(crate) fn bordered(&self, border: Border, mut x: Vec<f64>) -> Vec<f64> {
        if border == Border::Fixed {
            let held = coordinates(&self.reference);
            for control in border_points(Net::of(&self.reference)).into_iter().flatten() {
                let place = 3 * control..3 * control + 3;
                x[place.clone()].copy_from_slice(&held[place]);
            }
        }
        x
    }

    /// The control points of a start, given where the model stands, as this level's.
    pub(crate) fn started(
        &self,
        start: &BsplineSurface,
        place: &Normalization,
    ) -> Result<Vec<f64>, Error> {
        let start = scaled(&start.translated(-place.center()), self.stage.unit)?;
        Ok(coordinates(&self.refitted(&start)?))
    }

    /// The relation asked for, if any.
    pub(crate) fn target(&self) -> Option<&Target> {
        self.asked.as_ref().map(|asked| &asked.target)
    }

    /// The middles of the cells of a grid twice as dense as the samples, as metrics are measured at.
    pub(crate) fn midpoints(&self) -> SampleGrid {
        let fine = [2 * self.grid.u.len(), 2 * self.grid.v.len()];
        SampleGrid::midpoints(&self.reference, fine).within(self.trim.as_ref(), &self.reference)
    }

    /// What tells whether a run of the level has stalled.
    pub(crate) fn recent(&self, options: &Options) -> Recent {
        let weight = options.alignment_weight();
        match self.asked {
            Some(_) => Recent::new("relation", weight, reference_rows(&self.grid)),
            None => Recent::new("alignment", weight, self.grid.count()),
        }
    }

    /// The surface with these coordinates.
    pub(crate) fn surface(&self, x: &[f64]) -> Result<BsplineSurface, Error> {
        Ok(self.reference.with_control_points(control_points(x))?)
    }

    /// The surface with these control points on the grid of the level.
    pub(crate) fn sampled(&self, x: &[f64]) -> Result<SampledSurface, Error> {
        SampledSurface::at(&self.grid, x, self.curvature)
    }

    /// The problem of the eliminated formulation: scales come from `start`, and the run begins at `x`.
    pub(crate) fn problem(
        &self,
        options: &Options,
        start: &SampledSurface,
        x: &[f64],
    ) -> Result<Problem<'static>, Error> {
        let mut problem = Problem::new(variables(&self.reference, options.border)?);
        match &self.asked {
            None => {
                problem.add(Alignment::new(start, options.alignment_weight()));
            }
            Some(Asked { target, input }) => {
                let weight = options.alignment_weight();
                problem.add(RelationRows::of_target(start, target.clone(), weight));
                let check = CheckGrid::new(input, &self.reference, self.trim.as_ref(), x);
                let grid = SampleGrid::quadrature(&self.reference, |_| BARRIER_NODES, 1);
                let grid = Arc::new(grid.within(self.trim.as_ref(), &self.reference));
                let reference = coordinates(&self.reference);
                let rows = reference_rows(&grid);
                let check = Arc::new(check);
                problem.add(Regularity::new(grid, check, &reference, rows, BARRIER_WEIGHT));
            }
        }
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
        match options.border {
            Border::Glide => {
                problem.add(BorderGlide::new(net, reference, BORDER_WEIGHT));
                problem.add(BorderSpacing::new(net, reference, SPACING_WEIGHT));
            }
            Border::Soft(weight) if weight > 0.0 => {
                let mut weights = vec![0.0; reference.len()];
                for control in border_points(net).into_iter().flatten() {
                    weights[3 * control..3 * control + 3].fill(weight);
                }
                problem.add(Closeness::new("border", reference.to_vec(), weights));
            }
            _ => {}
        }
    }
}

/// The samples of a level that asks for a relation: those asked for, or the nodes of a quadrature rule
/// that is exact for products of two splines in every knot span. Between samples further apart a relation
/// can hold on them and nowhere else.
pub(crate) fn relation_grid(
    surface: &BsplineSurface,
    samples: Option<gp_solver::Counts>,
) -> SampleGrid {
    match samples {
        Some(counts) => SampleGrid::uniform(surface, [counts.u, counts.v]),
        None => SampleGrid::quadrature(surface, |order| order, 2),
    }
}
