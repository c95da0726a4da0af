//! Kinks inside a surface, along knots of full multiplicity.

use crate::knots::KnotVector;
use crate::region::Region;
use crate::surface::BsplineSurface;
use crate::trim::Trim;
use glam::DVec3;
use std::fmt;

/// The smallest angle between the tangent planes of two sides that counts as a crease: 0.01
/// degrees, in radians. Exact arcs have knots of full multiplicity too, but no crease there.
pub const CREASE_ANGLE: f64 = 1.745e-4;
/// Places on every span of a knot line where the angle is measured.
const PER_SPAN: usize = 8;

/// A knot line across which the surface has a kink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crease {
    /// Whether the line has constant u, and not constant v.
    pub constant_u: bool,
    /// The constant parameter.
    pub parameter: f64,
    /// Largest angle between the tangent planes of the two sides, in radians.
    pub angle: f64,
    /// Parameters where it is that large.
    pub at: [f64; 2],
    /// The point there.
    pub point: DVec3,
}

impl fmt::Display for Crease {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, other) = if self.constant_u { ("u", "v") } else { ("v", "u") };
        let along = self.at[usize::from(self.constant_u)];
        let DVec3 { x, y, z } = self.point;
        let angle = self.angle.to_degrees();
        write!(
            f,
            "a crease of {angle:.1} degrees along {name} = {}, sharpest at {other} = {along:.4} near ({x:.4}, {y:.4}, {z:.4})",
            self.parameter
        )
    }
}

impl BsplineSurface {
    /// All knot lines inside the surface, or the part that `trim` bounds, whose two sides meet at
    /// more than [`CREASE_ANGLE`].
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = |d: usize, n: usize| KnotVector::clamped_uniform(Degree::new(d)?, n);
    /// // A roof of two planes, at right angles.
    /// let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)];
    /// let net = points.iter().flat_map(|&(x, z)| [DVec3::new(x, 0.0, z), DVec3::new(x, 1.0, z)]);
    /// let roof = BsplineSurface::new(knots(1, 3)?, knots(1, 2)?, net.collect(), None)?;
    /// let [ridge] = roof.creases(None)[..] else { panic!("one ridge") };
    /// assert!(ridge.constant_u && ridge.parameter == 0.5);
    /// assert!((ridge.angle.to_degrees() - 90.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn creases(&self, trim: Option<&Trim>) -> Vec<Crease> {
        let region = trim.map(|trim| Region::new(trim, self));
        // At a pole the tangents of either side may be noise.
        let poles = self.pole_sides(None);
        let counts = |at: [f64; 2]| {
            let [u, v] = at;
            !self.is_on_pole(&poles, at) && region.as_ref().is_none_or(|r| r.contains(u, v))
        };
        let turn = |c: Crease| Crease { constant_u: false, at: [c.at[1], c.at[0]], ..c };
        let across_v = creases_across_u(&self.swapped(), |[v, u]| counts([u, v]));
        let across_v = across_v.into_iter().map(turn);
        creases_across_u(self, counts).into_iter().chain(across_v).collect()
    }

    /// The sharpest of the [creases](Self::creases).
    #[must_use]
    pub fn sharpest_crease(&self, trim: Option<&Trim>) -> Option<Crease> {
        self.creases(trim).into_iter().max_by(|a, b| a.angle.total_cmp(&b.angle))
    }
}

/// The creases of constant u, at the places that count.
fn creases_across_u(surface: &BsplineSurface, counts: impl Fn([f64; 2]) -> bool) -> Vec<Crease> {
    let knots = surface.knots_u();
    let breaks = knots.breaks();
    let places = places(surface.knots_v());
    let full = |t: f64| knots.multiplicity(t) >= knots.degree().get();
    breaks
        .windows(3)
        .filter(|w| full(w[1]))
        .filter_map(|w| {
            let places = places.iter().copied().filter(|&v| counts([w[1], v]));
            sharpest(surface, [w[0], w[1], w[2]], places)
        })
        .collect()
}

/// The sharpest place of the line of constant `u = line`, which stands between two others.
fn sharpest(
    surface: &BsplineSurface,
    [before, line, after]: [f64; 3],
    places: impl Iterator<Item = f64>,
) -> Option<Crease> {
    let (start, end) = surface.knots_v().domain();
    let part = |a: f64, b: f64| surface.subdomain([a, b], [start, end]).ok();
    let (left, right) = (part(before, line)?, part(line, after)?);
    let mut found: Option<Crease> = None;
    for v in places {
        let [a, b] = [&left, &right].map(|side| side.jet(line, v, 1));
        let (Ok(n), Ok(m)) = (a.normal(), b.normal()) else { continue };
        let angle = n.cross(m).length().atan2(n.dot(m));
        if angle > found.map_or(CREASE_ANGLE, |c| c.angle) {
            let (at, point) = ([line, v], a.position());
            found = Some(Crease { constant_u: true, parameter: line, angle, at, point });
        }
    }
    found
}

fn places(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let inside = breaks.windows(2).flat_map(|pair| {
        let step = (pair[1] - pair[0]) / PER_SPAN as f64;
        (0..PER_SPAN).map(move |k| pair[0] + step * k as f64)
    });
    inside.chain(breaks.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Axis, BsplineCurve, Degree};
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn exact_arcs_have_knots_of_full_multiplicity_but_no_crease() {
        let spans = ArcSpans::new(0.0, TAU);
        let ring = BsplineCurve::arc(3.0 * DVec3::X, DVec3::X, DVec3::Z, spans).unwrap();
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        let torus = BsplineSurface::revolution(&ring, axis, spans).unwrap();
        assert!(torus.knots_u().multiplicities().len() > 2);
        assert_eq!(torus.creases(None), []);
        // Nor have they one at a pole that is collapsed to rounding only.
        let meridian = ArcSpans::new(-FRAC_PI_2, FRAC_PI_2);
        let half = BsplineCurve::arc(DVec3::ZERO, 50.0 * DVec3::X, 50.0 * DVec3::Z, meridian);
        let sphere = BsplineSurface::revolution(&half.unwrap(), axis, spans).unwrap();
        let off = |k: usize| 3e-15 * DVec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3);
        let points = sphere.control_points().iter().enumerate().map(|(k, p)| *p + off(k)).collect();
        let rounded = sphere.with_control_points(points).unwrap();
        assert_eq!((sphere.creases(None), rounded.creases(None)), (vec![], vec![]));
    }

    #[test]
    fn a_crease_is_measured_where_it_is_sharpest() {
        // Degree 3, a knot of multiplicity 3 at 0.5; the right half rises by the slope v.
        let knots = KnotVector::new(
            Degree::new(3).unwrap(),
            vec![0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0],
        );
        let across = KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let point = |k: usize| {
            let (x, y) = ((k / 2) as f64 - 3.0, (k % 2) as f64);
            DVec3::new(x, y, if x > 0.0 { x * y } else { 0.0 })
        };
        let net = (0..14).map(point).collect();
        let surface = BsplineSurface::new(knots.unwrap(), across, net, None).unwrap();
        for (surface, constant_u) in [(surface.clone(), true), (surface.swapped(), false)] {
            let creases = surface.creases(None);
            let [crease] = creases[..] else { panic!("{creases:?}") };
            assert_eq!((crease.constant_u, crease.parameter), (constant_u, 0.5));
            assert!((crease.angle.to_degrees() - 45.0).abs() < 1e-9, "{crease}");
            assert_eq!(crease.point, DVec3::new(0.0, 1.0, 0.0));
            let text = crease.to_string();
            let place = if constant_u {
                "along u = 0.5, sharpest at v"
            } else {
                "along v = 0.5, sharpest at u"
            };
            assert!(text.contains("45.0 degrees") && text.contains(place), "{text}");
        }
    }
}
