//! Plain data of the plots and tables next to the surface.

use glam::DVec3;

/// How a measure is spread, for one or more series side by side.
///
/// ```
/// use report::{Histogram, Series};
/// let kinks = Histogram {
///     id: "kinks".into(),
///     title: "Kinks along seams".into(),
///     quantity: "kink".into(),
///     unit: "°".into(),
///     series: vec![
///         Series { name: "before".into(), values: vec![0.1, 0.2, 0.4] },
///         Series { name: "after".into(), values: vec![0.02, 0.03, 0.05] },
///     ],
///     tolerance: Some(0.1),
/// };
/// let report = report::Report { histograms: vec![kinks], ..report::Report::new("Panels", "") };
/// assert!(report.to_html().contains("Kinks along seams"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Short name, used in file names.
    pub id: String,
    /// Heading.
    pub title: String,
    /// What is measured, named on the axis.
    pub quantity: String,
    /// Unit; empty if there is none.
    pub unit: String,
    /// The measured values, one list per series.
    pub series: Vec<Series>,
    /// A bound to draw and count against, in the unit of the values.
    pub tolerance: Option<f64>,
}

/// Named values of one histogram series; values that are not finite are counted apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// The values in any order.
    pub values: Vec<f64>,
}

/// Energy of every term at every iteration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnergyHistory {
    /// Terms with their value before the first iteration and after each; NaN where a term does not
    /// exist.
    pub terms: Vec<Series>,
    /// Where something changed, such as a new resolution: iteration and its name.
    pub marks: Vec<(usize, String)>,
}

/// The worst seams, each with a place to look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeamTable {
    /// Heading; the report writes `Worst seams` if it is empty.
    pub title: String,
    /// Names of the measures with their units, such as `kink [°]`.
    pub columns: Vec<String>,
    /// Bound of each column, if it has one; values beyond it are marked.
    pub tolerances: Vec<Option<f64>>,
    /// The seams, worst first.
    pub rows: Vec<Seam>,
}

/// One row of a [`SeamTable`].
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Name, such as `panel 12 – panel 13`.
    pub label: String,
    /// Name of the view it lies on; the first view if empty.
    pub stage: String,
    /// Where it is worst, in model units.
    pub location: DVec3,
    /// How much of the model to show around it, in model units.
    pub size: f64,
    /// The seam itself, drawn when the row is chosen; may be empty.
    pub path: Vec<DVec3>,
    /// One value per column.
    pub values: Vec<f64>,
}

/// A curve drawn over the curvature diagram, such as the relation that was aimed at.
#[derive(Clone, Debug, PartialEq)]
pub struct RelationCurve {
    /// Name in the legend.
    pub name: String,
    /// Points `[H, K]` in the order they are joined.
    pub points: Vec<[f64; 2]>,
}
