//! All measures of a finished net in one place.

use geom_core::{Ball, BoundingBox};
use serde::Serialize;

use crate::gates::GateReport;
use crate::input::Input;
use crate::net::{
    AsymptoticField, BoundaryPolygon, HyperbolicNet, distances, distinct_shape_parameters,
    star_planarity,
};

/// Shape parameters this close count as one mold.
const SAME_SHAPE: f64 = 1e-3;

/// Measures of a hyperbolic net against the surface it stands for.
///
/// # Example
/// ```
/// use geom_core::PolyMesh;
/// use hyperbolic_nets::{Input, Options, QuadNet, solve};
/// let model = fixtures::asymptotic_nets::scherk(6);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// let metrics = solve(&Input::new(&net), &Options::default(), &mut ())?.metrics;
/// assert_eq!((metrics.faces, metrics.vertices, metrics.irregular_vertices), (36, 49, 0));
/// assert!(metrics.star_planarity_max < 1e-9 && metrics.kink_max_deg < 1e-9 && metrics.folds == 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Faces.
    pub faces: usize,
    /// Vertices.
    pub vertices: usize,
    /// Inner vertices whose valence is not 4.
    pub irregular_vertices: usize,
    /// Inner vertices of odd valence: none, since nets that have some are refused.
    pub odd_valence_vertices: usize,
    /// Largest distance from a vertex or its neighbours to the plane of its star, in mean edge
    /// lengths.
    pub star_planarity_max: f64,
    /// Largest kink between patches, in degrees.
    pub kink_max_deg: f64,
    /// Mean over the inner edges of the largest kink of each, in degrees.
    pub kink_mean_deg: f64,
    /// Edges at which the result folds back.
    pub folds: usize,
    /// Least `W` of the diagonals 0–2.
    pub shape_parameter_min: f64,
    /// Largest `W` of the diagonals 0–2.
    pub shape_parameter_max: f64,
    /// Different shape parameters, those within 10⁻³ of one another counted as one.
    pub shape_parameters_distinct: usize,
    /// Mean distance of the vertices from the reference (see [`distances`]), in percent of the
    /// size of the reference: the diameter of the smallest ball around its vertices.
    pub deviation_mean_percent: f64,
    /// Largest such distance.
    pub deviation_max_percent: f64,
    /// The mean in percent of the diagonal of the reference's bounding box, as releases before gave
    /// it.
    pub deviation_mean_percent_box: f64,
    /// The largest, likewise.
    pub deviation_max_percent_box: f64,
    /// Largest such distance, in mean edge lengths.
    pub deviation_max_edges: f64,
    /// How far boundary vertices left the boundary polygon of the input, in mean edge lengths.
    pub boundary_deviation_max_edges: f64,
    /// Mean angle between edges and the asymptotic directions of the reference, in degrees.
    pub asymptotic_deviation_mean_deg: f64,
    /// The same of the input.
    pub input_asymptotic_deviation_mean_deg: f64,
    /// Share of the reference that is negatively curved, in percent.
    pub negative_curvature_percent: f64,
}

impl Metrics {
    /// Measures `surface`, the result for `input`; `field` is the curvature of its mesh and `gates`
    /// what was measured of it before.
    #[must_use]
    pub fn new(
        surface: &HyperbolicNet,
        input: &Input<'_>,
        field: &AsymptoticField<'_>,
        gates: &GateReport,
    ) -> Self {
        let net = surface.net();
        let far = distances(net.positions(), input.reference());
        let mean = far.iter().sum::<f64>() / far.len().max(1) as f64;
        let largest = far.iter().copied().fold(0.0, f64::max);
        let positions = input.mesh().positions();
        let size = Ball::around(positions).map_or(0.0, Ball::diameter);
        let diagonal = BoundingBox::of(positions.iter().copied()).map_or(0.0, |b| b.diagonal());
        let edge_length = net.mesh().mean_edge_length();
        let kinks = surface.kink_statistics();
        let shape = surface.shape();
        let limits = |[low, high]: [f64; 2], &w: &f64| [low.min(w), high.max(w)];
        let [shape_parameter_min, shape_parameter_max] =
            shape.iter().fold([f64::INFINITY, 0.0], limits);
        Self {
            faces: net.quads().len(),
            vertices: net.positions().len(),
            irregular_vertices: net.irregular_vertices().len(),
            odd_valence_vertices: 0,
            star_planarity_max: star_planarity(net),
            kink_max_deg: kinks.max.to_degrees(),
            kink_mean_deg: kinks.mean.to_degrees(),
            folds: kinks.folds,
            shape_parameter_min,
            shape_parameter_max,
            shape_parameters_distinct: distinct_shape_parameters(shape, SAME_SHAPE),
            deviation_mean_percent: 100.0 * mean / size,
            deviation_max_percent: 100.0 * largest / size,
            deviation_mean_percent_box: 100.0 * mean / diagonal,
            deviation_max_percent_box: 100.0 * largest / diagonal,
            deviation_max_edges: largest / edge_length,
            boundary_deviation_max_edges: BoundaryPolygon::deviation(input.net(), net)
                / edge_length,
            asymptotic_deviation_mean_deg: field.mean_misalignment(net).to_degrees(),
            input_asymptotic_deviation_mean_deg: gates.misalignment.to_degrees(),
            negative_curvature_percent: 100.0 * gates.negative_share,
        }
    }
}
