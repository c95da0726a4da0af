//! A z-buffer for shaded triangles, with four samples per pixel.

use crate::colormap::{from_linear, to_linear};

/// Samples per pixel.
const FINE: usize = 4;
/// Where they lie in the pixel: no two in a row or column, so that nearly level and nearly upright
/// edges get five steps of grey, where a grid of two by two gives them three.
const SAMPLES: [[f64; 2]; FINE] = [[0.125, 0.625], [0.375, 0.125], [0.625, 0.875], [0.875, 0.375]];
/// How far outside a triangle, in barycentric weight, a sample still belongs to it, so that
/// rounding opens no slit between neighbours.
const RIM: f64 = -1e-9;

/// A point of the image plane in pixels from the upper left, with 1/distance from the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) nearness: f64,
}

/// Samples of a picture in the making.
pub(crate) struct Raster {
    width: usize,
    height: usize,
    colours: Vec<[[u8; 3]; FINE]>,
    nearness: Vec<[f32; FINE]>,
}

impl Raster {
    /// An empty picture of `width` x `height` pixels.
    pub(crate) fn new(width: usize, height: usize, background: [u8; 3]) -> Self {
        let pixels = width * height;
        let (colours, nearness) = (vec![[background; FINE]; pixels], vec![[0.0; FINE]; pixels]);
        Self { width, height, colours, nearness }
    }

    /// Draws a triangle. `shade` gets perspective-correct weights of its corners, once for the
    /// samples of a pixel that the triangle takes.
    pub(crate) fn triangle(
        &mut self,
        corners: [Projected; 3],
        shade: impl Fn([f64; 3]) -> [u8; 3],
    ) {
        let [a, b, c] = corners.map(|p| [p.x, p.y]);
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let area = cross(a, b, c);
        if !(area.abs() > 0.0) {
            return;
        }
        let weights =
            |p: [f64; 2]| [cross(b, c, p) / area, cross(c, a, p) / area, cross(a, b, p) / area];
        // Weights are linear in the plane: what a sample adds to those at its pixel's corner.
        let at_origin = weights([0.0; 2]);
        let added = SAMPLES.map(|offset| {
            let there = weights(offset);
            [0, 1, 2].map(|i| there[i] - at_origin[i])
        });
        let range = |k: usize, size: usize| {
            let (lo, hi) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            lo.max(0.0) as usize..((hi + 1.0).max(0.0) as usize).min(size)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let at_corner = weights([x as f64, y as f64]);
                let pixel = y * self.width + x;
                let (mut taken, mut sum) = ([false; FINE], [0.0; 3]);
                for (s, added) in added.iter().enumerate() {
                    let flat = [0, 1, 2].map(|i| at_corner[i] + added[i]);
                    if flat.iter().any(|w| *w < RIM) {
                        continue;
                    }
                    let near = [0, 1, 2].map(|i| flat[i] * corners[i].nearness);
                    let nearness = (near[0] + near[1] + near[2]) as f32;
                    if nearness > self.nearness[pixel][s] {
                        self.nearness[pixel][s] = nearness;
                        taken[s] = true;
                        sum = [0, 1, 2].map(|i| sum[i] + near[i]);
                    }
                }
                let total = sum[0] + sum[1] + sum[2];
                if total > 0.0 {
                    let colour = shade(sum.map(|w| w / total));
                    for s in (0..FINE).filter(|s| taken[*s]) {
                        self.colours[pixel][s] = colour;
                    }
                }
            }
        }
    }

    /// Whether nothing lies in front of `point` by more than the share `bias` at one of the samples
    /// within a pixel of it: a surface seen edge-on is in front of its own border half a pixel on.
    pub(crate) fn shows(&self, point: Projected, bias: f64) -> bool {
        let near = point.nearness * (1.0 + bias);
        let around = |at: f64, size: usize| {
            let inside = |v: f64| (v.max(0.0) as usize).min(size);
            inside(at - 0.5)..inside(at + 1.5)
        };
        around(point.y, self.height).any(|y| {
            let row = &self.nearness[y * self.width..(y + 1) * self.width];
            row[around(point.x, self.width)].iter().flatten().any(|n| near >= f64::from(*n))
        })
    }

    /// The pixels row by row, each the mean of its samples in linear light.
    pub(crate) fn pixels(&self) -> Vec<[u8; 3]> {
        let linear: Vec<f64> = (0..=255).map(to_linear).collect();
        let mean = |samples: &[[u8; 3]; FINE]| {
            // Most pixels are of one colour; the root is for edges alone.
            if samples[1..].iter().all(|s| *s == samples[0]) {
                return samples[0];
            }
            [0, 1, 2].map(|k| {
                let sum: f64 = samples.iter().map(|s| linear[usize::from(s[k])]).sum();
                from_linear(sum / FINE as f64)
            })
        };
        self.colours.iter().map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEAR: f64 = 2.0;
    const FAR: f64 = 1.0;

    fn square(raster: &mut Raster, nearness: f64, colour: [u8; 3]) {
        let corner = |x: f64, y: f64| Projected { x, y, nearness };
        let [a, b, c, d] = [corner(0.0, 0.0), corner(8.0, 0.0), corner(8.0, 8.0), corner(0.0, 8.0)];
        raster.triangle([a, b, c], |_| colour);
        raster.triangle([a, c, d], |_| colour);
    }

    #[test]
    fn the_nearer_surface_wins_in_any_order() {
        for near_first in [true, false] {
            let mut raster = Raster::new(8, 8, [9; 3]);
            let mut parts = [(NEAR, [200, 0, 0]), (FAR, [0, 0, 200])];
            if !near_first {
                parts.reverse();
            }
            for (nearness, colour) in parts {
                square(&mut raster, nearness, colour);
            }
            assert!(raster.pixels().into_iter().all(|p| p == [200, 0, 0]));
        }
    }

    #[test]
    fn edges_are_averaged_in_linear_light() {
        let mut raster = Raster::new(1, 1, [0; 3]);
        let corner = |x: f64, y: f64| Projected { x, y, nearness: 1.0 };
        let left = [corner(0.0, -1.0), corner(0.5, -1.0), corner(0.5, 3.0)];
        raster.triangle(left, |_| [255; 3]);
        raster.triangle([corner(0.0, -1.0), corner(0.5, 3.0), corner(0.0, 3.0)], |_| [255; 3]);
        // Half the light is the sRGB byte 188.
        assert_eq!(raster.pixels(), [[188; 3]]);
    }

    #[test]
    fn a_fan_of_triangles_has_no_slits_and_no_sample_twice() {
        let mut raster = Raster::new(40, 40, [0; 3]);
        let rim = |k: usize| {
            let angle = k as f64 * std::f64::consts::TAU / 17.0;
            Projected { x: 20.3 + 60.0 * angle.cos(), y: 19.6 + 60.0 * angle.sin(), nearness: 1.0 }
        };
        let middle = Projected { x: 20.3, y: 19.6, nearness: 1.0 };
        for k in 0..17 {
            raster.triangle([middle, rim(k), rim(k + 1)], |_| [255; 3]);
        }
        assert!(raster.pixels().into_iter().all(|p| p == [255; 3]));
    }

    #[test]
    fn a_triangle_takes_as_many_samples_as_its_area() {
        let mut raster = Raster::new(200, 150, [0; 3]);
        let corner = |x: f64, y: f64| Projected { x, y, nearness: 1.0 };
        raster
            .triangle([corner(13.2, 11.7), corner(190.1, 40.3), corner(60.6, 140.9)], |_| [255; 3]);
        let light: f64 = raster.pixels().iter().map(|p| to_linear(p[0])).sum();
        let area = 0.5 * ((190.1 - 13.2) * (140.9 - 11.7) - (40.3 - 11.7) * (60.6 - 13.2));
        assert!((light / area - 1.0).abs() < 2e-3, "{light} {area}");
    }

    #[test]
    fn weights_are_perspective_correct() {
        let mut raster = Raster::new(4, 4, [0; 3]);
        let (a, b) = (Projected { x: 0.0, y: 0.0, nearness: 1.0 }, 0.25);
        let far = Projected { x: 4.0, y: 0.0, nearness: b };
        let other = Projected { x: 4.0, y: 4.0, nearness: b };
        let seen = std::cell::RefCell::new(Vec::new());
        raster.triangle([a, far, other], |w| {
            seen.borrow_mut().push(w);
            [1; 3]
        });
        // Half-way across the image is at a fifth of the way in space: 1/(1 + 4).
        let middle = seen.into_inner().into_iter().map(|w| (w[0] - 0.8).abs());
        assert!(middle.fold(f64::MAX, f64::min) < 0.06);
    }

    #[test]
    fn points_show_unless_something_is_in_front_all_around() {
        let mut raster = Raster::new(12, 8, [9; 3]);
        square(&mut raster, NEAR, [200, 0, 0]);
        let at = |x: f64, nearness: f64| Projected { x, y: 4.0, nearness };
        assert!(raster.shows(at(4.0, NEAR), 1e-3) && raster.shows(at(4.0, NEAR + 0.1), 0.0));
        assert!(!raster.shows(at(4.0, FAR), 1e-3));
        // Beside the square, on its rim, and outside the picture nothing is in front.
        assert!(raster.shows(at(11.0, FAR), 0.0) && raster.shows(at(7.9, FAR), 0.0));
        assert!(!raster.shows(at(7.4, FAR), 0.0));
        assert!(!raster.shows(at(-50.0, NEAR), 0.0) && !raster.shows(at(1e9, NEAR), 0.0));
    }
}
