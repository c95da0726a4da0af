//! Panels on their molds.

use crate::layout::panels::{PanelSet, Pose};
use crate::mold::prices::PriceList;
use crate::mold::shape::Mold;
use crate::seam::measure::{Measures, measure};
use crate::search::attempt::Found;
use geom_core::DVec3;

/// Panels on their molds; lengths in model units.
///
/// # Example
/// ```
/// use paneling::{Counts, MoldType, Options, Price, PriceList, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let panels = Some(Counts { u: 4, v: 3 });
/// let options = Options { panels, molds: Some(3), ..Options::default() };
/// let paneling = solve(&surface, &options, &mut ())?.result;
/// let prices = PriceList::new([(MoldType::Cubic, Price { mold: 900.0, panel: 45.0 })]);
/// assert_eq!(paneling.cost(&prices), 3.0 * 900.0 + 12.0 * 45.0);
/// # Ok::<(), paneling::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Paneling {
    /// The molds.
    pub molds: Vec<Mold>,
    /// The mold of each panel.
    pub labels: Vec<usize>,
    /// Where the mold's frame stands for each panel.
    pub poses: Vec<Pose>,
    /// Kinks, gaps and deviations.
    pub measures: Measures,
    /// Energy after each round of the alternation (squared heights in panel sizes and weighted
    /// squared slopes, summed over samples).
    pub fit_history: Vec<f64>,
    /// Energy of the joint seam step at its start and after each step.
    pub seam_history: Vec<f64>,
}

impl Paneling {
    /// Turns a fit in units of the panel size into model units and measures it.
    pub(crate) fn new(set: &PanelSet, found: Found) -> Self {
        let Found { fit, fit_history, seam_history, .. } = found;
        let molds: Vec<Mold> = fit.molds.iter().map(|m| m.scaled(set.size)).collect();
        let poses: Vec<Pose> = fit
            .poses
            .iter()
            .map(|p| Pose { origin: p.origin * set.size, rotation: p.rotation })
            .collect();
        let measures = measure(set, &molds, &fit.labels, &poses);
        Self { molds, labels: fit.labels, poses, measures, fit_history, seam_history }
    }

    /// The same panels somewhere else.
    pub(crate) fn translated(mut self, by: DVec3) -> Self {
        self.poses.iter_mut().for_each(|pose| pose.origin += by);
        self
    }

    /// Total cost of molds and panels.
    #[must_use]
    pub fn cost(&self, prices: &PriceList) -> f64 {
        let mut counts = vec![0; self.molds.len()];
        self.labels.iter().for_each(|&m| counts[m] += 1);
        self.molds.iter().zip(counts).map(|(m, n)| prices.cost(m.kind, n)).sum()
    }

    /// Rounds of the alternation and seam steps.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.fit_history.len() + self.seam_history.len().saturating_sub(1)
    }
}
