//! A shaded picture of a view with its colour map and a bar of length, without a browser.

use glam::DVec3;

use crate::border::{border_lines, visible_pieces};
use crate::camera::{Camera, Frame};
use crate::canvas::Canvas;
use crate::colormap;
use crate::legend::{INK, LEGEND, field_legend, group_legend, length_bar};
use crate::palette::Palette;
use crate::raster::{Projected, Raster};
use crate::{FaceGroups, ReportError, ScalarField, SurfaceView};

const WIDTH: usize = 1200;
const HEIGHT: usize = 900;
const PAPER: [u8; 3] = [0xfb, 0xfa, 0xf8];

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
    let failed = |e: png::EncodingError| ReportError::Picture {
        view: view.name().to_owned(),
        reason: e.to_string(),
    };
    picture(view, layer, length_unit).png().map_err(failed)
}

fn picture(view: &SurfaceView, layer: Layer<'_>, length_unit: &str) -> Canvas {
    let size = [WIDTH as f64 - LEGEND, HEIGHT as f64];
    let camera = Camera::fitted(view.positions(), Frame { corner: [LEGEND, 0.0], size });
    let projected: Vec<Projected> = view.positions().iter().map(|p| camera.project(*p)).collect();
    let mut raster = Raster::new(WIDTH, HEIGHT, PAPER);
    match layer {
        Layer::Field(field) => {
            let palette = Palette::of(field);
            shade(&mut raster, view, &camera, &projected, |_, at, w| {
                palette.value((0..3).map(|i| field.values[at[i]] * w[i]).sum())
            });
            let mut canvas = with_border(&raster, view, &projected);
            field_legend(&mut canvas, view.name(), field, &palette);
            length_bar(&mut canvas, HEIGHT as f64, camera.pixels_per_unit(), length_unit);
            canvas
        }
        Layer::Groups(groups) => {
            shade(&mut raster, view, &camera, &projected, |triangle, _, _| {
                colormap::group_colour(groups.of_triangle[triangle] as usize)
            });
            let mut canvas = with_border(&raster, view, &projected);
            group_legend(&mut canvas, view.name(), groups);
            length_bar(&mut canvas, HEIGHT as f64, camera.pixels_per_unit(), length_unit);
            canvas
        }
    }
}

/// Draws all triangles; `colour` gets the triangle, its corners and their weights at a sample.
fn shade(
    raster: &mut Raster,
    view: &SurfaceView,
    camera: &Camera,
    projected: &[Projected],
    colour: impl Fn(usize, [usize; 3], [f64; 3]) -> [u8; 3],
) {
    for (t, corners) in view.triangles().iter().enumerate() {
        let at = corners.map(|v| v as usize);
        raster.triangle(at.map(|v| projected[v]), |w| {
            let blend = |of: &[DVec3]| of[at[0]] * w[0] + of[at[1]] * w[1] + of[at[2]] * w[2];
            camera.lit(colour(t, at, w), blend(view.positions()), blend(view.normals()))
        });
    }
}

/// The shaded surface with what can be seen of its border.
fn with_border(raster: &Raster, view: &SurfaceView, projected: &[Projected]) -> Canvas {
    let border = border_lines(view.triangles());
    let segments: usize = border.iter().map(|line| line.len() - 1).sum();
    // The borders of many panels would hide what is on them.
    let (width, alpha) = if segments > 2000 { (1.0, 0.35) } else { (1.3, 0.75) };
    let mut pieces = Vec::new();
    for line in border {
        let line: Vec<Projected> = line.into_iter().map(|v| projected[v as usize]).collect();
        pieces.extend(visible_pieces(&line, raster));
    }
    let mut canvas = Canvas::new(WIDTH, &raster.pixels());
    canvas.polylines(&pieces, width, INK, alpha);
    canvas
}
