//! Which colour a value has in a picture.

use crate::colormap::{self, NO_VALUE, TABLE};
use crate::numbers::{quantile, sorted_finite};
use crate::{FieldScale, ScalarField};

/// Colours of the values of a field.
pub(crate) struct Palette {
    table: Vec<[u8; 3]>,
    /// The part of the table that is used: of a signed map a half, if all values have one sign.
    part: [f64; 2],
    range: [f64; 2],
}

impl Palette {
    pub(crate) fn of(field: &ScalarField) -> Self {
        let range = field_range(field);
        let part = match field.scale {
            FieldScale::Signed if range[0] >= 0.0 => [0.54, 1.0],
            FieldScale::Signed if range[1] <= 0.0 => [0.0, 0.46],
            _ => [0.0, 1.0],
        };
        Self { table: colormap::table(field.scale), part, range }
    }

    /// Values at the ends of the map.
    pub(crate) fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The colour of a value; beyond the ends that of the end.
    pub(crate) fn value(&self, value: f64) -> [u8; 3] {
        if !value.is_finite() {
            return NO_VALUE;
        }
        let t = (value - self.range[0]) / (self.range[1] - self.range[0]);
        let t = self.part[0] + (self.part[1] - self.part[0]) * t.clamp(0.0, 1.0);
        self.table[(t * (TABLE - 1) as f64).round() as usize]
    }
}

/// Values at the ends of the map: the field's own range, or its central 98 %, symmetric about 0
/// where both signs occur.
fn field_range(field: &ScalarField) -> [f64; 2] {
    // A range that is empty or the wrong way round is no range to show.
    if let Some(range) = field.range.filter(|[lo, hi]| lo < hi) {
        return range;
    }
    let sorted = sorted_finite(field.values.iter().copied());
    let (lo, hi) = (quantile(&sorted, 0.01), quantile(&sorted, 0.99));
    let most = lo.abs().max(hi.abs());
    match field.scale {
        // Values of one sign that differ enough get one half of the map for themselves.
        FieldScale::Signed if lo * hi > 0.0 && hi - lo > 0.15 * most => [lo, hi],
        FieldScale::Signed if most > 0.0 => [-most, most],
        FieldScale::Magnitude if hi > lo => [if lo >= 0.0 && lo < 0.4 * hi { 0.0 } else { lo }, hi],
        FieldScale::Magnitude if most > 0.0 => [lo, lo + most],
        _ => [-1.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn palette(scale: FieldScale, values: &[f64]) -> Palette {
        let field = ScalarField::signed("f", "f", "", values.to_vec());
        Palette::of(&ScalarField { scale, ..field })
    }

    #[test]
    fn zero_is_the_middle_of_a_map_with_both_signs() {
        let palette = palette(FieldScale::Signed, &[-1.0, 0.5, 2.0]);
        assert_eq!(palette.range(), [-2.0, 2.0]);
        let middle = palette.value(0.0);
        assert!(middle.iter().all(|c| *c > 0xe0), "{middle:?}");
    }

    #[test]
    fn values_of_one_sign_have_one_half_of_the_map() {
        let below = palette(FieldScale::Signed, &[-3.0, -2.0, -1.0]);
        assert_eq!(below.range(), [-3.0, -1.0]);
        assert!(below.value(-1.0)[2] > below.value(-1.0)[0], "bluish");
        let above = palette(FieldScale::Signed, &[1.0, 2.0, 3.0]);
        assert!(above.value(1.0)[0] > above.value(1.0)[2], "reddish");
    }

    #[test]
    fn sizes_start_at_zero_unless_they_lie_far_from_it() {
        assert_eq!(palette(FieldScale::Magnitude, &[0.1, 1.0]).range(), [0.0, 1.0]);
        assert_eq!(palette(FieldScale::Magnitude, &[0.9, 1.0]).range(), [0.9, 1.0]);
    }

    #[test]
    fn a_constant_or_empty_field_has_a_range_too() {
        for scale in [FieldScale::Signed, FieldScale::Magnitude] {
            for values in [&[][..], &[0.0, 0.0], &[3.5, 3.5], &[f64::NAN]] {
                let [lo, hi] = palette(scale, values).range();
                assert!(lo < hi && lo.is_finite() && hi.is_finite());
            }
        }
    }

    #[test]
    fn what_is_not_a_number_has_a_colour_of_its_own() {
        assert_eq!(palette(FieldScale::Signed, &[1.0]).value(f64::NAN), NO_VALUE);
    }
}
