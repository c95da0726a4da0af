//! The bundled font: how wide a line of text is, and its letters as outlines.
//!
//! Letters are set one after the other by their own width, without kerning or shaping. What the
//! font lacks is a box with the code point in it, so that nothing is silently left out.

use std::sync::LazyLock;

use tiny_skia::PathBuilder;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A weight of the font.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weight {
    Regular,
    SemiBold,
}

/// How a piece of text is set; lengths of text are in the unit of `size`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lettering {
    pub(crate) weight: Weight,
    /// Size of the font: the height of a line set solid.
    pub(crate) size: f64,
}

static REGULAR: LazyLock<Face<'static>> =
    LazyLock::new(|| bundled(include_bytes!("../fonts/inter-regular-subset.ttf")));
static SEMI_BOLD: LazyLock<Face<'static>> =
    LazyLock::new(|| bundled(include_bytes!("../fonts/inter-semibold-subset.ttf")));

fn bundled(bytes: &'static [u8]) -> Face<'static> {
    Face::parse(bytes, 0).expect("the bundled fonts are whole, a test reads both")
}

/// Size of the digits in the box of a missing character, against that of the text.
const BOX_DIGITS: f64 = 0.5;
/// Room between the box's frame and its digits, and to its neighbours, in sizes of the text.
const BOX_PAD: f64 = 0.11;
/// Thickness of the frame, in sizes of the text.
const BOX_FRAME: f64 = 0.055;

impl Lettering {
    pub(crate) fn regular(size: f64) -> Self {
        Self { weight: Weight::Regular, size }
    }

    pub(crate) fn semi_bold(size: f64) -> Self {
        Self { weight: Weight::SemiBold, size }
    }

    /// Width of a line of text, from the origin of its first letter to where a next one would
    /// stand.
    pub(crate) fn width(self, text: &str) -> f64 {
        text.chars().map(|c| self.advance(c)).sum()
    }

    /// Height of a capital letter above the baseline.
    pub(crate) fn capital(self) -> f64 {
        self.scale() * f64::from(self.face().capital_height().unwrap_or(0))
    }

    /// Adds the outlines of a line of text whose baseline starts at `origin`; y points down. They
    /// are to be filled by the nonzero rule.
    pub(crate) fn outline(self, text: &str, origin: [f64; 2], path: &mut PathBuilder) {
        let mut x = origin[0];
        for c in text.chars() {
            match self.glyph(c) {
                Some(glyph) => {
                    let mut pen = Pen { path, origin: [x, origin[1]], scale: self.scale() };
                    // A space has no outline.
                    let _ = self.face().outline_glyph(glyph, &mut pen);
                }
                None => self.missing(c, [x, origin[1]], path),
            }
            x += self.advance(c);
        }
    }

    /// The text if it fits into `room`, else its beginning with `…` after it.
    pub(crate) fn cut(self, text: &str, room: f64) -> String {
        if self.width(text) <= room {
            return text.to_owned();
        }
        let room = room - self.width("…");
        let mut x = 0.0;
        let fits = |c: &char| {
            x += self.advance(*c);
            x <= room
        };
        let kept: String = text.chars().take_while(fits).collect();
        kept.trim_end().to_owned() + "…"
    }

    /// The text broken between words into lines of `room`, the last of at most `most` cut.
    pub(crate) fn lines(self, text: &str, room: f64, most: usize) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            let full = lines.len() == most;
            match lines.last_mut() {
                // What does not fit any more is cut with the last line.
                Some(line) if full || self.width(&format!("{line} {word}")) <= room => {
                    *line += " ";
                    *line += word;
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines.iter().map(|line| self.cut(line, room)).collect()
    }

    fn face(self) -> &'static Face<'static> {
        match self.weight {
            Weight::Regular => &REGULAR,
            Weight::SemiBold => &SEMI_BOLD,
        }
    }

    /// Size of a unit of the font.
    fn scale(self) -> f64 {
        self.size / f64::from(self.face().units_per_em())
    }

    fn glyph(self, c: char) -> Option<GlyphId> {
        self.face().glyph_index(c)
    }

    fn advance(self, c: char) -> f64 {
        let units = self.glyph(c).and_then(|glyph| self.face().glyph_hor_advance(glyph));
        match units {
            Some(units) => self.scale() * f64::from(units),
            None => self.box_width(c) + 2.0 * BOX_PAD * self.size,
        }
    }

    /// The lettering of the digits in a box.
    fn small(self) -> Self {
        Self { size: BOX_DIGITS * self.size, ..self }
    }

    fn box_width(self, c: char) -> f64 {
        let rows = code_point_rows(c).map(|row| self.small().width(&row));
        rows[0].max(rows[1]) + 2.0 * (BOX_PAD + BOX_FRAME) * self.size
    }

    /// A frame with the code point in two rows.
    fn missing(self, c: char, [x, baseline]: [f64; 2], path: &mut PathBuilder) {
        let (pad, frame) = (BOX_PAD * self.size, BOX_FRAME * self.size);
        let digit = self.small().capital();
        let height = 2.0 * digit + 3.0 * pad + 2.0 * frame;
        let width = self.box_width(c);
        // As far above capitals as below the baseline.
        let top = baseline - 0.5 * (self.capital() + height);
        let left = x + pad;
        let corners = |inset: f64| {
            let (l, t) = (left + inset, top + inset);
            let (r, b) = (left + width - inset, top + height - inset);
            [[l, t], [r, t], [r, b], [l, b]]
        };
        polygon(corners(0.0), path);
        // The other way round, which makes it a hole.
        let [a, b, c_, d] = corners(frame);
        polygon([a, d, c_, b], path);
        for (row, digits) in code_point_rows(c).iter().enumerate() {
            let y = top + frame + (row + 1) as f64 * (pad + digit);
            let x = left + 0.5 * (width - self.small().width(digits));
            self.small().outline(digits, [x, y], path);
        }
    }
}

/// `26`, `03` for U+2603: the hexadecimal digits in two rows, at least two in each.
fn code_point_rows(c: char) -> [String; 2] {
    let digits = format!("{:04X}", u32::from(c));
    let (first, second) = digits.split_at(digits.len().div_ceil(2));
    [first.to_owned(), second.to_owned()]
}

fn polygon(corners: [[f64; 2]; 4], path: &mut PathBuilder) {
    for (i, [x, y]) in corners.into_iter().enumerate() {
        let (x, y) = (x as f32, y as f32);
        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    path.close();
}

/// Carries outlines from the font's units, y upwards, to where a letter stands.
struct Pen<'p> {
    path: &'p mut PathBuilder,
    origin: [f64; 2],
    scale: f64,
}

impl Pen<'_> {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        let across = self.origin[0] + self.scale * f64::from(x);
        (across as f32, (self.origin[1] - self.scale * f64::from(y)) as f32)
    }
}

impl OutlineBuilder for Pen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2)) = (self.place(x1, y1), self.place(x2, y2));
        let (x, y) = self.place(x, y);
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const BOTH: [Lettering; 2] = [
        Lettering { weight: Weight::Regular, size: 20.0 },
        Lettering { weight: Weight::SemiBold, size: 20.0 },
    ];

    fn bounds(set: Lettering, text: &str) -> tiny_skia::Rect {
        let mut path = PathBuilder::new();
        set.outline(text, [0.0, 0.0], &mut path);
        path.finish().unwrap().bounds()
    }

    #[test]
    fn the_fonts_are_whole_and_stay_small() {
        let files = [
            &include_bytes!("../fonts/inter-regular-subset.ttf")[..],
            &include_bytes!("../fonts/inter-semibold-subset.ttf")[..],
        ];
        assert!(files.iter().map(|f| f.len()).sum::<usize>() <= 500_000);
        for set in BOTH {
            assert!(set.face().number_of_glyphs() > 1600 && set.capital() > 0.7 * set.size);
        }
    }

    #[test]
    fn latin_greek_and_cyrillic_letters_are_there() {
        let names = "Weingarten Straßenüberführung Łódź İstanbul Đà Nẵng œuvre ñandú þing \
                     Καμπυλότητα επιφάνειας ψαλίδι Кривизна поверхности щель єдність їжак";
        let labels = "principal curvature κ₁ [1/mm²] −3.5·10⁻⁴⁶⁷⁸⁹⁰ (95 %) 0.1° 14×10 √N … – \
                      ₀₁₂₃₄₅₆₇₈₉ ≤ ≥ ≠ ≈ ± ∞ ∂ ∫ ∑ ∏ ∆ Ω µ φ θ → ← ↑ ↓ € № ½ ‰";
        for set in BOTH {
            for c in names.chars().chain(labels.chars()) {
                assert!(set.glyph(c).is_some(), "{c}");
                assert!(c == ' ' || bounds(set, &c.to_string()).width() > 0.0, "{c}");
            }
        }
    }

    #[test]
    fn every_printable_ascii_character_has_its_own_outline() {
        for set in BOTH {
            let mut seen = std::collections::BTreeSet::new();
            for c in '!'..='~' {
                assert!(seen.insert(set.glyph(c).unwrap().0), "{c}");
            }
        }
    }

    #[test]
    fn widths_are_those_of_the_font() {
        let set = Lettering::regular(2048.0);
        // Advances of Inter 4.001 in units of 1/2048: digits and signs are of equal width.
        assert_eq!(set.width("0"), 1328.0);
        assert_eq!(set.width("−1+7"), 4.0 * 1328.0);
        assert!((Lettering::regular(20.48).width("12") - 26.56).abs() < 1e-12);
        assert_eq!(set.capital(), 1490.0);
    }

    #[test]
    fn a_missing_character_is_a_box_with_its_code_point() {
        assert_eq!(code_point_rows('☃'), ["26", "03"]);
        assert_eq!(code_point_rows('\u{7}'), ["00", "07"]);
        assert_eq!(code_point_rows('🏛'), ["1F3", "DB"]);
        for set in BOTH {
            for c in ['☃', '家', '🏛', '\n'] {
                assert!(set.glyph(c).is_none());
                let (frame, width) = (bounds(set, &c.to_string()), set.width(&c.to_string()));
                // The frame keeps clear of both neighbours and holds two rows of digits.
                assert!(f64::from(frame.left()) > 0.05 * set.size);
                assert!(f64::from(frame.right()) < width - 0.05 * set.size);
                let rows = code_point_rows(c).map(|row| bounds(set.small(), &row));
                assert!(frame.width() > rows[0].width().max(rows[1].width()) + 2.0);
                assert!(frame.height() > rows[0].height() + rows[1].height() + 3.0);
                // It is no higher than a line.
                assert!(f64::from(frame.height()) < 1.25 * set.size);
            }
        }
    }

    #[test]
    fn long_text_is_cut_and_broken_between_words() {
        let set = Lettering::regular(10.0);
        assert_eq!(set.cut("after", 100.0), "after");
        let cut = set.cut("a rather long name of a stage", 60.0);
        assert!(cut.starts_with("a rather") && cut.ends_with('…') && set.width(&cut) <= 60.0);
        assert_eq!(set.lines("one two", 1000.0, 2), ["one two"]);
        assert_eq!(set.lines("one two three", set.width("one two"), 3), ["one two", "three"]);
        let two = set.lines("one two three four", set.width("one two"), 2);
        assert!(two.len() == 2 && two[0] == "one two" && two[1].ends_with('…'));
        assert!(set.lines("", 10.0, 2).is_empty());
    }

    proptest! {
        #[test]
        fn widths_add_up_and_scale(a in ".{0,20}", b in ".{0,20}", size in 4.0..80.0_f64) {
            for set in BOTH {
                let set = Lettering { size, ..set };
                let sum = set.width(&a) + set.width(&b);
                let joined = set.width(&(a.clone() + &b));
                prop_assert!((joined - sum).abs() <= 1e-9 * (1.0 + sum));
                let twice = Lettering { size: 2.0 * size, ..set };
                prop_assert!((twice.width(&a) - 2.0 * set.width(&a)).abs() <= 1e-9 * (1.0 + sum));
            }
        }

        #[test]
        fn no_line_is_wider_than_its_room(text in ".{0,60}", room in 30.0..400.0_f64, most in 1_usize..4) {
            let set = Lettering::regular(16.0);
            let lines = set.lines(&text, room, most);
            prop_assert!(lines.len() <= most);
            prop_assert!(lines.iter().all(|line| set.width(line) <= room));
            prop_assert!(set.width(&set.cut(&text, room)) <= room);
        }

        #[test]
        fn outlines_stay_about_their_line(text in "\\PC{1,12}") {
            let set = Lettering::regular(20.0);
            let mut path = PathBuilder::new();
            set.outline(&text, [100.0, 50.0], &mut path);
            if let Some(path) = path.finish() {
                let (frame, width) = (path.bounds(), set.width(&text) as f32);
                // Some letters lean out of their width, accents rise above a line.
                prop_assert!(frame.left() > 90.0 && frame.right() < 110.0 + width);
                prop_assert!(frame.top() > 50.0 - 30.0 && frame.bottom() < 50.0 + 14.0);
            }
        }
    }
}
