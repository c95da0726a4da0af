//! Corners in which the border alone decides the mean curvature.

use bspline::BsplineSurface;

use crate::field::samples;
use crate::grid::SampleGrid;
use crate::kind::Kind;
use crate::options::Border;
use crate::target::Target;
use crate::variables::coordinates;

/// Border curves whose angle has at most this cosine count as orthogonal. The twist `s_uv` is all that a
/// held border leaves free; to change the mean curvature by some amount it must then change by more
/// than five times as much.
const ORTHOGONAL: f64 = 0.2;
/// A mean curvature farther than this from the one asked for, as a share of the curvatures, is worth
/// telling.
const FAR: f64 = 0.02;

/// A corner where two held border curves meet at a right angle or nearly so (cosine at most 0.2).
/// `H = (L G − 2 M F + N E)/(2 Δ)` with `F = 0` is made of the curves alone: no surface through them has
/// another mean curvature there, and with a small `F` only one with a large twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldCorner {
    /// Where, in the domain.
    pub u: f64,
    /// Where, in the domain.
    pub v: f64,
    /// The mean curvature it has, in units of the model.
    pub mean_curvature: f64,
    /// The mean curvature asked for.
    pub wanted: f64,
}

/// The corners of `input` that keep a constant mean curvature from being reached. `unit` working lengths
/// make one of the model.
pub(crate) fn held_corners(
    input: &BsplineSurface,
    border: Border,
    target: &Target,
    unit: f64,
) -> Vec<HeldCorner> {
    let (ku, kv) = (input.knots_u(), input.knots_v());
    let Kind::Affine([a, b, c]) = *target.wanted() else { return Vec::new() };
    if border == Border::Free || b != 0.0 || ku.is_periodic() || kv.is_periodic() {
        return Vec::new();
    }
    // Not −0, which would be printed.
    let wanted = 0.0 - c / a * unit;
    let (u, v) = (ku.domain(), kv.domain());
    let grid = SampleGrid::new(input, vec![u.0, u.1], vec![v.0, v.1]);
    let corner = |(k, s): (usize, crate::field::Sample)| {
        let [u, v] = grid.parameters(k);
        let far = (s.jet.h - wanted).abs() > FAR * target.natural() * unit;
        let is_held = s.f.abs() <= ORTHOGONAL * (s.e * s.g).sqrt() && far;
        is_held.then_some(HeldCorner { u, v, mean_curvature: s.jet.h, wanted })
    };
    samples(&grid, &coordinates(input)).into_iter().enumerate().filter_map(corner).collect()
}

#[cfg(test)]
mod tests {
    use crate::{Border, Options, Relation, solve};

    /// A vault has right angles in its corners, and one of its border curves is a parabola.
    #[test]
    fn a_held_border_decides_the_mean_curvature_of_a_right_angled_corner() {
        let vault = fixtures::surfaces::Shape::Vault.surface(8, 8, 4, 4);
        let corners = |border, relation| {
            let options = Options { border, relation, iterations: 2, ..Options::default() };
            solve(&vault, &options, &mut ()).unwrap().held_corners
        };
        assert_eq!(corners(Border::Free, Relation::Minimal), []);
        assert_eq!(corners(Border::Fixed, Relation::Developable), []);
        let held = corners(Border::Fixed, Relation::Minimal);
        assert!(!held.is_empty());
        for corner in held {
            assert!(corner.wanted == 0.0 && corner.mean_curvature.abs() > 0.02, "{corner:?}");
        }
    }
}
