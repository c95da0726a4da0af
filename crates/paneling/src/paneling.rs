//! Panels on their molds.

use crate::fit::state::members_of;
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::prices::PriceList;
use crate::mold::shape::{Mold, blank};
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
/// let solution = solve(&surface, &options, &mut ())?;
/// let (paneling, panels) = (&solution.result, &solution.panels);
/// let area: f64 = paneling.blanks(panels).iter().sum();
/// let price = Price { mold: 900.0, panel: 45.0, area: 20.0 };
/// let prices = PriceList::new([(MoldType::Cubic, price)]);
/// let cost = 3.0 * 900.0 + 12.0 * 45.0 + 20.0 * area;
/// assert!((paneling.cost(panels, &prices) - cost).abs() < 1e-9 * cost);
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

    /// Total cost of molds, their blanks and panels.
    #[must_use]
    pub fn cost(&self, set: &PanelSet, prices: &PriceList) -> f64 {
        let members = members_of(&self.labels, self.molds.len());
        let molds = self.molds.iter().zip(members).zip(self.blanks(set));
        molds.map(|((m, panels), area)| prices.cost(m.kind, panels.len(), area)).sum()
    }

    /// The area of each mold: of the rectangle around its panels in its frame.
    #[must_use]
    pub fn blanks(&self, set: &PanelSet) -> Vec<f64> {
        let of = |panels: &Vec<usize>| {
            blank(
                panels
                    .iter()
                    .flat_map(|&p| set.border(p).iter().map(move |x| self.poses[p].to_local(*x))),
            )
        };
        members_of(&self.labels, self.molds.len()).iter().map(of).collect()
    }

    /// Rounds of the alternation and seam steps.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.fit_history.len() + self.seam_history.len().saturating_sub(1)
    }
}
