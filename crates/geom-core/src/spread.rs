//! How the values of a quantity are spread over an area, in bounded memory.

/// Mantissa bits of a value that are kept: a bin is 1/256 of its values wide.
const KEPT_BITS: u32 = 8;
/// Bits of an `f64` below those.
const DROPPED_BITS: u32 = 52 - KEPT_BITS;
/// So many values wait before they are sorted into bins.
const WAITING: usize = 512;

/// Weights of values, binned by their leading digits.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    /// Rising.
    bins: Vec<(u32, f64)>,
    waiting: Vec<(u32, f64)>,
}

impl Spread {
    /// Adds a value; those without weight change nothing.
    pub(crate) fn add(&mut self, value: f64, weight: f64) {
        if weight > 0.0 {
            self.push(bin(value), weight);
        }
    }

    /// Adds the values of another one.
    pub(crate) fn merge(&mut self, other: &Self) {
        other.bins.iter().chain(&other.waiting).for_each(|&(bin, weight)| self.push(bin, weight));
    }

    fn push(&mut self, bin: u32, weight: f64) {
        self.waiting.push((bin, weight));
        if self.waiting.len() >= WAITING.max(self.bins.len()) {
            self.settle();
        }
    }

    fn settle(&mut self) {
        // Stable, so that equal bins are added in the order they came.
        self.bins.append(&mut self.waiting);
        self.bins.sort_by_key(|&(bin, _)| bin);
        self.bins.dedup_by(|next, first| {
            let same = next.0 == first.0;
            if same {
                first.1 += next.1;
            }
            same
        });
    }

    /// The value below which the given shares of the weight lie, to 1/256 of its size; `None`
    /// without weight. `shares` rise.
    pub(crate) fn quantiles<const N: usize>(&self, shares: [f64; N]) -> Option<[f64; N]> {
        let mut all = self.clone();
        all.settle();
        let total: f64 = all.bins.iter().map(|(_, weight)| weight).sum();
        let last = all.bins.last()?.0;
        let mut below = 0.0;
        let mut at = all.bins.iter();
        let mut current = at.next();
        Some(shares.map(|share| {
            while let Some(&(bin, weight)) = current {
                if below + weight >= share * total {
                    return centre(bin);
                }
                below += weight;
                current = at.next();
            }
            centre(last)
        }))
    }
}

/// Rises with the value.
fn bin(value: f64) -> u32 {
    let bits = value.to_bits();
    let ordered = if value.is_sign_negative() { !bits } else { bits | 1 << 63 };
    (ordered >> DROPPED_BITS) as u32
}

fn centre(bin: u32) -> f64 {
    let ordered = u64::from(bin) << DROPPED_BITS | 1 << (DROPPED_BITS - 1);
    f64::from_bits(if ordered >> 63 == 1 { ordered & !(1 << 63) } else { !ordered })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_rise_and_keep_three_digits() {
        let values = [-1e300, -2.5, -1.0, -1e-12, 0.0, 1e-12, 0.7, 3.0, 1e9];
        assert!(values.windows(2).all(|p| bin(p[0]) < bin(p[1])));
        for x in values {
            assert!((centre(bin(x)) - x).abs() <= x.abs() / 256.0 + f64::MIN_POSITIVE, "{x}");
        }
    }

    #[test]
    fn quantiles_are_those_of_the_sorted_values() {
        let (mut whole, mut parts) = (Spread::default(), [Spread::default(), Spread::default()]);
        for k in 0..10_000_u32 {
            let value = (f64::from(k * 7919 % 10_000) - 5000.0) / 1000.0;
            whole.add(value, 1.0);
            parts[(k % 2) as usize].add(value, 1.0);
        }
        let [low, high] = whole.quantiles([0.01, 0.99]).unwrap();
        assert!((low + 4.9).abs() < 0.02 && (high - 4.9).abs() < 0.02, "{low} {high}");
        let [mut merged, second] = parts;
        merged.merge(&second);
        assert_eq!(merged.quantiles([0.01, 0.5, 0.99]), whole.quantiles([0.01, 0.5, 0.99]));
        assert_eq!(Spread::default().quantiles([0.5]), None);
        assert!(merged.bins.len() < 10_000);
    }
}
