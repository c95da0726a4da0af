//! The curvature diagram of a view as a figure: every vertex at its place in the (H, K) plane.

use crate::colormap::{self, TABLE};
use crate::numbers::{axis_name, format_number, quantile, sorted_finite, ticks};
use crate::svg::{Anchor, GRID, INK, MARK, SOFT, Svg};
use crate::{FieldScale, RelationCurve, SurfaceView};

const SIZE: f64 = 460.0;
const LEFT: f64 = 74.0;
const TOP: f64 = 14.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 48.0;
/// Dots of a figure at most; of more vertices every n-th is drawn.
const DOTS: usize = 20_000;
/// Shades the dots are grouped into, so that each shade is one path.
const SHADES: usize = 32;

/// The diagram coloured by K, or `None` without curvatures.
pub(crate) fn diagram_svg(view: &SurfaceView, relations: &[RelationCurve]) -> Option<String> {
    let (h, k) = (view.field("H")?, view.field("K")?);
    let most = |values: &[f64]| {
        let sorted = sorted_finite(values.iter().map(|v| v.abs()));
        quantile(&sorted, 0.99)
    };
    let k_most = Some(most(&k.values)).filter(|m| *m > 0.0).unwrap_or(1.0);
    let x = axis_range(&h.values, k_most.sqrt());
    let y = axis_range(&k.values, k_most);
    let (right, base) = (SIZE - RIGHT, SIZE - BOTTOM);
    let place = |a: f64, b: f64| {
        let across = LEFT + (right - LEFT) * (a - x[0]) / (x[1] - x[0]);
        [across, base - (base - TOP) * (b - y[0]) / (y[1] - y[0])]
    };
    let inside = |p: &[f64; 2]| (LEFT..=right).contains(&p[0]) && (TOP..=base).contains(&p[1]);

    let title = format!("Curvature diagram of {}", view.name());
    let mut svg = Svg::new(SIZE, SIZE, &title);
    for t in ticks(x[0], x[1], 5) {
        let [across, _] = place(t, y[0]);
        svg.line([across, TOP], [across, base], if t == 0.0 { SOFT } else { GRID }, 1.0);
        svg.text([across, base + 16.0], Anchor::Middle, SOFT, &format_number(t, 3));
    }
    for t in ticks(y[0], y[1], 5) {
        let [_, up] = place(x[0], t);
        svg.line([LEFT, up], [right, up], if t == 0.0 { SOFT } else { GRID }, 1.0);
        svg.text([LEFT - 7.0, up + 4.0], Anchor::End, SOFT, &format_number(t, 3));
    }
    let (middle_x, middle_y) = ((LEFT + right) / 2.0, (TOP + base) / 2.0);
    svg.text([middle_x, base + 38.0], Anchor::Middle, INK, &axis_name("H", &h.unit));
    svg.upward_text([14.0, middle_y], INK, &axis_name("K", &k.unit));

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
    // No point of a surface lies above the parabola K = H² of umbilic points.
    let parabola = (0..=100).map(|i| x[0] + (x[1] - x[0]) * f64::from(i) / 100.0);
    let parabola: Vec<[f64; 2]> = parabola.map(|a| place(a, a * a)).filter(inside).collect();
    svg.polyline(&parabola, SOFT, 0.8);
    for relation in relations {
        let points: Vec<[f64; 2]> =
            relation.points.iter().map(|[a, b]| place(*a, *b)).filter(inside).collect();
        svg.polyline(&points, MARK, 1.6);
        if let Some([across, up]) = points.get(points.len() / 2) {
            svg.text([across + 7.0, up - 6.0], Anchor::Start, MARK, &relation.name);
        }
    }
    Some(svg.finish())
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
