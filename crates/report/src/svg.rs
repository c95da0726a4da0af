//! A little SVG: text that stands alone in a file as well as in the page.

use std::fmt::{Display, Write as _};

use crate::font::Lettering;
use crate::text::escape;

pub(crate) const INK: &str = "#1b2129";
pub(crate) const SOFT: &str = "#5d6673";
pub(crate) const LINE: &str = "#dcd9d2";
pub(crate) const GRID: &str = "#eeece6";
pub(crate) const MARK: &str = "#b3123f";

/// Colours of the series of a plot, told apart by lightness as well as by hue.
pub(crate) const SERIES: [&str; 6] =
    ["#8a93a3", "#1f5fa8", "#d9782d", "#2b8c82", "#7a3e8f", "#b89b1f"];

/// Size of the font of text that is not said to have another.
pub(crate) const TEXT: f64 = 11.5;

/// Width of a text in the reader's font against that in ours: the common ones are up to so much
/// wider.
const WIDER: f64 = 1.1;

/// Room that a text of size `size` takes in whatever font the reader has.
pub(crate) fn text_room(text: &str, size: f64) -> f64 {
    WIDER * Lettering::regular(size).width(text)
}

/// The text if it fits into `room`, else its beginning with `…` after it.
pub(crate) fn cut(text: &str, size: f64, room: f64) -> String {
    Lettering::regular(size).cut(text, room / WIDER)
}

/// Where a piece of text is anchored.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// An SVG picture under construction; the y axis points down.
pub(crate) struct Svg {
    body: String,
    width: f64,
    height: f64,
    title: String,
}

impl Svg {
    pub(crate) fn new(width: f64, height: f64, title: &str) -> Self {
        Self { body: String::new(), width, height, title: title.to_owned() }
    }

    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: &str, width: f64) {
        let ([x1, y1], [x2, y2]) = (from, to);
        self.push(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\" \
             stroke-width=\"{width}\"/>"
        ));
    }

    pub(crate) fn dashed(&mut self, from: [f64; 2], to: [f64; 2], stroke: &str) {
        let ([x1, y1], [x2, y2]) = (from, to);
        self.push(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\" \
             stroke-width=\"1.3\" stroke-dasharray=\"4 3\"/>"
        ));
    }

    /// A filled rectangle with a text that shows when it is pointed at.
    pub(crate) fn bar(&mut self, corner: [f64; 2], size: [f64; 2], fill: &str, hint: &str) {
        let ([x, y], [w, h]) = (corner, size);
        let hint = escape(hint);
        self.push(format_args!(
            "<rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"{fill}\">\
             <title>{hint}</title></rect>"
        ));
    }

    /// A polyline, or dots where `stroke` has a round cap and the pieces are points.
    pub(crate) fn polyline(&mut self, points: &[[f64; 2]], stroke: &str, width: f64) {
        if points.is_empty() {
            return;
        }
        let mut d = String::new();
        for (i, [x, y]) in points.iter().enumerate() {
            let _ = write!(d, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
        }
        self.push(format_args!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" \
             stroke-linejoin=\"round\" stroke-linecap=\"round\"/>"
        ));
    }

    /// Dots of one colour as a single path.
    pub(crate) fn dots(&mut self, points: &[[f64; 2]], colour: &str, diameter: f64) {
        if points.is_empty() {
            return;
        }
        let mut d = String::new();
        for [x, y] in points {
            let _ = write!(d, "M{x:.1} {y:.1}h0");
        }
        self.push(format_args!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{diameter}\" \
             stroke-linecap=\"round\"/>"
        ));
    }

    pub(crate) fn text(&mut self, [x, y]: [f64; 2], anchor: Anchor, fill: &str, text: &str) {
        self.sized_text([x, y], anchor, fill, TEXT, text);
    }

    pub(crate) fn sized_text(
        &mut self,
        [x, y]: [f64; 2],
        anchor: Anchor,
        fill: &str,
        size: f64,
        text: &str,
    ) {
        let (anchor, text) = (anchor_name(anchor), escape(text));
        self.push(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{fill}\" \
             font-size=\"{size}\">{text}</text>"
        ));
    }

    /// The name of what follows.
    pub(crate) fn bold_text(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        let text = escape(text);
        self.push(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" font-weight=\"600\" \
             fill=\"{INK}\">{text}</text>"
        ));
    }

    /// Text that runs upwards.
    pub(crate) fn upward_text(&mut self, [x, y]: [f64; 2], fill: &str, text: &str) {
        let text = escape(text);
        self.push(format_args!(
            "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"middle\" \
             fill=\"{fill}\" font-size=\"{TEXT}\">{text}</text>"
        ));
    }

    /// Adds markup as it is.
    fn push(&mut self, markup: impl Display) {
        let _ = writeln!(self.body, "{markup}");
    }

    pub(crate) fn finish(self) -> String {
        let Self { body, width, height, title } = self;
        let title = escape(&title);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{title}\" \
             font-family=\"system-ui, 'Segoe UI', Helvetica, Arial, sans-serif\">\n{body}</svg>\n"
        )
    }
}

fn anchor_name(anchor: Anchor) -> &'static str {
    match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    }
}
