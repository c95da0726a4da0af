//! Patches as panels: rulings for hot-wire cut molds, and how many different panels there are.

use super::hyperbolic_net::HyperbolicNet;
use super::patch::BilinearPatch;
use crate::PatchError;
use bspline::{BsplineSurface, Degree, KnotVector, SplineError};
use geom_core::DVec3;

/// A straight position of the cutting wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WireCut {
    /// The panel.
    pub face: usize,
    /// 1 for rulings from edge 0–1 to edge 2–3, 2 for those from edge 1–2 to edge 3–0.
    pub family: u8,
    /// Number of the position within its family, from 0.
    pub index: usize,
    /// Where the wire crosses the two edges of the panel.
    pub ends: [DVec3; 2],
}

/// `positions` rulings of each family of every panel, the edges included: a mold for the panel is
/// the sweep of the wire through either family.
///
/// Equal steps of the parameter are not equal steps along the edge where `W ≠ 1`; both ends of a
/// ruling always belong to the same parameter.
///
/// # Errors
/// [`PatchError`] if a corner is not finite.
///
/// # Panics
/// With fewer than two positions.
pub fn wire_cuts(surface: &HyperbolicNet, positions: usize) -> Result<Vec<WireCut>, PatchError> {
    assert!(positions >= 2, "a sweep has a first and a last position");
    let mut cuts = Vec::with_capacity(2 * positions * surface.shape().len());
    for (face, patch) in surface.patches()?.iter().enumerate() {
        for family in [1, 2] {
            for index in 0..positions {
                let t = index as f64 / (positions - 1) as f64;
                let ends =
                    if family == 1 { patch.ruling_along_v(t) } else { patch.ruling_along_u(t) };
                cuts.push(WireCut { face, family, index, ends });
            }
        }
    }
    Ok(cuts)
}

/// How many different shape parameters there are when values within `relative` of one another
/// count as one; the greedy count over sorted values is the least possible.
#[must_use]
pub fn distinct_shape_parameters(shape: &[f64], relative: f64) -> usize {
    // W and 1/W are the same panel seen along the other diagonal.
    let mut logs: Vec<f64> = shape.iter().map(|w| w.ln().abs()).collect();
    logs.sort_by(f64::total_cmp);
    let mut count = 0;
    let mut first = f64::NEG_INFINITY;
    for log in logs {
        if log - first > relative {
            count += 1;
            first = log;
        }
    }
    count
}

impl BilinearPatch {
    /// The patch as a rational B-spline surface of degree 1 × 1, exact.
    ///
    /// # Errors
    /// [`SplineError`] does not occur for corners and weights that [`BilinearPatch::new`] accepts.
    pub fn to_surface(&self) -> Result<BsplineSurface, SplineError> {
        let line = || Degree::new(1).and_then(|d| KnotVector::clamped_uniform(d, 2));
        let order = [0, 3, 1, 2];
        let points = order.map(|k| self.corners()[k]).to_vec();
        let weights = order.map(|k| self.weights()[k]).to_vec();
        BsplineSurface::new(line()?, line()?, points, Some(weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::QuadNet;

    fn patch() -> BilinearPatch {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.1, 1.2, 0.4), DVec3::Y];
        BilinearPatch::new(corners, [1.0, 1.4, 0.8, 1.1]).unwrap()
    }

    #[test]
    fn b_spline_surface_is_the_same_patch() {
        let (patch, surface) = (patch(), patch().to_surface().unwrap());
        for (u, v) in [(0.0, 0.0), (0.3, 0.8), (1.0, 0.2)] {
            let (a, b) = (patch.jet(u, v), surface.jet(u, v, 2));
            assert!(a.point.distance(b.position()) < 1e-15);
            let close = |x: f64, y: f64| (x - y).abs() < 1e-12;
            assert!(close(a.gaussian_curvature().unwrap(), b.gaussian_curvature().unwrap()));
            assert!(close(a.mean_curvature().unwrap(), b.mean_curvature().unwrap()));
        }
    }

    #[test]
    fn distinct_parameters_are_counted_up_to_the_diagonal() {
        assert_eq!(distinct_shape_parameters(&[2.0, 0.5, 2.0001], 1e-3), 1);
        assert_eq!(distinct_shape_parameters(&[1.0, 1.0, 1.5], 1e-3), 2);
        assert_eq!(distinct_shape_parameters(&[], 1e-3), 0);
    }

    #[test]
    fn wire_lies_on_the_panel() {
        let net = fixtures::asymptotic_nets::moutard(2, 1, 3);
        let mesh = geom_core::PolyMesh::new(net.positions, &net.quads).unwrap();
        let surface =
            HyperbolicNet::new(QuadNet::new(&mesh).unwrap(), None, vec![1.2, 0.9]).unwrap();
        let cuts = wire_cuts(&surface, 5).unwrap();
        assert_eq!(cuts.len(), 2 * 2 * 5);
        for cut in cuts {
            let patch = surface.patch(cut.face).unwrap();
            let quadric = patch.implicit_quadric();
            let size = patch.twist().powi(2);
            for t in [0.0, 0.3, 1.0] {
                let p = cut.ends[0].lerp(cut.ends[1], t);
                assert!(quadric.value(p).abs() < 1e-12 * size.max(1e-3), "the whole wire");
            }
        }
    }
}
