//! Curvatures of a whole surface in a few numbers.

use crate::bounding_box::BoundingBox;
use glam::DVec3;

/// Extremes and mean size of a quantity over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueRange {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Area-weighted mean of the absolute value.
    pub mean_abs: f64,
}

/// Area, extent and curvatures of a surface or mesh, gathered sample by sample.
///
/// # Example
/// ```
/// use geom_core::{CurvatureStatistics, DVec3};
/// let mut cylinder = CurvatureStatistics::default(); // of radius 2
/// cylinder.add_area(3.0);
/// cylinder.add(DVec3::X, 3.0, 0.25, 0.0);
/// assert_eq!(cylinder.mean_curvature().unwrap().max, 0.25);
/// assert_eq!(cylinder.principal_curvature().unwrap().max, 0.5);
/// assert_eq!(cylinder.principal_curvature().unwrap().mean_abs, 0.25);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurvatureStatistics {
    /// Area of the surface.
    pub area: f64,
    /// Samples with curvatures.
    pub samples: usize,
    /// Points where the surface is singular and has no curvature.
    pub singular: usize,
    /// Box around all points.
    pub bounding_box: Option<BoundingBox>,
    weight: f64,
    mean: Option<ValueRange>,
    gaussian: Option<ValueRange>,
    principal: Option<ValueRange>,
}

impl CurvatureStatistics {
    /// Widens the bounding box.
    pub fn add_point(&mut self, point: DVec3) {
        self.bounding_box = match self.bounding_box {
            Some(bounds) => Some(bounds.including(point)),
            None => BoundingBox::of([point]),
        };
    }

    /// The same statistics of a model that stands elsewhere.
    #[must_use]
    pub fn moved(self, by: DVec3) -> Self {
        let moved = |b: BoundingBox| BoundingBox { min: b.min + by, max: b.max + by };
        Self { bounding_box: self.bounding_box.map(moved), ..self }
    }

    /// Adds area that may or may not have curvatures.
    pub fn add_area(&mut self, area: f64) {
        self.area += area;
    }

    /// Adds mean curvature `h` and Gaussian curvature `k` at a point that stands for `weight` of
    /// area; a weight of 0 only extends the ranges. The principal curvatures are
    /// `h ± sqrt(h² − k)`.
    pub fn add(&mut self, point: DVec3, weight: f64, h: f64, k: f64) {
        self.add_point(point);
        self.samples += 1;
        self.weight += weight;
        let half = (h * h - k).max(0.0).sqrt();
        widen(&mut self.mean, h, h, weight * h.abs());
        widen(&mut self.gaussian, k, k, weight * k.abs());
        let sizes = 0.5 * ((h + half).abs() + (h - half).abs());
        widen(&mut self.principal, h - half, h + half, weight * sizes);
    }

    /// A point without curvature.
    pub fn add_singular(&mut self, point: DVec3) {
        self.add_point(point);
        self.singular += 1;
    }

    /// Adds the samples of another surface.
    ///
    /// # Example
    /// ```
    /// use geom_core::{CurvatureStatistics, DVec3};
    /// let patch = |area: f64, h: f64| {
    ///     let mut patch = CurvatureStatistics::default();
    ///     patch.add_area(area);
    ///     patch.add(DVec3::ZERO, area, h, h * h);
    ///     patch
    /// };
    /// let mut both = patch(1.0, -1.0); // of two spheres
    /// both.merge(&patch(3.0, -0.5));
    /// let h = both.mean_curvature().expect("samples");
    /// assert_eq!((both.area, h.min, h.max, h.mean_abs), (4.0, -1.0, -0.5, 0.625));
    /// ```
    pub fn merge(&mut self, other: &Self) {
        self.area += other.area;
        self.samples += other.samples;
        self.singular += other.singular;
        self.weight += other.weight;
        if let Some(bounds) = other.bounding_box {
            self.add_point(bounds.min);
            self.add_point(bounds.max);
        }
        for (own, other) in [
            (&mut self.mean, other.mean),
            (&mut self.gaussian, other.gaussian),
            (&mut self.principal, other.principal),
        ] {
            if let Some(range) = other {
                widen(own, range.min, range.max, range.mean_abs);
            }
        }
    }

    /// Mean curvature in 1/length, `None` without samples.
    #[must_use]
    pub fn mean_curvature(&self) -> Option<ValueRange> {
        self.finished(self.mean)
    }

    /// Gaussian curvature in 1/length², `None` without samples.
    #[must_use]
    pub fn gaussian_curvature(&self) -> Option<ValueRange> {
        self.finished(self.gaussian)
    }

    /// Both principal curvatures together in 1/length, `None` without samples.
    #[must_use]
    pub fn principal_curvature(&self) -> Option<ValueRange> {
        self.finished(self.principal)
    }

    /// While gathering, `mean_abs` holds the weighted sum.
    fn finished(&self, range: Option<ValueRange>) -> Option<ValueRange> {
        let mean = |sum: f64| if self.weight > 0.0 { sum / self.weight } else { f64::NAN };
        range.map(|r| ValueRange { mean_abs: mean(r.mean_abs), ..r })
    }
}

fn widen(range: &mut Option<ValueRange>, low: f64, high: f64, sum: f64) {
    *range = Some(match *range {
        None => ValueRange { min: low, max: high, mean_abs: sum },
        Some(r) => {
            ValueRange { min: r.min.min(low), max: r.max.max(high), mean_abs: r.mean_abs + sum }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    #[test]
    fn merging_is_adding_one_after_the_other() {
        let samples = [(1.0, -0.5, -2.0), (3.0, 0.25, 0.0625), (0.0, 1.0, 0.5), (2.0, 0.0, -1.0)];
        let mut all = CurvatureStatistics::default();
        let mut parts = [CurvatureStatistics::default(), CurvatureStatistics::default()];
        for (i, (weight, h, k)) in samples.into_iter().enumerate() {
            let point = DVec3::splat(i as f64);
            for target in [&mut all, &mut parts[i % 2]] {
                target.add(point, weight, h, k);
                target.add_area(weight);
            }
        }
        let [mut merged, second] = parts;
        merged.merge(&second);
        assert_eq!(merged.gaussian_curvature(), all.gaussian_curvature());
        assert_eq!((merged.area, merged.samples), (all.area, all.samples));
        assert_eq!(merged.bounding_box, all.bounding_box);
        let want = (1.0 * 0.5 + 3.0 * 0.25) / 6.0;
        assert_close(all.mean_curvature().unwrap().mean_abs, want, 1e-15);
        assert_eq!(CurvatureStatistics::default().mean_curvature(), None);
    }
}
