//! Flat drawing on a picture: rectangles, thin lines and text, all antialiased.
//!
//! tiny-skia is taken without its feature `simd`, which has code of its own for each set of
//! instructions, with reciprocals, minima and conversions that are not the same on all of them.
//! Without it only whole numbers and operations that IEEE 754 defines to the last bit remain on the
//! way of a path of lines and quadratic curves, so a picture has the same bytes on every machine.
//! Seventeen pictures take 4.2 s of one core either way: nearly all of it is the shaded surface.

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform,
};

use crate::font::Lettering;

/// A finished picture that is drawn on; y points down, pixel (0, 0) covers the unit square.
pub(crate) struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// A canvas of `width` pixels a row that shows `pixels`.
    ///
    /// # Panics
    /// If there is no pixel or the last row is not full.
    pub(crate) fn new(width: usize, pixels: &[[u8; 3]]) -> Self {
        let height = pixels.len() / width;
        assert_eq!(width * height, pixels.len(), "a picture has whole rows");
        let pixmap = Pixmap::new(width as u32, height as u32);
        let mut pixmap = pixmap.expect("a picture has pixels, and fewer than 2³¹");
        for (to, [r, g, b]) in pixmap.data_mut().chunks_exact_mut(4).zip(pixels) {
            to.copy_from_slice(&[*r, *g, *b, u8::MAX]);
        }
        Self { pixmap }
    }

    /// Fills the rectangle from `corner` on.
    pub(crate) fn fill(&mut self, corner: [f64; 2], size: [f64; 2], colour: [u8; 3]) {
        let [x, y, w, h] = [corner[0], corner[1], size[0], size[1]].map(|v| v as f32);
        // An empty rectangle shows nothing.
        if let Some(rectangle) = Rect::from_xywh(x, y, w, h) {
            self.pixmap.fill_rect(rectangle, &ink(colour, 1.0), Transform::identity(), None);
        }
    }

    /// Draws polylines `width` pixels wide; where they cross they do not get darker.
    pub(crate) fn polylines(
        &mut self,
        lines: &[Vec<[f64; 2]>],
        width: f64,
        colour: [u8; 3],
        alpha: f64,
    ) {
        let mut path = PathBuilder::new();
        for line in lines {
            for (i, point) in line.iter().enumerate() {
                let [x, y] = point.map(|v| v as f32);
                if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
        }
        let stroke = Stroke {
            width: width as f32,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Bevel,
            ..Stroke::default()
        };
        if let Some(path) = path.finish() {
            let paint = ink(colour, alpha);
            self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
    }

    /// Writes a line of text whose baseline starts at `origin`.
    pub(crate) fn text(
        &mut self,
        text: &str,
        origin: [f64; 2],
        lettering: Lettering,
        colour: [u8; 3],
    ) {
        let mut path = PathBuilder::new();
        lettering.outline(text, origin, &mut path);
        if let Some(path) = path.finish() {
            let (paint, rule) = (ink(colour, 1.0), FillRule::Winding);
            self.pixmap.fill_path(&path, &paint, rule, Transform::identity(), None);
        }
    }

    /// The picture as a PNG file.
    pub(crate) fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.pixmap.width(), self.pixmap.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels())?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The pixels row by row, three bytes each.
    fn pixels(&self) -> Vec<u8> {
        // Nothing see-through is left once it is drawn, so the fourth byte says nothing.
        self.pixmap.data().chunks_exact(4).flat_map(|p| &p[..3]).copied().collect()
    }
}

fn ink([r, g, b]: [u8; 3], alpha: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    let alpha = (255.0 * alpha).round() as u8;
    paint.set_color(Color::from_rgba8(r, g, b, alpha));
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 3] = [255; 3];
    const BLACK: [u8; 3] = [0; 3];

    fn blank(width: usize, height: usize) -> Canvas {
        Canvas::new(width, &vec![WHITE; width * height])
    }

    /// Darkness of every pixel, 0 to 1.
    fn cover(canvas: &Canvas) -> Vec<f64> {
        canvas.pixels().chunks(3).map(|p| 1.0 - f64::from(p[0]) / 255.0).collect()
    }

    #[test]
    fn rectangles_cover_their_area() {
        let mut canvas = blank(8, 8);
        canvas.fill([2.0, 3.0], [4.0, 2.0], BLACK);
        let dark = cover(&canvas);
        for (i, cover) in dark.iter().enumerate() {
            let inside = (2..6).contains(&(i % 8)) && (3..5).contains(&(i / 8));
            assert_eq!(*cover, if inside { 1.0 } else { 0.0 });
        }
        let mut canvas = blank(8, 8);
        canvas.fill([2.25, 3.0], [0.5, 1.0], BLACK);
        assert!((cover(&canvas)[3 * 8 + 2] - 0.5).abs() < 0.01);
    }

    #[test]
    fn lines_cover_their_area_and_crossings_stay_as_light() {
        let mut canvas = blank(40, 40);
        let lines = [vec![[5.0, 8.5], [35.0, 31.0]], vec![[5.0, 31.5], [35.0, 8.0]]];
        canvas.polylines(&lines[..1], 2.0, BLACK, 1.0);
        let (length, dark) = (30.0_f64.hypot(22.5), cover(&canvas));
        assert!((dark.iter().sum::<f64>() / (2.0 * length) - 1.0).abs() < 0.02);
        let mut canvas = blank(40, 40);
        canvas.polylines(&lines, 2.0, BLACK, 0.4);
        let darkest = cover(&canvas).into_iter().fold(0.0, f64::max);
        assert!((darkest - 0.4).abs() < 0.005);
    }

    #[test]
    fn text_is_as_dark_as_its_outlines_are_large() {
        // A dash is a rectangle.
        let set = Lettering::regular(64.0);
        let mut canvas = blank(100, 100);
        canvas.text("–", [20.0, 60.0], set, BLACK);
        let mut path = PathBuilder::new();
        set.outline("–", [20.0, 60.0], &mut path);
        let dash = path.finish().unwrap().bounds();
        let area = f64::from(dash.width() * dash.height());
        assert!((cover(&canvas).iter().sum::<f64>() / area - 1.0).abs() < 0.02);
    }

    #[test]
    fn text_outside_and_empty_text_draw_nothing() {
        let mut canvas = blank(10, 10);
        canvas.text("", [0.0, 5.0], Lettering::regular(10.0), BLACK);
        canvas.text("   ", [0.0, 5.0], Lettering::regular(10.0), BLACK);
        canvas.text("far away", [500.0, 500.0], Lettering::regular(10.0), BLACK);
        canvas.polylines(&[vec![], vec![[1.0, 1.0]]], 1.0, BLACK, 1.0);
        assert!(cover(&canvas).iter().all(|c| *c == 0.0));
    }

    #[test]
    fn the_png_holds_the_pixels() {
        let pixels: Vec<[u8; 3]> = (0..12).map(|i| [i, 2 * i, 255 - i]).collect();
        let file = Canvas::new(4, &pixels).png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut read).unwrap();
        assert_eq!(read, pixels.concat());
    }
}
