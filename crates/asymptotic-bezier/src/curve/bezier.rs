//! Boundary curves: Bezier curves with curvature, torsion and binormal turning.

use geom_core::DVec3;

use crate::curve::bernstein::{self, derivative};

/// Samples per curve for turning, torsion signs and extremes.
pub(crate) const CURVE_SAMPLES: usize = 401;

/// A Bezier curve in space, at least a cubic and finite (the solvers that build it see to both).
///
/// Besides the control points it keeps their offsets from the first one. The torsion of a curve of
/// length `h` divides third differences by `h³`, so the rounding of coordinates far from the origin
/// would show; the offsets are rounded in units of the curve itself.
///
/// A curve made from the normals of a surface along it keeps them (`r′ = ± N × N′`, Lelieuvre):
/// they tell its torsion even where its curvature is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierCurve {
    points: Vec<DVec3>,
    offsets: Vec<DVec3>,
    normals: Option<Vec<DVec3>>,
}

/// Position and the first three derivatives with respect to the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveJet {
    /// `r`
    pub position: DVec3,
    /// `r′`
    pub first: DVec3,
    /// `r″`
    pub second: DVec3,
    /// `r‴`
    pub third: DVec3,
}

impl CurveJet {
    /// Curvature `|r′ × r″| / |r′|³`, in 1/length.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        self.first.cross(self.second).length() / self.first.length().powi(3)
    }

    /// Torsion `det(r′, r″, r‴) / |r′ × r″|²`, in 1/length; NaN where the curvature is zero.
    #[must_use]
    pub fn torsion(&self) -> f64 {
        let b = self.first.cross(self.second);
        b.dot(self.third) / b.length_squared()
    }
}

/// Sampled quantities of one boundary curve (401 parameters, both ends included).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveQuality {
    /// `∫ |r′| dt`.
    pub length: f64,
    /// `∫ |τ| ds` in radians: how far the binormal, hence the surface normal, turns.
    pub turning: f64,
    /// Least and greatest curvature.
    pub curvature: [f64; 2],
    /// Least and greatest torsion.
    pub torsion: [f64; 2],
    /// Least speed `|r′|` divided by the mean speed; zero at a cusp.
    pub relative_speed: f64,
    /// Parameter where the binormal reverses, if it does.
    pub reversal: Option<f64>,
}

impl BezierCurve {
    /// The curve with these control points.
    ///
    /// # Panics
    /// With fewer than four control points.
    #[must_use]
    pub fn new(points: Vec<DVec3>) -> Self {
        assert!(points.len() >= 4, "a boundary curve is at least a cubic");
        let offsets = points.iter().map(|p| *p - points[0]).collect();
        Self { points, offsets, normals: None }
    }

    /// The curve between two points with these offsets from the first.
    pub(crate) fn from_offsets(offsets: Vec<DVec3>, [start, end]: [DVec3; 2]) -> Self {
        let mut points: Vec<DVec3> = offsets.iter().map(|d| start + *d).collect();
        // Curves that meet share the vertex to the last bit.
        if let Some(last) = points.last_mut() {
            *last = end;
        }
        Self { points, offsets, normals: None }
    }

    /// The same curve somewhere else; what is measured from its start stays to the last bit.
    pub(crate) fn translated(mut self, by: DVec3) -> Self {
        self.points.iter_mut().for_each(|p| *p += by);
        self
    }

    /// The same curve with the control points of its polynomial normal `N`, `r′ = ± N × N′`.
    pub(crate) fn with_normals(self, normals: Vec<DVec3>) -> Self {
        Self { normals: Some(normals), ..self }
    }

    /// Control points of the polynomial normal it was made from.
    pub(crate) fn normals(&self) -> Option<&[DVec3]> {
        self.normals.as_deref()
    }

    /// Polynomial degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.points.len() - 1
    }

    /// Control points, start to end.
    #[must_use]
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Control points measured from the first one.
    pub(crate) fn offsets(&self) -> &[DVec3] {
        &self.offsets
    }

    fn ends(&self) -> [DVec3; 2] {
        [self.points[0], self.points[self.degree()]]
    }

    /// The curve traversed the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let last = self.offsets[self.degree()];
        let offsets = self.offsets.iter().rev().map(|d| *d - last).collect();
        let points = self.points.iter().rev().copied().collect();
        let normals = self.normals.as_ref().map(|n| n.iter().rev().copied().collect());
        Self { points, offsets, normals }
    }

    /// The same curve written in degree `degree`, which is not below its own.
    #[must_use]
    pub fn elevated(&self, degree: usize) -> Self {
        let normals = self.normals.clone();
        Self {
            normals,
            ..Self::from_offsets(bernstein::elevate(&self.offsets, degree), self.ends())
        }
    }

    /// Position at `t`.
    #[must_use]
    pub fn position(&self, t: f64) -> DVec3 {
        self.points[0] + bernstein::eval(&self.offsets, t)
    }

    /// `segments + 1` points, evenly spaced in the parameter.
    #[must_use]
    pub fn polyline(&self, segments: usize) -> Vec<DVec3> {
        (0..=segments).map(|k| self.position(k as f64 / segments as f64)).collect()
    }

    /// Position and three derivatives at `t`.
    #[must_use]
    pub fn jet(&self, t: f64) -> CurveJet {
        JetTable::new(self).at(t)
    }

    /// `∫ |r^(order)|² dt`: order 2 is the strain energy of Wang et al. 2019, Eq. 3.4.
    #[must_use]
    pub fn derivative_energy(&self, order: usize) -> f64 {
        // Differences first: a straight curve then has no energy rather than rounding noise.
        let mut polygon = self.offsets.clone();
        for _ in 0..order {
            polygon = bernstein::derivative(&polygon);
        }
        let mass = bernstein::gram(polygon.len() - 1, 0);
        let mut sum = 0.0;
        for (i, p) in polygon.iter().enumerate() {
            for (j, q) in polygon.iter().enumerate() {
                sum += mass[(i, j)] * p.dot(*q);
            }
        }
        sum
    }

    /// Length, turning, extremes of curvature and torsion, reversals of the binormal.
    #[must_use]
    pub fn quality(&self) -> CurveQuality {
        let table = JetTable::new(self);
        let step = 1.0 / (CURVE_SAMPLES - 1) as f64;
        let mut out = CurveQuality {
            length: 0.0,
            turning: 0.0,
            curvature: [f64::INFINITY, f64::NEG_INFINITY],
            torsion: [f64::INFINITY, f64::NEG_INFINITY],
            relative_speed: f64::INFINITY,
            reversal: None,
        };
        let mut last = None::<(f64, DVec3)>;
        for i in 0..CURVE_SAMPLES {
            let t = i as f64 * step;
            let jet = table.at(t);
            let b = jet.first.cross(jet.second);
            let speed = jet.first.length();
            let (k, tau) = (jet.curvature(), table.torsion(t, &jet));
            // Trapezoidal rule, as the sampled extremes use the same points.
            let weight = if i == 0 || i + 1 == CURVE_SAMPLES { 0.5 * step } else { step };
            out.length += weight * speed;
            out.turning += weight * speed * tau.abs();
            out.curvature = [out.curvature[0].min(k), out.curvature[1].max(k)];
            out.torsion = [out.torsion[0].min(tau), out.torsion[1].max(tau)];
            out.relative_speed = out.relative_speed.min(speed);
            // A sample on the inflection itself has no binormal to compare, and with a normal along
            // the curve reversals do no harm.
            if b == DVec3::ZERO || self.normals.is_some() {
                continue;
            }
            if let Some((before, binormal)) = last
                && binormal.dot(b) < 0.0
                && out.reversal.is_none()
            {
                out.reversal = table.find_reversal(before, t);
            }
            last = Some((t, b));
        }
        out.relative_speed /= out.length;
        out
    }
}

/// Derivative polygons of a curve, kept for many evaluations.
pub(crate) struct JetTable<'a> {
    start: DVec3,
    offsets: &'a [DVec3],
    first: Vec<DVec3>,
    second: Vec<DVec3>,
    third: Vec<DVec3>,
    /// Normals along the curve and their derivative.
    normals: Option<(&'a [DVec3], Vec<DVec3>)>,
}

impl<'a> JetTable<'a> {
    pub(crate) fn new(curve: &'a BezierCurve) -> Self {
        let first = bernstein::derivative(&curve.offsets);
        let second = bernstein::derivative(&first);
        let third = bernstein::derivative(&second);
        let normals = curve.normals().map(|normals| (normals, derivative(normals)));
        Self { start: curve.points[0], offsets: &curve.offsets, first, second, third, normals }
    }

    /// Torsion at `t`, where the curve has this jet: from the normals where there are any
    /// (`|τ| = 1/|N|²`), which inflections and lines do not disturb.
    pub(crate) fn torsion(&self, t: f64, jet: &CurveJet) -> f64 {
        let Some((normals, slopes)) = &self.normals else { return jet.torsion() };
        let [slope, n] = bernstein::eval_rising([slopes, normals], t);
        n.length_squared().recip().copysign(n.cross(slope).dot(jet.first))
    }

    pub(crate) fn at(&self, t: f64) -> CurveJet {
        let rising = [&self.third, &self.second, &self.first, self.offsets];
        let [third, second, first, offset] = bernstein::eval_rising(rising, t);
        CurveJet { position: self.start + offset, first, second, third }
    }

    /// Bisects towards the sharpest turn of the binormal between two parameters; a turn by more
    /// than a right angle within 1e-9 is a reversal, anything slower is a fast but smooth twist.
    fn find_reversal(&self, mut a: f64, mut b: f64) -> Option<f64> {
        let binormal = |t: f64| {
            let jet = self.at(t);
            jet.first.cross(jet.second).normalize_or_zero()
        };
        let (mut na, mut nb) = (binormal(a), binormal(b));
        while b - a > 1e-9 {
            let m = 0.5 * (a + b);
            let nm = binormal(m);
            if na.dot(nm) <= nm.dot(nb) {
                (b, nb) = (m, nm);
            } else {
                (a, na) = (m, nm);
            }
            if na.dot(nb) > 0.0 {
                return None;
            }
        }
        Some(0.5 * (a + b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twisted_cubic_has_the_textbook_curvature_and_torsion() {
        // r = (t, t², t³): κ(0) = 2, τ(0) = 3.
        let curve = BezierCurve::new(vec![
            DVec3::ZERO,
            DVec3::new(1.0 / 3.0, 0.0, 0.0),
            DVec3::new(2.0 / 3.0, 1.0 / 3.0, 0.0),
            DVec3::new(1.0, 1.0, 1.0),
        ]);
        let jet = curve.elevated(7).jet(0.0);
        assert!((jet.curvature() - 2.0).abs() < 1e-12);
        assert!((jet.torsion() - 3.0).abs() < 1e-11);
        assert!((curve.derivative_energy(2) - (4.0 + 12.0)).abs() < 1e-12);
        assert_eq!(curve.quality().reversal, None);
    }

    #[test]
    fn a_planar_s_curve_reverses_its_binormal_at_the_inflection() {
        let curve = BezierCurve::new(vec![
            DVec3::ZERO,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(2.0, -1.0, 0.0),
            DVec3::new(3.0, 0.0, 0.0),
        ]);
        let t = curve.quality().reversal.unwrap();
        assert!((t - 0.5).abs() < 1e-8, "{t}");
    }
}
