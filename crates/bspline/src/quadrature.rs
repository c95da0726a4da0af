//! Gauss quadrature over the knot spans, and how samples of a surface are counted.

use crate::knots::KnotVector;
use crate::pole::SurfaceCurvature;
use crate::surface::BsplineSurface;
use crate::trim::Trim;
use geom_core::{CurvatureStatistics, SurfaceJet};
use std::ops::Range;

/// Nodes and weights of five-point Gauss-Legendre quadrature on `[0, 1]`, exact to degree 9.
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_46, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];
/// Knot spans are cut until a direction has at least this many cells.
pub(crate) const CELLS: usize = 16;

/// Statistics of one surface while they are gathered.
pub(crate) struct CurvatureSamples<'s> {
    pub(crate) statistics: CurvatureStatistics,
    surface: &'s BsplineSurface,
    // None if the surface leaves the range of `f64` next to a pole.
    curvature: Option<SurfaceCurvature<'s>>,
}

impl<'s> CurvatureSamples<'s> {
    pub(crate) fn new(surface: &'s BsplineSurface) -> Self {
        let curvature = SurfaceCurvature::new(surface).ok();
        Self { statistics: CurvatureStatistics::default(), surface, curvature }
    }

    /// Widens the box to what lies between the samples.
    pub(crate) fn add_extent(&mut self, trim: Option<&Trim>) {
        let bounds = self.surface.bounding_box(trim);
        self.statistics.add_point(bounds.min);
        self.statistics.add_point(bounds.max);
    }

    /// Adds the jet at a parameter pair, which stands for `weight` of area.
    pub(crate) fn add(&mut self, [u, v]: [f64; 2], jet: &SurfaceJet, weight: f64) {
        let found = self.curvature.as_ref().and_then(|c| c.of_jet(u, v, jet).ok());
        match found {
            Some((h, k)) => self.statistics.add(jet.position(), weight, h, k),
            None => self.statistics.add_singular(jet.position(), weight),
        }
    }
}

pub(crate) fn cells(knots: &KnotVector) -> Vec<Range<f64>> {
    let breaks = knots.breaks();
    let pieces = CELLS.div_ceil(breaks.len() - 1);
    let cut = |pair: &[f64]| {
        let (a, b) = (pair[0], pair[1]);
        let at =
            move |i: usize| if i == pieces { b } else { a + (b - a) * i as f64 / pieces as f64 };
        (0..pieces).map(move |i| at(i)..at(i + 1))
    };
    breaks.windows(2).flat_map(cut).collect()
}

pub(crate) fn nodes(cells: &[Range<f64>]) -> Vec<(f64, f64)> {
    let of = |cell: &Range<f64>| {
        let (start, length) = (cell.start, cell.end - cell.start);
        GAUSS.map(|(x, w)| (start + length * x, length * w))
    };
    cells.iter().flat_map(of).collect()
}

pub(crate) fn parameters(nodes: &[(f64, f64)]) -> Vec<f64> {
    nodes.iter().map(|(t, _)| *t).collect()
}

pub(crate) fn ends(cells: &[Range<f64>]) -> Vec<f64> {
    let starts = cells.iter().map(|cell| cell.start);
    starts.chain(cells.last().map(|cell| cell.end)).collect()
}
