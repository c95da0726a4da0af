//! The image of a whole net, sampled and measured.

use geom_core::{BoundingBox, DVec3};
use gp_solver::{Observer, RunReport, Status};
use serde::Serialize;

use super::cage::{CageFit, cage_corners, fit_cage};
use super::error::Error;
use super::map::DarbouxMap;
use super::options::Options;
use super::transformed::TransformedNet;
use crate::net::{HyperbolicNet, SampledPatches};

/// Accuracy of the sampled image as a share of its bounding-box diagonal.
const ACCURACY: f64 = 1e-4;
/// Growth of the box on every side, as a share of its diagonal.
const CAGE_MARGIN: f64 = 0.05;

/// Measures of an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Patches.
    pub faces: usize,
    /// The centre that was asked for, or found for a cage with 16 degrees of freedom.
    pub c: Option<f64>,
    /// Largest kink between patches, in degrees.
    pub kink_max_deg: f64,
    /// Mean over the inner edges of the largest kink of each, in degrees.
    pub kink_mean_deg: f64,
    /// Least Gaussian curvature of the samples, in 1/length².
    pub gaussian_curvature_min: f64,
    /// Largest Gaussian curvature of the samples, in 1/length².
    pub gaussian_curvature_max: f64,
    /// Least mean curvature of the samples, in 1/length.
    pub mean_curvature_min: f64,
    /// Largest mean curvature of the samples, in 1/length.
    pub mean_curvature_max: f64,
    /// Largest distance of the image of a corner of the cage from where it was to go.
    pub cage_error_max: Option<f64>,
    /// How far the cells between the samples are off the surface at most.
    pub sampling_error_max: f64,
    /// Samples.
    pub samples: usize,
    /// Largest distance of a sample from the circle its parameter line is: rulings go to circles.
    pub circle_defect_max: f64,
    /// Mean of the samples.
    pub centroid: [f64; 3],
}

/// What a user should know although there is a result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Warning {
    /// The finest sampling misses the accuracy.
    #[error(
        "the sampled image is {error:.2e} length units off in places; parts of it are strongly curved"
    )]
    Coarse { error: f64 },
}

/// An image with what is to be said about it.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Points, normals and curvatures on all patches, dense enough for 10⁻⁴ of the size.
    pub result: SampledPatches,
    /// Its measures.
    pub metrics: Metrics,
    /// No steps: converged, or interrupted by the observer.
    pub report: RunReport,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// The transformation.
    pub map: DarbouxMap,
    /// The cage it was fitted to, if it was.
    pub fit: Option<CageFit>,
    /// The corners of the cage before.
    pub corners: [DVec3; 8],
}

/// Transforms a hyperbolic net into a smooth surface of Darboux cyclide patches (Shi et al. 2014,
/// §4).
///
/// # Errors
/// [`Error`] where there is no transformation, or the net has no real and finite image.
///
/// # Example
/// ```
/// use geom_core::PolyMesh;
/// use hyperbolic_nets::{Input, Options, QuadNet, darboux, solve};
/// let model = fixtures::asymptotic_nets::catenoid(20, 14);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let skin = solve(&Input::new(&net), &Options::default(), &mut ())?.result;
/// let options = darboux::Options { c: Some(-0.6), ..Default::default() };
/// let image = darboux::solve(&skin, &options, &mut ())?;
/// assert!(image.metrics.kink_max_deg < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(
    surface: &HyperbolicNet,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let bounds =
        BoundingBox::of(surface.net().positions().iter().copied()).ok_or(Error::NoVertex)?;
    let corners = cage_corners(bounds, CAGE_MARGIN);
    let (map, c, fit) = match options.c {
        Some(c) => {
            let map = DarbouxMap::new(c)?.in_frame(bounds.center(), bounds.diagonal())?;
            (map, Some(c), None)
        }
        None => {
            let mut images = corners;
            for corner in options.corners.iter() {
                images[corner.index] = corner.point;
            }
            let fit = fit_cage(&corners, &images, options.freedom)?;
            (fit.map.clone(), fit.c, Some(fit))
        }
    };
    let image = TransformedNet::new(surface, &map, options.branch)?;
    let extent = BoundingBox::of(image.positions()?).map_or(1.0, BoundingBox::diagonal);
    let (result, error, status) = image.sample_within(ACCURACY * extent, observer)?;
    let mut warnings = Vec::new();
    if status == Status::IterationLimit {
        warnings.push(Warning::Coarse { error });
    }
    let kinks = image.kinks()?;
    let (gaussian_curvature_min, gaussian_curvature_max) = result.range(|s| s.gaussian_curvature);
    let (mean_curvature_min, mean_curvature_max) = result.range(|s| s.mean_curvature);
    let metrics = Metrics {
        faces: surface.shape().len(),
        c,
        kink_max_deg: kinks.iter().copied().fold(0.0, f64::max).to_degrees(),
        kink_mean_deg: (kinks.iter().sum::<f64>() / kinks.len().max(1) as f64).to_degrees(),
        gaussian_curvature_min,
        gaussian_curvature_max,
        mean_curvature_min,
        mean_curvature_max,
        cage_error_max: fit.as_ref().map(|f| f.errors.iter().copied().fold(0.0, f64::max)),
        sampling_error_max: error,
        samples: result.samples.len(),
        circle_defect_max: circle_defect(&result),
        centroid: centroid(&result).to_array(),
    };
    let status =
        if status == Status::Interrupted { Status::Interrupted } else { Status::Converged };
    let report = RunReport { status, iterations: 0, stages: Vec::new() };
    Ok(Solution { result, metrics, report, warnings, map, fit, corners })
}

fn centroid(sampled: &SampledPatches) -> DVec3 {
    let sum: DVec3 = sampled.samples.iter().map(|s| s.point).sum();
    sum / sampled.samples.len().max(1) as f64
}

/// Largest distance of the samples along a parameter line from the circle through the first, the
/// middle and the last of them, to first order.
///
/// Inverted at the first point, the circle is the line through the images of the other two, on which
/// those of all points must lie; a straight line is no exception.
fn circle_defect(sampled: &SampledPatches) -> f64 {
    let (n, point) = (sampled.cells, |k: usize| sampled.samples[k].point);
    let side = n + 1;
    let along = |start: usize, step: usize| {
        let a = point(start);
        let inverted = |k: usize| {
            let chord = point(start + k * step) - a;
            chord / chord.length_squared()
        };
        let (foot, middle) = (inverted(n), inverted(n / 2));
        let direction = (middle - foot).normalize_or_zero();
        let distance = |k: usize| {
            let chord = point(start + k * step) - a;
            (inverted(k) - foot).cross(direction).length() * chord.length_squared()
        };
        (1..n).map(distance).fold(0.0, f64::max)
    };
    let patches = sampled.samples.len() / (side * side);
    let lines = (0..patches).flat_map(|p| (0..side).map(move |k| (p * side * side, k)));
    lines.map(|(from, k)| along(from + k, side).max(along(from + k * side, 1))).fold(0.0, f64::max)
}
