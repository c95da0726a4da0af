//! The numbers a paneling is judged by.

use crate::layout::panels::PanelSet;
use crate::paneling::Paneling;
use serde::Serialize;

/// How well the panels of one paneling meet, in degrees, units of the model, and percent of the
/// size of the design (the diameter of the smallest ball around its check grid); `_box` of the
/// diagonal of the bounding box of all panels, as releases before gave it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Number of panels.
    pub panels: usize,
    /// Number of molds.
    pub molds: usize,
    /// Half of the kinks are at most this.
    pub kink_median_deg: f64,
    /// 95 % of the kinks are at most this.
    pub kink_p95_deg: f64,
    /// The largest kink.
    pub kink_max_deg: f64,
    /// Root mean square of the kinks.
    pub kink_rms_deg: f64,
    /// Half of the gaps are at most this.
    pub gap_median: f64,
    /// 95 % of the gaps are at most this.
    pub gap_p95: f64,
    /// The largest gap.
    pub gap_max: f64,
    /// Root mean square of the gaps.
    pub gap_rms: f64,
    /// [`gap_median`](Self::gap_median) in percent.
    pub gap_median_percent: f64,
    /// [`gap_p95`](Self::gap_p95) in percent.
    pub gap_p95_percent: f64,
    /// [`gap_max`](Self::gap_max) in percent.
    pub gap_max_percent: f64,
    /// The largest distance of any panel from the design, in percent.
    pub deviation_max_percent: f64,
    /// Root mean square of the distances of all samples of the panels from the design, in percent.
    pub deviation_rms_percent: f64,
    /// [`gap_median`](Self::gap_median) in percent of the box.
    pub gap_median_percent_box: f64,
    /// [`gap_p95`](Self::gap_p95) in percent of the box.
    pub gap_p95_percent_box: f64,
    /// [`gap_max`](Self::gap_max) in percent of the box.
    pub gap_max_percent_box: f64,
    /// [`deviation_max_percent`](Self::deviation_max_percent) of the box.
    pub deviation_max_percent_box: f64,
}

impl Quality {
    /// The quality of a paneling of these panels.
    #[must_use]
    pub fn new(set: &PanelSet, paneling: &Paneling) -> Self {
        let (kinks, gaps) = (paneling.measures.kinks, paneling.measures.gaps);
        let percent = |length: f64| 100.0 * length / set.extent();
        let of_box = |length: f64| 100.0 * length / set.diagonal();
        let deviation = paneling.measures.max_deviation();
        Self {
            panels: set.len(),
            molds: paneling.molds.len(),
            kink_median_deg: kinks.median.to_degrees(),
            kink_p95_deg: kinks.p95.to_degrees(),
            kink_max_deg: kinks.max.to_degrees(),
            kink_rms_deg: kinks.rms.to_degrees(),
            gap_median: gaps.median,
            gap_p95: gaps.p95,
            gap_max: gaps.max,
            gap_rms: gaps.rms,
            gap_median_percent: percent(gaps.median),
            gap_p95_percent: percent(gaps.p95),
            gap_max_percent: percent(gaps.max),
            deviation_max_percent: percent(deviation),
            deviation_rms_percent: percent(paneling.measures.deviation_rms),
            gap_median_percent_box: of_box(gaps.median),
            gap_p95_percent_box: of_box(gaps.p95),
            gap_max_percent_box: of_box(gaps.max),
            deviation_max_percent_box: of_box(deviation),
        }
    }
}

/// The numbers of a solution.
///
/// # Example
/// ```
/// use paneling::{Counts, Options, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let panels = Some(Counts { u: 4, v: 3 });
/// let options = Options { panels, molds: Some(3), ..Options::default() };
/// let metrics = solve(&surface, &options, &mut ())?.metrics;
/// // Without prices every mold costs 1 and panels nothing.
/// assert_eq!((metrics.quality.molds, metrics.cost, metrics.worst_excess), (3, 3.0, None));
/// # Ok::<(), paneling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// How well the panels meet.
    #[serde(flatten)]
    pub quality: Quality,
    /// Total cost of molds and panels.
    pub cost: f64,
    /// Total area of the molds, each the rectangle around its panels in its frame.
    pub blank_area: f64,
    /// Total area of the panels, each of the polygon through the samples of its border.
    pub panel_area: f64,
    /// How many times the worst seam or panel exceeds the bounds, at most 1 if all are within; none
    /// without bounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_excess: Option<f64>,
    /// The bound on the distance of every panel from the design, in units of the model; none
    /// without bounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_deviation: Option<f64>,
    /// The published grid clustering with as many molds; none if it is not to be compared with, or
    /// the panels were covered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid: Option<Quality>,
}
