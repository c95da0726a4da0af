//! Energy of every term per iteration, on a logarithmic axis.

use libm::log10;

use crate::numbers::{format_number, superscript, ticks};
use crate::svg::{Anchor, GRID, INK, LINE, SERIES, SOFT, Svg, TEXT, cut, text_room};
use crate::{EnergyHistory, Series};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
/// Room for the names of the terms: from the least to the most.
const RIGHT: [f64; 2] = [110.0, 260.0];
const TOP: f64 = 22.0;
const BOTTOM: f64 = 42.0;
/// From the end of the lines to their names.
const LABEL_GAP: f64 = 10.0;
/// Size of the labels of the marks, and the room from which on one has a label.
const MARK_TEXT: f64 = 10.5;
const LEAST_MARK: f64 = 26.0;
/// Powers of ten below the largest value that are shown; what is smaller lies on the axis.
const DECADES: f64 = 14.0;

/// The energies as a picture.
pub(crate) fn energies_svg(history: &EnergyHistory) -> String {
    let mut svg = Svg::new(WIDTH, HEIGHT, "Energies per iteration");
    let all = || history.terms.iter().flat_map(|t| &t.values).copied();
    let positive = || all().filter(|v| *v > 0.0 && v.is_finite());
    let most = log10(positive().fold(f64::MIN_POSITIVE, f64::max));
    let least = log10(positive().fold(f64::MAX, f64::min)).max(most - DECADES);
    let (floor, ceiling) = (least.min(most).floor(), most.ceil().max(least.floor() + 1.0));
    let steps = history.terms.iter().map(|t| t.values.len()).max().unwrap_or(0).max(2) - 1;
    let ends: Vec<Option<f64>> =
        history.terms.iter().map(|t| t.values.iter().copied().rfind(|v| !v.is_nan())).collect();
    let name = |(term, end): (&Series, &Option<f64>)| {
        end.map(|value| format!("{} {}", term.name, format_number(value, 3)))
    };
    let names: Vec<Option<String>> = history.terms.iter().zip(&ends).map(name).collect();
    let widest = names.iter().flatten().map(|n| text_room(n, TEXT)).fold(0.0, f64::max);
    let margin = (widest + LABEL_GAP + 6.0).clamp(RIGHT[0], RIGHT[1]);
    let (right, base) = (WIDTH - margin, HEIGHT - BOTTOM);
    let x_of = |i: f64| LEFT + (right - LEFT) * i / steps as f64;
    let y_of_log = |log: f64| base - (base - TOP) * (log - floor) / (ceiling - floor);
    // Zero and less lie on the axis, infinity at the top; what is not a number lies nowhere.
    let y_of =
        |v: f64| y_of_log(if v.is_nan() { v } else { log10(v.max(0.0)).clamp(floor, ceiling) });

    for power in ticks(floor, ceiling, 6).into_iter().filter(|p| p.fract() == 0.0) {
        let y = y_of_log(power);
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
    let mut marks: Vec<(f64, &str)> =
        history.marks.iter().map(|(at, label)| (x_of(*at as f64), label.as_str())).collect();
    marks.retain(|(x, _)| *x <= right);
    marks.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (i, (x, label)) in marks.iter().enumerate() {
        svg.dashed([*x, TOP], [*x, base], SOFT);
        // A label ends before the next one; where marks crowd, some have none.
        let next = marks.get(i + 1).map_or(WIDTH, |(x, _)| *x);
        if next - x >= LEAST_MARK {
            let label = cut(label, MARK_TEXT, next - x - 8.0);
            svg.sized_text([x + 4.0, TOP - 8.0], Anchor::Start, SOFT, MARK_TEXT, &label);
        }
    }

    let mut labels = Vec::new();
    for (k, (term, name)) in history.terms.iter().zip(names).enumerate() {
        // The first colour is the pale one for "before"; energies start with the strong one.
        let colour = SERIES[(k + 1) % SERIES.len()];
        let points: Vec<[f64; 2]> =
            term.values.iter().enumerate().map(|(i, v)| [x_of(i as f64), y_of(*v)]).collect();
        // The line is broken where the term does not exist.
        let exists = |p: &[f64; 2]| p[1].is_finite();
        for piece in points.chunk_by(|a, b| exists(a) == exists(b)).filter(|p| exists(&p[0])) {
            svg.polyline(piece, colour, 1.8);
        }
        if let (Some(end), Some(name)) = (points.iter().rfind(|p| exists(p)), name) {
            svg.dots(&[*end], colour, 5.0);
            labels.push((end[1], colour, cut(&name, TEXT, margin - LABEL_GAP)));
        }
    }
    spread_labels(&mut labels, TOP + 4.0, base);
    for (y, colour, label) in labels {
        svg.text([right + LABEL_GAP, y + 4.0], Anchor::Start, colour, &label);
    }
    svg.finish()
}

fn power_of_ten(power: i32) -> String {
    format!("10{}", superscript(&power.to_string()))
}

/// Moves labels apart so that none covers another, keeping their order; more than fit share the room.
fn spread_labels(labels: &mut [(f64, &str, String)], top: f64, bottom: f64) {
    const GAP: f64 = 15.0;
    let gap = GAP.min((bottom - top) / (labels.len().max(2) - 1) as f64);
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = top;
    for label in labels.iter_mut() {
        label.0 = label.0.max(least);
        least = label.0 + gap;
    }
    let mut most = bottom;
    for label in labels.iter_mut().rev() {
        label.0 = label.0.min(most);
        most = label.0 - gap;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
    fn long_names_are_written_out_or_cut_inside_the_picture() {
        let term = |name: &str| Series { name: name.into(), values: vec![1.0, 0.1] };
        let terms = vec![term("asymptotic and smooth, twice"), term(&"very ".repeat(40))];
        let svg = energies_svg(&EnergyHistory { terms, marks: vec![] });
        assert!(svg.contains("asymptotic and smooth, twice 0.1<"));
        assert!(svg.contains("very very very") && svg.contains("…<"));
    }

    #[test]
    fn labels_of_marks_that_crowd_are_cut_or_left_out() {
        let terms = vec![Series { name: "e".into(), values: vec![1.0; 101] }];
        let mark = |at: usize| (at, format!("level of step {at}"));
        let marks = vec![mark(0), mark(9), mark(10), mark(60), mark(7000)];
        let svg = energies_svg(&EnergyHistory { terms, marks });
        assert!(svg.contains("level of step 60<") && svg.contains("level of step 10<"));
        assert!(!svg.contains("step 9<") && !svg.contains("step 7000") && svg.contains("…<"));
    }

    #[test]
    fn labels_do_not_overlap() {
        let mut labels: Vec<_> = (0..5).map(|_| (100.0, "", String::new())).collect();
        spread_labels(&mut labels, 20.0, 120.0);
        assert!(labels.windows(2).all(|p| p[1].0 - p[0].0 >= 14.9));
    }

    proptest! {
        #[test]
        fn labels_keep_their_order_and_share_the_room(
            heights in prop::collection::vec(0.0..250.0_f64, 0..40),
        ) {
            let mut labels: Vec<_> = heights.iter().map(|y| (*y, "", y.to_string())).collect();
            spread_labels(&mut labels, 20.0, 250.0);
            prop_assert!(labels.iter().all(|l| (19.99..=250.01).contains(&l.0)));
            let gap = f64::min(15.0, 230.0 / (labels.len() as f64 - 1.0));
            prop_assert!(labels.windows(2).all(|p| p[1].0 - p[0].0 >= gap - 0.01));
            let before: Vec<f64> = labels.iter().map(|l| l.2.parse().unwrap()).collect();
            prop_assert!(before.is_sorted());
        }
    }
}
