//! Free-form deformation by a cage: a box whose corners are moved determines the transformation.

use super::error::{CageFault, Error};
use super::map::{Branch, DarbouxMap};
use geom_core::{BoundingBox, DVec3};
use gp_solver::choices;
use numerics::right_singular_vectors;
use serde::{Deserialize, Serialize};

/// How much freedom the transformation has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Freedom {
    /// A projective map and `c`, 16 degrees of freedom, as published: Λ stays centred at the
    /// middle of the box.
    #[serde(rename = "16")]
    Sixteen,
    /// The general matrix `N`, 19 degrees of freedom: the image may also be translated.
    #[default]
    #[serde(rename = "19")]
    Nineteen,
}

choices!(Freedom { Sixteen = "16", Nineteen = "19" });

/// A fitted transformation.
#[derive(Clone, Debug, PartialEq)]
pub struct CageFit {
    /// The map; `Regular` is the branch through the corners.
    pub map: DarbouxMap,
    /// The centre `c`, known for 16 degrees of freedom.
    pub c: Option<f64>,
    /// Distance of the image of every corner from where it was asked to go, in model units.
    pub errors: [f64; 8],
}

/// The corners of a box, number `i` at the high end in x, y, z where bit 0, 1, 2 of `i` is set.
///
/// `margin` enlarges the box on every side by this share of its diagonal, so that flat models get
/// a box with a volume.
#[must_use]
pub fn cage_corners(bounds: BoundingBox, margin: f64) -> [DVec3; 8] {
    let grow = DVec3::splat(margin * bounds.diagonal());
    let (low, high) = (bounds.min - grow, bounds.max + grow);
    std::array::from_fn(|i| {
        let pick = |bit: usize| if i >> bit & 1 == 1 { high[bit] } else { low[bit] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// The transformation that takes eight corners to eight images as well as it can.
///
/// Every pair `x → y` gives three linear equations `x_i (N Y)₄ = (N Y)_i` for the entries of `N`;
/// the smallest singular vector solves them (direct linear transformation). For 16 degrees of
/// freedom this is done for fixed `c`, and `c ≥ 0` is searched (`−c` differs by a scaling). Where
/// no map takes all corners exactly, or several do, a map near the identity is taken that meets
/// them approximately: [`CageFit::errors`] says how well.
///
/// # Errors
/// [`Error::BadCage`] if the corners span no volume, have no common transformation, or
/// would be images of different branches.
pub fn fit_cage(
    corners: &[DVec3; 8],
    images: &[DVec3; 8],
    freedom: Freedom,
) -> Result<CageFit, Error> {
    if !corners.iter().chain(images).all(|p| p.is_finite()) {
        return Err(CageFault::NotFinite.into());
    }
    let centre = corners.iter().sum::<DVec3>() / 8.0;
    let unit = corners.iter().map(|x| x.distance(centre)).fold(0.0, f64::max) * 2.0;
    let volume =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(corners[4] - corners[0]).abs();
    if !(volume > 1e-9 * unit.powi(3)) {
        return Err(CageFault::NoVolume.into());
    }
    // In lengths of the box's diagonal about its middle all entries of N have like sizes.
    let shrink = |p: &DVec3| (*p - centre) / unit;
    let pairs: Vec<(DVec3, DVec3)> =
        corners.iter().zip(images).map(|(x, y)| (shrink(x), shrink(y))).collect();
    let (matrix, c) = match freedom {
        Freedom::Nineteen => (general(&pairs), None),
        Freedom::Sixteen => {
            let c = best_centre(&pairs);
            (with_centre(&pairs, c).1, Some(c))
        }
    };
    let map = DarbouxMap::from_matrix(matrix)?.in_frame(centre, unit)?;
    let world: Vec<(DVec3, DVec3)> = corners.iter().copied().zip(images.iter().copied()).collect();
    let map = map.through(&world)?;
    let mut errors = [0.0; 8];
    for (k, (x, y)) in world.iter().enumerate() {
        errors[k] = map.image(*x, Branch::Regular)?.distance(*y);
    }
    Ok(CageFit { map, c, errors })
}

/// Rows of the direct linear transformation for lifted images with `width` entries.
fn equations(pairs: &[(DVec3, Vec<f64>)]) -> Vec<Vec<f64>> {
    let width = pairs[0].1.len();
    let mut rows = Vec::with_capacity(3 * pairs.len());
    for (x, lifted) in pairs {
        for i in 0..3 {
            let mut row = vec![0.0; 4 * width];
            for (k, &l) in lifted.iter().enumerate() {
                row[i * width + k] = l;
                row[3 * width + k] = -x[i] * l;
            }
            rows.push(row);
        }
    }
    rows
}

fn general(pairs: &[(DVec3, DVec3)]) -> [[f64; 5]; 4] {
    let lifted: Vec<(DVec3, Vec<f64>)> =
        pairs.iter().map(|&(x, y)| (x, vec![y.x, y.y, y.z, y.length_squared(), 1.0])).collect();
    let all = right_singular_vectors(&equations(&lifted));
    let largest = all[0].0;
    let null = all.iter().filter(|(s, _)| *s <= NULL_RATIO * largest).count();
    let best: Vec<f64> = if null == 1 {
        all[all.len() - 1].1.clone()
    } else {
        // The corners of a box lie on a sphere, whose equation maps them all to nothing: cages near
        // a box have such false solutions with small residuals. The identity with its components
        // of large residual damped away is the regularised solution without them.
        let mut best = vec![0.0; 20];
        for (s, v) in &all {
            let identity = v[0] + v[6] + v[12] + v[19];
            let share = identity / (1.0 + (s / (DAMPING * largest)).powi(2));
            best.iter_mut().zip(v).for_each(|(b, x)| *b += share * x);
        }
        best
    };
    std::array::from_fn(|i| std::array::from_fn(|k| best[5 * i + k]))
}

/// Singular values below this share of the largest count as zero.
const NULL_RATIO: f64 = 1e-10;
/// Singular values far below this share of the largest are left alone by the damping.
const DAMPING: f64 = 1e-2;

/// Residual and matrix of the best projective map before the transformation with centre `c`.
fn with_centre(pairs: &[(DVec3, DVec3)], c: f64) -> (f64, [[f64; 5]; 4]) {
    let lift = |y: DVec3| {
        let z = y * (2.0 * (1.0 - c));
        vec![z.x, z.y, z.z, y.length_squared() + c * c - 1.0]
    };
    // Rows of like size for every c, so that residuals can be compared.
    let lifted: Vec<(DVec3, Vec<f64>)> = pairs
        .iter()
        .map(|&(x, y)| {
            let l = lift(y);
            let size = l.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            (x, l.into_iter().map(|v| v / size).collect())
        })
        .collect();
    let all = right_singular_vectors(&equations(&lifted));
    let (residual, a) = &all[all.len() - 1];
    let a = |i: usize, k: usize| a[4 * i + k];
    let matrix = std::array::from_fn(|i| {
        let s = 2.0 * (1.0 - c);
        [a(i, 0) * s, a(i, 1) * s, a(i, 2) * s, a(i, 3), a(i, 3) * (c * c - 1.0)]
    });
    (residual / all[0].0, matrix)
}

/// The `c` with the least residual: a scan over both sides of 1 and of −1, then golden sections.
fn best_centre(pairs: &[(DVec3, DVec3)]) -> f64 {
    let residual =
        |c: f64| if (c - 1.0).abs() < 1e-9 { f64::INFINITY } else { with_centre(pairs, c).0 };
    // c = tan of equal steps covers the whole line; 0.7854 (c = 1) falls between two steps.
    let steps = 240;
    let at = |k: usize| {
        (std::f64::consts::PI * (k as f64 + 0.5) / steps as f64 - std::f64::consts::FRAC_PI_2).tan()
    };
    let values: Vec<f64> = (0..steps).map(|k| residual(at(k))).collect();
    let mut order: Vec<usize> = (1..steps - 1)
        .filter(|&k| values[k] <= values[k - 1] && values[k] <= values[k + 1])
        .collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut best = (f64::INFINITY, -0.5);
    for &k in order.iter().take(4) {
        let (mut low, mut high) = (at(k - 1), at(k + 1));
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..90 {
            let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
            if residual(a) < residual(b) {
                high = b;
            } else {
                low = a;
            }
        }
        let c = 0.5 * (low + high);
        let value = residual(c);
        if value < best.0 {
            best = (value, c);
        }
    }
    // Only c² is determined: the sign is a scaling of the model.
    best.1.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> [DVec3; 8] {
        let bounds =
            BoundingBox { min: DVec3::new(10.0, -3.0, 2.0), max: DVec3::new(18.0, 4.0, 6.0) };
        cage_corners(bounds, 0.05)
    }

    /// A map of the general form, near the identity in the frame of the box.
    fn general_map() -> DarbouxMap {
        let mut n = [[0.0; 5]; 4];
        for i in 0..4 {
            for k in 0..5 {
                n[i][k] = 0.06 * (1.3 + 2.1 * i as f64 + 0.7 * k as f64 * k as f64).sin();
            }
        }
        for i in 0..3 {
            n[i][i] += 1.0;
        }
        n[3][4] += 1.0;
        n[3][3] += 0.3;
        let centre = corners().iter().sum::<DVec3>() / 8.0;
        DarbouxMap::from_matrix(n).unwrap().in_frame(centre, 12.0).unwrap()
    }

    /// Images of the corners on the branch that stays near them.
    fn images(map: &DarbouxMap) -> [DVec3; 8] {
        let near =
            |branch: Branch| corners().map(|x| map.image(x, branch).unwrap_or(DVec3::splat(1e9)));
        let far = |y: &[DVec3; 8]| y.iter().zip(corners()).map(|(y, x)| y.distance(x)).sum::<f64>();
        let (a, b) = (near(Branch::Regular), near(Branch::Other));
        if far(&a) < far(&b) { a } else { b }
    }

    #[test]
    fn general_cage_is_recovered_from_its_corners() {
        let map = general_map();
        let fit = fit_cage(&corners(), &images(&map), Freedom::Nineteen).unwrap();
        assert!(fit.errors.iter().all(|e| *e < 1e-8 * 12.0), "{:?}", fit.errors);
        let (got, want) = (fit.map.matrix(), map.matrix());
        let sign = (got[0][0] * want[0][0]).signum();
        for (g, w) in got.iter().flatten().zip(want.iter().flatten()) {
            assert!((sign * g - w).abs() < 1e-8, "{g} {w}");
        }
        // Inside the box as well.
        let x = DVec3::new(13.0, 1.0, 3.5);
        let y = fit.map.image(x, Branch::Regular).unwrap();
        assert!(fit.map.preimage(y).unwrap().distance(x) < 1e-9);
    }

    #[test]
    fn published_cage_finds_its_centre_on_both_sides_of_one() {
        let centre = corners().iter().sum::<DVec3>() / 8.0;
        let unit = corners()[0].distance(centre) * 2.0;
        for c in [-2.5, -0.6, 0.3, 2.2] {
            // A projective map first: x' = A x with a mild perspective.
            let a = [
                [0.9, 0.05, 0.0, 0.02],
                [-0.04, 1.0, 0.03, 0.0],
                [0.0, 0.06, 0.95, -0.03],
                [0.08, -0.05, 0.04, 1.0],
            ];
            let plain = DarbouxMap::new(c).unwrap().matrix();
            let mut n = [[0.0; 5]; 4];
            for i in 0..4 {
                for k in 0..5 {
                    n[i][k] = (0..4).map(|j| a[i][j] * plain[j][k]).sum();
                }
            }
            let map = DarbouxMap::from_matrix(n).unwrap().in_frame(centre, unit).unwrap();
            let images = images(&map);
            let fit = fit_cage(&corners(), &images, Freedom::Sixteen).unwrap();
            assert!((fit.c.unwrap() - c.abs()).abs() < 1e-6, "{:?} for {c}", fit.c);
            assert!(fit.errors.iter().all(|e| *e < 1e-8 * unit), "c = {c}: {:?}", fit.errors);
        }
    }

    #[test]
    fn box_that_is_not_moved_stays() {
        let fit = fit_cage(&corners(), &corners(), Freedom::Nineteen).unwrap();
        assert!(fit.errors.iter().all(|e| *e < 1e-9), "{:?}", fit.errors);
        let x = DVec3::new(13.0, 1.0, 3.5);
        assert!(fit.map.image(x, Branch::Regular).unwrap().distance(x) < 1e-8);
    }

    #[test]
    fn one_moved_corner_bends_the_box() {
        let mut moved = corners();
        moved[7] += DVec3::new(0.5, 0.3, 0.8);
        let fit = fit_cage(&corners(), &moved, Freedom::Nineteen).unwrap();
        // 24 equations for 19 numbers: near, not exact.
        assert!(fit.errors.iter().all(|e| *e < 0.5), "{:?}", fit.errors);
    }

    #[test]
    fn impossible_cages_are_refused() {
        let flat = corners().map(|p| DVec3::new(p.x, p.y, 0.0));
        let error = fit_cage(&flat, &corners(), Freedom::Nineteen).unwrap_err();
        assert!(error.to_string().contains("no volume"), "{error}");
        let mut nan = corners();
        nan[3].x = f64::NAN;
        assert!(fit_cage(&corners(), &nan, Freedom::Nineteen).is_err());
    }
}
