//! How the values of a quantity are spread over an area, in bounded memory.

use std::cmp::Ordering;

/// So many values are kept as they are; more are counted by their leading digits.
const LIMIT: usize = 1 << 20;
/// Bits of the mantissa of an `f64`.
const MANTISSA: u32 = 52;
/// Ranges as short as this are sorted.
const SHORT: usize = 32;

/// Weights of values.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    /// Values with their weights, in the order they came.
    values: Vec<(f64, f64)>,
    /// How many bits of the mantissa of every value have been dropped.
    dropped: u32,
}

impl Spread {
    /// Adds a value; those without weight change nothing.
    pub(crate) fn add(&mut self, value: f64, weight: f64) {
        if weight > 0.0 {
            self.values.push((value, weight));
            self.bound();
        }
    }

    /// Adds the values of another one.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.dropped = self.dropped.max(other.dropped);
        self.values.extend_from_slice(&other.values);
        self.bound();
    }

    fn bound(&mut self) {
        if self.values.len() > LIMIT {
            self.coarsen();
        }
    }

    /// Counts values of the same leading digits together, until half as many remain.
    fn coarsen(&mut self) {
        // Stable, so that weights of one bin are added in the order they came.
        self.values.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Those that came since the last time may have bins already.
        self.bin();
        while self.values.len() > LIMIT / 2 && self.dropped + 1 < MANTISSA {
            self.dropped += 1;
            self.bin();
        }
    }

    fn bin(&mut self) {
        let dropped = self.dropped;
        if dropped > 0 {
            self.values.iter_mut().for_each(|(value, _)| *value = shortened(*value, dropped));
        }
        self.values.dedup_by(|next, first| {
            let same = next.0 == first.0;
            if same {
                first.1 += next.1;
            }
            same
        });
    }

    /// The values below which the given shares of the weight lie; `None` without weight.
    ///
    /// Half of a value's own weight counts as below it, and between two values the share grows
    /// linearly: so the answer is continuous in values and weights, and the same from above as from
    /// below.
    pub(crate) fn quantiles<const N: usize>(&self, shares: [f64; N]) -> Option<[f64; N]> {
        let mut values = self.values.clone();
        let total: f64 = values.iter().map(|(_, weight)| weight).sum();
        (!values.is_empty()).then(|| shares.map(|share| quantile(&mut values, share * total)))
    }
}

/// The value with `target` of the weight below it, in linear time: the half that holds it is halved
/// again.
fn quantile(values: &mut [(f64, f64)], target: f64) -> f64 {
    let by_value = |a: &(f64, f64), b: &(f64, f64)| -> Ordering {
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    let (mut low, mut high, mut below) = (0, values.len(), 0.0);
    while high - low > SHORT {
        let middle = usize::midpoint(low, high);
        values[low..high].select_nth_unstable_by(middle - low, by_value);
        let left: f64 = values[low..middle].iter().map(|(_, weight)| weight).sum();
        if target <= below + left + 0.5 * values[middle].1 {
            high = middle + 1;
        } else {
            (low, below) = (middle, below + left);
        }
    }
    let range = &mut values[low..high];
    range.sort_unstable_by(by_value);
    let mut last: Option<(f64, f64)> = None;
    for &mut (value, weight) in range {
        let here = below + 0.5 * weight;
        if target <= here {
            return match last {
                Some((before, share)) => {
                    before + (value - before) * ((target - share) / (here - share))
                }
                None => value,
            };
        }
        (last, below) = (Some((value, here)), below + weight);
    }
    last.map_or(f64::NAN, |(value, _)| value)
}

/// The value with the last bits of its mantissa replaced by their middle.
fn shortened(value: f64, dropped: u32) -> f64 {
    let mask = (1_u64 << dropped) - 1;
    f64::from_bits(value.to_bits() & !mask | 1 << (dropped - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform(count: u32) -> impl Iterator<Item = f64> {
        // 7919 is coprime to powers of ten: every value once.
        (0..count).map(move |k| {
            f64::from((u64::from(k) * 7919 % u64::from(count)) as u32) / f64::from(count) - 0.5
        })
    }

    #[test]
    fn quantiles_are_those_of_the_sorted_values() {
        let (mut whole, mut parts) = (Spread::default(), [Spread::default(), Spread::default()]);
        for (k, value) in uniform(10_000).enumerate() {
            whole.add(value, 1.0);
            parts[k % 2].add(value, 1.0);
        }
        let [low, high] = whole.quantiles([0.01, 0.99]).unwrap();
        // Value k has k + 1/2 values below.
        let want = (100.0 - 0.5) / 10_000.0 - 0.5;
        assert!((low - want).abs() < 1e-15 && (high + want + 1e-4).abs() < 1e-15, "{low} {high}");
        let [mut merged, second] = parts;
        merged.merge(&second);
        assert_eq!(merged.quantiles([0.01, 0.5, 0.99]), whole.quantiles([0.01, 0.5, 0.99]));
        assert_eq!(Spread::default().quantiles([0.5]), None);
    }

    #[test]
    fn a_turned_sign_turns_the_quantiles() {
        let (mut there, mut back) = (Spread::default(), Spread::default());
        for (k, value) in uniform(1000).enumerate() {
            let (value, weight) = (value.exp() - 1.0, 1.0 + (k % 7) as f64);
            there.add(value, weight);
            back.add(-value, weight);
        }
        let shares = [0.01, 0.3, 0.99];
        let (a, b) = (there.quantiles(shares).unwrap(), back.quantiles([0.99, 0.7, 0.01]).unwrap());
        assert!(a.iter().zip(b).all(|(a, b)| (a + b).abs() < 1e-12), "{a:?} {b:?}");
    }

    #[test]
    fn millions_of_values_take_bounded_memory_and_keep_their_digits() {
        let mut spread = Spread::default();
        uniform(3_000_000).for_each(|value| spread.add(value, 2.0));
        assert!(spread.values.len() <= LIMIT);
        let [low, high] = spread.quantiles([0.01, 0.99]).unwrap();
        assert!((low + 0.49).abs() < 1e-5 && (high - 0.49).abs() < 1e-5, "{low} {high}");
    }
}
