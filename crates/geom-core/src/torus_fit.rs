//! The torus nearest to a set of points.

use glam::{DMat3, DVec3};
use numerics::least_squares;

/// Unknowns: centre, two tilts of the axis, two radii.
const UNKNOWNS: usize = 7;
/// Gauss-Newton steps at most.
const STEPS: usize = 50;
/// The fit has settled once a step is at most this share of the major radius.
const SETTLED: f64 = 1e-12;

/// A torus of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// Centre of symmetry.
    pub centre: DVec3,
    /// Unit vector along the axis of revolution.
    pub axis: DVec3,
    /// Distance of the tube's centre from the axis.
    pub major_radius: f64,
    /// Radius of the tube.
    pub minor_radius: f64,
}

impl Torus {
    /// The ratio of the minor to the major radius.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.minor_radius / self.major_radius
    }

    /// Signed distance of a point from the torus, positive outside the tube.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, Torus};
    /// let (centre, axis) = (DVec3::ZERO, DVec3::Z);
    /// let ring = Torus { centre, axis, major_radius: 2.0, minor_radius: 0.5 };
    /// assert_eq!(ring.distance(DVec3::new(3.0, 0.0, 0.0)), 0.5);
    /// assert_eq!(ring.distance(DVec3::new(0.0, 2.0, 0.0)), -0.5);
    /// ```
    #[must_use]
    pub fn distance(&self, point: DVec3) -> f64 {
        let height = self.axis.dot(point - self.centre);
        let reach = (point - self.centre - height * self.axis).length();
        (reach - self.major_radius).hypot(height) - self.minor_radius
    }

    /// The torus with the least sum of squared distances from the points, by Gauss-Newton steps;
    /// also the root mean square of the distances.
    ///
    /// The start takes the direction of least variance as axis, so that the points should go all
    /// around. `None` for fewer than seven points and for points that determine no torus.
    ///
    /// # Example
    /// ```
    /// use geom_core::{DVec3, Torus};
    /// let at = |u: f64, v: f64| {
    ///     let reach = 2.0 + 0.5 * v.cos();
    ///     DVec3::new(reach * u.cos(), 0.5 * v.sin(), reach * u.sin())
    /// };
    /// let points: Vec<DVec3> = (0..40).map(|k| at(f64::from(k), 2.4 * f64::from(k))).collect();
    /// let (torus, rms) = Torus::fit(&points).unwrap();
    /// assert!((torus.ratio() - 0.25).abs() < 1e-9 && rms < 1e-9);
    /// ```
    #[must_use]
    pub fn fit(points: &[DVec3]) -> Option<(Self, f64)> {
        let mut torus = Self::start(points)?;
        let mut rows = vec![0.0; UNKNOWNS * points.len()];
        let mut residuals = vec![0.0; points.len()];
        for _ in 0..STEPS {
            let (x, y) = torus.axis.any_orthonormal_pair();
            for ((point, row), residual) in
                points.iter().zip(rows.chunks_exact_mut(UNKNOWNS)).zip(&mut residuals)
            {
                let offset = *point - torus.centre;
                let height = torus.axis.dot(offset);
                let across = offset - height * torus.axis;
                let reach = across.length();
                let tube = (reach - torus.major_radius).hypot(height);
                // Points on the axis or on the tube's centre line have no direction outwards.
                let outwards = across / reach.max(f64::MIN_POSITIVE);
                let (cos, sin) = ((reach - torus.major_radius) / tube, height / tube);
                if !(cos.is_finite() && sin.is_finite()) {
                    return None;
                }
                let gradient = cos * outwards + sin * torus.axis;
                // Tilting the axis by δ changes the height by δ·across, the reach by −height δ·out.
                let tilt = sin * across - cos * height * outwards;
                row.copy_from_slice(&[
                    -gradient.x,
                    -gradient.y,
                    -gradient.z,
                    tilt.dot(x),
                    tilt.dot(y),
                    -cos,
                    -1.0,
                ]);
                *residual = torus.minor_radius - tube;
            }
            let (mut matrix, mut step) = (rows.clone(), residuals.clone());
            least_squares(&mut matrix, UNKNOWNS, &mut step, 1).ok()?;
            torus.centre += DVec3::new(step[0], step[1], step[2]);
            torus.axis = (torus.axis + step[3] * x + step[4] * y).normalize();
            torus.major_radius += step[5];
            torus.minor_radius += step[6];
            let size = step[..UNKNOWNS].iter().map(|s| s * s).sum::<f64>().sqrt();
            if size <= SETTLED * torus.major_radius {
                break;
            }
        }
        let sum: f64 = points.iter().map(|&p| torus.distance(p).powi(2)).sum();
        let rms = (sum / points.len() as f64).sqrt();
        let fits = rms.is_finite() && torus.minor_radius > 0.0 && torus.major_radius > 0.0;
        fits.then_some((torus, rms))
    }

    fn start(points: &[DVec3]) -> Option<Self> {
        if points.len() < UNKNOWNS {
            return None;
        }
        let count = points.len() as f64;
        let centre = points.iter().copied().sum::<DVec3>() / count;
        let mut spread = DMat3::ZERO;
        for &p in points {
            let d = p - centre;
            spread += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        }
        let trace = spread.col(0).x + spread.col(1).y + spread.col(2).z;
        // Squared again and again, the columns turn into the direction of least spread.
        let mut power = DMat3::IDENTITY * trace - spread;
        for _ in 0..24 {
            let size = power.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            power *= 1.0 / size;
            power = power * power;
        }
        let columns = [power.col(0), power.col(1), power.col(2)];
        let axis = columns.into_iter().max_by(|a, b| a.length().total_cmp(&b.length()))?;
        let axis = axis.try_normalize()?;
        let reach = |p: &DVec3| (*p - centre).reject_from(axis).length();
        let major_radius = points.iter().map(reach).sum::<f64>() / count;
        let tube = |p: &DVec3| (reach(p) - major_radius).hypot(axis.dot(*p - centre));
        let minor_radius = points.iter().map(tube).sum::<f64>() / count;
        Some(Self { centre, axis, major_radius, minor_radius })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    fn samples(torus: &Torus, bumps: f64) -> Vec<DVec3> {
        let (x, y) = torus.axis.any_orthonormal_pair();
        (0..30 * 20)
            .map(|k| {
                let (u, v) = (f64::from(k / 20) * 0.21, f64::from(k % 20) * 0.314);
                let tube = torus.minor_radius + bumps * (5.0 * u + 3.0 * v).sin();
                let out = u.cos() * x + u.sin() * y;
                torus.centre
                    + (torus.major_radius + tube * v.cos()) * out
                    + tube * v.sin() * torus.axis
            })
            .collect()
    }

    #[test]
    fn exact_tori_are_found() {
        for ratio in [0.05, 0.3, 0.7, 0.95] {
            let want = Torus {
                centre: DVec3::new(3.0, -1.0, 7.0),
                axis: DVec3::new(1.0, 2.0, -0.5).normalize(),
                major_radius: 2.0,
                minor_radius: 2.0 * ratio,
            };
            let (got, rms) = Torus::fit(&samples(&want, 0.0)).expect("a torus");
            assert_close(got.ratio(), ratio, 1e-9);
            assert_close(got.major_radius, 2.0, 1e-9);
            assert!(got.centre.distance(want.centre) < 1e-9 && rms < 1e-9, "{got:?}");
            assert!(got.axis.dot(want.axis).abs() > 1.0 - 1e-9);
        }
    }

    #[test]
    fn bumps_stay_as_residual() {
        let want =
            Torus { centre: DVec3::ZERO, axis: DVec3::Z, major_radius: 1.0, minor_radius: 0.4 };
        let (got, rms) = Torus::fit(&samples(&want, 0.01)).expect("a torus");
        assert_close(got.ratio(), 0.4, 2e-3);
        assert!((0.005..0.009).contains(&rms), "{rms}");
    }

    #[test]
    fn points_without_a_torus_give_none() {
        assert_eq!(Torus::fit(&[DVec3::X, DVec3::Y]), None);
        assert_eq!(Torus::fit(&[DVec3::X; 9]), None);
    }
}
