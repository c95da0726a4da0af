//! Kinks and gaps along the seams, and the deviation from the design.

use crate::fit::residuals::foot;
use crate::layout::panels::{PanelSet, Pose, SEAM_SAMPLES};
use crate::mold::shape::Mold;
use rayon::prelude::*;

/// Kinks and gaps at the sample points of one seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamMeasure {
    /// The two panels that meet.
    pub panels: [usize; 2],
    /// Angles between the normals of the two molds, in radians.
    pub kinks: [f64; SEAM_SAMPLES],
    /// Differences of the offsets of the two molds along the normal of the design.
    pub gaps: [f64; SEAM_SAMPLES],
}

impl SeamMeasure {
    /// The largest kink, in radians.
    #[must_use]
    pub fn max_kink(&self) -> f64 {
        self.kinks.iter().copied().fold(0.0, f64::max)
    }

    /// The largest gap.
    #[must_use]
    pub fn max_gap(&self) -> f64 {
        self.gaps.iter().copied().fold(0.0, f64::max)
    }
}

/// Median, 95th percentile and maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Half of the values are at most this.
    pub median: f64,
    /// 95 % of the values are at most this.
    pub p95: f64,
    /// The largest value.
    pub max: f64,
    /// Root mean square: no value can change without it.
    pub rms: f64,
}

impl Spread {
    /// The spread of some values; zero if there are none. Between two values the percentile is
    /// interpolated linearly.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * values.len().saturating_sub(1) as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            match (values.get(low), values.get(low + 1)) {
                (Some(a), Some(b)) => a + part * (b - a),
                (Some(a), None) => *a,
                _ => 0.0,
            }
        };
        let squares: f64 = values.iter().map(|x| x * x).sum();
        let rms = (squares / values.len().max(1) as f64).sqrt();
        Self { median: at(0.5), p95: at(0.95), max: at(1.0), rms }
    }
}

/// How well the panels meet and follow the design; lengths in model units, angles in radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Measures {
    /// Every seam between two panels.
    pub seams: Vec<SeamMeasure>,
    /// Kinks over all samples of all seams.
    pub kinks: Spread,
    /// Gaps over all samples of all seams.
    pub gaps: Spread,
    /// The largest distance of each panel from the design, along the design's normal.
    pub deviations: Vec<f64>,
    /// Root mean square of that distance over all samples of all panels.
    pub deviation_rms: f64,
}

impl Measures {
    /// The largest distance of any panel from the design.
    #[must_use]
    pub fn max_deviation(&self) -> f64 {
        self.deviations.iter().copied().fold(0.0, f64::max)
    }

    /// The `count` seams with the largest kinks, worst first.
    #[must_use]
    pub fn worst_kinks(&self, count: usize) -> Vec<usize> {
        self.worst(count, SeamMeasure::max_kink)
    }

    /// The `count` seams with the largest gaps, worst first.
    #[must_use]
    pub fn worst_gaps(&self, count: usize) -> Vec<usize> {
        self.worst(count, SeamMeasure::max_gap)
    }

    fn worst(&self, count: usize, key: fn(&SeamMeasure) -> f64) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.seams.len()).collect();
        // The index breaks ties, so that the order is always the same.
        order.sort_by(|&a, &b| key(&self.seams[b]).total_cmp(&key(&self.seams[a])).then(a.cmp(&b)));
        order.truncate(count);
        order
    }

    /// Largest kink and gap of the seams around each panel.
    #[must_use]
    pub fn worst_of_panels(&self) -> Vec<[f64; 2]> {
        let mut worst = vec![[0.0_f64; 2]; self.deviations.len()];
        for seam in &self.seams {
            for p in seam.panels {
                worst[p][0] = worst[p][0].max(seam.max_kink());
                worst[p][1] = worst[p][1].max(seam.max_gap());
            }
        }
        worst
    }
}

/// Measures panels on their molds, all lengths in one unit.
pub(crate) fn measure(
    set: &PanelSet,
    molds: &[Mold],
    labels: &[usize],
    poses: &[Pose],
) -> Measures {
    let seams: Vec<SeamMeasure> = set
        .seams
        .par_iter()
        .with_min_len(64)
        .map(|seam| {
            let (points, normals) = set.edge_samples(seam.edge);
            let mut measure =
                SeamMeasure { panels: seam.panels, kinks: [0.0; 5], gaps: [0.0; SEAM_SAMPLES] };
            for k in 0..SEAM_SAMPLES {
                let [a, b] = seam.panels.map(|p| {
                    let to_local = poses[p].rotation.transpose();
                    let local = to_local * (points[k] - poses[p].origin);
                    let (t, m) = foot(&molds[labels[p]], local, to_local * normals[k]);
                    (t, poses[p].rotation * m)
                });
                measure.gaps[k] = reached((a.0 - b.0).abs());
                measure.kinks[k] = reached(a.1.cross(b.1).length().atan2(a.1.dot(b.1)));
            }
            measure
        })
        .collect();
    let offsets: Vec<[f64; 3]> = (0..set.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|p| {
            let (points, normals) = set.panel_samples(p);
            let to_local = poses[p].rotation.transpose();
            let offset = |(x, n): (&glam::DVec3, &glam::DVec3)| {
                let local = to_local * (*x - poses[p].origin);
                reached(foot(&molds[labels[p]], local, to_local * *n).0.abs())
            };
            let all = points.iter().zip(normals).map(offset);
            all.fold([0.0, 0.0, 0.0], |[most, squares, count]: [f64; 3], t| {
                [most.max(t), squares + t * t, count + 1.0]
            })
        })
        .collect();
    let kinks = Spread::of(seams.iter().flat_map(|s| s.kinks).collect());
    let gaps = Spread::of(seams.iter().flat_map(|s| s.gaps).collect());
    let deviations = offsets.iter().map(|[most, ..]| *most).collect();
    let sum = |k: usize| offsets.iter().map(|o| o[k]).sum::<f64>();
    let deviation_rms = (sum(1) / sum(2).max(1.0)).sqrt();
    Measures { seams, kinks, gaps, deviations, deviation_rms }
}

/// Largest angle to the design and largest offset from it along the border of a panel, and the
/// largest offset anywhere.
pub(crate) fn own_deviation(set: &PanelSet, mold: &Mold, pose: &Pose, p: usize) -> [f64; 3] {
    let (points, normals) = set.panel_samples(p);
    let to_local = pose.rotation.transpose();
    let border = set.border(p).len();
    let mut worst = [0.0_f64; 3];
    for (k, (x, n)) in points.iter().zip(normals).enumerate() {
        let n = to_local * *n;
        let (t, m) = foot(mold, to_local * (*x - pose.origin), n);
        let offset = reached(t.abs());
        worst[2] = worst[2].max(offset);
        if k < border {
            worst[0] = worst[0].max(reached(m.cross(n).length().atan2(m.dot(n))));
            worst[1] = worst[1].max(offset);
        }
    }
    worst
}

/// NaN, beyond the reach of a round mold, counts as infinitely bad.
fn reached(value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate() {
        let spread = Spread::of(vec![4.0, 1.0, 3.0, 2.0]);
        assert_eq!((spread.median, spread.max), (2.5, 4.0));
        geom_core::assert_close(spread.p95, 3.85, 1e-15);
        assert_eq!(Spread::of(vec![]), Spread::default());
    }
}
