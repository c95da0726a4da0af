//! How far a panel on its mold is from the design, in shares of the bounds.

use crate::layout::panels::Pose;
use crate::mold::shape::Mold;
use crate::seam::measure::own_deviation;
use crate::search::bounds::Bounds;
use crate::search::site::Site;

/// How many times a panel exceeds half of the bounds of the seams against the design, and how many
/// times the bound on its distance from the design.
pub(crate) fn strains(
    site: &Site<'_>,
    bounds: &Bounds,
    mold: &Mold,
    pose: &Pose,
    p: usize,
) -> [f64; 2] {
    let [kink, gap, deviation] = own_deviation(&site.set, mold, pose, p);
    [2.0 * bounds.excess(kink, gap), bounds.design_excess(deviation)]
}

/// The larger of the two.
pub(crate) fn strain(site: &Site<'_>, bounds: &Bounds, mold: &Mold, pose: &Pose, p: usize) -> f64 {
    let [seams, design] = strains(site, bounds, mold, pose, p);
    seams.max(design)
}
