//! Splines as openNURBS writes them: without the first and the last knot, and with control points
//! times their weights.

use super::chunks::Chunks;
use super::codes::{NURBS_CURVE, NURBS_SURFACE};
use crate::wrapped::wrapped;
use bspline::{BsplineCurve, BsplineSurface, KnotVector};
use geom_core::DVec3;

impl Chunks {
    /// A curve, in the plane for `dimension` 2.
    pub(super) fn nurbs_curve(&mut self, curve: &BsplineCurve, dimension: usize) {
        self.object(&NURBS_CURVE, |file| {
            let rows = wrapped(curve.knots());
            file.u8(0x10);
            file.int(dimension);
            file.int(usize::from(curve.weights().is_some()));
            file.int(curve.knots().degree().order());
            file.int(rows.len());
            // Reserved.
            file.i32s(&[0, 0]);
            file.bounds(curve.control_points().iter().copied());
            file.knots(curve.knots());
            file.int(rows.len());
            for k in rows {
                let weight = curve.weights().map(|w| w[k]);
                file.control_point(curve.control_points()[k], weight, dimension);
            }
        });
    }

    /// A surface.
    pub(super) fn nurbs_surface(&mut self, surface: &BsplineSurface) {
        self.object(&NURBS_SURFACE, |file| {
            let (rows_u, rows_v) = (wrapped(surface.knots_u()), wrapped(surface.knots_v()));
            file.u8(0x10);
            file.int(3);
            file.int(usize::from(surface.is_rational()));
            file.int(surface.degree_u().order());
            file.int(surface.degree_v().order());
            file.int(rows_u.len());
            file.int(rows_v.len());
            // Reserved.
            file.i32s(&[0, 0]);
            file.bounds(surface.control_points().iter().copied());
            file.knots(surface.knots_u());
            file.knots(surface.knots_v());
            file.int(rows_u.len() * rows_v.len());
            for i in &rows_u {
                for j in &rows_v {
                    let k = i * surface.n_v() + j;
                    let weight = surface.weights().map(|w| w[k]);
                    file.control_point(surface.control_points()[k], weight, 3);
                }
            }
        });
    }

    fn knots(&mut self, knots: &KnotVector) {
        let knots = knots.knots();
        self.reals(&knots[1..knots.len() - 1]);
    }

    fn control_point(&mut self, p: DVec3, weight: Option<f64>, dimension: usize) {
        for x in p.to_array().into_iter().take(dimension) {
            self.f64(weight.map_or(x, |w| weighted(x, w)));
        }
        if let Some(w) = weight {
            self.f64(w);
        }
    }
}

/// `x w`, rounded so that the quotient by `w` is `x` again wherever a double does that.
fn weighted(x: f64, w: f64) -> f64 {
    let near = x * w;
    let back = |y: &f64| y / w == x;
    [near, near.next_up(), near.next_down()].into_iter().find(back).unwrap_or(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weighted_coordinates_come_back_wherever_a_double_does_that_else_within_one_bit() {
        let (mut x, mut exact) = (0.1_f64, 0);
        for k in 0..1000 {
            x = (x * 997.13).fract() + 0.01;
            let w = 0.05 + f64::from(k) * 0.0031;
            let back = weighted(x, w) / w;
            assert!(back == x || back == x.next_up() || back == x.next_down());
            // Nothing in reach of the product does better.
            let reach = 8;
            let lowest = (0..reach).fold(x * w, |y, _| y.next_down());
            let mut all = std::iter::successors(Some(lowest), |y| Some(y.next_up()));
            assert_eq!(all.by_ref().take(2 * reach + 1).any(|y| y / w == x), back == x, "{x} {w}");
            exact += usize::from(back == x);
            assert_eq!(weighted(x, 0.25) / 0.25, x);
        }
        // A quotient misses a double only where doubles are wider spaced above than below it.
        assert!(exact > 500, "{exact}");
    }
}
