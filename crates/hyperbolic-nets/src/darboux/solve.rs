//! The image of a whole net, sampled and measured.

use geom_core::{Ball, BoundingBox, DVec3};
use gp_solver::{Observer, RunReport, Status};
use serde::Serialize;

use super::cage::{CageFit, cage_corners, fit_cage};
use super::error::Error;
use super::map::DarbouxMap;
use super::options::Options;
use super::transformed::TransformedNet;
use crate::net::{HyperbolicNet, PlacedNet, SampledPatches};

/// Accuracy of the sampled image as a share of its bounding-box diagonal.
const ACCURACY: f64 = 1e-4;
/// Growth of the box on every side, as a share of its diagonal.
const CAGE_MARGIN: f64 = 0.05;

/// Measures of an image.
///
/// # Example
/// ```
/// # use geom_core::PolyMesh;
/// # use hyperbolic_nets::{Input, QuadNet, darboux};
/// # let model = fixtures::asymptotic_nets::catenoid(20, 14);
/// # let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// # let skin = hyperbolic_nets::solve(&Input::new(&net), &Default::default(), &mut ())?;
/// let options = darboux::Options { c: Some(-0.6), ..Default::default() };
/// let metrics = darboux::solve(&skin.result, &options, &mut ())?.metrics;
/// // Rulings become circles, and the image is as smooth as the net.
/// assert!(metrics.circle_defect_max < 1e-9 && metrics.kink_max_deg < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
///
/// # Example
/// The other image of the same map, in units of the model:
/// ```
/// # use geom_core::PolyMesh;
/// # use hyperbolic_nets::{Input, QuadNet};
/// use hyperbolic_nets::darboux::{Branch, Options, solve_placed};
/// # let model = fixtures::asymptotic_nets::catenoid(20, 14);
/// # let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// # let skin = hyperbolic_nets::solve(&Input::new(&net), &Default::default(), &mut ())?;
/// let options = Options { c: Some(-0.6), ..Default::default() };
/// let image = solve_placed(skin.placed, &options, &mut ())?;
/// let samples = image.result.samples.len();
/// assert_eq!(samples, image.metrics.samples);
/// let other = image.placed.sample_image(&image.map, Branch::Other, 4)?;
/// assert!(other.samples[0].point.distance(image.result.samples[0].point) > 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    /// The transformation, of normalised coordinates.
    pub map: DarbouxMap,
    /// The net in normalised coordinates, which gives further images in model units.
    pub placed: PlacedNet,
    /// Of a transformation by a cage: distance of the image of every corner from where it was asked
    /// to go, in model units.
    pub corner_errors: Option<[f64; 8]>,
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
    if surface.net().positions().is_empty() {
        return Err(Error::NoVertex);
    }
    solve_placed(PlacedNet::new(surface)?, options, observer)
}

/// As [`solve`], of a net that is in normalised coordinates already, such as that of
/// [`crate::Solution`]: nothing of it is lost, wherever its model stands.
///
/// # Errors
/// As [`solve`].
pub fn solve_placed(
    placed: PlacedNet,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let corners = cage_corners(bounds_of(placed.net())?, CAGE_MARGIN);
    let Transformation { map, c, fit } =
        transformation(&placed, &corners, options).map_err(|e| placed.told(e))?;
    let (sampled, sampling_error, sampling) =
        sampled(&placed, &map, options, observer).map_err(|e| placed.told(e))?;
    let kinks = TransformedNet::new(placed.net(), &map, options.branch)?.kinks()?;
    let unit = placed.place().scale().recip();
    let circle_defect_max = circle_defect(&sampled) * unit;
    let sampling_error_max = sampling_error * unit;
    let result = placed.restored(sampled);
    let mut warnings = Vec::new();
    if sampling == Status::IterationLimit {
        warnings.push(Warning::Coarse { error: sampling_error_max });
    }
    let corner_errors = fit.map(|fit| fit.errors.map(|e| e * unit));
    let (gaussian_curvature_min, gaussian_curvature_max) = result.range(|s| s.gaussian_curvature);
    let (mean_curvature_min, mean_curvature_max) = result.range(|s| s.mean_curvature);
    let metrics = Metrics {
        faces: placed.net().shape().len(),
        c,
        kink_max_deg: kinks.iter().copied().fold(0.0, f64::max).to_degrees(),
        kink_mean_deg: (kinks.iter().sum::<f64>() / kinks.len().max(1) as f64).to_degrees(),
        gaussian_curvature_min,
        gaussian_curvature_max,
        mean_curvature_min,
        mean_curvature_max,
        cage_error_max: corner_errors.map(|errors| errors.into_iter().fold(0.0, f64::max)),
        sampling_error_max,
        samples: result.samples.len(),
        circle_defect_max,
        centroid: placed.place().restore(centroid(&placed, &result)).to_array(),
    };
    let status = match sampling {
        Status::Interrupted => Status::Interrupted,
        _ => Status::Converged,
    };
    let report = RunReport { status, iterations: 0, stages: Vec::new() };
    let corners = corners.map(|p| placed.place().restore(p));
    Ok(Solution { result, metrics, report, warnings, map, placed, corner_errors, corners })
}

fn bounds_of(surface: &HyperbolicNet) -> Result<BoundingBox, Error> {
    BoundingBox::of(surface.net().positions().iter().copied()).ok_or(Error::NoVertex)
}

/// What the options ask for, in normalised coordinates.
struct Transformation {
    map: DarbouxMap,
    c: Option<f64>,
    fit: Option<CageFit>,
}

fn transformation(
    placed: &PlacedNet,
    corners: &[DVec3; 8],
    options: &Options,
) -> Result<Transformation, Error> {
    if let Some(c) = options.c {
        let ball = Ball::around(placed.net().net().positions()).ok_or(Error::NoVertex)?;
        let map = DarbouxMap::new(c)?.in_frame(ball.center, ball.diameter())?;
        return Ok(Transformation { map, c: Some(c), fit: None });
    }
    let mut images = *corners;
    for corner in options.corners.iter() {
        images[corner.index] = placed.place().apply(corner.point);
    }
    let fit = fit_cage(corners, &images, options.freedom)?;
    Ok(Transformation { map: fit.map.clone(), c: fit.c, fit: Some(fit) })
}

/// The image in normalised coordinates, its accuracy and whether that suffices.
fn sampled(
    placed: &PlacedNet,
    map: &DarbouxMap,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<(SampledPatches, f64, Status), Error> {
    let image = TransformedNet::new(placed.net(), map, options.branch)?;
    let extent = BoundingBox::of(image.positions()?).map_or(1.0, BoundingBox::diagonal);
    image.sample_within(ACCURACY * extent, observer)
}

/// Mean of the samples in normalised coordinates, where far models lose nothing to the sum.
fn centroid(placed: &PlacedNet, sampled: &SampledPatches) -> DVec3 {
    let sum: DVec3 = sampled.samples.iter().map(|s| placed.place().apply(s.point)).sum();
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
