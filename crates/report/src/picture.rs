//! A shaded picture of a view with its colour map and scale bar, without a browser.

use glam::DVec3;

use crate::colormap::{self, NO_VALUE, TABLE};
use crate::font::{text_strokes, text_width};
use crate::numbers::{format_number, nice_step, quantile, sorted_finite, ticks};
use crate::raster::{Image, Projected, Raster};
use crate::{FaceGroups, FieldScale, ReportError, ScalarField, SurfaceView};

const WIDTH: usize = 1200;
const HEIGHT: usize = 900;
/// Room on the left that the legend takes.
const LEGEND: f64 = 210.0;
const BAR_TOP: usize = 96;
const BAR_HEIGHT: usize = 300;
const PAPER: [u8; 3] = [0xfb, 0xfa, 0xf8];
const INK: [u8; 3] = [0x1b, 0x21, 0x29];
const SOFT: [u8; 3] = [0x5d, 0x66, 0x73];
/// Direction of view, in degrees: seen from the front left and from above.
const AZIMUTH: f64 = -60.0;
const ELEVATION: f64 = 28.0;
const FIELD_OF_VIEW: f64 = 26.0;

/// What a picture shows on the surface.
#[derive(Clone, Copy)]
pub(crate) enum Layer<'a> {
    Field(&'a ScalarField),
    Groups(&'a FaceGroups),
}

/// The PNG bytes of a picture of `view`.
pub(crate) fn picture_png(
    view: &SurfaceView,
    layer: Layer<'_>,
    length_unit: &str,
) -> Result<Vec<u8>, ReportError> {
    let camera = Camera::fitted(view.positions());
    let projected: Vec<Projected> = view.positions().iter().map(|p| camera.project(*p)).collect();
    let mut raster = Raster::new(WIDTH, HEIGHT, PAPER);
    let palette = Palette::of(layer);
    for (t, corners) in view.triangles().iter().enumerate() {
        let at = corners.map(|v| v as usize);
        let shade = |w: [f64; 3]| {
            let blend = |of: &[DVec3]| of[at[0]] * w[0] + of[at[1]] * w[1] + of[at[2]] * w[2];
            let base = match layer {
                Layer::Field(f) => palette.value((0..3).map(|i| f.values[at[i]] * w[i]).sum()),
                Layer::Groups(g) => colormap::group_colour(g.of_triangle[t] as usize),
            };
            camera.lit(base, blend(view.positions()), blend(view.normals()))
        };
        raster.triangle(at.map(|v| projected[v]), shade);
    }
    let border = border_edges(view);
    // The borders of many panels would hide what is on them.
    let alpha = if border.len() > 2000 { 0.25 } else { 0.7 };
    for [a, b] in border {
        let ends = [projected[a as usize], projected[b as usize]];
        raster.segment(ends, 1.2, INK, alpha, 2e-3);
    }
    let mut image = raster.finish();
    label(&mut image, view, layer, &palette);
    scale_bar(&mut image, &camera, length_unit);
    encode(&image)
        .map_err(|e| ReportError::Picture { view: view.name().to_owned(), reason: e.to_string() })
}

/// A camera that looks at the middle of the model, which fills the picture beside the legend.
struct Camera {
    right: DVec3,
    up: DVec3,
    back: DVec3,
    eye: DVec3,
    distance: f64,
}

impl Camera {
    fn fitted(points: &[DVec3]) -> Self {
        let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
        let back = DVec3::new(
            elevation.cos() * azimuth.cos(),
            elevation.cos() * azimuth.sin(),
            elevation.sin(),
        );
        let right = DVec3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let up = back.cross(right);
        let local = |p: &DVec3| DVec3::new(p.dot(right), p.dot(up), p.dot(back));
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = points.iter().map(local).fold(start, |(a, b), q| (a.min(q), b.max(q)));
        let middle = 0.5 * (lo + hi);
        let tangent = (0.5 * FIELD_OF_VIEW).to_radians().tan();
        let wide = 0.9 * tangent * (WIDTH as f64 - LEGEND) / HEIGHT as f64;
        let needed = points.iter().map(|p| {
            let q = local(p) - middle;
            (q.x.abs() / wide).max(q.y.abs() / (0.9 * tangent)) + q.z
        });
        let distance = needed.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let centre = right * middle.x + up * middle.y + back * middle.z;
        Self { right, up, back, eye: centre + back * distance, distance }
    }

    /// Pixels per unit of length at the distance of the middle.
    fn pixels_per_unit(&self) -> f64 {
        0.5 * HEIGHT as f64 / ((0.5 * FIELD_OF_VIEW).to_radians().tan() * self.distance)
    }

    fn project(&self, p: DVec3) -> Projected {
        let q = p - self.eye;
        let nearness = self.distance / -q.dot(self.back);
        let scale = self.pixels_per_unit() * nearness;
        Projected {
            x: 0.5 * (WIDTH as f64 + LEGEND) + scale * q.dot(self.right),
            y: 0.5 * HEIGHT as f64 - scale * q.dot(self.up),
            nearness,
        }
    }

    /// The same soft light as the viewer's.
    fn lit(&self, base: [u8; 3], position: DVec3, normal: DVec3) -> [u8; 3] {
        let to_eye = (self.eye - position).normalize();
        let mut n = normal.normalize_or(to_eye);
        if n.dot(to_eye) < 0.0 {
            n = -n;
        }
        let key = (-0.45 * self.right + 0.65 * self.up + 0.75 * self.back).normalize();
        let wrap = 0.5 + 0.5 * n.dot(key);
        let light = 0.60 + 0.44 * wrap * wrap;
        let mirrored = 2.0 * n.dot(key) * n - key;
        let shine = 0.07 * mirrored.dot(to_eye).max(0.0).powi(28);
        let rim = 0.90 + 0.10 * (n.dot(to_eye) / 0.35).clamp(0.0, 1.0);
        base.map(|c| (((f64::from(c) / 255.0) * light + shine) * rim * 255.0).round() as u8)
    }
}

/// Colours of the values of a field.
struct Palette {
    table: Vec<[u8; 3]>,
    /// The part of the table that is used: of a signed map a half, if all values have one sign.
    part: [f64; 2],
    range: [f64; 2],
}

impl Palette {
    fn of(layer: Layer<'_>) -> Self {
        match layer {
            Layer::Field(f) => {
                let range = field_range(f);
                let part = match f.scale {
                    FieldScale::Signed if range[0] >= 0.0 => [0.54, 1.0],
                    FieldScale::Signed if range[1] <= 0.0 => [0.0, 0.46],
                    _ => [0.0, 1.0],
                };
                Self { table: colormap::table(f.scale), part, range }
            }
            Layer::Groups(_) => Self { table: Vec::new(), part: [0.0, 1.0], range: [0.0, 1.0] },
        }
    }

    fn value(&self, value: f64) -> [u8; 3] {
        if !value.is_finite() {
            return NO_VALUE;
        }
        let t = (value - self.range[0]) / (self.range[1] - self.range[0]);
        let t = self.part[0] + (self.part[1] - self.part[0]) * t.clamp(0.0, 1.0);
        self.table[(t * (TABLE - 1) as f64).round() as usize]
    }
}

/// Values at the ends of the map: the field's own range, or its central 98 %, symmetric about 0
/// where both signs occur.
fn field_range(field: &ScalarField) -> [f64; 2] {
    if let Some(range) = field.range {
        return range;
    }
    let sorted = sorted_finite(field.values.iter().copied());
    let (lo, hi) = (quantile(&sorted, 0.01), quantile(&sorted, 0.99));
    let most = lo.abs().max(hi.abs());
    match field.scale {
        // Values of one sign that differ enough get one half of the map for themselves.
        FieldScale::Signed if lo * hi > 0.0 && hi - lo > 0.15 * most => [lo, hi],
        FieldScale::Signed if most > 0.0 => [-most, most],
        FieldScale::Magnitude if hi > lo => [if lo >= 0.0 && lo < 0.4 * hi { 0.0 } else { lo }, hi],
        FieldScale::Magnitude if most > 0.0 => [lo, lo + most],
        _ => [-1.0, 1.0],
    }
}

fn label(image: &mut Image, view: &SurfaceView, layer: Layer<'_>, palette: &Palette) {
    let mut write = |text: &str, x: f64, y: f64, size: f64, colour: [u8; 3]| {
        let lines = text_strokes(text, [x, y], size);
        image.strokes(&lines, 0.135 * size, colour);
    };
    write(view.name(), 34.0, 30.0, 13.0, INK);
    match layer {
        Layer::Field(field) => {
            write(&field.label, 34.0, 56.0, 9.5, INK);
            if !field.unit.is_empty() {
                write(&format!("in {}", field.unit), 34.0, 74.0, 9.0, SOFT);
            }
            let [lo, hi] = palette.range;
            for t in ticks(lo, hi, 6) {
                let at = BAR_TOP as f64 + BAR_HEIGHT as f64 * (hi - t) / (hi - lo);
                write(&format_number(t, 3), 66.0, at - 4.5, 9.0, INK);
            }
        }
        Layer::Groups(groups) => {
            let text = format!("{}: {} in all", groups.label, groups.names.len());
            write(&text, 34.0, 56.0, 9.5, INK);
        }
    }
    let Layer::Field(_) = layer else { return };
    let [lo, hi] = palette.range;
    for row in 0..BAR_HEIGHT {
        let t = 1.0 - row as f64 / (BAR_HEIGHT - 1) as f64;
        image.fill([34, BAR_TOP + row], [18, 1], palette.value(lo + (hi - lo) * t));
    }
    for t in ticks(lo, hi, 6) {
        let row = (BAR_HEIGHT - 1) as f64 * (hi - t) / (hi - lo);
        image.fill([54, BAR_TOP + row.round() as usize], [6, 1], SOFT);
    }
}

/// A bar of round length, true at the middle of the model.
fn scale_bar(image: &mut Image, camera: &Camera, length_unit: &str) {
    let per_unit = camera.pixels_per_unit();
    let length = nice_step(150.0 / per_unit, 1);
    let pixels = (length * per_unit).round() as usize;
    let (left, base) = (image.width - 40 - pixels, image.height - 36);
    image.fill([left, base], [pixels, 2], INK);
    image.fill([left, base - 7], [2, 9], INK);
    image.fill([left + pixels - 2, base - 7], [2, 9], INK);
    let text = crate::numbers::with_unit(length, length_unit, 3);
    let x = left as f64 + 0.5 * (pixels as f64 - text_width(&text, 9.5));
    image.strokes(&text_strokes(&text, [x, base as f64 - 20.0], 9.5), 1.3, INK);
}

/// Edges of one triangle only, each once.
fn border_edges(view: &SurfaceView) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * view.triangles().len());
    for [a, b, c] in view.triangles() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            edges.push([*p.min(q), *p.max(q)]);
        }
    }
    edges.sort_unstable();
    let runs = edges.chunk_by(|a, b| a == b);
    runs.filter(|run| run.len() == 1).map(|run| run[0]).collect()
}

fn encode(image: &Image) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.bytes())?;
    writer.finish()?;
    Ok(bytes)
}
