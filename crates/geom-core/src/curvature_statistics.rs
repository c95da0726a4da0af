//! Curvatures of a whole surface in a few numbers.

use crate::bounding_box::BoundingBox;
use crate::spread::Spread;
use glam::DVec3;

/// Shares of the area below [`ValueRange::low`] and [`ValueRange::high`].
const SHARES: [f64; 2] = [0.01, 0.99];

/// Extremes and mean size of a quantity over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueRange {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Where the smallest value was met first.
    pub min_at: DVec3,
    /// Where the largest value was met first.
    pub max_at: DVec3,
    /// On 1 % of the area the value is lower than this.
    pub low: f64,
    /// On 1 % of the area the value is higher than this.
    ///
    /// Both are exact for up to a million samples; beyond, they have as many leading digits as
    /// half a million different values allow.
    pub high: f64,
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
    /// Area those points stand for.
    pub singular_area: f64,
    /// Box around all points.
    pub bounding_box: Option<BoundingBox>,
    weight: f64,
    mean: Option<Gathered>,
    gaussian: Option<Gathered>,
    principal: Option<Gathered>,
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
        let gathered = |g: Option<Gathered>| g.map(|g| g.moved(by));
        Self {
            bounding_box: self.bounding_box.map(moved),
            mean: gathered(self.mean),
            gaussian: gathered(self.gaussian),
            principal: gathered(self.principal),
            ..self
        }
    }

    /// Adds area that may or may not have curvatures.
    pub fn add_area(&mut self, area: f64) {
        self.area += area;
    }

    /// Adds mean curvature `h` and Gaussian curvature `k` at a point that stands for `weight` of
    /// area; a weight of 0 only extends the ranges. The principal curvatures are
    /// `h ± sqrt(h² − k)`. Values that are not finite make the point singular.
    pub fn add(&mut self, point: DVec3, weight: f64, h: f64, k: f64) {
        let half = (h * h - k).max(0.0).sqrt();
        if !(h.is_finite() && k.is_finite() && half.is_finite()) {
            self.add_singular(point, weight);
            return;
        }
        self.add_point(point);
        self.samples += 1;
        self.weight += weight;
        gather(&mut self.mean, point, weight, &[h], h.abs());
        gather(&mut self.gaussian, point, weight, &[k], k.abs());
        let (low, high) = (h - half, h + half);
        let size = 0.5 * (low.abs() + high.abs());
        gather(&mut self.principal, point, weight, &[low, high], size);
    }

    /// A point without curvature that stands for `weight` of area.
    pub fn add_singular(&mut self, point: DVec3, weight: f64) {
        self.add_point(point);
        self.singular += 1;
        self.singular_area += weight;
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
        self.singular_area += other.singular_area;
        self.weight += other.weight;
        if let Some(bounds) = other.bounding_box {
            self.add_point(bounds.min);
            self.add_point(bounds.max);
        }
        for (own, other) in [
            (&mut self.mean, &other.mean),
            (&mut self.gaussian, &other.gaussian),
            (&mut self.principal, &other.principal),
        ] {
            match (own.as_mut(), other) {
                (Some(own), Some(other)) => own.merge(other),
                (None, Some(_)) => own.clone_from(other),
                (_, None) => {}
            }
        }
    }

    /// Mean curvature in 1/length, `None` without samples.
    #[must_use]
    pub fn mean_curvature(&self) -> Option<ValueRange> {
        self.mean.as_ref().map(|g| g.finished(self.weight))
    }

    /// Gaussian curvature in 1/length², `None` without samples.
    #[must_use]
    pub fn gaussian_curvature(&self) -> Option<ValueRange> {
        self.gaussian.as_ref().map(|g| g.finished(self.weight))
    }

    /// Both principal curvatures together in 1/length, `None` without samples.
    #[must_use]
    pub fn principal_curvature(&self) -> Option<ValueRange> {
        self.principal.as_ref().map(|g| g.finished(self.weight))
    }
}

/// A quantity while it is gathered.
#[derive(Clone, Debug, PartialEq)]
struct Gathered {
    min: (f64, DVec3),
    max: (f64, DVec3),
    /// Of the sizes times their areas.
    sum: f64,
    spread: Spread,
}

/// Adds values at one point, in rising order, with their mean size.
fn gather(to: &mut Option<Gathered>, point: DVec3, weight: f64, values: &[f64], size: f64) {
    let (Some(&low), Some(&high)) = (values.first(), values.last()) else { return };
    let here = Gathered {
        min: (low, point),
        max: (high, point),
        sum: weight * size,
        spread: Spread::default(),
    };
    match to {
        Some(gathered) => gathered.merge(&here),
        None => *to = Some(here),
    }
    if let Some(gathered) = to {
        values.iter().for_each(|x| gathered.spread.add(*x, weight));
    }
}

impl Gathered {
    fn moved(self, by: DVec3) -> Self {
        let moved = |(value, at): (f64, DVec3)| (value, at + by);
        Self { min: moved(self.min), max: moved(self.max), ..self }
    }

    fn merge(&mut self, other: &Self) {
        if other.min.0 < self.min.0 {
            self.min = other.min;
        }
        if other.max.0 > self.max.0 {
            self.max = other.max;
        }
        self.sum += other.sum;
        self.spread.merge(&other.spread);
    }

    fn finished(&self, weight: f64) -> ValueRange {
        let ((min, min_at), (max, max_at)) = (self.min, self.max);
        let [low, high] = self.spread.quantiles(SHARES).unwrap_or([min, max]);
        let mean_abs = if weight > 0.0 { self.sum / weight } else { 0.5 * (min.abs() + max.abs()) };
        let (low, high) = (low.clamp(min, max), high.clamp(min, max));
        ValueRange { min, max, min_at, max_at, low, high, mean_abs }
    }
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
        let range = all.gaussian_curvature().unwrap();
        assert_eq!((range.min_at, range.max_at), (DVec3::splat(0.0), DVec3::splat(2.0)));
        assert_eq!((range.low, range.high), (-2.0, 0.0625));
        assert_eq!((merged.area, merged.samples), (all.area, all.samples));
        assert_eq!(merged.bounding_box, all.bounding_box);
        let want = (1.0 * 0.5 + 3.0 * 0.25) / 6.0;
        assert_close(all.mean_curvature().unwrap().mean_abs, want, 1e-15);
        assert_eq!(CurvatureStatistics::default().mean_curvature(), None);
    }

    #[test]
    fn values_without_meaning_are_no_samples() {
        let mut all = CurvatureStatistics::default();
        all.add(DVec3::X, 1.0, f64::NAN, 1.0);
        all.add(DVec3::X, 1.0, 1e200, -1.0);
        all.add(DVec3::X, 2.0, 0.0, f64::INFINITY);
        assert_eq!((all.samples, all.singular, all.singular_area), (0, 3, 4.0));
    }
}
