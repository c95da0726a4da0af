//! What the joint seam step works on, and how its vectors of unknowns are laid out: the six numbers
//! of every pose, then the seven of every mold.

use crate::fit::residuals::POSE;
use crate::layout::panels::PanelSet;
use crate::mold::shape::MAX_PARAMETERS;

/// What the joint seam step weighs against what, and where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeamOptions {
    /// Most Gauss-Newton steps.
    pub(crate) steps: usize,
    /// Weight of a gap in units of the panel size, against a kink in radians.
    pub(crate) gap_weight: f64,
    /// Weight of the distance to the design against the seams.
    pub(crate) design_weight: f64,
    /// Ends when a step lowers the energy by less than this share.
    pub(crate) stall: f64,
    /// What kinks and gaps beyond their bounds pay besides.
    pub(crate) hinge: Option<Hinge>,
}

/// What kinks and gaps beyond a limit pay besides: `weight` times the square of what is beyond.
/// Where the limits can be kept this vanishes, so that Gauss-Newton steps are good ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hinge {
    /// In radians; infinite where there is no bound.
    pub(crate) kink: f64,
    /// In units of the panel size; infinite where there is no bound.
    pub(crate) gap: f64,
    pub(crate) weight: f64,
}

impl Hinge {
    pub(crate) fn energy(&self, kink: f64, gap: f64) -> f64 {
        let of = |beyond: f64| if beyond > 0.0 { self.weight * beyond * beyond } else { 0.0 };
        of(kink - self.kink) + of(gap - self.gap)
    }
}

/// Factors in the energy of the joint seam step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// One per seam.
    pub(crate) seams: Vec<f64>,
    /// One per panel, of its distance to the design.
    pub(crate) panels: Vec<f64>,
}

impl Weights {
    /// The same for all.
    pub(crate) fn even(set: &PanelSet) -> Self {
        Self { seams: vec![1.0; set.seams.len()], panels: vec![1.0; set.len()] }
    }
}

/// Poses and molds of a vector of unknowns.
pub(crate) fn parts(x: &[f64], panels: usize) -> (&[[f64; POSE]], &[[f64; MAX_PARAMETERS]]) {
    let (poses, molds) = x.split_at(POSE * panels);
    (poses.as_chunks().0, molds.as_chunks().0)
}

/// As [`parts`], to be changed.
pub(crate) fn parts_mut(
    x: &mut [f64],
    panels: usize,
) -> (&mut [[f64; POSE]], &mut [[f64; MAX_PARAMETERS]]) {
    let (poses, molds) = x.split_at_mut(POSE * panels);
    (poses.as_chunks_mut().0, molds.as_chunks_mut().0)
}

/// `aᵀ b`, item by item: poses, then molds. Serial and in order: the same for every number of
/// threads.
pub(crate) fn dot(a: &[f64], b: &[f64], panels: usize) -> f64 {
    fn of<const N: usize>(a: &[[f64; N]], b: &[[f64; N]]) -> f64 {
        let item =
            |(a, b): (&[f64; N], &[f64; N])| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        a.iter().zip(b).map(item).sum()
    }
    let ((poses, molds), (other_poses, other_molds)) = (parts(a, panels), parts(b, panels));
    of(poses, other_poses) + of(molds, other_molds)
}

/// What seam steps work on.
#[derive(Clone, Copy)]
pub(crate) struct Seams<'a> {
    pub(crate) set: &'a PanelSet,
    pub(crate) options: &'a SeamOptions,
    pub(crate) weights: &'a Weights,
    /// As of [`PanelSet::incident_seams`].
    pub(crate) incident: &'a [Vec<(usize, usize)>],
}
