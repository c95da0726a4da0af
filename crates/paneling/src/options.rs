//! Settings of a paneling.

use crate::error::Error;
use crate::fit::clustering::DiagramAxis;
use crate::layout::tiling::Pattern;
use crate::mold::shape::MoldType;
use crate::search::bounds::Bounds;
use geom_core::Normalization;
use gp_solver::{Counts, List, OptionValue, choices, options, serde_as_text};
use serde::{Deserialize, Serialize};

/// How panels are grouped by mold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clustering {
    /// k-means in the space of panel shapes; uses exactly the wanted number of molds.
    #[default]
    Own,
    /// The published grid over the curvature diagram; uses at most the wanted number.
    Grid,
    /// Greedy covering as in the assignment of Eigensatz et al. 2010, restricted to one type of
    /// mold: the fewest shapes that are near enough to every panel, where "near enough" is as
    /// tight as the wanted number of molds allows.
    Cover,
}

choices!(Clustering { Own = "own", Grid = "grid", Cover = "cover" });

/// Width and height of a sheet in units of the model, written `3x1.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetSize {
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl OptionValue for SheetSize {
    const FORM: &'static str = "WxH";

    fn read(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X']).and_then(|(width, height)| {
            Some([width.trim().parse::<f64>().ok()?, height.trim().parse().ok()?])
        });
        match sides {
            Some([width, height]) if [width, height].iter().all(|s| *s > 0.0 && s.is_finite()) => {
                Ok(Self { width, height })
            }
            _ => Err(format!(
                "`{text}` is not of the form WxH with two positive lengths, as in 3x1.5"
            )),
        }
    }

    fn print(&self) -> Option<String> {
        Some(format!("{}x{}", self.width, self.height))
    }
}

serde_as_text!(SheetSize);

/// Panels in u and v where nothing else is asked for.
pub(crate) const PANELS: Counts = Counts { u: 30, v: 30 };
/// Molds per square root of the number of panels where nothing else is asked for.
const K: f64 = 3.0;
/// Most that a panel may deviate from the design under bounds where nothing else is asked for, as a
/// share of the size.
pub(crate) const MAX_DEVIATION: f64 = 0.002;

options! {
    /// Settings of a paneling.
    ///
    /// The number of molds follows from one of three rules: `k`, `molds`, or the bounds
    /// `max_kink_deg`, `max_gap` and `max_deviation`, for which the cheapest molds are searched.
    ///
    /// # Example
    /// ```
    /// use paneling::{Counts, MoldType, Options, Pattern};
    /// let options = Options {
    ///     panels: Some(Counts { u: 20, v: 12 }),
    ///     layout: Pattern::Staggered,
    ///     mold_types: vec![MoldType::Plane, MoldType::Cylinder].into(),
    ///     max_kink_deg: Some(1.0),
    ///     ..Options::default()
    /// };
    /// assert_eq!((options.k, options.seam_steps), (None, 40));
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct Options {
        /// Panels in u and v; 30x30 if not given.
        panels: Option<Counts> = None;
        /// Pattern of the panels.
        layout: Pattern = Pattern::Quad;
        /// Equal steps of mean arc length instead of equal parameter steps.
        equal_arc_length: bool = false;
        /// By panel shape, by the published grid over the curvature diagram, or by greedy covering.
        clustering: Clustering = Clustering::Own;
        /// k √N molds for N panels; 3 where no other rule is given.
        ///
        /// The rule of Pellis et al. 2021, Sec. 4.2.
        k: Option<f64> = None, replaces ["molds", "max_kink_deg", "max_gap", "max_deviation"];
        /// Number of molds.
        molds: Option<usize> = None, replaces ["k", "max_kink_deg", "max_gap", "max_deviation"];
        /// Find the cheapest molds with every kink at most this.
        max_kink_deg: Option<f64> = None, replaces ["k", "molds"];
        /// Find the cheapest molds with every gap at most this, in units of the model.
        max_gap: Option<f64> = None, replaces ["k", "molds"];
        /// Find the cheapest molds with no panel further than this from the design, in units of the
        /// model; 0.2 % of the size where only kinks or gaps are bounded.
        max_deviation: Option<f64> = None, replaces ["k", "molds"];
        /// How long to look for cheaper molds within bounds, as a multiple of the usual.
        ///
        /// With 1 about as many steps are made as a paneling of 900 panels makes in two seconds on two
        /// cores; the search ends earlier where nothing more is found.
        effort: f64 = 1.0;
        /// Types of molds: plane, cylinder, sphere, paraboloid, torus, cubic; several only together
        /// with bounds.
        mold_types: List<MoldType> = List(vec![MoldType::Cubic]);
        /// Most steps of the joint seam step; 0 leaves it out.
        ///
        /// A step that lowers the energy by less than 3 % is the last one.
        seam_steps: usize = 40;
        /// Width and height of the sheets for flat outlines, in units of the model; without it one
        /// large sheet.
        sheet: Option<SheetSize> = None;
        /// Length and breadth no panel may exceed, in units of the model, whichever way it lies.
        panel_max: Option<SheetSize> = None;
        /// Measure the published grid clustering with as many molds beside the own one.
        compare_grid: bool = true;
        /// Second coordinate of the published grid's curvature diagram (rarely needed).
        diagram_axis: DiagramAxis = DiagramAxis::SignedRoot;
        /// Weight of a slope difference in radians against a height difference in panel sizes
        /// (rarely needed).
        slope_weight: f64 = 0.5;
        /// Most rounds of the alternation of molds and poses, which ends earlier when a round lowers
        /// the energy by less than 1 % (rarely needed).
        rounds: usize = 30;
    }
}

/// How the number of molds is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum MoldRule {
    /// `k √N` molds.
    PerRoot(f64),
    /// This many.
    Count(usize),
    /// The cheapest within bounds.
    Bounds(Bounds),
}

impl Options {
    /// The defaults with this number of molds of this type.
    #[must_use]
    pub fn with_molds(molds: usize, kind: MoldType) -> Self {
        Self { molds: Some(molds), mold_types: List(vec![kind]), ..Self::default() }
    }

    /// Everything that can be checked without the surface.
    ///
    /// # Errors
    /// [`Error`] names the field at fault.
    pub fn check(&self) -> Result<(), Error> {
        let positive = [
            ("slope_weight", Some(self.slope_weight)),
            ("k", self.k),
            ("max_kink_deg", self.max_kink_deg),
            ("max_gap", self.max_gap),
            ("max_deviation", self.max_deviation),
            ("effort", Some(self.effort)),
            ("sheet", self.sheet.map(|s| s.width)),
            ("sheet", self.sheet.map(|s| s.height)),
            ("panel_max", self.panel_max.map(|s| s.width)),
            ("panel_max", self.panel_max.map(|s| s.height)),
        ];
        for (name, value) in positive {
            // Squares and shares of it stay numbers.
            if let Some(value) = value.filter(|v| !(*v > 0.0 && *v <= Normalization::LARGEST)) {
                return Err(Error::BadOption { name, value });
            }
        }
        if self.mold_types.is_empty() {
            return Err(Error::NoMoldTypes);
        }
        match self.rule()? {
            MoldRule::PerRoot(_) | MoldRule::Count(_) if self.types().len() > 1 => {
                Err(Error::SeveralTypes)
            }
            _ => Ok(()),
        }
    }

    /// The rule in force.
    pub(crate) fn rule(&self) -> Result<MoldRule, Error> {
        let has_bounds =
            self.max_kink_deg.is_some() || self.max_gap.is_some() || self.max_deviation.is_some();
        match (self.k, self.molds, has_bounds) {
            (None, None, false) => Ok(MoldRule::PerRoot(K)),
            (Some(k), None, false) => Ok(MoldRule::PerRoot(k)),
            (None, Some(molds), false) => Ok(MoldRule::Count(molds)),
            (None, None, true) => Ok(MoldRule::Bounds(Bounds {
                max_kink: self.max_kink_deg.map(f64::to_radians),
                max_gap: self.max_gap,
                max_deviation: self.max_deviation,
            })),
            _ => Err(Error::SeveralRules),
        }
    }

    /// The types of molds, each once, from the simplest to the most general.
    pub(crate) fn types(&self) -> Vec<MoldType> {
        let mut types = self.mold_types.0.clone();
        types.sort_unstable();
        types.dedup();
        types
    }
}

/// The number of molds for `panels` panels by the rule `k √N` of Pellis et al. 2021, Sec. 4.2.
///
/// # Example
/// ```
/// assert_eq!(paneling::mold_count(3.0, 900), 90);
/// ```
#[must_use]
pub fn mold_count(k: f64, panels: usize) -> usize {
    ((k * (panels as f64).sqrt()).round() as usize).clamp(1, panels.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_rule_at_a_time() {
        let bounds = Options { max_kink_deg: Some(1.0), max_gap: Some(0.1), ..Options::default() };
        assert!(matches!(bounds.rule(), Ok(MoldRule::Bounds(_))));
        assert_eq!(Options::default().rule(), Ok(MoldRule::PerRoot(3.0)));
        let both = Options { molds: Some(3), ..bounds };
        assert_eq!(both.check(), Err(Error::SeveralRules));
        let types = List(vec![MoldType::Cubic, MoldType::Plane, MoldType::Cubic]);
        let several = Options { mold_types: types, ..Options::default() };
        assert_eq!(several.types(), [MoldType::Plane, MoldType::Cubic]);
        assert_eq!(several.check(), Err(Error::SeveralTypes));
        let k = Options { k: Some(f64::NAN), ..Options::default() };
        assert!(k.check().unwrap_err().to_string().starts_with("`k` is NaN; "));
    }

    #[test]
    fn what_is_printed_is_read() {
        let options = Options {
            mold_types: List(vec![MoldType::Plane, MoldType::Torus]),
            sheet: Some(SheetSize { width: 3.0, height: 1.5 }),
            panels: Some(Counts { u: 3, v: 4 }),
            ..Options::default()
        };
        let mut read = Options::default();
        for field in Options::FIELDS {
            if let Some(text) = (field.get)(&options) {
                (field.set)(&mut read, &text).unwrap();
            }
        }
        assert_eq!(read, options);
        let text = serde_json::to_string(&options).unwrap();
        assert_eq!(serde_json::from_str::<Options>(&text).unwrap(), options);
        for bad in ["3", "3x", "0x4", "-1x3", "3x4x5", "infx2", "NaNx1", ""] {
            assert!(SheetSize::read(bad).is_err(), "{bad}");
        }
    }
}
