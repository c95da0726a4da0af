//! A small piece of surface fitted to points around a place.

use crate::worst_direction::{self, Pairs, add_pairs};
use glam::DVec3;
use numerics::least_squares;

/// Terms of a piece of degree two to four through the origin, by degree.
const TERMS: [usize; 5] = [0, 2, 5, 9, 14];
/// A piece is fitted to at least this many points per unknown.
const POINTS_PER_TERM: f64 = 1.3;
/// Where the fit of the curvature terms begins and ends among the unknowns.
const CURVATURE_TERMS: std::ops::Range<usize> = 2..5;

/// The graph `z = a x + b y + (c x² + 2 d x y + e y²) / 2 + …` near the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeightFit {
    /// `a` and `b`.
    pub(crate) slope: [f64; 2],
    /// `c`, `d` and `e`.
    pub(crate) curvature: [f64; 3],
    /// How much the curvature terms magnify an error of the heights, in the worst direction and with
    /// its column made of length one. 1 where all terms are orthogonal, and without bound where the
    /// points cannot tell them apart.
    pub(crate) gain: f64,
}

impl HeightFit {
    /// Fits a piece of the given degree, 2 to 4, by weighted least squares; nearer points say more.
    /// `None` if there are too few points or they leave a term undetermined.
    pub(crate) fn new(points: &[DVec3], degree: usize) -> Option<Self> {
        let terms = TERMS[degree];
        let few = (points.len() as f64) < POINTS_PER_TERM * terms as f64;
        if points.len() < terms || (degree > 2 && few) {
            return None;
        }
        let mut matrix = Vec::with_capacity(points.len() * terms);
        let mut heights = Vec::with_capacity(points.len());
        let mut row = [0.0; TERMS[4]];
        let mut moments = Pairs::default();
        for p in points {
            let weight = 1.0 / p.length().max(1e-3);
            monomials(p.x, p.y, &mut row);
            add_pairs(&mut moments, [2, 3, 4].map(|k| weight * row[k]));
            matrix.extend(row[..terms].iter().map(|value| weight * value));
            heights.push(weight * p.z);
        }
        // Columns of length one, so that the gain does not depend on how far the points reach.
        let mut lengths = [0.0; TERMS[4]];
        for row in matrix.chunks_exact(terms) {
            row.iter().zip(&mut lengths).for_each(|(x, l)| *l += x * x);
        }
        lengths.iter_mut().for_each(|l| *l = l.sqrt());
        for row in matrix.chunks_exact_mut(terms) {
            row.iter_mut().zip(&lengths).for_each(|(x, l)| *x /= l);
        }
        least_squares(&mut matrix, terms, &mut heights, 1).ok()?;
        let value = |k: usize| heights[k] / lengths[k];
        Some(Self {
            slope: [value(0), value(1)],
            curvature: [value(2), value(3), value(4)],
            gain: worst_direction::gain(&covariance(&matrix, terms, &lengths), &moments),
        })
    }
}

/// Terms by total degree, the curvature terms as in [`HeightFit`].
fn monomials(x: f64, y: f64, out: &mut [f64; TERMS[4]]) {
    let (xx, xy, yy) = (x * x, x * y, y * y);
    *out = [
        x,
        y,
        0.5 * xx,
        xy,
        0.5 * yy,
        xx * x,
        xx * y,
        x * yy,
        yy * y,
        xx * xx,
        xx * xy,
        xx * yy,
        xy * yy,
        yy * yy,
    ];
}

/// Covariance of the curvature terms for heights of standard deviation 1, from an upper triangle
/// whose columns have been divided by `lengths`.
fn covariance(triangle: &[f64], terms: usize, lengths: &[f64]) -> Pairs {
    let mut sum = Pairs::default();
    let mut column = [0.0; TERMS[4]];
    for c in CURVATURE_TERMS.start..terms {
        column.fill(0.0);
        for i in (CURVATURE_TERMS.start..=c).rev() {
            let known: f64 = (i + 1..=c).map(|k| triangle[i * terms + k] * column[k]).sum();
            column[i] = (f64::from(u8::from(i == c)) - known) / triangle[i * terms + i];
        }
        add_pairs(&mut sum, [2, 3, 4].map(|i| column[i] / lengths[i]));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    fn grid(rows: std::ops::Range<i32>, height: impl Fn(f64, f64) -> f64) -> Vec<DVec3> {
        let points = rows.flat_map(|i| (-2..=2).map(move |j| (f64::from(i), f64::from(j))));
        let points = points.filter(|p| *p != (0.0, 0.0));
        points.map(|(x, y)| 0.5 * DVec3::new(x, y, 2.0 * height(0.5 * x, 0.5 * y))).collect()
    }

    #[test]
    fn polynomials_of_the_degree_are_found() {
        let height = |x: f64, y: f64| {
            0.3 * x - 0.1 * y + 0.5 * (2.0 * x * x - 3.0 * x * y + 5.0 * y * y) + x * x * y
                - y * y * y
        };
        for degree in [3, 4] {
            let fit = HeightFit::new(&grid(-2..3, height), degree).unwrap();
            assert!(fit.gain < 20.0, "{fit:?}");
            let found = [fit.slope[0], fit.slope[1], fit.curvature[0], fit.curvature[1]];
            for (got, want) in found.into_iter().zip([0.3, -0.1, 2.0, -1.5]) {
                assert_close(got, want, 1e-12);
            }
            assert_close(fit.curvature[2], 5.0, 1e-12);
        }
    }

    #[test]
    fn terms_that_cannot_be_told_apart_have_a_large_gain() {
        // On the rows 0, 1/2 and 1 to one side x³ is a combination of x² and x.
        let rows = grid(0..3, |x, _| x);
        assert!(HeightFit::new(&rows, 3).is_none_or(|fit| fit.gain > 1e6));
        assert!(HeightFit::new(&rows, 2).unwrap().gain < 10.0);
        assert_eq!(HeightFit::new(&rows[..4], 2), None);
        // A little off the rows the rank is full, and the gain says what it is worth.
        let shifted: Vec<DVec3> =
            (0..).zip(&rows).map(|(k, p)| *p + 1e-6 * f64::from(k).sin() * DVec3::X).collect();
        assert!(HeightFit::new(&shifted, 3).unwrap().gain > 1e3);
    }
}
