//! Energy of every term per iteration, on a logarithmic axis.

use crate::EnergyHistory;
use crate::numbers::{format_number, superscript, ticks};
use crate::svg::{Anchor, GRID, INK, LINE, SERIES, SOFT, Svg};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 42.0;
/// Powers of ten below the largest value that are shown; what is smaller lies on the axis.
const DECADES: f64 = 14.0;

/// The energies as a picture.
pub(crate) fn energies_svg(history: &EnergyHistory) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT, "Energies per iteration");
    let all = || history.terms.iter().flat_map(|t| &t.values).copied();
    let positive = || all().filter(|v| *v > 0.0 && v.is_finite());
    let most = positive().fold(f64::MIN_POSITIVE, f64::max).log10();
    let least = positive().fold(f64::MAX, f64::min).log10().max(most - DECADES);
    let (floor, ceiling) = (least.min(most).floor(), most.ceil().max(least.floor() + 1.0));
    let steps = history.terms.iter().map(|t| t.values.len()).max().unwrap_or(0).max(2) - 1;
    let (right, base) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let x_of = |i: f64| LEFT + (right - LEFT) * i / steps as f64;
    let y_of = |v: f64| {
        // Zero lies on the axis; what is not a number lies nowhere.
        let log = if v > 0.0 { v.log10().max(floor) } else { floor + 0.0 * v };
        base - (base - TOP) * (log - floor) / (ceiling - floor)
    };

    for power in ticks(floor, ceiling, 6).into_iter().filter(|p| p.fract() == 0.0) {
        let y = y_of(10_f64.powf(power));
        svg.line([LEFT, y], [right, y], GRID, 1.0);
        let label = if power == 0.0 { "1".to_owned() } else { power_of_ten(power as i32) };
        svg.text([LEFT - 7.0, y + 4.0], Anchor::End, SOFT, &label);
    }
    for i in ticks(0.0, steps as f64, 8).into_iter().filter(|i| i.fract() == 0.0) {
        svg.text([x_of(i), base + 16.0], Anchor::Middle, SOFT, &format_number(i, 6));
    }
    svg.line([LEFT, base], [right, base], LINE, 1.0);
    svg.text([(LEFT + right) / 2.0, base + 34.0], Anchor::Middle, INK, "iteration");
    svg.upward_text([14.0, (TOP + base) / 2.0], INK, "energy");
    for (at, label) in &history.marks {
        let x = x_of(*at as f64);
        svg.dashed([x, TOP], [x, base], SOFT);
        svg.sized_text([x + 4.0, TOP - 8.0], Anchor::Start, SOFT, 10.5, label);
    }

    let mut labels = Vec::new();
    for (k, term) in history.terms.iter().enumerate() {
        // The first colour is the pale one for "before"; energies start with the strong one.
        let colour = SERIES[(k + 1) % SERIES.len()];
        let points: Vec<[f64; 2]> =
            term.values.iter().enumerate().map(|(i, v)| [x_of(i as f64), y_of(*v)]).collect();
        // The line is broken where the term does not exist.
        let exists = |p: &[f64; 2]| p[1].is_finite();
        for piece in points.chunk_by(|a, b| exists(a) == exists(b)).filter(|p| exists(&p[0])) {
            svg.polyline(piece, colour, 1.8);
        }
        let ends = points.iter().zip(&term.values).rfind(|(p, _)| exists(p));
        if let Some((end, value)) = ends {
            svg.dots(&[*end], colour, 5.0);
            labels.push((end[1], colour, format!("{} {}", term.name, format_number(*value, 3))));
        }
    }
    spread_labels(&mut labels, TOP + 4.0, base);
    for (y, colour, label) in labels {
        svg.text([right + 10.0, y + 4.0], Anchor::Start, colour, &label);
    }
    svg.finish()
}

fn power_of_ten(power: i32) -> String {
    format!("10{}", superscript(&power.to_string()))
}

/// Moves labels apart so that none covers another, keeping their order.
fn spread_labels(labels: &mut [(f64, &str, String)], top: f64, bottom: f64) {
    const GAP: f64 = 15.0;
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    for i in 1..labels.len() {
        labels[i].0 = labels[i].0.max(labels[i - 1].0 + GAP);
    }
    let mut limit = bottom;
    for label in labels.iter_mut().rev() {
        label.0 = label.0.min(limit).max(top);
        limit = label.0 - GAP;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Series;

    #[test]
    fn terms_and_marks_appear() {
        let terms = vec![
            Series { name: "alignment".into(), values: vec![1.0, 1e-2, 1e-4] },
            Series { name: "closeness".into(), values: vec![0.0, 2e-3, 3e-3] },
        ];
        let svg = energies_svg(&EnergyHistory { terms, marks: vec![(1, "14x10".into())] });
        for text in ["alignment 1·10⁻⁴", "closeness 0.003", "14x10", "10⁻²"] {
            assert!(svg.contains(text), "{text}");
        }
    }

    #[test]
    fn nothing_and_zeros_still_draw() {
        assert!(!energies_svg(&EnergyHistory::default()).contains("NaN"));
        let terms = vec![Series { name: "e".into(), values: vec![0.0, 0.0] }];
        let svg = energies_svg(&EnergyHistory { terms, marks: vec![] });
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn a_term_may_begin_later() {
        let values = vec![f64::NAN, f64::NAN, 1.0, 0.1];
        let terms = vec![Series { name: "late".into(), values }];
        let svg = energies_svg(&EnergyHistory { terms, marks: vec![] });
        assert!(svg.contains("late 0.1") && !svg.contains("NaN"));
    }

    #[test]
    fn labels_do_not_overlap() {
        let mut labels: Vec<_> = (0..5).map(|_| (100.0, "", String::new())).collect();
        spread_labels(&mut labels, 20.0, 120.0);
        assert!(labels.windows(2).all(|p| p[1].0 - p[0].0 >= 14.9));
    }
}
