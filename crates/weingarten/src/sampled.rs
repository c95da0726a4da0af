//! A surface with its samples: where a level begins, and what its rows take their scales from.

use std::sync::Arc;

use bspline::BsplineSurface;
use geom_core::{BoundingBox, FirstForm};
use gp_solver::Counts;

use crate::error::Error;
use crate::field::{Sample, samples};
use crate::grid::SampleGrid;
use crate::variables::coordinates;

/// A surface whose mean absolute principal curvature times its bounding-box diagonal is below
/// this is flat: its working scale is bounding-box diagonal = 1.
const FLAT_RATIO: f64 = 1e-9;

/// A surface sampled on a grid, each sample checked to be regular. Blocks with one row per sample
/// are made from it: it fixes their sparsity, and their residuals are scaled to be of size one
/// there.
#[derive(Clone, Debug)]
pub struct SampledSurface {
    pub(crate) grid: Arc<SampleGrid>,
    /// Coordinates of the control points.
    pub(crate) x: Vec<f64>,
    pub(crate) samples: Vec<Sample>,
    /// Mean absolute principal curvature, or 1 where nothing is curved.
    pub(crate) curvature: f64,
}

impl SampledSurface {
    /// Samples `surface` at the cell corners of a grid over its domain, per knot span as evenly as
    /// the counts allow.
    ///
    /// # Errors
    /// [`Error::Singular`] at a pole, a cusp or a collapsed edge.
    ///
    /// ```
    /// use gp_solver::{Counts, check_jacobian};
    /// use weingarten::blocks::{Alignment, SampledSurface};
    /// let roof = fixtures::surfaces::Shape::Roof.surface(6, 5, 3, 3);
    /// let sampled = SampledSurface::new(&roof, Counts { u: 12, v: 10 })?;
    /// let block = Alignment::new(&sampled, 1.0);
    /// let x: Vec<f64> = roof.control_points().iter().flat_map(|p| p.to_array()).collect();
    /// assert!(check_jacobian(&block, &x)?.expect("derivatives").error < 1e-5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(surface: &BsplineSurface, samples: Counts) -> Result<Self, Error> {
        let grid = Arc::new(SampleGrid::uniform(surface, [samples.u, samples.v]));
        let x = coordinates(surface);
        let samples = regular_samples(&grid, &x)?;
        let curvature = curvature_size(surface, &samples).unwrap_or(1.0);
        Ok(Self { grid, x, samples, curvature })
    }

    /// The surface with control points `x` on the grid of a level whose curvatures have the size
    /// `curvature`.
    pub(crate) fn at(grid: &Arc<SampleGrid>, x: &[f64], curvature: f64) -> Result<Self, Error> {
        let samples = regular_samples(grid, x)?;
        Ok(Self { grid: Arc::clone(grid), x: x.to_vec(), samples, curvature })
    }
}

/// The samples of a surface that count, each checked to be regular.
pub(crate) fn regular_samples(grid: &SampleGrid, x: &[f64]) -> Result<Vec<Sample>, Error> {
    if grid.count() == 0 {
        return Err(Error::NothingInside);
    }
    let samples = samples(grid, x);
    let singular = |s: &Sample| {
        let first = FirstForm { e: s.e, f: s.f, g: s.g };
        first.check().is_err() || !(s.jet.h_u.is_finite() && s.jet.k_v.is_finite())
    };
    match samples.iter().position(singular) {
        Some(k) => {
            let [u, v] = grid.parameters(grid.place(k));
            Err(Error::Singular { u, v })
        }
        None => Ok(samples),
    }
}

/// Samples in u and v: as asked for, or twice the control points.
pub(crate) fn sample_counts(surface: &BsplineSurface, samples: Option<Counts>) -> [usize; 2] {
    samples.map_or([2 * surface.n_u(), 2 * surface.n_v()], |s| [s.u, s.v])
}

/// Mean absolute principal curvature of samples of a surface, `None` where nothing is curved.
pub(crate) fn curvature_size(surface: &BsplineSurface, samples: &[Sample]) -> Option<f64> {
    let mean = |s: &Sample| {
        let (k1, k2) = s.principal();
        0.5 * (k1.abs() + k2.abs())
    };
    let curvature = samples.iter().map(mean).sum::<f64>() / samples.len() as f64;
    (curvature * extent(surface) > FLAT_RATIO).then_some(curvature)
}

/// Diagonal of the bounding box of the control points: a size that costs nothing, for what does not
/// depend on a factor of two.
fn extent(surface: &BsplineSurface) -> f64 {
    BoundingBox::of(surface.control_points().iter().copied()).map_or(0.0, BoundingBox::diagonal)
}
