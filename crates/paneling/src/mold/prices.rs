//! What molds and panels cost.

use crate::error::Error;
use crate::mold::shape::MoldType;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Price of one type of mold and of a panel made on it, in any currency.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Price {
    /// Making the mold.
    pub mold: f64,
    /// Making one panel on it.
    pub panel: f64,
    /// A unit of area of the mold: of the rectangle around its panels, in units of the model.
    #[serde(default)]
    pub area: f64,
}

/// Prices by type of mold (Eigensatz et al. 2010, Sec. 3: a mold is paid once, a panel each time):
///
/// `cost = Σ over molds (mold + area · blank area + panels · panel)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PriceList {
    prices: BTreeMap<MoldType, Price>,
}

impl PriceList {
    /// A list with these types.
    #[must_use]
    pub fn new(prices: impl IntoIterator<Item = (MoldType, Price)>) -> Self {
        Self { prices: prices.into_iter().collect() }
    }

    /// Every mold costs 1 and panels nothing: the total cost is the number of molds.
    #[must_use]
    pub fn counting_molds() -> Self {
        let price = Price { mold: 1.0, ..Price::default() };
        Self::new(MoldType::ALL.map(|kind| (kind, price)))
    }

    /// Checks that every one of `types` has a price, and that all prices of the list make sense.
    ///
    /// # Errors
    /// [`Error::NoPrice`] or [`Error::BadPrice`] names the type.
    pub fn check(&self, types: &[MoldType]) -> Result<(), Error> {
        if let Some(kind) = types.iter().find(|kind| !self.prices.contains_key(kind)) {
            return Err(Error::NoPrice { kind: kind.name() });
        }
        for (kind, price) in &self.prices {
            for value in [price.mold, price.panel, price.area] {
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(Error::BadPrice { kind: kind.name(), value });
                }
            }
        }
        Ok(())
    }

    /// Cost of one mold of a type with a blank of this area, and of `panels` panels on it; infinite
    /// for a type without price.
    #[must_use]
    pub fn cost(&self, kind: MoldType, panels: usize, area: f64) -> f64 {
        let of = |p: &Price| p.mold + p.area * area + panels as f64 * p.panel;
        self.prices.get(&kind).map_or(f64::INFINITY, of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prices_are_checked_by_type() {
        let mut list = PriceList::counting_molds();
        assert_eq!(list.cost(MoldType::Cubic, 10, 5.0), 1.0);
        list.check(&MoldType::ALL).unwrap();
        list.prices.insert(MoldType::Plane, Price { mold: f64::NAN, ..Price::default() });
        list.prices.remove(&MoldType::Torus);
        assert!(matches!(
            list.check(&[MoldType::Plane]),
            Err(Error::BadPrice { kind: "plane", .. })
        ));
        // A price that makes no sense, of a type that is not asked for.
        assert!(matches!(
            list.check(&[MoldType::Cubic]),
            Err(Error::BadPrice { kind: "plane", .. })
        ));
        let error = list.check(&[MoldType::Cubic, MoldType::Torus]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the price list has no entry for torus; add it or leave that type out"
        );
    }
}
