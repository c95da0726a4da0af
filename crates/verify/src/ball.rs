//! The smallest ball around some points, whose diameter is the size of a model.

use glam::DVec3;

/// How far, relative to the radius, a point may stand out of a ball that counts as around it.
const ROUNDING: f64 = 1e-14;
/// Rounds after which the ball is taken as it is; a handful is usual.
const MOST_ROUNDS: usize = 1000;

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ball {
    /// Its centre.
    pub(crate) center: DVec3,
    /// Its radius.
    pub(crate) radius: f64,
}

impl Ball {
    /// The smallest ball around some points; `None` without any.
    ///
    /// Whoever stands out most joins a short list, and the ball around that list is found by taking
    /// its points in turn onto the sphere (Welzl 1991, with the last one that stood out moved to
    /// the front).
    pub(crate) fn around(points: impl Iterator<Item = DVec3>) -> Option<Self> {
        let points: Vec<DVec3> = points.collect();
        let first = *points.first()?;
        let mut list = vec![DVec3::ZERO];
        let mut ball = Self { center: DVec3::ZERO, radius: 0.0 };
        for _ in 0..MOST_ROUNDS {
            let far = |p: &DVec3| (*p - first).distance(ball.center);
            let out = points.iter().copied().max_by(|p, q| far(p).total_cmp(&far(q)))?;
            if !(far(&out) > ball.radius * (1.0 + ROUNDING)) {
                break;
            }
            list.insert(0, out - first);
            let count = list.len();
            let grown = around(&mut list, count, Sphere::default()).ball();
            if !(grown.radius > ball.radius) {
                break;
            }
            ball = grown;
        }
        Some(Self { center: first + ball.center, ..ball })
    }
}

/// Diameter of the smallest ball around some points, if it is not zero.
pub(crate) fn diameter(points: impl Iterator<Item = DVec3>) -> Option<f64> {
    Ball::around(points).map(|ball| 2.0 * ball.radius).filter(|d| *d > 0.0)
}

/// The smallest ball around the first `count` of the list that has the points of `sphere` on it.
fn around(list: &mut [DVec3], count: usize, sphere: Sphere) -> Sphere {
    let mut best = sphere;
    if sphere.count == 4 {
        return best;
    }
    for k in 0..count {
        if best.holds(list[k]) {
            continue;
        }
        // A point that is in the flat of the others to rounding is on their sphere as well.
        let Some(next) = sphere.through(list[k]) else { continue };
        best = around(list, k, next);
        list[..=k].rotate_right(1);
    }
    best
}

/// The smallest sphere through up to four points.
#[derive(Clone, Copy, Debug, Default)]
struct Sphere {
    count: usize,
    first: DVec3,
    center: DVec3,
    /// Square of the radius.
    square: f64,
    /// Orthogonal directions that span the points from the first on.
    span: [DVec3; 3],
}

impl Sphere {
    fn holds(&self, point: DVec3) -> bool {
        self.count > 0
            && point.distance_squared(self.center) <= self.square * (1.0 + 2.0 * ROUNDING)
    }

    /// Of all centres as far from the points so far, the one as far from this point too: along the
    /// part of it that is new.
    fn through(&self, point: DVec3) -> Option<Self> {
        if self.count == 0 {
            return Some(Self { count: 1, first: point, center: point, ..*self });
        }
        let from_first = point - self.first;
        let known = &self.span[..self.count - 1];
        let within = |d: DVec3| d.length_squared().max(f64::MIN_POSITIVE);
        let new = known.iter().fold(from_first, |p, d| p - p.dot(*d) / within(*d) * *d);
        if !(new.length_squared() > 1e-24 * from_first.length_squared()) {
            return None;
        }
        let beyond = point.distance_squared(self.center) - self.square;
        let share = beyond / (2.0 * new.length_squared());
        let mut next = *self;
        next.span[self.count - 1] = new;
        next.center += share * new;
        next.square += 0.5 * beyond * share;
        next.count += 1;
        Some(next)
    }

    fn ball(&self) -> Ball {
        Ball { center: self.center, radius: self.square.max(0.0).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_of_few_points_are_known() {
        let of = |list: &[[f64; 3]]| Ball::around(list.iter().map(|p| DVec3::from_array(*p)));
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[[1.0, 2.0, 3.0]; 3]).unwrap().radius, 0.0);
        // Of an obtuse triangle the long side counts, of an equilateral one the circle.
        let obtuse = of(&[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [2.0, 1.0, 0.0]]).unwrap();
        assert!((obtuse.radius - 2.0).abs() < 1e-15);
        let h = 0.75_f64.sqrt();
        let equal = of(&[[0.0, 0.0, 7.0], [1.0, 0.0, 7.0], [0.5, h, 7.0]]).unwrap();
        assert!((equal.radius - 1.0 / 3.0_f64.sqrt()).abs() < 1e-15);
        // A cube far away, and its eight corners are on one sphere.
        let far = 1e6;
        let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2].map(|x| x as f64 + far);
        let cube = of(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
        assert!((cube.radius - h).abs() < 1e-14);
        assert!(cube.center.distance(DVec3::splat(far + 0.5)) < 1e-9);
    }

    #[test]
    fn many_points_are_inside_and_four_at_most_hold_the_ball() {
        let part = |k: usize, step: f64| (k as f64 * step).fract();
        let point =
            |k: usize| DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_84));
        let points: Vec<DVec3> = (1..3000).map(point).collect();
        let ball = Ball::around(points.iter().copied()).unwrap();
        let far: Vec<f64> = points.iter().map(|p| p.distance(ball.center)).collect();
        assert!(far.iter().all(|d| *d <= ball.radius * (1.0 + 1e-13)));
        let on = (0..points.len()).filter(|k| far[*k] > ball.radius * (1.0 - 1e-9));
        let on: Vec<DVec3> = on.map(|k| points[k]).collect();
        assert!((2..=4).contains(&on.len()));
        // It is the smallest: from the centre its points are on all sides, so no move helps.
        for k in 0..200 {
            let step = 1e-4 * (point(7 * k + 1) - DVec3::splat(0.5));
            let there = on.iter().map(|p| p.distance(ball.center + step)).fold(0.0, f64::max);
            assert!(there >= ball.radius * (1.0 - 1e-15), "{k}");
        }
    }
}
