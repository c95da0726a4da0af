//! The energies of spline patches as they go into a file, by another path than the optimiser's: from
//! the derivatives of the splines themselves, by quadrature over their knot spans.

use crate::density::{Density, GUARD};
use crate::evaluator::EnergyTable;
use crate::functional::{Functional, ROOT_EPSILON};
use crate::grounds::skip_boundary;
use crate::metrics::Warning;
use crate::rules::gauss_legendre;
use crate::solution::Solution;
use crate::splines::SplinePatches;
use bspline::{BsplineSurface, KnotVector};
use geom_core::{FaceId, SurfaceJet, ThirdOrder};
use rayon::prelude::*;

/// Gauss points per knot span of a patch of few spans, and of one of many.
const POINTS: [usize; 2] = [10, 4];
/// Spans of a patch of many.
const MANY: usize = 3;
/// Written energies up to second order that differ by more than this share are warned about.
const SECOND_ORDER: f64 = 1e-3;
/// The same of third-order ones.
const THIRD_ORDER: f64 = 0.03;

impl SplinePatches {
    /// All functionals of the patches together; those of faces for which `counts` is false are left
    /// out.
    #[must_use]
    pub fn energies(&self, counts: &(dyn Fn(FaceId) -> bool + Sync)) -> EnergyTable {
        let patches: Vec<&BsplineSurface> =
            self.surfaces.iter().filter(|(face, _)| counts(*face)).map(|(_, s)| s).collect();
        // Patch by patch, so that the sums do not depend on the number of threads.
        let areas: Vec<f64> = patches.par_iter().map(|s| area(s)).collect();
        let area: f64 = areas.iter().sum();
        let densities = Functional::ALL.map(Functional::density);
        let epsilon = ROOT_EPSILON / area;
        let parts: Vec<[f64; Functional::ALL.len()]> = patches
            .par_iter()
            .map(|surface| {
                let mut sums = [0.0; Functional::ALL.len()];
                for (weight, shape) in samples(surface) {
                    for (sum, (density, _)) in sums.iter_mut().zip(&densities) {
                        *sum += weight * shape.density(density, epsilon);
                    }
                }
                sums
            })
            .collect();
        let value = |k: usize| {
            let integral: f64 = parts.iter().map(|sums| sums[k]).sum();
            match Functional::ALL[k] {
                Functional::Area => area,
                _ if densities[k].1 => area * integral,
                _ => integral,
            }
        };
        let values = Functional::ALL.iter().enumerate().map(|(k, f)| (*f, value(k)));
        EnergyTable::of(values.collect())
    }
}

fn area(surface: &BsplineSurface) -> f64 {
    let [nodes_u, nodes_v] = [surface.knots_u(), surface.knots_v()].map(nodes);
    let parameters = |nodes: &[(f64, f64)]| nodes.iter().map(|(t, _)| *t).collect::<Vec<f64>>();
    let jets = surface.jet_grid(&parameters(&nodes_u), &parameters(&nodes_v), 1);
    let element = |(k, jet): (usize, &SurfaceJet)| {
        let weight = nodes_u[k / nodes_v.len()].1 * nodes_v[k % nodes_v.len()].1;
        weight * jet.first_form().determinant().max(0.0).sqrt()
    };
    jets.iter().enumerate().map(element).sum()
}

/// Second form and harmonics of the derivative of the normal curvature at a place.
struct SurfaceShape {
    second: [f64; 3],
    first: [f64; 2],
    third: [f64; 2],
}

impl SurfaceShape {
    /// The density, as it stands in the doc of [`Density`].
    fn density(&self, w: &Density, epsilon: f64) -> f64 {
        let [l, m, q] = self.second;
        let ([f1c, f1s], [f3c, f3s]) = (self.first, self.third);
        let (first, third) = (f1c * f1c + f1s * f1s, f3c * f3c + f3s * f3s);
        let mut e = 0.5 * w.mean * (l + q)
            + w.square * (l * l + q * q)
            + w.product * l * q
            + w.twist * m * m
            + w.f1 * first
            + w.f3 * third
            + w.root * (first + third + epsilon * epsilon).sqrt();
        if w.coupling != 0.0 {
            // Re(Z1 Z3 e^{4iφ}): 4φ is twice the angle of (half, m), the half-difference form.
            let half = 0.5 * (l - q);
            let size = half * half + m * m + GUARD * (l * l + q * q + 2.0 * m * m) + 1e-200;
            let (cos, sin) = ((half * half - m * m) / size, 2.0 * half * m / size);
            let (re, im) = (f1c * f3c - f1s * f3s, -(f1c * f3s + f1s * f3c));
            e += w.coupling * (re * cos - im * sin);
        }
        e
    }
}

/// Quadrature weights times the area element with the shapes; singular points have no area.
fn samples(surface: &BsplineSurface) -> Vec<(f64, SurfaceShape)> {
    let nodes = [surface.knots_u(), surface.knots_v()].map(nodes);
    let parameters = |k: usize| nodes[k].iter().map(|(t, _)| *t).collect::<Vec<f64>>();
    let jets = surface.jet_grid(&parameters(0), &parameters(1), 3);
    let n_v = nodes[1].len();
    let shape = |(k, jet): (usize, &SurfaceJet)| {
        let found = ThirdOrder::new(jet).ok()?;
        let area = jet.first_form().determinant().max(0.0).sqrt();
        let shape = SurfaceShape {
            second: found.second,
            first: found.first_harmonic(),
            third: found.third_harmonic(),
        };
        Some((nodes[0][k / n_v].1 * nodes[1][k % n_v].1 * area, shape))
    };
    jets.iter().enumerate().filter_map(shape).collect()
}

fn nodes(knots: &KnotVector) -> Vec<(f64, f64)> {
    let breaks = knots.breaks();
    let rule = gauss_legendre(POINTS[usize::from(breaks.len() > MANY)]);
    let in_span = |pair: &[f64]| {
        let (start, length) = (pair[0], pair[1] - pair[0]);
        rule.iter().map(move |(x, w)| (start + length * x, length * w)).collect::<Vec<_>>()
    };
    breaks.windows(2).flat_map(in_span).collect()
}

impl Solution {
    /// Adds what is known of the result's spline patches to the metrics: how many are fitted and
    /// how well, and all energies measured again on them. If they are not what was reported, to
    /// 0.1 % up to second order and 3 % in third order, there is a warning with both numbers.
    pub fn add_splines(&mut self, splines: &SplinePatches) {
        self.metrics.fitted_patches = Some(splines.fitted);
        self.metrics.fitted_deviation_max = Some(splines.max_deviation);
        self.warnings.splice(..0, splines.warning(&self.result));
        let mut counts = vec![1; self.result.face_count()];
        if self.clamps {
            skip_boundary(&self.result, &mut counts);
        }
        let written = splines.energies(&|face| counts[face.index()] > 0);
        self.warnings.extend(compared(&self.after, &written));
        self.metrics.written_energies = Some(written.by_name());
    }
}

/// The functional that differs most beyond what it may, second-order ones first.
fn compared(reported: &EnergyTable, written: &EnergyTable) -> Option<Warning> {
    let size = reported.get(Functional::Bending).abs();
    let second = |functional: &Functional| {
        let difference = (written.get(*functional) - reported.get(*functional)).abs();
        // The integrals of K and of the difference of the principal curvatures may vanish.
        (difference / size, SECOND_ORDER)
    };
    let third = |functional: &Functional| {
        let scale = reported.get(*functional).abs();
        let difference = (written.get(*functional) - reported.get(*functional)).abs();
        (difference / scale, THIRD_ORDER)
    };
    let mut worst: Option<(f64, Functional)> = None;
    for functional in &Functional::ALL {
        let (share, bound) = match functional {
            Functional::Area | Functional::MeanCurvature => continue,
            Functional::Gaussian
            | Functional::Bending
            | Functional::Willmore
            | Functional::UmbilicDeviation => second(functional),
            _ => third(functional),
        };
        let excess = share / bound;
        if excess > 1.0 && worst.is_none_or(|(most, _)| excess > most) {
            worst = Some((excess, *functional));
        }
    }
    worst.map(|(_, functional)| Warning::WrittenEnergy {
        functional,
        reported: reported.get(functional),
        written: written.get(functional),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_functional_that_is_farthest_off_is_told_with_both_numbers() {
        let table = |f1: f64, bending: f64| {
            let value = |f: &Functional| match f {
                Functional::F1 => f1,
                Functional::Bending => bending,
                _ => 50.0,
            };
            EnergyTable::of(Functional::ALL.iter().map(|f| (*f, value(f))).collect())
        };
        let reported = table(10.0, 20.0);
        assert!(compared(&reported, &table(10.29, 20.019)).is_none());
        let told = compared(&reported, &table(10.4, 20.1));
        let Some(Warning::WrittenEnergy { functional, reported: r, written }) = told else {
            panic!("{told:?}")
        };
        // Five times what bending may differ by, and a third more than a third derivative may.
        assert_eq!((functional, r, written), (Functional::Bending, 20.0, 20.1));
        let told = compared(&reported, &table(12.0, 20.0));
        assert!(matches!(told, Some(Warning::WrittenEnergy { functional: Functional::F1, .. })));
    }
}
