//! All measures of a finished net in one place.

use crate::hyperbolic_net::{distances, star_planarity};
use crate::{AsymptoticField, HyperbolicNet, KinkStatistics};
use geom_core::{BoundingBox, TriMesh};

/// Measures of a hyperbolic net against the surface it stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct NetMeasures {
    /// Largest distance from a vertex or its neighbours to the plane of its star, in mean edge
    /// lengths.
    pub star_planarity: f64,
    /// Kinks between patches.
    pub kinks: KinkStatistics,
    /// Least and largest `W` of the diagonals 0–2.
    pub shape_range: [f64; 2],
    /// Mean and largest distance of the vertices from the reference (see [`crate::distances`]), in
    /// model units.
    pub deviation: [f64; 2],
    /// Diagonal of the reference's bounding box, in model units.
    pub diagonal: f64,
    /// Mean edge length, in model units.
    pub edge_length: f64,
    /// Mean angle between edges and the asymptotic directions of the reference, in radians.
    pub misalignment: f64,
}

impl NetMeasures {
    /// Measures `surface` against `reference`, whose curvature is `field`.
    #[must_use]
    pub fn new(surface: &HyperbolicNet, reference: &TriMesh, field: &AsymptoticField<'_>) -> Self {
        let net = surface.net();
        let far = distances(net.positions(), reference);
        let angles: Vec<f64> = net
            .edges()
            .iter()
            .filter_map(|e| {
                let [a, b] = e.ends.map(|v| net.positions()[v]);
                field.misalignment((a + b) / 2.0, b - a)
            })
            .collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let bounds = BoundingBox::of(reference.positions().iter().copied());
        Self {
            star_planarity: star_planarity(net),
            kinks: surface.kink_statistics(),
            shape_range: surface
                .shape()
                .iter()
                .fold([f64::INFINITY, 0.0], |[low, high], &w| [low.min(w), high.max(w)]),
            deviation: [mean(&far), far.iter().copied().fold(0.0, f64::max)],
            diagonal: bounds.map_or(0.0, |b| b.diagonal()),
            edge_length: net.mesh().mean_edge_length(),
            misalignment: mean(&angles),
        }
    }

    /// Mean and largest deviation in percent of the reference's bounding-box diagonal.
    #[must_use]
    pub fn deviation_percent(&self) -> [f64; 2] {
        self.deviation.map(|d| 100.0 * d / self.diagonal)
    }

    /// Mean and largest deviation in mean edge lengths.
    #[must_use]
    pub fn deviation_edges(&self) -> [f64; 2] {
        self.deviation.map(|d| d / self.edge_length)
    }
}

/// Vertices (one flag each) whose foot lies where the reference is not negatively curved.
#[must_use]
pub fn not_negatively_curved(net: &crate::QuadNet, field: &AsymptoticField<'_>) -> Vec<bool> {
    net.positions().iter().map(|p| field.gaussian_curvature(*p).is_some_and(|k| k >= 0.0)).collect()
}
