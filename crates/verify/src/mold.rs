//! Molds as equations `F(x, y, z) = 0` in their own frames.

use glam::DVec3;

/// A mold touches the plane `z = 0` of its frame at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mold {
    /// `z = 0`.
    Plane,
    /// Of this curvature along x, with its axis along y.
    Cylinder(f64),
    /// Of this curvature.
    Sphere(f64),
    /// `z = a x² + b y²`.
    Paraboloid(f64, f64),
    /// Curvatures `k₁` of the parallel through the origin (along x) and `k₂` of the generating
    /// circle (along y), and the geodesic curvature `g` of the parallel.
    Torus(f64, f64, f64),
    /// `z =` the sum of these times `x², xy, y², x³, x²y, xy², y³`.
    Cubic([f64; 7]),
}

impl Mold {
    /// `F` and its gradient; NaN beyond the reach of a round mold.
    #[must_use]
    pub fn equation(&self, DVec3 { x, y, z }: DVec3) -> (f64, DVec3) {
        let graph = |f: f64, fx: f64, fy: f64| (z - f, DVec3::new(-fx, -fy, 1.0));
        match *self {
            Self::Plane => graph(0.0, 0.0, 0.0),
            Self::Cylinder(k) => {
                let (f, slope) = circle(k, x);
                graph(f, slope, 0.0)
            }
            Self::Sphere(k) => {
                let (f, slope) = circle(k, x.hypot(y));
                let r = x.hypot(y);
                let share = if r > 0.0 { slope / r } else { k };
                graph(f, share * x, share * y)
            }
            Self::Paraboloid(a, b) => graph(a * x * x + b * y * y, 2.0 * a * x, 2.0 * b * y),
            Self::Cubic([a, b, c, d, e, g, h]) => graph(
                a * x * x
                    + b * x * y
                    + c * y * y
                    + d * x.powi(3)
                    + e * x * x * y
                    + g * x * y * y
                    + h * y.powi(3),
                2.0 * a * x + b * y + 3.0 * d * x * x + 2.0 * e * x * y + g * y * y,
                b * x + 2.0 * c * y + e * x * x + 2.0 * g * x * y + 3.0 * h * y * y,
            ),
            Self::Torus(k1, k2, g) => torus([k1, k2, g], [x, y, z]),
        }
    }

    /// The signed distance `t` from `point` along the direction `along` to the mold, and its unit
    /// normal there, on the side of `along`: Newton's method on the line.
    #[must_use]
    pub fn foot(&self, point: DVec3, along: DVec3) -> (f64, DVec3) {
        let mut t = 0.0;
        for _ in 0..50 {
            let (value, gradient) = self.equation(point + t * along);
            let step = value / gradient.dot(along);
            t -= step;
            if !(step.abs() > 1e-16 * point.length()) {
                break;
            }
        }
        let normal = self.equation(point + t * along).1.normalize();
        (t, normal * normal.dot(along).signum())
    }
}

/// Height and slope of a circle of curvature `k` that touches the axis at 0.
fn circle(k: f64, r: f64) -> (f64, f64) {
    let root = (1.0 - k * k * r * r).sqrt();
    (k * r * r / (1.0 + root), k * r / root)
}

/// Turning the point about the axis into the plane `x = 0` moves it by `d` along `(g, k₁)`, with
/// `d = −x²/(σ + √((k₁² + g²) x² + σ²))`, `σ = 1 − g y − k₁ z`; there it must lie on the generating
/// circle. This stays exact as the axis moves to infinity.
fn torus([k1, k2, g]: [f64; 3], [x, y, z]: [f64; 3]) -> (f64, DVec3) {
    let squared = k1 * k1 + g * g;
    let sigma = 1.0 - g * y - k1 * z;
    let w = (squared * x * x + sigma * sigma).sqrt();
    let sum = sigma + w;
    let d = -x * x / sum;
    // Derivatives of `sum` and of `d` by x, y, z.
    let sums = [squared * x / w, -g * (1.0 + sigma / w), -k1 * (1.0 + sigma / w)];
    let tops = [-2.0 * x, 0.0, 0.0];
    let by = |k: usize| tops[k] / sum + x * x * sums[k] / (sum * sum);
    let (height, slope) = circle(k2, y + g * d);
    let gradient = DVec3::new(
        (k1 - slope * g) * by(0),
        (k1 - slope * g) * by(1) - slope,
        (k1 - slope * g) * by(2) + 1.0,
    );
    (z + k1 * d - height, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn molds() -> [Mold; 6] {
        [
            Mold::Plane,
            Mold::Cylinder(-0.4),
            Mold::Sphere(0.5),
            Mold::Paraboloid(0.2, -0.3),
            Mold::Torus(0.3, -0.5, 0.2),
            Mold::Cubic([0.2, 0.1, -0.3, 0.05, 0.04, -0.03, 0.02]),
        ]
    }

    #[test]
    fn gradients_are_those_of_differences() {
        let (p, h) = (DVec3::new(0.4, -0.3, 0.1), 1e-6);
        for mold in molds() {
            let (_, gradient) = mold.equation(p);
            for k in 0..3 {
                let step = h * DVec3::AXES[k];
                let slope = (mold.equation(p + step).0 - mold.equation(p - step).0) / (2.0 * h);
                assert!((slope - gradient[k]).abs() < 1e-9, "{mold:?} {k}");
            }
        }
    }

    #[test]
    fn feet_lie_on_their_molds() {
        let along = DVec3::new(0.1, -0.2, 1.0).normalize();
        for mold in molds() {
            let p = DVec3::new(0.3, 0.5, 0.2);
            let (t, normal) = mold.foot(p, along);
            assert!(mold.equation(p + t * along).0.abs() < 1e-15, "{mold:?}");
            assert!(normal.dot(along) > 0.5);
        }
        // A torus of radii 3 and 1 at latitude 0.8, seen from inside of the tube.
        let (sin, cos) = 0.8_f64.sin_cos();
        let to_axis = 3.0 + cos;
        let mold = Mold::Torus(cos / to_axis, 1.0, sin / to_axis);
        let (z, _) = mold.foot(DVec3::new(0.3, -0.2, 0.0), DVec3::Z);
        let away = to_axis + 0.2 * sin - cos * z;
        let height = sin - 0.2 * cos - sin * z;
        assert!(((away.hypot(0.3) - 3.0).hypot(height) - 1.0).abs() < 1e-14);
    }
}
