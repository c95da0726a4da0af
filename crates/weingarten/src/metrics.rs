//! How Weingarten a surface is, and how far it has moved.

use bspline::{BsplineSurface, Trim, TrimLoop};
use geom_core::BoundingBox;

use crate::field::{Sample, samples};
use crate::grid::SampleGrid;
use crate::input::Input;
use crate::locus::RelationLocus;
use crate::miss::RelationMiss;
use crate::target::Target;
use crate::variables::coordinates;

/// A curvature counts as constant if it varies by no more than this fraction of its size.
const CONSTANT_RATIO: f64 = 1e-9;

/// What is reported about a surface. Everything is measured on the surface itself at the cell
/// midpoints of a grid with twice the samples in each direction, never on auxiliary variables.
/// Curvatures are in units of the model.
///
/// # Example
/// ```
/// use weingarten::{Options, solve};
/// // Every surface of revolution is a Weingarten surface: its diagram is a curve.
/// let torus = fixtures::surfaces::torus_patch(4, 3);
/// let options = Options { iterations: 0, ..Options::default() };
/// let metrics = solve(&torus, &options, &mut ())?.metrics;
/// assert!(metrics.diagram_area < 1e-9 && metrics.alignment_rms < 1e-6);
/// assert!(metrics.gaussian_curvature_min < 0.0 && metrics.gaussian_curvature_max > 0.0);
/// # Ok::<(), weingarten::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// Root mean square sine of the angle between `∇_s H` and `∇_s K`, weighted by area and
    /// gradients: `√(Σ J²/Δ / Σ |∇_s H|² |∇_s K|²)` with `J = H_u K_v − H_v K_u`. 0 where `H` or
    /// `K` is constant.
    pub alignment_rms: f64,
    /// Integral of `|J|` over the parameter domain (within the trim), over `range H · range K`: the area the
    /// curvature diagram sweeps in units of its box. 0 where `H` or `K` is constant to 1e-9 of
    /// its size.
    pub diagram_area: f64,
    /// Mean same-parameter distance to the input, in percent of its size: the diameter of the
    /// smallest ball around its [check grid](BsplineSurface::check_parameters).
    pub deviation_mean_percent: f64,
    /// Largest same-parameter distance to the input, likewise.
    pub deviation_max_percent: f64,
    /// Largest same-parameter distance along the border, likewise; 0 for a surface without one.
    pub boundary_deviation_max_percent: f64,
    /// [`deviation_mean_percent`](Self::deviation_mean_percent) of the diagonal of the box of the
    /// control points, as releases before gave it.
    pub deviation_mean_percent_box: f64,
    /// [`deviation_max_percent`](Self::deviation_max_percent), likewise.
    pub deviation_max_percent_box: f64,
    /// [`boundary_deviation_max_percent`](Self::boundary_deviation_max_percent), likewise.
    pub boundary_deviation_max_percent_box: f64,
    /// Least mean curvature.
    pub mean_curvature_min: f64,
    /// Largest mean curvature.
    pub mean_curvature_max: f64,
    /// Least Gaussian curvature.
    pub gaussian_curvature_min: f64,
    /// Largest Gaussian curvature.
    pub gaussian_curvature_max: f64,
    /// Root mean square distance from the relation asked for, on the surface scaled to mean
    /// absolute principal curvature 5; 0 if none was.
    pub relation_rms: f64,
}

/// Measures surfaces against the input they come from.
pub(crate) struct Meter<'a> {
    input: &'a BsplineSurface,
    trim: Option<&'a Trim>,
    /// Size of the input, and the diagonal of the box of its control points.
    size: f64,
    diagonal: f64,
    samples: [usize; 2],
    unit: f64,
}

/// A target with the working scale it is meant for: `unit` working lengths make one of the model.
pub(crate) type ScaledTarget<'t> = Option<&'t Target>;

impl<'a> Meter<'a> {
    /// `size` is that of the input, `samples` are those of the optimiser, `unit` its working scale.
    pub(crate) fn new(input: Input<'a>, size: f64, samples: [usize; 2], unit: f64) -> Self {
        let points = input.surface.control_points().iter().copied();
        let diagonal = BoundingBox::of(points).map_or(1.0, BoundingBox::diagonal);
        Self { input: input.surface, trim: input.trim, size, diagonal, samples, unit }
    }

    /// The metrics of `surface`.
    pub(crate) fn measure(&self, surface: &BsplineSurface, target: ScaledTarget<'_>) -> Metrics {
        let fine = self.samples.map(|m| 2 * m);
        let grid = SampleGrid::midpoints(surface, fine).within(self.trim, surface);
        let here = samples(&grid, &coordinates(surface));
        let (mean, max) = deviation(self.input, &grid, &here);
        let border = self.border_deviation(surface, fine);
        let of_size = |length: f64| 100.0 * length / self.size;
        let of_box = |length: f64| 100.0 * length / self.diagonal;
        let range = |f: fn(&Sample) -> f64| {
            here.iter()
                .map(f)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let (h, k) = (range(|s| s.jet.h), range(|s| s.jet.k));
        let (alignment_rms, diagram_area) = self.alignment(surface, &here, grid.len(), h, k);
        Metrics {
            alignment_rms,
            diagram_area,
            deviation_mean_percent: of_size(mean),
            deviation_max_percent: of_size(max),
            boundary_deviation_max_percent: of_size(border),
            deviation_mean_percent_box: of_box(mean),
            deviation_max_percent_box: of_box(max),
            boundary_deviation_max_percent_box: of_box(border),
            mean_curvature_min: h.0,
            mean_curvature_max: h.1,
            gaussian_curvature_min: k.0,
            gaussian_curvature_max: k.1,
            relation_rms: target.map_or(0.0, |t| t.rms(&rescaled(here, self.unit), None)),
        }
    }

    /// Where the relation holds in the diagram, fitted to `surface` if it is one to fit.
    pub(crate) fn locus(&self, surface: &BsplineSurface, target: &Target) -> RelationLocus {
        let grid = SampleGrid::midpoints(surface, self.samples).within(self.trim, surface);
        target.locus(&rescaled(samples(&grid, &coordinates(surface)), self.unit))
    }

    /// How far `surface` is from the relation, and where.
    pub(crate) fn miss(&self, surface: &BsplineSurface, target: &Target) -> RelationMiss {
        let fine = self.samples.map(|m| 2 * m);
        let grid = SampleGrid::midpoints(surface, fine).within(self.trim, surface);
        let here = rescaled(samples(&grid, &coordinates(surface)), self.unit);
        RelationMiss::new(&grid, &here, target)
    }

    fn alignment(
        &self,
        surface: &BsplineSurface,
        here: &[Sample],
        cells: usize,
        h: (f64, f64),
        k: (f64, f64),
    ) -> (f64, f64) {
        // The size of the curvatures; where nothing is curved, rounding counts for nothing.
        let largest = |s: &Sample| s.principal().0.abs().max(s.principal().1.abs());
        let size = here.iter().map(largest).fold(CONSTANT_RATIO / self.size, f64::max);
        let (range_h, range_k) = (h.1 - h.0, k.1 - k.0);
        if range_h <= CONSTANT_RATIO * size || range_k <= CONSTANT_RATIO * size * size {
            return (0.0, 0.0);
        }
        let area: f64 = here.iter().map(|s| s.jacobian().abs()).sum();
        let (u, v) = (surface.knots_u().domain(), surface.knots_v().domain());
        let cell = (u.1 - u.0) * (v.1 - v.0) / cells as f64;
        (alignment_rms(here), area * cell / (range_h * range_k))
    }

    /// Largest distance along the open sides, at midpoints and corners, or along the trim.
    fn border_deviation(&self, surface: &BsplineSurface, fine: [usize; 2]) -> f64 {
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let with_ends = |knots: &bspline::KnotVector, m: usize| {
            let (start, end) = knots.domain();
            let mut t = vec![start];
            t.extend(knots.cell_midpoints(m));
            t.push(end);
            t
        };
        let (u, v) = (with_ends(ku, fine[0]), with_ends(kv, fine[1]));
        let mut pairs = Vec::new();
        if let Some(trim) = self.trim {
            let places = trim.loops().iter().flat_map(TrimLoop::polygon);
            pairs.extend(places.map(|p| [p.x, p.y]));
            return self.largest_deviation(surface, &pairs);
        }
        if !kv.is_periodic() {
            let (start, end) = kv.domain();
            pairs.extend(u.iter().flat_map(|&u| [[u, start], [u, end]]));
        }
        if !ku.is_periodic() {
            let (start, end) = ku.domain();
            pairs.extend(v.iter().flat_map(|&v| [[start, v], [end, v]]));
        }
        self.largest_deviation(surface, &pairs)
    }

    fn largest_deviation(&self, surface: &BsplineSurface, pairs: &[[f64; 2]]) -> f64 {
        let here = surface.jets(pairs, 0);
        let there = self.input.jets(pairs, 0);
        let distance = |(a, b): (&geom_core::SurfaceJet, &geom_core::SurfaceJet)| {
            a.position().distance(b.position())
        };
        here.iter().zip(&there).map(distance).fold(0.0, f64::max)
    }
}

/// `√(Σ J²/Δ / Σ |∇_s H|² |∇_s K|²)` over samples.
pub(crate) fn alignment_rms(here: &[Sample]) -> f64 {
    let (mut sine, mut weight) = (0.0, 0.0);
    for s in here {
        let j = s.jacobian();
        let (grad_h, grad_k) = s.gradients();
        sine += j * j / s.delta();
        weight += grad_h * grad_k;
    }
    if weight > 0.0 { (sine / weight).sqrt() } else { 0.0 }
}

/// Mean and largest same-parameter distance of samples to `input`.
fn deviation(input: &BsplineSurface, grid: &SampleGrid, here: &[Sample]) -> (f64, f64) {
    let there = input.point_grid(&grid.u.parameters, &grid.v.parameters);
    let (mut sum, mut max) = (0.0, 0.0f64);
    for (k, s) in here.iter().enumerate() {
        let d = s.point.distance(there[grid.place(k)]);
        sum += d;
        max = max.max(d);
    }
    (sum / here.len() as f64, max)
}

/// Samples of the model to those of the working scale; only curvatures are needed there.
fn rescaled(mut samples: Vec<Sample>, unit: f64) -> Vec<Sample> {
    for s in &mut samples {
        s.jet.h /= unit;
        s.jet.k /= unit * unit;
    }
    samples
}
