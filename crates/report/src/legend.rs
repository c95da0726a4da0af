//! What stands beside the surface in a picture: its name, the colour map or the groups, and a bar
//! of known length.

use std::collections::BTreeSet;

use crate::canvas::Canvas;
use crate::colormap::{self, NO_VALUE};
use crate::font::Lettering;
use crate::numbers::{digits_beside, format_number, nice_step, tick_labels, with_unit};
use crate::palette::Palette;
use crate::{FaceGroups, ScalarField};

pub(crate) const INK: [u8; 3] = [0x1b, 0x21, 0x29];
const SOFT: [u8; 3] = [0x5d, 0x66, 0x73];
const LINE: [u8; 3] = [0xb9, 0xb6, 0xb0];

/// Room for the legend at the left of a picture, its margin included.
pub(crate) const LEGEND: f64 = 250.0;
const LEFT: f64 = 36.0;
const ROOM: f64 = LEGEND - LEFT;
const TOP: f64 = 34.0;

const BAR_WIDTH: f64 = 20.0;
const BAR_HEIGHT: usize = 340;
/// A value so far beyond the end of the map, in its span, is told, as its colour does not tell it.
const BEYOND: f64 = 0.02;
/// From one group of the list to the next.
const ROW: f64 = 26.0;
const SWATCH: f64 = 14.0;
/// More groups than these have colours that cannot be told apart, so they are only counted.
const LISTED: usize = 20;

fn title() -> Lettering {
    Lettering::semi_bold(24.0)
}

fn label() -> Lettering {
    Lettering::regular(18.0)
}

fn small() -> Lettering {
    Lettering::regular(16.0)
}

/// Writes from top to bottom.
struct Column<'c> {
    canvas: &'c mut Canvas,
    y: f64,
}

impl Column<'_> {
    /// At most `most` lines of text.
    fn text(&mut self, text: &str, lettering: Lettering, colour: [u8; 3], most: usize) {
        for line in lettering.lines(text, ROOM, most) {
            let baseline = self.y + lettering.capital();
            self.canvas.text(&line, [LEFT, baseline], lettering, colour);
            self.y += 1.3 * lettering.size;
        }
    }

    /// A square of colour with a name beside it.
    fn swatch(&mut self, colour: [u8; 3], name: &str) {
        self.y = self.y.round();
        self.canvas.fill([LEFT, self.y], [SWATCH; 2], colour);
        let baseline = self.y + 0.5 * (SWATCH + small().capital());
        let x = LEFT + SWATCH + 10.0;
        let name = small().cut(name, LEGEND - x);
        self.canvas.text(&name, [x, baseline], small(), INK);
        self.y += ROW;
    }
}

/// The name of what is shown, and the colour map of `field` with its numbers.
pub(crate) fn field_legend(
    canvas: &mut Canvas,
    view: &str,
    field: &ScalarField,
    palette: &Palette,
) {
    let mut column = Column { canvas, y: TOP };
    column.text(view, title(), INK, 2);
    column.y += 4.0;
    column.text(&field.label, label(), INK, 3);
    match field.unit.as_str() {
        "" => {}
        "°" => column.text("in degrees", small(), SOFT, 1),
        unit => column.text(&format!("in {unit}"), small(), SOFT, 1),
    }
    column.y += 14.0;

    // On whole pixels, so that the rows of the bar do not mix.
    let (top, [lo, hi]) = (column.y.round(), palette.range());
    let height = BAR_HEIGHT as f64;
    // A frame keeps the pale middle of a map apart from the paper.
    column.canvas.fill([LEFT - 1.0, top - 1.0], [BAR_WIDTH + 2.0, height + 2.0], LINE);
    for row in 0..BAR_HEIGHT {
        let t = 1.0 - (row as f64 + 0.5) / height;
        let colour = palette.value(lo + (hi - lo) * t);
        column.canvas.fill([LEFT, top + row as f64], [BAR_WIDTH, 1.0], colour);
    }
    let right = LEFT + BAR_WIDTH;
    for (value, text) in tick_labels(lo, hi, 6) {
        let y = top + height * (hi - value) / (hi - lo);
        column.canvas.fill([right + 3.0, y.round() - 1.0], [6.0, 2.0], LINE);
        let baseline = y + 0.5 * small().capital();
        let text = small().cut(&text, LEGEND - right - 16.0);
        column.canvas.text(&text, [right + 16.0, baseline], small(), INK);
    }
    column.y += height + 20.0;

    let finite = || field.values.iter().copied().filter(|v| v.is_finite());
    let (least, most) = (finite().fold(f64::MAX, f64::min), finite().fold(f64::MIN, f64::max));
    let beyond = BEYOND * (hi - lo);
    for (name, value, is_beyond) in
        [("max", most, most > hi + beyond), ("min", least, least < lo - beyond)]
    {
        if is_beyond {
            let digits = digits_beside(value, hi - lo, 3);
            column.text(&format!("{name} {}", format_number(value, digits)), small(), SOFT, 1);
        }
    }
    if field.values.iter().any(|v| !v.is_finite()) {
        column.swatch(NO_VALUE, "no value");
    }
}

/// The name of what is shown, and the groups with their colours where these can be told apart.
pub(crate) fn group_legend(canvas: &mut Canvas, view: &str, groups: &FaceGroups) {
    let mut column = Column { canvas, y: TOP };
    column.text(view, title(), INK, 2);
    column.y += 4.0;
    column.text(&groups.label, label(), INK, 3);
    let used: BTreeSet<usize> = groups.of_triangle.iter().map(|g| *g as usize).collect();
    if used.len() > LISTED {
        column.text(&format!("{} in all", used.len()), small(), SOFT, 1);
        return;
    }
    column.y += 10.0;
    for group in used {
        column.swatch(colormap::group_colour(group), &groups.names[group]);
    }
}

/// A bar of round length below the legend, true at the middle of the model.
pub(crate) fn length_bar(
    canvas: &mut Canvas,
    picture_height: f64,
    pixels_per_unit: f64,
    length_unit: &str,
) {
    let most = ROOM - 30.0;
    // The largest round length that fits; the next ones down are at least 0.4 of one.
    let mut length = nice_step(most / pixels_per_unit, 1);
    while length * pixels_per_unit > most {
        length = nice_step(0.4 * length, 1);
    }
    let pixels = (length * pixels_per_unit).round();
    let base = picture_height - 44.0;
    canvas.fill([LEFT, base], [pixels, 2.0], INK);
    for end in [LEFT, LEFT + pixels - 2.0] {
        canvas.fill([end, base - 7.0], [2.0, 9.0], INK);
    }
    let text = with_unit(length, length_unit, 3);
    canvas.text(&text, [LEFT, base - 15.0], small(), INK);
}
