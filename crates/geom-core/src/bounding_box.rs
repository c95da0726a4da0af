//! Axis-parallel boxes.

use glam::DVec3;

/// The smallest axis-parallel box around some points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBox {
    /// The corner with the smallest coordinates.
    pub min: DVec3,
    /// The corner with the largest coordinates.
    pub max: DVec3,
}

impl BoundingBox {
    /// The box around `points`; `None` if there are none.
    ///
    /// # Example
    /// ```
    /// use geom_core::{BoundingBox, DVec3};
    /// let bounds = BoundingBox::of([DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0)]).unwrap();
    /// assert_eq!(bounds.diagonal(), 5.0);
    /// ```
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        points.into_iter().fold(None, |bounds: Option<Self>, p| {
            Some(bounds.map_or(Self { min: p, max: p }, |b| b.including(p)))
        })
    }

    /// The box grown to hold `point`.
    ///
    /// # Example
    /// ```
    /// use geom_core::{BoundingBox, DVec3};
    /// let point = BoundingBox { min: DVec3::ONE, max: DVec3::ONE };
    /// let grown = point.including(DVec3::new(0.0, 3.0, 1.0));
    /// assert_eq!(grown.size(), DVec3::new(1.0, 2.0, 0.0));
    /// assert_eq!(grown.center(), DVec3::new(0.5, 2.0, 1.0));
    /// ```
    #[must_use]
    pub fn including(self, point: DVec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// Edge lengths.
    #[must_use]
    pub fn size(self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal: the measure "in percent of the model" refers to.
    #[must_use]
    pub fn diagonal(self) -> f64 {
        self.size().length()
    }

    /// The middle.
    #[must_use]
    pub fn center(self) -> DVec3 {
        0.5 * (self.min + self.max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_of_nothing_is_none_and_of_points_is_tight() {
        assert_eq!(BoundingBox::of([]), None);
        let points = [DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 5.0, 3.5)];
        let bounds = BoundingBox::of(points).unwrap();
        assert_eq!(bounds.min, DVec3::new(-1.0, -2.0, 3.0));
        assert_eq!(bounds.max, DVec3::new(1.0, 5.0, 3.5));
        assert_eq!(bounds.center(), DVec3::new(0.0, 1.5, 3.25));
        assert_eq!(bounds.size(), DVec3::new(2.0, 7.0, 0.5));
    }
}
