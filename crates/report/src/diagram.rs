//! The curvature diagram of a view as a figure: every vertex at its place in the (H, K) plane.

use crate::colormap::{self, TABLE};
use crate::numbers::{axis_name, quantile, sorted_finite, tick_labels};
use crate::svg::{Anchor, GRID, INK, MARK, SOFT, Svg, TEXT, cut, text_room};
use crate::{FieldScale, RelationCurve, ScalarField, SurfaceView};

const SIZE: f64 = 460.0;
const LEFT: f64 = 74.0;
const TOP: f64 = 14.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 72.0;
/// Colour of the points behind.
const BEHIND: &str = "#b3b5ba";
/// Dots of a figure at most; of more vertices every n-th is drawn.
const DOTS: usize = 20_000;
/// Shades the dots are grouped into, so that each shade is one path.
const SHADES: usize = 32;

/// The diagram coloured by K over the points of the view `behind` in grey, or `None` without
/// curvatures.
pub(crate) fn diagram_svg(
    view: &SurfaceView,
    behind: Option<&SurfaceView>,
    relations: &[RelationCurve],
) -> Option<String> {
    let (h, k) = (view.field("H")?, view.field("K")?);
    let earlier = behind.and_then(|b| Some((b, b.field("H")?, b.field("K")?)));
    let most = |values: &[f64]| {
        let sorted = sorted_finite(values.iter().map(|v| v.abs()));
        quantile(&sorted, 0.99)
    };
    let k_most = Some(most(&k.values)).filter(|m| *m > 0.0).unwrap_or(1.0);
    let both = |values: &[f64], other: Option<&ScalarField>| {
        let other = other.map_or(&[][..], |field| &field.values);
        values.iter().chain(other).copied().collect::<Vec<f64>>()
    };
    let x = axis_range(&both(&h.values, earlier.map(|e| e.1)), k_most.sqrt());
    let y = axis_range(&both(&k.values, earlier.map(|e| e.2)), k_most);
    let (right, base) = (SIZE - RIGHT, SIZE - BOTTOM);
    let place = |a: f64, b: f64| {
        let across = LEFT + (right - LEFT) * (a - x[0]) / (x[1] - x[0]);
        [across, base - (base - TOP) * (b - y[0]) / (y[1] - y[0])]
    };
    let inside = |p: &[f64; 2]| (LEFT..=right).contains(&p[0]) && (TOP..=base).contains(&p[1]);

    // No point of a surface lies above the parabola K = H² of umbilic points.
    let parabola = (0..=100).map(|i| x[0] + (x[1] - x[0]) * f64::from(i) / 100.0);
    let parabola: Vec<[f64; 2]> = parabola.map(|a| place(a, a * a)).collect();
    let window = [[LEFT, TOP], [right, base]];
    let parabola = clipped(&parabola, window);
    let mut key = Key::below(base);
    key.entry(Swatch::Dot("#2a63a5"), view.name());
    if let Some((view, ..)) = earlier {
        key.entry(Swatch::Dot(BEHIND), view.name());
    }
    for relation in relations {
        key.entry(Swatch::Line(MARK, 1.6), &relation.name);
    }
    if !parabola.is_empty() {
        key.entry(Swatch::Line(SOFT, 0.8), "K = H²");
    }

    let title = format!("Curvature diagram of {}", view.name());
    let mut svg = Svg::new(SIZE, key.bottom(), &title);
    for (t, label) in tick_labels(x[0], x[1], 6) {
        let [across, _] = place(t, y[0]);
        svg.line([across, TOP], [across, base], if t == 0.0 { SOFT } else { GRID }, 1.0);
        svg.text([across, base + 16.0], Anchor::Middle, SOFT, &label);
    }
    for (t, label) in tick_labels(y[0], y[1], 7) {
        let [_, up] = place(x[0], t);
        svg.line([LEFT, up], [right, up], if t == 0.0 { SOFT } else { GRID }, 1.0);
        svg.text([LEFT - 7.0, up + 4.0], Anchor::End, SOFT, &label);
    }
    let (middle_x, middle_y) = ((LEFT + right) / 2.0, (TOP + base) / 2.0);
    svg.text([middle_x, base + 38.0], Anchor::Middle, INK, &axis_name("H", &h.unit));
    svg.upward_text([14.0, middle_y], INK, &axis_name("K", &k.unit));

    if let Some((_, h, k)) = earlier {
        let step = h.values.len().div_ceil(DOTS).max(1);
        let pairs = h.values.iter().zip(&k.values).step_by(step);
        let dots: Vec<[f64; 2]> = pairs.map(|(a, b)| place(*a, *b)).filter(inside).collect();
        svg.dots(&dots, BEHIND, 2.0);
    }
    let mut shades = vec![Vec::new(); SHADES];
    let step = h.values.len().div_ceil(DOTS).max(1);
    for (a, b) in h.values.iter().zip(&k.values).step_by(step) {
        let p = place(*a, *b);
        if inside(&p) {
            let t = (0.5 + 0.5 * b / k_most).clamp(0.0, 1.0);
            shades[(t * (SHADES - 1) as f64).round() as usize].push(p);
        }
    }
    let table = colormap::table(FieldScale::Signed);
    for (shade, dots) in shades.iter().enumerate() {
        let entry = shade * (TABLE - 1) / (SHADES - 1);
        // Dots near zero would vanish on white.
        let colour = colormap::hex(table[entry].map(|c| (f64::from(c) * 0.88) as u8));
        svg.dots(dots, &colour, 2.4);
    }
    for piece in parabola {
        svg.polyline(&piece, SOFT, 0.8);
    }
    for relation in relations {
        let points: Vec<[f64; 2]> = relation.points.iter().map(|[a, b]| place(*a, *b)).collect();
        for piece in clipped(&points, window) {
            svg.polyline(&piece, MARK, 1.6);
        }
    }
    key.draw(&mut svg);
    Some(svg.finish())
}

/// What the dots and curves are, in rows below the axes.
struct Key {
    entries: Vec<([f64; 2], Swatch, String)>,
    at: [f64; 2],
}

enum Swatch {
    Dot(&'static str),
    Line(&'static str, f64),
}

impl Key {
    fn below(base: f64) -> Self {
        Self { entries: Vec::new(), at: [LEFT, base + 64.0] }
    }

    fn entry(&mut self, swatch: Swatch, text: &str) {
        let before = swatch.width();
        let text = cut(text, TEXT, SIZE - RIGHT - LEFT - before);
        let width = before + text_room(&text, TEXT);
        if self.at[0] > LEFT && self.at[0] + width > SIZE - RIGHT {
            self.at = [LEFT, self.at[1] + 18.0];
        }
        self.entries.push((self.at, swatch, text));
        self.at[0] += width + 14.0;
    }

    fn bottom(&self) -> f64 {
        self.at[1] + 8.0
    }

    fn draw(self, svg: &mut Svg) {
        for ([x, y], swatch, text) in self.entries {
            match swatch {
                Swatch::Dot(colour) => svg.dots(&[[x + 4.0, y - 4.0]], colour, 7.0),
                Swatch::Line(colour, width) => {
                    svg.line([x, y - 4.0], [x + 18.0, y - 4.0], colour, width);
                }
            }
            svg.text([x + swatch.width(), y], Anchor::Start, INK, &text);
        }
    }
}

impl Swatch {
    /// Up to the text beside it.
    fn width(&self) -> f64 {
        match self {
            Swatch::Dot(_) => 13.0,
            Swatch::Line(..) => 23.0,
        }
    }
}

/// The pieces of a polyline inside the box from `low` to `high` (Liang and Barsky's clipping); what
/// is not finite is outside.
fn clipped(points: &[[f64; 2]], [low, high]: [[f64; 2]; 2]) -> Vec<Vec<[f64; 2]>> {
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut joined = false;
    for pair in points.windows(2) {
        let (a, step) = (pair[0], [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
        if !step.iter().all(|s| s.is_finite()) {
            joined = false;
            continue;
        }
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let ends = [(low[axis] - a[axis]) / step[axis], (high[axis] - a[axis]) / step[axis]];
            if step[axis] != 0.0 {
                from = from.max(ends[0].min(ends[1]));
                to = to.min(ends[0].max(ends[1]));
            } else if !(low[axis]..=high[axis]).contains(&a[axis]) {
                to = -1.0;
            }
        }
        if !(from <= to) {
            joined = false;
            continue;
        }
        let at = |t: f64| [a[0] + t * step[0], a[1] + t * step[1]];
        match pieces.last_mut() {
            Some(piece) if joined && from == 0.0 => piece.push(at(to)),
            _ => pieces.push(vec![at(from), at(to)]),
        }
        joined = to == 1.0;
    }
    pieces
}

/// The range of nearly all values, at least a share of `size` so that rounding noise of a
/// constant curvature is not blown up.
fn axis_range(values: &[f64], size: f64) -> [f64; 2] {
    let sorted = sorted_finite(values.iter().copied());
    let (lo, hi) = (quantile(&sorted, 0.004), quantile(&sorted, 0.996));
    if !(lo <= hi) {
        return [-1.0, 1.0];
    }
    let half = (0.56 * (hi - lo)).max(0.05 * size).max(0.02 * hi.abs());
    [0.5 * (lo + hi) - half, 0.5 * (lo + hi) + half]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_long_key_goes_on_in_the_next_row() {
        let mut key = Key::below(100.0);
        key.entry(Swatch::Dot(BEHIND), "before");
        let one_row = key.bottom();
        for _ in 0..3 {
            key.entry(Swatch::Line(MARK, 1.0), "relation −0.31 H + 0.95 K = 0.2");
        }
        key.entry(Swatch::Dot(BEHIND), &"long ".repeat(60));
        assert_eq!(key.bottom(), one_row + 3.0 * 18.0);
        for ([x, _], swatch, text) in &key.entries {
            assert!(x + swatch.width() + text_room(text, TEXT) <= SIZE - RIGHT + 1e-9);
        }
    }

    #[test]
    fn curves_are_cut_at_the_border_and_stay_joined_inside() {
        let window = [[0.0, 0.0], [1.0, 1.0]];
        let through = clipped(&[[-1.0, 0.5], [0.25, 0.5], [0.5, 0.75], [0.5, 3.0]], window);
        assert_eq!(through, [[[0.0, 0.5], [0.25, 0.5], [0.5, 0.75], [0.5, 1.0]]]);
        let twice = clipped(&[[0.2, 0.5], [0.2, 2.0], [0.8, 2.0], [0.8, 0.5]], window);
        assert_eq!(twice, [[[0.2, 0.5], [0.2, 1.0]], [[0.8, 1.0], [0.8, 0.5]]]);
        assert!(clipped(&[[2.0, 2.0], [3.0, 2.0]], window).is_empty());
    }

    proptest! {
        #[test]
        fn pieces_hold_what_is_inside_and_nothing_else(
            points in prop::collection::vec([-2.0..3.0_f64, -2.0..3.0_f64], 2..12), t in 0.0..1.0_f64,
        ) {
            let window = [[0.0, 0.0], [1.0, 1.0]];
            let pieces = clipped(&points, window);
            let about_inside = |p: &[f64; 2]| p.iter().all(|c| (-1e-9..=1.0 + 1e-9).contains(c));
            prop_assert!(pieces.iter().flatten().all(about_inside));
            for pair in points.windows(2) {
                let p = [0, 1].map(|k| pair[0][k] + t * (pair[1][k] - pair[0][k]));
                if !p.iter().all(|c| (0.0..=1.0).contains(c)) {
                    continue;
                }
                let distance = |s: &[[f64; 2]]| {
                    let (d, q) = ([s[1][0] - s[0][0], s[1][1] - s[0][1]], [p[0] - s[0][0], p[1] - s[0][1]]);
                    let along = (d[0] * q[0] + d[1] * q[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-300);
                    let along = along.clamp(0.0, 1.0);
                    (q[0] - along * d[0]).hypot(q[1] - along * d[1])
                };
                let nearest = pieces.iter().flat_map(|piece| piece.windows(2)).map(distance);
                prop_assert!(nearest.fold(f64::MAX, f64::min) < 1e-9);
            }
        }
    }
}
