//! Round numbers for axes and short text for values.

use libm::{log10, pow};

/// A value beyond this counts as infinite, so that the span of an axis is always finite.
const LARGEST: f64 = 1e300;
/// The span of an axis below which it has no round numbers: their steps would underflow.
const LEAST_SPAN: f64 = 1e-300;

/// The round step that cuts `span` into about `count` parts.
pub(crate) fn nice_step(span: f64, count: usize) -> f64 {
    if !(span > LEAST_SPAN && span.is_finite()) {
        return 1.0;
    }
    let raw = span / count as f64;
    let power = pow(10.0, log10(raw).floor());
    let multiples = [1.0, 2.0, 2.5, 5.0];
    multiples.into_iter().map(|m| m * power).find(|s| *s >= raw * 0.999).unwrap_or(10.0 * power)
}

/// Round numbers from `lo` to `hi`, about `count` of them.
pub(crate) fn ticks(lo: f64, hi: f64, count: usize) -> Vec<f64> {
    let step = nice_step(hi - lo, count);
    let first = (lo / step - 1e-9).ceil();
    let last = (hi / step + 1e-9).floor();
    // At most `4 * count` of them, whatever the rounding.
    let steps = (last - first).clamp(-1.0, 4.0 * count as f64);
    let all = (0..=steps as i64).take((steps + 1.0) as usize);
    let mut ticks: Vec<f64> = all.map(|k| (first + k as f64) * step).collect();
    // Where the axis spans but a few of the numbers a computer has, neighbours may round to one.
    ticks.dedup();
    ticks
}

/// Round numbers from `lo` to `hi` as text, with as many digits as it takes to tell them apart.
pub(crate) fn tick_labels(lo: f64, hi: f64, count: usize) -> Vec<(f64, String)> {
    // Two digits of the step, as in 0.25.
    let step = nice_step(hi - lo, count);
    let label = |t: f64| (t, format_number(t, digits_beside(t, step, 2)));
    ticks(lo, hi, count).into_iter().map(label).collect()
}

/// Digits of `value` that show `few` digits of a difference such as `small`, but no less than 3.
pub(crate) fn digits_beside(value: f64, small: f64, few: usize) -> usize {
    let order = |x: f64| log10(x.abs()).floor();
    let more = order(value) - order(small);
    // Beyond 17 digits a number has nothing to tell; for 0 and its like `more` is no number.
    if more.is_finite() { (more + few as f64).clamp(3.0, 17.0) as usize } else { 3 }
}

/// A value with `digits` significant digits, without idle zeros, with a true minus sign.
pub(crate) fn format_number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "–".to_owned();
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    let size = x.abs();
    let text = if (1e-3..1e5).contains(&size) {
        let places = (digits as i32 - 1 - log10(size).floor() as i32).max(0) as usize;
        trim_zeros(&format!("{x:.places$}")).to_owned()
    } else {
        let text = format!("{x:.*e}", digits - 1);
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}·10{}", trim_zeros(mantissa), superscript(exponent))
    };
    text.replace('-', "−")
}

/// An exponent in raised digits.
pub(crate) fn superscript(exponent: &str) -> String {
    let raise = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        d => d.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(d),
    };
    exponent.chars().map(raise).collect()
}

/// `value unit`, or the value alone.
pub(crate) fn with_unit(value: f64, unit: &str, digits: usize) -> String {
    let number = format_number(value, digits);
    match unit {
        "" => number,
        // Signs such as ° and % follow a number as they do in print.
        "°" => format!("{number}°"),
        unit => format!("{number} {unit}"),
    }
}

/// `name [unit]`, or the name alone.
pub(crate) fn axis_name(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

/// The finite ones of `values`, sorted; what lies beyond 1e300 counts as infinite.
pub(crate) fn sorted_finite(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.abs() <= LARGEST).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The sorted value below which the share `q` lies (nearest rank); NaN for no values.
pub(crate) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((q * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

fn trim_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_sign() {
        let cases = [
            (0.0, "0"),
            (-0.25, "−0.25"),
            (1234.6, "1235"),
            (0.012_345, "0.0123"),
            (-3.2e-7, "−3.2·10⁻⁷"),
            (6.02e23, "6.02·10²³"),
            (f64::NAN, "–"),
        ];
        for (x, want) in cases {
            assert_eq!(format_number(x, 3), want);
        }
        assert_eq!(with_unit(0.1, "°", 3), "0.1°");
        assert_eq!(with_unit(2.0, "1/m", 3), "2 1/m");
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(-0.3, 1.1, 5), [0.0, 0.5, 1.0]);
        assert_eq!(ticks(0.0, 100.0, 5), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(ticks(1.0, 1.0, 5), [1.0]);
        assert!(ticks(3.0, 2.0, 5).is_empty());
    }

    #[test]
    fn labels_of_a_short_axis_far_from_zero_differ() {
        let texts = |lo, hi| -> Vec<String> {
            tick_labels(lo, hi, 4).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts(1234.5, 1234.7), ["1234.5", "1234.55", "1234.6", "1234.65", "1234.7"]);
        assert_eq!(texts(-0.5, 0.5), ["−0.5", "−0.25", "0", "0.25", "0.5"]);
        assert_eq!(texts(1e-9, 1.000_2e-9)[0], "1·10⁻⁹");
    }

    #[test]
    fn quantiles_of_few_values() {
        let sorted = sorted_finite([3.0, f64::NAN, 1.0, 2.0]);
        assert_eq!((quantile(&sorted, 0.0), quantile(&sorted, 0.5)), (1.0, 2.0));
        assert!(quantile(&[], 0.5).is_nan());
    }

    /// Reads what `format_number` wrote.
    fn read(text: &str) -> f64 {
        let plain = |c: char| match "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|raised| raised == c)
        {
            Some(digit) => char::from(b'0' + digit as u8),
            None if c == '−' || c == '⁻' => '-',
            None => c,
        };
        text.replace("·10", "e").chars().map(plain).collect::<String>().parse().unwrap()
    }

    /// Numbers of every size and sign.
    fn any_size() -> impl Strategy<Value = f64> {
        (1.0..10.0_f64, -290..290_i32, any::<bool>()).prop_map(|(mantissa, power, negative)| {
            let size = mantissa * 10_f64.powi(power);
            if negative { -size } else { size }
        })
    }

    proptest! {
        #[test]
        fn numbers_read_back_to_their_digits(x in any_size(), digits in 1_usize..12) {
            let text = format_number(x, digits);
            let step = 10_f64.powf(x.abs().log10().floor() + 1.0 - digits as f64);
            // Whole numbers keep all their digits.
            prop_assert!((read(&text) - x).abs() <= 0.500_001 * step, "{text}");
            prop_assert!(!text.ends_with('.') && !text.contains('-'));
            prop_assert!(!text.contains('.') || !text.split('·').next().unwrap().ends_with('0'));
        }

        #[test]
        fn ticks_lie_on_the_axis_in_order(lo in any_size(), span in 1e-9..1e9_f64, n in 1_usize..12) {
            let hi = lo + span * lo.abs();
            let ticks = ticks(lo, hi, n);
            let slack = 1e-8 * (hi - lo);
            prop_assert!(ticks.len() <= n + 1);
            prop_assert!(ticks.iter().all(|t| (lo - slack..=hi + slack).contains(t)));
            prop_assert!(ticks.windows(2).all(|t| t[0] < t[1]));
        }

        #[test]
        fn labels_of_ticks_differ_and_say_where_they_are(
            lo in any_size(), span in 1e-9..1e9_f64, n in 2_usize..12,
        ) {
            let hi = lo + span * lo.abs();
            let labels = tick_labels(lo, hi, n);
            for (value, text) in &labels {
                prop_assert!((read(text) - value).abs() < 0.02 * (hi - lo), "{value} {text}");
            }
            let texts: std::collections::BTreeSet<&String> = labels.iter().map(|l| &l.1).collect();
            prop_assert_eq!(texts.len(), labels.len());
        }

        #[test]
        fn any_axis_has_finitely_many_ticks(lo in any::<f64>(), hi in any::<f64>()) {
            prop_assert!(tick_labels(lo, hi, 6).iter().all(|(t, _)| !t.is_nan()));
        }

        #[test]
        fn quantiles_are_values_in_order(
            values in prop::collection::vec(any::<f64>(), 1..50), p in 0.0..=1.0_f64, q in 0.0..=1.0_f64,
        ) {
            let sorted = sorted_finite(values.iter().copied());
            let (a, b) = (quantile(&sorted, p.min(q)), quantile(&sorted, p.max(q)));
            prop_assert!(sorted.is_empty() || (a <= b && sorted.contains(&a)));
        }
    }
}
