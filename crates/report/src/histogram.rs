//! Histograms: one row per series over a common axis, with the tolerance line across.

use crate::Histogram;
use crate::numbers::{axis_name, digits_beside, quantile, sorted_finite, tick_labels, with_unit};
use crate::svg::{Anchor, GRID, INK, LINE, MARK, SERIES, SOFT, Svg, TEXT, cut, text_room};

const BINS: usize = 64;
/// Values all above this share of the largest have an axis that does not start at 0, ...
const APART: f64 = 0.6;
/// ... unless they differ by less than this share of it, which may be rounding.
const LEAST_SPREAD: f64 = 1e-6;
const WIDTH: f64 = 640.0;
const ROW: f64 = 92.0;
const LEFT: f64 = 48.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 8.0;
/// Size of the names of the series.
const NAME_TEXT: f64 = 12.0;

/// The histogram as a picture. Rows share the axis of values; each has its own height, written
/// beside it, since a good result is often ten times as concentrated as a bad one.
pub(crate) fn histogram_svg(histogram: &Histogram) -> String {
    let series: Vec<Vec<f64>> =
        histogram.series.iter().map(|s| sorted_finite(s.values.iter().copied())).collect();
    let [lo, hi] = axis_range(histogram, &series);
    let counts: Vec<[usize; BINS]> = series.iter().map(|s| count(s, lo, hi)).collect();
    let share = |n: usize, total: usize| n as f64 / total.max(1) as f64;

    let rows = series.len() as f64;
    let bottom = TOP + rows * ROW;
    let mut svg = Svg::new(WIDTH, bottom + 40.0, &histogram.title);
    let plot = WIDTH - LEFT - RIGHT;
    let x_of = |v: f64| LEFT + plot * (v - lo) / (hi - lo);
    for (t, label) in tick_labels(lo, hi, 7) {
        svg.line([x_of(t), TOP], [x_of(t), bottom], GRID, 1.0);
        svg.text([x_of(t), bottom + 15.0], Anchor::Middle, SOFT, &label);
    }
    let name = axis_name(&histogram.quantity, &histogram.unit);
    svg.text([LEFT + plot / 2.0, bottom + 33.0], Anchor::Middle, INK, &name);

    for (row, (sorted, counts)) in series.iter().zip(&counts).enumerate() {
        let base = TOP + (row as f64 + 1.0) * ROW;
        let room = ROW - 26.0;
        let colour = SERIES[row % SERIES.len()];
        let tallest = share(counts.iter().copied().max().unwrap_or(0), sorted.len()).max(1e-9);
        for (bin, &n) in counts.iter().enumerate() {
            if n == 0 {
                continue;
            }
            let height = room * share(n, sorted.len()) / tallest;
            let from = lo + (hi - lo) * bin as f64 / BINS as f64;
            let to = lo + (hi - lo) * (bin + 1) as f64 / BINS as f64;
            let hint = hint(n, from, to, bin + 1 == BINS, &histogram.unit);
            let width = plot / BINS as f64;
            svg.bar([x_of(from) + 0.4, base - height], [width - 0.8, height], colour, &hint);
        }
        svg.line([LEFT, base], [WIDTH - RIGHT, base], LINE, 1.0);
        let top_label = format!("{} %", with_unit(100.0 * tallest, "", 2));
        svg.sized_text([LEFT - 6.0, base - room + 4.0], Anchor::End, SOFT, 10.0, &top_label);
        svg.line([LEFT - 3.0, base - room], [LEFT, base - room], SOFT, 1.0);
        if let Some(tolerance) = histogram.tolerance {
            svg.dashed([x_of(tolerance), base - room - 3.0], [x_of(tolerance), base], MARK);
        }
        let at = [WIDTH - RIGHT, base - ROW + 16.0];
        let summary = cut(&summary(histogram, sorted, hi - lo), TEXT, 0.8 * plot);
        svg.text(at, Anchor::End, SOFT, &summary);
        let name_room = plot - text_room(&summary, TEXT) - 16.0;
        let name = cut(&histogram.series[row].name, NAME_TEXT, name_room);
        svg.bold_text([LEFT, base - ROW + 16.0], NAME_TEXT, &name);
    }
    svg.finish()
}

/// Median, 95 % and how many lie beyond the tolerance, of values on an axis of length `span`.
fn summary(histogram: &Histogram, sorted: &[f64], span: f64) -> String {
    if sorted.is_empty() {
        return "no values".to_owned();
    }
    let value = |q| {
        let value = quantile(sorted, q);
        with_unit(value, &histogram.unit, digits_beside(value, span, 3))
    };
    let mut text = format!("median {} · 95 % {} · max {}", value(0.5), value(0.95), value(1.0));
    if let Some(tolerance) = histogram.tolerance {
        let beyond = sorted.len() - sorted.partition_point(|v| *v <= tolerance);
        let bound = with_unit(tolerance, &histogram.unit, 3);
        text += &format!(" · {beyond} of {} above {bound}", sorted.len());
    }
    text
}

fn hint(n: usize, from: f64, to: f64, last: bool, unit: &str) -> String {
    let write = |value, unit| with_unit(value, unit, digits_beside(value, to - from, 3));
    match last {
        true => format!("{n} from {} up", write(from, unit)),
        false => format!("{n} from {} to {}", write(from, ""), write(to, unit)),
    }
}

/// From 0 to the largest 99.5 % point, with the tolerance inside; from the least value where
/// values are negative or lie close together far from 0.
fn axis_range(histogram: &Histogram, series: &[Vec<f64>]) -> [f64; 2] {
    let least = series.iter().filter_map(|s| s.first()).copied().fold(f64::INFINITY, f64::min);
    let most = series.iter().map(|s| quantile(s, 0.995)).filter(|v| v.is_finite());
    let most = most.chain(histogram.tolerance.map(|t| 1.12 * t)).fold(f64::NEG_INFINITY, f64::max);
    let lo = match least.is_finite() {
        true if least > APART * most && most - least > LEAST_SPREAD * most => {
            least - 0.02 * (most - least)
        }
        true => least.min(0.0),
        false => 0.0,
    };
    // Equal values have an axis of their size.
    let hi = lo + 1.02 * (most - lo);
    if hi > lo { [lo, hi] } else { [lo, lo + lo.abs().max(1.0)] }
}

/// Values per bin; those beyond the axis count in the last one.
fn count(sorted: &[f64], lo: f64, hi: f64) -> [usize; BINS] {
    let mut counts = [0; BINS];
    for v in sorted {
        let bin = ((v - lo) / (hi - lo) * BINS as f64) as usize;
        counts[bin.min(BINS - 1)] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Series;

    fn histogram(values: Vec<f64>, tolerance: Option<f64>) -> Histogram {
        Histogram {
            id: "kinks".into(),
            title: "Kinks <along> seams".into(),
            quantity: "kink".into(),
            unit: "°".into(),
            series: vec![Series { name: "after".into(), values }],
            tolerance,
        }
    }

    #[test]
    fn every_value_is_counted_once() {
        let values: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.01).collect();
        let [lo, hi] = axis_range(&histogram(values.clone(), None), std::slice::from_ref(&values));
        assert_eq!(count(&values, lo, hi).iter().sum::<usize>(), 1000);
    }

    #[test]
    fn the_summary_counts_beyond_the_tolerance() {
        let svg = histogram_svg(&histogram(vec![0.1, 0.2, 0.3, f64::NAN], Some(0.25)));
        assert!(svg.contains("median 0.2° · 95 % 0.3° · max 0.3° · 1 of 3 above 0.25°"));
        assert!(svg.contains("Kinks &lt;along&gt; seams"));
    }

    #[test]
    fn values_close_together_far_from_zero_fill_the_axis() {
        let sorted: Vec<f64> = (0..100).map(|i| 0.997 + 4e-5 * f64::from(i)).collect();
        let [lo, hi] = axis_range(&histogram(sorted.clone(), None), &[sorted]);
        assert!(lo > 0.9968 && hi < 1.0012);
        let rounding = vec![1.0, 1.0 + 1e-15];
        assert_eq!(axis_range(&histogram(rounding.clone(), None), &[rounding])[0], 0.0);
        assert_eq!(axis_range(&histogram(vec![], None), &[vec![0.2, 1.0]])[0], 0.0);
    }

    #[test]
    fn no_values_and_equal_values_still_draw() {
        assert!(histogram_svg(&histogram(vec![], None)).contains("no values"));
        assert!(!histogram_svg(&histogram(vec![0.0; 4], None)).contains("NaN"));
    }
}
