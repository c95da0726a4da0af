//! From a set of panels to molds, poses and measures.

use crate::error::PanelingError;
use crate::fit::clustering::{self, Clusters, DiagramAxis, Feature};
use crate::fit::state::Fit;
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::prices::PriceList;
use crate::mold::shape::{Mold, MoldType};
use crate::seam::measure::{Measures, measure};
use crate::seam::step as seam_step;
use crate::seam::system::SeamOptions;

/// How panels are grouped by mold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clustering {
    /// k-means in the space of panel shapes; uses exactly the wanted number of molds.
    #[default]
    Own,
    /// The published grid over the curvature diagram; uses at most the wanted number.
    Grid(DiagramAxis),
    /// Greedy covering as in the assignment of Eigensatz et al. 2010, restricted to one type of
    /// mold: the fewest shapes that are near enough to every panel, where "near enough" is as
    /// tight as the wanted number of molds allows.
    Cover,
}

/// Settings of a paneling.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How panels are grouped.
    pub clustering: Clustering,
    /// Number of molds.
    pub molds: usize,
    /// The type of all molds.
    pub mold_type: MoldType,
    /// Weight of a slope difference in radians against a height difference in panel sizes.
    pub slope_weight: f64,
    /// Most rounds of the alternation of molds and poses; it ends earlier when a round lowers the
    /// energy by less than 0.2 %.
    pub rounds: usize,
    /// Most Gauss-Newton steps of the joint seam step; 0 leaves it out.
    pub seam_steps: usize,
}

impl Options {
    /// The defaults with this number of molds.
    #[must_use]
    pub fn with_molds(molds: usize) -> Self {
        Self {
            clustering: Clustering::Own,
            molds,
            mold_type: MoldType::Cubic,
            slope_weight: 0.5,
            rounds: 30,
            seam_steps: 40,
        }
    }

    pub(crate) fn seam_settings(&self) -> SeamOptions {
        SeamOptions {
            steps: self.seam_steps,
            gap_weight: 1.0,
            design_weight: 0.1,
            stall: SEAM_STALL,
        }
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

/// Panels on their molds; lengths in model units.
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
    /// Total cost of molds and panels.
    #[must_use]
    pub fn cost(&self, prices: &PriceList) -> f64 {
        let mut counts = vec![0; self.molds.len()];
        self.labels.iter().for_each(|&m| counts[m] += 1);
        self.molds.iter().zip(counts).map(|(m, n)| prices.cost(m.kind, n)).sum()
    }

    /// Whether the last phase ended because its last step lowered the energy by less than its
    /// stop rule asks, and not because its steps were used up.
    #[must_use]
    pub fn has_settled(&self) -> bool {
        let (history, stall) = if self.seam_history.is_empty() {
            (&self.fit_history, crate::fit::alternation::STALL)
        } else {
            (&self.seam_history, SEAM_STALL)
        };
        match history[..] {
            [.., before, after] => after >= (1.0 - stall) * before,
            _ => true,
        }
    }
}

/// A seam step that lowers the energy by less than this share is the last.
const SEAM_STALL: f64 = 3e-2;

/// Clusters the panels, fits molds and poses, and measures the result.
///
/// # Errors
/// [`PanelingError::MoldCount`] if the number of molds is zero or above that of the panels,
/// [`PanelingError::BadOption`] for a slope weight that is not positive.
pub fn panel(set: &PanelSet, options: &Options) -> Result<Paneling, PanelingError> {
    let (molds, panels) = (options.molds, set.len());
    if molds == 0 || molds > panels {
        return Err(PanelingError::MoldCount { molds, panels });
    }
    if !(options.slope_weight > 0.0 && options.slope_weight.is_finite()) {
        let (name, value) = ("slope weight", options.slope_weight);
        return Err(PanelingError::BadOption { name, value });
    }
    let scaled = set.scaled(1.0 / set.size);
    let features = match options.clustering {
        Clustering::Grid(_) => Vec::new(),
        Clustering::Own | Clustering::Cover => clustering::features(&scaled, options.slope_weight),
    };
    let clusters = cluster(set, &features, options);
    let kinds = vec![options.mold_type; clusters.count];
    let mut fit = Fit::new(&scaled, &clusters, &kinds, options.slope_weight);
    let fit_history = fit.alternate(&scaled, options.rounds);
    let mut seam_history = Vec::new();
    if options.seam_steps > 0 {
        let weights = vec![1.0; scaled.seams.len()];
        seam_history = seam_step::improve(&scaled, &mut fit, &options.seam_settings(), &weights);
    }
    Ok(finish(set, fit, fit_history, seam_history))
}

/// Groups the panels as the options say.
pub(crate) fn cluster(set: &PanelSet, features: &[Feature], options: &Options) -> Clusters {
    match options.clustering {
        Clustering::Own => clustering::shapes(features, options.molds, 20),
        Clustering::Cover => clustering::cover(features, options.molds),
        Clustering::Grid(axis) => clustering::grid(set.curvatures(), options.molds, axis),
    }
}

/// Turns a fit in units of the panel size into model units and measures it.
pub(crate) fn finish(
    set: &PanelSet,
    fit: Fit,
    fit_history: Vec<f64>,
    seam_history: Vec<f64>,
) -> Paneling {
    let molds: Vec<Mold> = fit.molds.iter().map(|m| m.scaled(set.size)).collect();
    let poses: Vec<Pose> = fit
        .poses
        .iter()
        .map(|p| Pose { origin: p.origin * set.size, rotation: p.rotation })
        .collect();
    let measures = measure(set, &molds, &fit.labels, &poses);
    Paneling { molds, labels: fit.labels, poses, measures, fit_history, seam_history }
}
