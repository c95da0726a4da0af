//! The camera of a picture and the light it brings.

use glam::DVec3;
use libm::{cos, sin, tan};

use crate::raster::Projected;

/// Direction of view, in degrees: seen from the front left and from above.
const AZIMUTH: f64 = -60.0;
const ELEVATION: f64 = 28.0;
const FIELD_OF_VIEW: f64 = 26.0;
/// The share of the frame that the model fills.
const FILLED: f64 = 0.9;

/// A part of a picture, in pixels from its upper left corner.
#[derive(Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) corner: [f64; 2],
    pub(crate) size: [f64; 2],
}

/// A camera that looks at the middle of the model, which fills the frame.
pub(crate) struct Camera {
    right: DVec3,
    up: DVec3,
    back: DVec3,
    eye: DVec3,
    distance: f64,
    frame: Frame,
}

impl Camera {
    pub(crate) fn fitted(points: &[DVec3], frame: Frame) -> Self {
        let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
        let level = cos(elevation);
        let back = DVec3::new(level * cos(azimuth), level * sin(azimuth), sin(elevation));
        let right = DVec3::new(-sin(azimuth), cos(azimuth), 0.0);
        let up = back.cross(right);
        let local = |p: &DVec3| DVec3::new(p.dot(right), p.dot(up), p.dot(back));
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = points.iter().map(local).fold(start, |(a, b), q| (a.min(q), b.max(q)));
        let middle = 0.5 * (lo + hi);
        let high = FILLED * half_view();
        let wide = high * frame.size[0] / frame.size[1];
        let needed = points.iter().map(|p| {
            let q = local(p) - middle;
            (q.x.abs() / wide).max(q.y.abs() / high) + q.z
        });
        let distance = needed.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let centre = right * middle.x + up * middle.y + back * middle.z;
        Self { right, up, back, eye: centre + back * distance, distance, frame }
    }

    /// Pixels per unit of length at the distance of the middle.
    pub(crate) fn pixels_per_unit(&self) -> f64 {
        0.5 * self.frame.size[1] / (half_view() * self.distance)
    }

    pub(crate) fn project(&self, p: DVec3) -> Projected {
        let q = p - self.eye;
        let nearness = self.distance / -q.dot(self.back);
        let scale = self.pixels_per_unit() * nearness;
        let [x, y] = [0, 1].map(|k| self.frame.corner[k] + 0.5 * self.frame.size[k]);
        Projected { x: x + scale * q.dot(self.right), y: y - scale * q.dot(self.up), nearness }
    }

    /// The same soft light as the viewer's.
    pub(crate) fn lit(&self, base: [u8; 3], position: DVec3, normal: DVec3) -> [u8; 3] {
        let to_eye = (self.eye - position).normalize();
        let mut n = normal.normalize_or(to_eye);
        if n.dot(to_eye) < 0.0 {
            n = -n;
        }
        let key = (-0.45 * self.right + 0.65 * self.up + 0.75 * self.back).normalize();
        let wrap = 0.5 + 0.5 * n.dot(key);
        let light = 0.60 + 0.44 * wrap * wrap;
        let mirrored = 2.0 * n.dot(key) * n - key;
        let shine = 0.07 * power_28(mirrored.dot(to_eye).max(0.0));
        let rim = 0.90 + 0.10 * (n.dot(to_eye) / 0.35).clamp(0.0, 1.0);
        base.map(|c| (((f64::from(c) / 255.0) * light + shine) * rim * 255.0).round() as u8)
    }
}

/// Tangent of half the field of view.
fn half_view() -> f64 {
    tan((0.5 * FIELD_OF_VIEW).to_radians())
}

/// `x²⁸`, by products alone: what `powi` rounds to is not the same on every machine.
fn power_28(x: f64) -> f64 {
    let x4 = (x * x) * (x * x);
    let x8 = x4 * x4;
    x8 * x8 * (x8 * x4)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { corner: [200.0, 0.0], size: [800.0, 600.0] };

    /// A box with one corner at the origin.
    fn corners(size: DVec3) -> Vec<DVec3> {
        let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { size[bit] } else { 0.0 };
        (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect()
    }

    #[test]
    fn models_of_any_size_fill_the_frame_and_stay_inside() {
        for size in [DVec3::ONE, DVec3::new(1e-6, 3e-6, 0.0), DVec3::new(2e5, 1e4, 9e4)] {
            let points = corners(size);
            let camera = Camera::fitted(&points, FRAME);
            let seen: Vec<Projected> = points.iter().map(|p| camera.project(*p)).collect();
            let mut filled = [0.0_f64; 2];
            for p in &seen {
                for (k, at) in [p.x, p.y].into_iter().enumerate() {
                    let from_middle = (at - FRAME.corner[k]) / FRAME.size[k] - 0.5;
                    filled[k] = filled[k].max(2.0 * from_middle.abs());
                }
            }
            let most = filled[0].max(filled[1]);
            assert!((most - FILLED).abs() < 1e-9, "{most}");
        }
    }

    #[test]
    fn a_length_at_the_middle_has_the_scale_of_the_bar() {
        let points = corners(DVec3::new(4.0, 2.0, 1.0));
        let camera = Camera::fitted(&points, FRAME);
        let middle = camera.eye - camera.back * camera.distance;
        let (a, b) = (camera.project(middle), camera.project(middle + 0.1 * camera.right));
        assert!((b.x - a.x - 0.1 * camera.pixels_per_unit()).abs() < 1e-9);
        assert!((a.nearness - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_nearer_has_more_nearness() {
        let camera = Camera::fitted(&corners(DVec3::ONE), FRAME);
        let nearness = |p: DVec3| camera.project(p).nearness;
        assert!(nearness(camera.back) > nearness(DVec3::ZERO));
    }

    #[test]
    fn both_sides_of_a_surface_are_lit_alike() {
        let camera = Camera::fitted(&corners(DVec3::ONE), FRAME);
        let n = DVec3::new(0.3, -0.4, 0.8).normalize();
        let lit = |n| camera.lit([200, 100, 50], DVec3::splat(0.5), n);
        assert_eq!(lit(n), lit(-n));
        assert!((power_28(0.9) / 0.9_f64.powi(28) - 1.0).abs() < 1e-14);
    }
}
