//! Points of patches for pictures and meshes, with exact normals and curvatures.

use super::hyperbolic_net::HyperbolicNet;
use super::patch::PatchJet;
use crate::PatchError;
use geom_core::DVec3;
use rayon::prelude::*;

/// A point of a smooth surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Position.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Mean curvature in 1/length, positive where the surface bends towards the normal.
    pub mean_curvature: f64,
    /// Gaussian curvature in 1/length².
    pub gaussian_curvature: f64,
}

/// A grid of points on every patch; neighbouring patches have points of their own along their
/// common edge, so that each shows its own normals.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledPatches {
    /// `samples[(face * (cells + 1) + i) * (cells + 1) + j]` at `u = i/cells`, `v = j/cells`.
    pub samples: Vec<SurfaceSample>,
    /// Cells in each direction of a patch.
    pub cells: usize,
}

impl PatchJet {
    /// Position, unit normal and curvatures.
    ///
    /// # Errors
    /// [`PatchError::Singular`] where the two rulings are parallel.
    pub fn sample(&self) -> Result<SurfaceSample, PatchError> {
        Ok(SurfaceSample {
            point: self.point,
            normal: self.normal().normalize_or_zero(),
            mean_curvature: self.mean_curvature()?,
            gaussian_curvature: self.gaussian_curvature()?,
        })
    }
}

impl SampledPatches {
    /// Samples `map` of every patch at a grid of parameters.
    ///
    /// # Errors
    /// The first error of `map`, in the order of the faces.
    ///
    /// # Panics
    /// With no cells.
    pub fn new<E: From<PatchError> + Send>(
        surface: &HyperbolicNet,
        cells: usize,
        map: impl Fn(&PatchJet) -> Result<SurfaceSample, E> + Sync,
    ) -> Result<Self, E> {
        assert!(cells > 0, "a patch has at least one cell");
        let patches = surface.patches()?;
        let at = |k: usize| k as f64 / cells as f64;
        let grids: Vec<Result<Vec<SurfaceSample>, E>> = patches
            .par_iter()
            .map(|patch| {
                (0..=cells)
                    .flat_map(|i| (0..=cells).map(move |j| (i, j)))
                    .map(|(i, j)| map(&patch.jet(at(i), at(j))))
                    .collect()
            })
            .collect();
        let mut samples = Vec::with_capacity(patches.len() * (cells + 1) * (cells + 1));
        for grid in grids {
            samples.extend(grid?);
        }
        Ok(Self { samples, cells })
    }

    /// Quads over [`Self::samples`], all patches one after the other.
    #[must_use]
    pub fn quads(&self) -> Vec<[u32; 4]> {
        let n = self.cells;
        let patches = self.samples.len() / ((n + 1) * (n + 1));
        let at = |p: usize, i: usize, j: usize| ((p * (n + 1) + i) * (n + 1) + j) as u32;
        (0..patches)
            .flat_map(|p| (0..n).flat_map(move |i| (0..n).map(move |j| (p, i, j))))
            .map(|(p, i, j)| [at(p, i, j), at(p, i + 1, j), at(p, i + 1, j + 1), at(p, i, j + 1)])
            .collect()
    }

    /// Largest and smallest value of a quantity over all samples, `(min, max)`.
    #[must_use]
    pub fn range(&self, quantity: impl Fn(&SurfaceSample) -> f64) -> (f64, f64) {
        self.samples
            .iter()
            .map(quantity)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::QuadNet;
    use fixtures::asymptotic_nets;
    use geom_core::PolyMesh;

    #[test]
    fn samples_of_neighbours_agree_in_position_and_normal() {
        let model = asymptotic_nets::moutard(3, 3, 5);
        let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads).unwrap()).unwrap();
        let shape = crate::shape_parameters(&net, &model.normals);
        let surface = HyperbolicNet::new(net, None, shape).unwrap();
        let sampled = SampledPatches::new(&surface, 2, PatchJet::sample).unwrap();
        assert_eq!(sampled.samples.len(), 9 * 9);
        assert_eq!(sampled.quads().len(), 9 * 4);
        let (low, high) = sampled.range(|s| s.gaussian_curvature);
        assert!(low < 0.0 && high < 0.0);
        // Corners of patches at the same place have the same normal.
        for a in &sampled.samples {
            for b in sampled.samples.iter().filter(|b| b.point.distance(a.point) < 1e-9) {
                assert!(a.normal.dot(b.normal) > 1.0 - 1e-12);
            }
        }
    }
}
