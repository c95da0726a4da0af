//! A z-buffer rasteriser with four samples per pixel, and flat drawing on the finished image.

use crate::colormap::{from_linear, to_linear};

/// Samples per pixel along each side.
const FINE: usize = 2;

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
    colours: Vec<[u8; 3]>,
    nearness: Vec<f32>,
}

impl Raster {
    /// An empty picture of `width` x `height` pixels.
    pub(crate) fn new(width: usize, height: usize, background: [u8; 3]) -> Self {
        let (width, height) = (width * FINE, height * FINE);
        let colours = vec![background; width * height];
        Self { width, height, colours, nearness: vec![0.0; width * height] }
    }

    /// Draws a triangle; `shade` gets perspective-correct weights of its corners.
    pub(crate) fn triangle(
        &mut self,
        corners: [Projected; 3],
        shade: impl Fn([f64; 3]) -> [u8; 3],
    ) {
        let fine = FINE as f64;
        let [a, b, c] = corners.map(|p| [p.x * fine, p.y * fine]);
        let cross = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let area = cross(a, b, c);
        if !(area.abs() > 0.0) {
            return;
        }
        let range = |k: usize, size: usize| {
            let (lo, hi) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            (lo - 0.5).ceil().max(0.0) as usize..((hi + 0.5).max(0.0) as usize).min(size)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let flat = [cross(b, c, p) / area, cross(c, a, p) / area, cross(a, b, p) / area];
                if flat.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let near = [0, 1, 2].map(|i| flat[i] * corners[i].nearness);
                let sum = near[0] + near[1] + near[2];
                let at = y * self.width + x;
                if sum as f32 > self.nearness[at] {
                    self.nearness[at] = sum as f32;
                    self.colours[at] = shade(near.map(|w| w / sum));
                }
            }
        }
    }

    /// Draws a straight line `width` pixels wide over what is not nearer than it by more than the
    /// share `bias`.
    pub(crate) fn segment(
        &mut self,
        [a, b]: [Projected; 2],
        width: f64,
        colour: [u8; 3],
        alpha: f64,
        bias: f64,
    ) {
        let fine = FINE as f64;
        let (p, q) = ([a.x * fine, a.y * fine], [b.x * fine, b.y * fine]);
        let reach = 0.5 * width * fine;
        let range = |k: usize, size: usize| {
            let (lo, hi) = (p[k].min(q[k]) - reach, p[k].max(q[k]) + reach);
            lo.max(0.0) as usize..((hi + 1.0).max(0.0) as usize).min(size)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let (t, distance) = foot([x as f64 + 0.5, y as f64 + 0.5], p, q);
                if distance > reach {
                    continue;
                }
                let near = a.nearness + (b.nearness - a.nearness) * t;
                let at = y * self.width + x;
                if near * (1.0 + bias) >= f64::from(self.nearness[at]) {
                    self.colours[at] = mix(self.colours[at], colour, alpha);
                }
            }
        }
    }

    /// Averages the samples of each pixel in linear light.
    pub(crate) fn finish(self) -> Image {
        let linear: Vec<f64> = (0..=255).map(to_linear).collect();
        let (width, height) = (self.width / FINE, self.height / FINE);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0; 3];
                for dy in 0..FINE {
                    for dx in 0..FINE {
                        let c = self.colours[(y * FINE + dy) * self.width + x * FINE + dx];
                        for k in 0..3 {
                            sum[k] += linear[usize::from(c[k])];
                        }
                    }
                }
                let first = self.colours[y * FINE * self.width + x * FINE];
                // Most pixels are of one colour or empty; the root is for edges alone.
                let mean = sum.map(|s| s / (FINE * FINE) as f64);
                let flat = (0..3).all(|k| mean[k] == linear[usize::from(first[k])]);
                pixels.push(if flat { first } else { mean.map(from_linear) });
            }
        }
        Image { width, height, pixels }
    }
}

/// A finished picture that labels are drawn on.
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// Fills the pixels from `corner` on.
    pub(crate) fn fill(&mut self, corner: [usize; 2], size: [usize; 2], colour: [u8; 3]) {
        for y in corner[1]..(corner[1] + size[1]).min(self.height) {
            for x in corner[0]..(corner[0] + size[0]).min(self.width) {
                self.pixels[y * self.width + x] = colour;
            }
        }
    }

    /// Draws polylines with round ends; where they cross they do not get darker.
    pub(crate) fn strokes(&mut self, lines: &[Vec<[f64; 2]>], width: f64, colour: [u8; 3]) {
        let reach = 0.5 * width + 0.5;
        let corners = || lines.iter().flatten();
        let range = |k: usize, size: usize| {
            let lo = corners().map(|p| p[k]).fold(f64::INFINITY, f64::min) - reach;
            let hi = corners().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + reach;
            lo.max(0.0) as usize..((hi + 1.0).max(0.0) as usize).min(size)
        };
        for y in range(1, self.height) {
            for x in range(0, self.width) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let segments = lines.iter().flat_map(|l| l.windows(2));
                let distances = segments.map(|s| foot(p, s[0], s[1]).1);
                let cover = (reach - distances.fold(f64::INFINITY, f64::min)).clamp(0.0, 1.0);
                if cover > 0.0 {
                    let pixel = &mut self.pixels[y * self.width + x];
                    *pixel = mix(*pixel, colour, cover);
                }
            }
        }
    }

    /// The pixels row by row, three bytes each.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.pixels.concat()
    }
}

/// Parameter and distance of the point of a segment nearest to `p`.
fn foot(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> (f64, f64) {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let dot = (p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1];
    let t = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
    (t, (p[0] - a[0] - t * along[0]).hypot(p[1] - a[1] - t * along[1]))
}

fn mix(a: [u8; 3], b: [u8; 3], t: f64) -> [u8; 3] {
    [0, 1, 2].map(|k| {
        let (x, y) = (f64::from(a[k]), f64::from(b[k]));
        (x + (y - x) * t).round() as u8
    })
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
            assert!(raster.finish().bytes().chunks(3).all(|p| p == [200, 0, 0]));
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
        assert_eq!(raster.finish().bytes(), [188; 3]);
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
    fn strokes_cover_their_line() {
        let mut image = Raster::new(9, 9, [255; 3]).finish();
        image.strokes(&[vec![[1.0, 4.5], [8.0, 4.5]]], 1.0, [0; 3]);
        let bytes = image.bytes();
        assert_eq!(bytes[(4 * 9 + 4) * 3], 0);
        assert_eq!(bytes[(2 * 9 + 4) * 3], 255);
    }
}
