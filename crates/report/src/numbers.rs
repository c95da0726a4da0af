//! Round numbers for axes and short text for values.

/// The round step that cuts `span` into about `count` parts.
pub(crate) fn nice_step(span: f64, count: usize) -> f64 {
    if !(span > 0.0 && span.is_finite()) {
        return 1.0;
    }
    let raw = span / count as f64;
    let power = 10_f64.powf(raw.log10().floor());
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
    (0..=steps as i64).take((steps + 1.0) as usize).map(|k| (first + k as f64) * step).collect()
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
        let places = (digits as i32 - 1 - size.log10().floor() as i32).max(0) as usize;
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

/// The finite ones of `values`, sorted.
pub(crate) fn sorted_finite(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
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
    fn quantiles_of_few_values() {
        let sorted = sorted_finite([3.0, f64::NAN, 1.0, 2.0]);
        assert_eq!((quantile(&sorted, 0.0), quantile(&sorted, 0.5)), (1.0, 2.0));
        assert!(quantile(&[], 0.5).is_nan());
    }
}
