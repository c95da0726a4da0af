//! Sides of a surface that collapse to a point, and the curvature next to them.

use crate::error::SplineError;
use crate::knots::{Degree, KnotVector};
use crate::rational;
use crate::surface::BsplineSurface;
use crate::trim::{Trim, TrimLoop};
use geom_core::{BoundingBox, CurvatureError, SurfaceJet};
use glam::{DVec3, DVec4};

/// Control points within this share of the surface's size count as one point. CAD systems write
/// poles a few units in the last digit apart.
const COLLAPSED: f64 = 1e-10;
/// Next to a pole, within this share of the span there, curvatures come from the surface divided by
/// the distance; farther away the plain formula keeps eleven digits and more.
const NEAR: f64 = 0.05;
/// Within this share of the span a value is that of the pole itself.
const AT: f64 = 1e-8;
/// Normal part of the second derivative around the pole, as a share of its length or of the first
/// derivative over the way around, above which the pole is the tip of a cone and has no curvature.
const TIP: f64 = 1e-7;

/// A side of the parameter rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The smallest u.
    StartU,
    /// The largest u.
    EndU,
    /// The smallest v.
    StartV,
    /// The largest v.
    EndV,
}

impl Side {
    const ALL: [Self; 4] = [Self::StartU, Self::EndU, Self::StartV, Self::EndV];

    fn is_u(self) -> bool {
        matches!(self, Self::StartU | Self::EndU)
    }

    fn is_end(self) -> bool {
        matches!(self, Self::EndU | Self::EndV)
    }
}

impl BsplineSurface {
    /// The sides whose control points coincide, to 1e-10 of the surface's size: poles. Of a trimmed
    /// face those that it reaches.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector, Side};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, 1e-15 * DVec3::Y, DVec3::X, DVec3::ONE];
    /// let triangle = BsplineSurface::new(line()?, line()?, corners, None)?;
    /// assert_eq!(triangle.pole_sides(None), [Side::StartU]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn pole_sides(&self, trim: Option<&Trim>) -> Vec<Side> {
        let size = BoundingBox::of(self.control_points().iter().copied())
            .map_or(0.0, BoundingBox::diagonal);
        let collapsed = |side: &Side| {
            let knots = if side.is_u() { self.knots_u() } else { self.knots_v() };
            let mut points = self.side_points(*side);
            let first = points.next().unwrap_or_default();
            is_clamped_at(knots, side.is_end())
                && points.all(|p| p.distance(first) <= COLLAPSED * size)
        };
        let reached = |side: &Side| {
            let mut border = trim.into_iter().flat_map(Trim::loops).flat_map(TrimLoop::polygon);
            trim.is_none() || border.any(|p| self.is_on_pole(&[*side], [p.x, p.y]))
        };
        Side::ALL.into_iter().filter(|side| collapsed(side) && reached(side)).collect()
    }

    /// Whether a parameter pair lies on a pole.
    #[must_use]
    pub fn is_on_pole(&self, sides: &[Side], [u, v]: [f64; 2]) -> bool {
        sides.iter().any(|&side| {
            let (knots, t) = if side.is_u() { (self.knots_u(), u) } else { (self.knots_v(), v) };
            let (start, end) = knots.domain();
            let from = if side.is_end() { end } else { start };
            (t - from).abs() <= AT * (end - start)
        })
    }

    fn side_points(&self, side: Side) -> impl Iterator<Item = DVec3> + '_ {
        let (n_u, n_v) = (self.n_u(), self.n_v());
        let (count, across) = if side.is_u() { (n_v, n_u) } else { (n_u, n_v) };
        let row = if side.is_end() { across - 1 } else { 0 };
        (0..count).map(move |k| {
            if side.is_u() { self.control_point(row, k) } else { self.control_point(k, row) }
        })
    }
}

fn is_clamped_at(knots: &KnotVector, end: bool) -> bool {
    let d = knots.degree().get();
    let all = knots.knots();
    let ends = if end { &all[all.len() - d - 1..] } else { &all[..=d] };
    !knots.is_periodic() && ends[0] == ends[d]
}

/// Mean and Gaussian curvature of a surface at parameters, poles included.
///
/// Next to a pole `S_u` vanishes and with it `E`, `F`, `L` and `M`: their quotients lose all
/// digits. There the surface is written as `S = P + t C(u, t)` with the distance `t` from the pole
/// `P`, exactly, by the control points. With `X = C_u = S_u/t` and `Y = S_t`, both of them not zero,
/// `M = t X_t·n`, and
///
/// `H = (l Y·Y − 2 m X·Y + n X·X) / (2 D)`, `K = (l n − m²) / D`, `D = X² Y² − (X·Y)²`
///
/// with `l = X_u·n / t`, `m = X_t·n` and `n = S_tt·n`; at the pole itself `l` is the derivative of
/// `X_u·n` by `t`.
#[derive(Clone, Debug)]
pub struct SurfaceCurvature<'s> {
    surface: &'s BsplineSurface,
    poles: Vec<PoleStrip>,
}

impl<'s> SurfaceCurvature<'s> {
    /// Finds the poles of a surface.
    ///
    /// # Errors
    /// [`SplineError`] if a number leaves the range of `f64`.
    pub fn new(surface: &'s BsplineSurface) -> Result<Self, SplineError> {
        let strip = |side| PoleStrip::new(surface, side);
        let poles = surface.pole_sides(None).into_iter().map(strip).collect::<Result<_, _>>()?;
        Ok(Self { surface, poles })
    }

    /// `(H, K)` at a parameter pair.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the surface has no curvature.
    pub fn at(&self, u: f64, v: f64) -> Result<(f64, f64), CurvatureError> {
        self.of_jet(u, v, &self.surface.jet(u, v, 2))
    }

    /// As [`Self::at`], from the jet of second order there.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn of_jet(&self, u: f64, v: f64, jet: &SurfaceJet) -> Result<(f64, f64), CurvatureError> {
        match self.poles.iter().find_map(|pole| Some((pole, pole.place(u, v)?))) {
            Some((pole, place)) => pole.curvatures(place),
            None => Ok((jet.mean_curvature()?, jet.gaussian_curvature()?)),
        }
    }
}

/// The span next to a pole as a surface over `(along, t)`, `t` from 0 at the pole to 1.
#[derive(Clone, Debug)]
struct PoleStrip {
    side: Side,
    /// The parameter of the pole and that of the span's other end.
    from: f64,
    to: f64,
    /// `C` times the weight: degree one less in `t`.
    numerator: BsplineSurface,
    /// The weight as the first coordinate.
    weight: Option<BsplineSurface>,
    /// Length of the domain of `along`.
    around: f64,
    /// Whether `(along, t)` has the other orientation than `(u, v)`.
    turned: bool,
}

impl PoleStrip {
    fn new(surface: &BsplineSurface, side: Side) -> Result<Self, SplineError> {
        let (mut strip, mut turned) = (surface.clone(), false);
        if side.is_u() {
            (strip, turned) = (strip.swapped(), !turned);
        }
        let breaks = strip.knots_v().breaks();
        let last = breaks.len() - 1;
        let (from, to) =
            if side.is_end() { (breaks[last], breaks[last - 1]) } else { (breaks[0], breaks[1]) };
        let along = strip.knots_u().domain();
        strip = strip.subdomain(along.into(), [from.min(to), from.max(to)])?;
        if side.is_end() {
            // Backwards in v: exchange, run the first direction backwards, exchange again.
            (strip, turned) = (strip.swapped().reversed_u().swapped(), !turned);
        }
        let (n_u, n_v) = (strip.n_u(), strip.n_v());
        let degree = n_v - 1;
        let pole = strip.control_point(0, 0);
        let weight_of = |k: usize| strip.weights().map_or(1.0, |w| w[k]);
        // B_{j,q}(t) = t (q/j) B_{j−1,q−1}(t).
        let row = |i: usize, j: usize| {
            let k = i * n_v + j;
            let share = degree as f64 / j as f64;
            share * weight_of(k) * (strip.control_points()[k] - pole)
        };
        // A constant is a line whose ends agree.
        let rows: Vec<usize> = if degree == 1 { vec![1, 1] } else { (1..n_v).collect() };
        let points = (0..n_u).flat_map(|i| rows.iter().map(move |&j| (i, j)));
        let points = points.map(|(i, j)| row(i, j)).collect();
        let bezier = |degree: usize| {
            KnotVector::new(
                Degree::new(degree)?,
                [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat(),
            )
        };
        let knots_u = strip.knots_u().clone();
        let numerator =
            BsplineSurface::new(knots_u.clone(), bezier(rows.len() - 1)?, points, None)?;
        let weight = match strip.weights() {
            None => None,
            Some(weights) => {
                let points = weights.iter().map(|w| *w * DVec3::X).collect();
                Some(BsplineSurface::new(knots_u, bezier(degree)?, points, None)?)
            }
        };
        Ok(Self { side, from, to, numerator, weight, around: along.1 - along.0, turned })
    }

    /// `(along, t)` of a parameter pair next to the pole.
    fn place(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let (along, across) = if self.side.is_u() { (v, u) } else { (u, v) };
        let t = (across - self.from) / (self.to - self.from);
        (t <= NEAR).then_some([along, t.max(0.0)])
    }

    fn curvatures(&self, [along, t]: [f64; 2]) -> Result<(f64, f64), CurvatureError> {
        let t = if t < AT { 0.0 } else { t };
        let c = self.quotient(along, t);
        let x = c.d(1, 0);
        let y = c.d(0, 0) + t * c.d(0, 1);
        let x_t = c.d(1, 1);
        let (xx, xy, yy) = (x.dot(x), x.dot(y), y.dot(y));
        let singular = CurvatureError::Singular { e: t * t * xx, f: t * xy, g: yy };
        let determinant = xx * yy - xy * xy;
        if !(determinant > geom_core::SINGULAR_RATIO * xx * yy && determinant.is_finite()) {
            return Err(singular);
        }
        let normal = x.cross(y).normalize();
        let around = c.d(2, 0);
        let l = if t > 0.0 {
            around.dot(normal) / t
        } else {
            let size = around.length().max(x.length() / self.around);
            if around.dot(normal).abs() > TIP * size {
                return Err(singular);
            }
            // The change of X × Y by t, of which the part along the normal does not count.
            let change = x_t.cross(y) + x.cross(2.0 * c.d(0, 1));
            let normal_t = (change - normal * change.dot(normal)) / x.cross(y).length();
            c.d(2, 1).dot(normal) + around.dot(normal_t)
        };
        let m = x_t.dot(normal);
        let n = (2.0 * c.d(0, 1) + t * c.d(0, 2)).dot(normal);
        let sign = if self.turned { -1.0 } else { 1.0 };
        let mean = sign * (l * yy - 2.0 * m * xy + n * xx) / (2.0 * determinant);
        Ok((mean, (l * n - m * m) / determinant))
    }

    /// `C` and its derivatives to order three.
    fn quotient(&self, along: f64, t: f64) -> SurfaceJet {
        let numerator = self.numerator.jet(along, t, 3);
        let Some(weight) = &self.weight else { return numerator };
        let weight = weight.jet(along, t, 3);
        let mut all = [DVec4::ZERO; SurfaceJet::LEN];
        for ((out, a), w) in all.iter_mut().zip(&numerator.derivatives).zip(&weight.derivatives) {
            *out = a.extend(w.x);
        }
        rational::surface(&all, 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Axis, BsplineCurve};
    use geom_core::assert_close;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// A sphere of radius 50 about the z axis; the meridian runs from pole to pole.
    fn sphere() -> BsplineSurface {
        let meridian = ArcSpans::new(-FRAC_PI_2, FRAC_PI_2);
        let arc = BsplineCurve::arc(DVec3::ZERO, 50.0 * DVec3::X, 50.0 * DVec3::Z, meridian);
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        BsplineSurface::revolution(&arc.unwrap(), axis, ArcSpans::new(0.0, TAU)).unwrap()
    }

    /// The poles a few units in the last digit apart, as Open CASCADE writes them.
    fn rounded(surface: &BsplineSurface) -> BsplineSurface {
        let off = |k: usize| 3e-15 * DVec3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3);
        let points =
            surface.control_points().iter().enumerate().map(|(k, p)| *p + off(k)).collect();
        surface.with_control_points(points).unwrap()
    }

    fn check_sphere(surface: &BsplineSurface, outward: f64) {
        let curvature = SurfaceCurvature::new(surface).unwrap();
        let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
        let shares = [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.02, 0.1, 0.3, 0.5];
        let shares: Vec<f64> = shares.into_iter().flat_map(|s| [s, 1.0 - s]).collect();
        for (a, b) in shares.iter().flat_map(|a| shares.iter().map(move |b| (a, b))) {
            let (u, v) = (u0 + (u1 - u0) * a, v0 + (v1 - v0) * b);
            let (h, k) = curvature.at(u, v).unwrap();
            let near = [a, b].into_iter().any(|s| s.min(1.0 - s) < 1e-4);
            let bound = if near { 1e-6 } else { 1e-9 };
            assert_close(h / (-0.02 * outward), 1.0, bound);
            assert_close(k / 0.0004, 1.0, bound);
        }
    }

    #[test]
    fn a_sphere_has_its_curvature_up_to_the_poles() {
        let sphere = sphere();
        let jet = sphere.jet(1.0, 0.3, 1);
        let outward = jet.d(1, 0).cross(jet.d(0, 1)).dot(jet.position()).signum();
        for (surface, sign) in [
            (sphere.clone(), 1.0),
            (sphere.swapped(), -1.0),
            (sphere.reversed_u(), -1.0),
            (sphere.swapped().reversed_u(), 1.0),
        ] {
            assert_eq!(surface.pole_sides(None).len(), 2);
            assert_eq!(rounded(&surface).pole_sides(None), surface.pole_sides(None));
            check_sphere(&surface, outward * sign);
            check_sphere(&rounded(&surface), outward * sign);
        }
    }

    #[test]
    fn a_pole_of_a_curved_patch_is_the_limit_of_its_surroundings() {
        // A polynomial triangle: z = x² + 3xy + 2y² + x³ over a disc sector, collapsed at v = 0.
        let height = |x: f64, y: f64| x * x + 3.0 * x * y + 2.0 * y * y + x * x * x;
        let knots = |d: usize| KnotVector::clamped_uniform(Degree::new(d).unwrap(), d + 1).unwrap();
        let flat = |u: f64, v: f64| (v * (1.0 - 0.5 * u), v * (0.2 + u));
        // Degree 3 in each parameter: interpolated at 4 × 4 points, exactly.
        let at = |k: usize| (k as f64) / 3.0;
        let parameters: Vec<f64> = (0..4).map(at).collect();
        let point = |u: f64, v: f64| {
            let (x, y) = flat(u, v);
            DVec3::new(x, y, height(x, y))
        };
        let points: Vec<DVec3> = (0..16).map(|k| point(at(k / 4), at(k % 4))).collect();
        let patch = crate::fit_surface(&knots(3), &knots(3), &parameters, &parameters, &points);
        let patch = patch.unwrap();
        assert_eq!(patch.pole_sides(None), [Side::StartV]);
        let curvature = SurfaceCurvature::new(&patch).unwrap();
        // H and K of the graph at the origin, whose normal is S_u × S_v = −z here or z.
        let (h, k) = (0.5 * (2.0 + 4.0), 2.0 * 4.0 - 9.0);
        for u in [0.0, 0.3, 0.77, 1.0] {
            let jet = patch.jet(u, 0.5, 1);
            let sign = jet.d(1, 0).cross(jet.d(0, 1)).z.signum();
            let (h0, k0) = curvature.at(u, 0.0).unwrap();
            assert_close(h0, sign * h, 1e-9);
            assert_close(k0, k, 1e-9);
            let (h1, k1) = curvature.at(u, 1e-5).unwrap();
            assert!((h1 - sign * h).abs() < 1e-3 && (k1 - k).abs() < 1e-3, "{h1} {k1}");
            // The two ways meet.
            let (below, above) =
                (curvature.at(u, 0.0499).unwrap(), curvature.at(u, 0.0501).unwrap());
            assert!((below.0 - above.0).abs() < 0.02 && (below.1 - above.1).abs() < 0.02);
        }
    }

    #[test]
    fn the_tip_of_a_cone_is_singular() {
        let line = BsplineCurve::segment(DVec3::Z, 2.0 * DVec3::X, 0.0, 1.0).unwrap();
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        let cone = BsplineSurface::revolution(&line, axis, ArcSpans::new(0.0, TAU)).unwrap();
        let curvature = SurfaceCurvature::new(&cone).unwrap();
        let pole = cone.pole_sides(None)[0];
        let at = |u: f64, t: f64| if pole.is_u() { (t, u) } else { (u, t) };
        let (u, v) = at(0.3 * PI, 0.0);
        assert!(curvature.at(u, v).is_err());
        // Beside it K vanishes and H grows as one over the distance.
        for t in [1e-6, 1e-3, 0.3] {
            let (u, v) = at(0.3 * PI, t);
            let (h, k) = curvature.at(u, v).unwrap();
            let radius = 2.0 * t;
            let want = 0.5 * (1.0_f64 / 5.0_f64.sqrt()) / radius;
            assert_close(h.abs() / want, 1.0, 1e-9);
            assert!(k.abs() * radius * radius < 1e-12, "{k:e}");
        }
    }
}
