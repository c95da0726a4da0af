//! The smallest ball around some points: the size of a model, however it is turned.

use glam::{DMat3, DVec3};

/// How far, relative to the radius, a point may stand out before the ball has to grow.
const ROUNDING: f64 = 1e-13;
/// Growths after which the ball is taken as it is; a handful is usual.
const MOST_GROWTHS: usize = 1000;

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

impl Ball {
    /// The smallest ball around `points`, to some 1e-13 of its radius; `None` if there are none, or
    /// if a coordinate is not finite.
    ///
    /// The ball is spanned by at most four of the points. Beginning with one that holds some of
    /// them, the point that stands out most joins and the smallest ball around these few is found
    /// among all their subsets; the radius grows each time, so this ends, after a handful of passes
    /// over the points (Gärtner 1999 grows the ball likewise).
    ///
    /// # Example
    /// ```
    /// use geom_core::{Ball, DVec3};
    /// let cube = (0..8).map(|k| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64));
    /// let ball = Ball::around(&cube.collect::<Vec<_>>()).unwrap();
    /// assert!((ball.diameter() - 3.0_f64.sqrt()).abs() < 1e-12);
    /// assert!(ball.center.distance(DVec3::splat(0.5)) < 1e-12);
    /// ```
    #[must_use]
    pub fn around(points: &[DVec3]) -> Option<Self> {
        if points.is_empty() || points.iter().any(|p| !p.is_finite()) {
            return None;
        }
        // Far from the origin squares would lose what is small: all is measured from one point.
        let origin = points[0];
        let farthest = |center: DVec3| {
            let mut best = (origin, -1.0);
            for &p in points {
                let far = (p - origin - center).length();
                if far > best.1 {
                    best = (p, far);
                }
            }
            (best.0 - origin, best.1)
        };
        let mut support = vec![DVec3::ZERO];
        let mut ball = Self { center: DVec3::ZERO, radius: 0.0 };
        for _ in 0..MOST_GROWTHS {
            let (point, far) = farthest(ball.center);
            if far <= ball.radius * (1.0 + ROUNDING) {
                break;
            }
            support.push(point);
            let (grown, kept) = smallest(&support);
            if !(grown.radius > ball.radius) {
                break;
            }
            (ball, support) = (grown, kept);
        }
        Some(Self { center: origin + ball.center, ..ball })
    }

    /// Twice the radius.
    #[must_use]
    pub fn diameter(self) -> f64 {
        2.0 * self.radius
    }
}

/// The smallest ball around at most five points, and the points on it that span it.
fn smallest(points: &[DVec3]) -> (Ball, Vec<DVec3>) {
    let mut best: Option<(Ball, Vec<DVec3>)> = None;
    // Where rounding leaves a point out of every ball, the one that has to grow least holds all.
    let mut widened: Option<(Ball, Vec<DVec3>)> = None;
    for subset in 1_usize..1 << points.len() {
        if subset.count_ones() > 4 {
            continue;
        }
        let chosen: Vec<DVec3> =
            (0..points.len()).filter(|k| subset >> k & 1 == 1).map(|k| points[k]).collect();
        let Some(ball) = through(&chosen) else { continue };
        let far = points.iter().map(|p| p.distance(ball.center)).fold(0.0, f64::max);
        let is_smaller = |than: &Option<(Ball, Vec<DVec3>)>, radius: f64| {
            than.as_ref().is_none_or(|(b, _)| radius < b.radius)
        };
        if far <= ball.radius * (1.0 + 0.1 * ROUNDING) {
            if is_smaller(&best, ball.radius) {
                best = Some((ball, chosen));
            }
        } else if best.is_none() && is_smaller(&widened, far) {
            widened = Some((Ball { radius: far, ..ball }, chosen));
        }
    }
    best.or(widened).unwrap_or((Ball { center: points[0], radius: 0.0 }, points[..1].to_vec()))
}

/// The smallest ball with all of one to four points on it; `None` if they are in line or in a
/// circle already.
fn through(points: &[DVec3]) -> Option<Ball> {
    let first = points[0];
    let edge = |k: usize| points[k] - first;
    let half = |k: usize| 0.5 * edge(k).length_squared();
    let from_first = match points.len() {
        1 => DVec3::ZERO,
        2 => 0.5 * edge(1),
        3 => {
            let (a, b) = (edge(1), edge(2));
            let normal = a.cross(b);
            let square = normal.length_squared();
            // The circumcentre of a triangle.
            let across = b.cross(normal) * half(1) + normal.cross(a) * half(2);
            (square > 1e-24 * a.length_squared() * b.length_squared()).then(|| across / square)?
        }
        _ => {
            let rows = DMat3::from_cols(edge(1), edge(2), edge(3)).transpose();
            let volume = rows.determinant().abs();
            let scale = edge(1).length() * edge(2).length() * edge(3).length();
            let right = DVec3::new(half(1), half(2), half(3));
            (volume > 1e-12 * scale).then(|| rows.inverse() * right)?
        }
    };
    Some(Ball { center: first + from_first, radius: from_first.length() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    /// Points of a fixed sequence in the unit cube.
    fn scattered(count: usize) -> Vec<DVec3> {
        let part = |k: usize, step: f64| (k as f64 * step).fract();
        (1..=count)
            .map(|k| DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_84)))
            .collect()
    }

    #[test]
    fn it_is_the_smallest_over_all_subsets_and_holds_every_point() {
        for count in [2, 3, 4, 7, 12] {
            let points = scattered(count);
            let ball = Ball::around(&points).unwrap();
            let far = points.iter().map(|p| p.distance(ball.center)).fold(0.0, f64::max);
            assert_close(far, ball.radius, 1e-12 * ball.radius);
            let mut least = f64::INFINITY;
            for subset in 1_usize..1 << count {
                if subset.count_ones() > 4 {
                    continue;
                }
                let chosen: Vec<_> =
                    (0..count).filter(|k| subset >> k & 1 == 1).map(|k| points[k]).collect();
                let Some(other) = through(&chosen) else { continue };
                let radius = points.iter().map(|p| p.distance(other.center)).fold(0.0, f64::max);
                if radius <= other.radius * (1.0 + 1e-12) {
                    least = least.min(other.radius);
                }
            }
            assert_close(ball.radius, least, 1e-11 * least);
        }
    }

    #[test]
    fn rounding_makes_no_ball_larger() {
        // Rings of points on one sphere, which no four of them hold to the last bit.
        for count in 5..60 {
            let ring = |k: usize| {
                let (around, up) = (0.37 * k as f64, 1.3 * (k as f64 * 0.618_034).fract() - 0.65);
                let out = (1.0_f64 - up * up).sqrt();
                DVec3::new(out * around.cos(), out * around.sin(), up)
            };
            let points: Vec<_> = (0..200 * count).map(ring).collect();
            let ball = Ball::around(&points).unwrap();
            assert!(ball.radius <= 1.0 + 1e-13, "{count}: {}", ball.radius);
            assert!(points.iter().all(|p| p.distance(ball.center) <= ball.radius * (1.0 + 1e-12)));
        }
    }

    #[test]
    fn it_turns_moves_and_grows_with_the_points() {
        let points = scattered(200);
        let ball = Ball::around(&points).unwrap();
        let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(-1.1);
        let moved: Vec<_> =
            points.iter().map(|&p| 3.0 * (turn * p) + DVec3::new(5e5, -2e5, 1e4)).collect();
        let other = Ball::around(&moved).unwrap();
        // What 1e-16 of the distance from the origin is worth.
        assert_close(other.radius, 3.0 * ball.radius, 1e-9);
        let center = 3.0 * (turn * ball.center) + DVec3::new(5e5, -2e5, 1e4);
        assert!(other.center.distance(center) < 1e-8);
    }

    #[test]
    fn degenerate_sets_have_one_too() {
        let same = [DVec3::splat(2.0); 5];
        assert_eq!(Ball::around(&same), Some(Ball { center: same[0], radius: 0.0 }));
        let line: Vec<_> = (0..9).map(|k| k as f64 * DVec3::new(1.0, 2.0, -2.0)).collect();
        assert_close(Ball::around(&line).unwrap().diameter(), 24.0, 1e-12);
        let circle: Vec<_> = (0..100)
            .map(|k| (0.0628 * k as f64).sin_cos())
            .map(|(s, c)| DVec3::new(c, s, 7.0))
            .collect();
        assert_close(Ball::around(&circle).unwrap().radius, 1.0, 1e-3);
        assert_eq!(Ball::around(&[]), None);
        assert_eq!(Ball::around(&[DVec3::NAN]), None);
    }
}
