//! Units of length. Coordinates are never rescaled unasked: the unit is only remembered.

use std::fmt;

/// What a coordinate of 1 means.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum LengthUnit {
    /// 0.001 m.
    #[default]
    Millimetre,
    /// 0.01 m.
    Centimetre,
    /// 0.1 m.
    Decimetre,
    /// The metre itself.
    Metre,
    /// 1000 m.
    Kilometre,
    /// 0.0254 m.
    Inch,
    /// 0.3048 m.
    Foot,
    /// 0.9144 m.
    Yard,
    /// 1609.344 m.
    Mile,
    /// Any other, with its name in the file and its length in metres.
    Other {
        /// The name in the file.
        name: String,
        /// Its length in metres.
        metres: f64,
    },
}

const NAMED: [(LengthUnit, &str, f64); 9] = [
    (LengthUnit::Millimetre, "mm", 1e-3),
    (LengthUnit::Centimetre, "cm", 1e-2),
    (LengthUnit::Decimetre, "dm", 1e-1),
    (LengthUnit::Metre, "m", 1.0),
    (LengthUnit::Kilometre, "km", 1e3),
    (LengthUnit::Inch, "in", 0.0254),
    (LengthUnit::Foot, "ft", 0.3048),
    (LengthUnit::Yard, "yd", 0.9144),
    (LengthUnit::Mile, "mi", 1609.344),
];

impl LengthUnit {
    /// The unit of a symbol: `mm`, `cm`, `dm`, `m`, `km`, `in`, `ft`, `yd`, `mi`.
    #[must_use]
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        NAMED.iter().find(|(_, s, _)| *s == symbol).map(|(unit, ..)| unit.clone())
    }

    /// The unit of this many metres; rounding of the last digits is forgiven.
    #[must_use]
    pub fn from_metres(name: &str, metres: f64) -> Self {
        let close = |m: f64| (metres - m).abs() <= 1e-9 * m;
        match NAMED.iter().find(|(.., m)| close(*m)) {
            Some((unit, ..)) => unit.clone(),
            None => Self::Other { name: name.to_owned(), metres },
        }
    }

    /// Its length in metres.
    #[must_use]
    pub fn metres(&self) -> f64 {
        match self {
            Self::Other { metres, .. } => *metres,
            known => NAMED.iter().find(|(unit, ..)| unit == known).map_or(1.0, |(.., m)| *m),
        }
    }

    /// What is to be said if numbers in this unit go into a file with this (lower case) extension
    /// that cannot tell it: nothing for millimetres, which are meant where nothing is said.
    #[must_use]
    pub fn lost_in(&self, extension: &str) -> Option<String> {
        let format = extension.to_uppercase();
        match (extension, self) {
            (_, Self::Millimetre) => None,
            ("obj" | "off" | "stl" | "json" | "csv", _) => {
                Some(format!("{format} holds no unit of length; its numbers are in {self}"))
            }
            ("dxf", _) => Some(format!(
                "DXF tells the unit of length in a comment only; its numbers are in {self}"
            )),
            ("ron" | "ply", Self::Other { name, metres }) => Some(format!(
                "{format} does not know the unit {name} ({metres} m); its numbers are in that unit"
            )),
            _ => None,
        }
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Other { name, .. } => f.write_str(name),
            known => f.write_str(NAMED.iter().find(|(unit, ..)| unit == known).map_or("", |n| n.1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_and_lengths_agree() {
        for (unit, symbol, metres) in NAMED {
            assert_eq!(LengthUnit::from_symbol(symbol), Some(unit.clone()));
            assert_eq!(LengthUnit::from_metres("x", metres), unit);
            assert_eq!((unit.to_string().as_str(), unit.metres()), (symbol, metres));
        }
        let fathom = LengthUnit::from_metres("fathom", 1.8288);
        assert_eq!((fathom.to_string().as_str(), fathom.metres()), ("fathom", 1.8288));
    }
}
