//! The coefficients of wide blends' guides as further control points of the evaluation.

use rayon::prelude::*;
use subdiv_catmull_clark::{GuideSector, SubdivisionSurface};

/// Coordinates of a sector's coefficients.
const LENGTH: usize = 3 * GuideSector::COEFFICIENTS;

/// The guides some patches of a surface need.
pub(crate) struct Guides {
    sectors: Vec<GuideSector>,
    used: Vec<bool>,
}

impl Guides {
    /// The guides of `surface`; the patches with these `controls` are evaluated.
    pub(crate) fn new(surface: &SubdivisionSurface, controls: impl Iterator<Item = u32>) -> Self {
        let sectors = surface.sectors().to_vec();
        let mut used = vec![false; sectors.len()];
        if let Some(first) = sectors.first() {
            for control in controls.filter(|&c| c >= first.first) {
                used[(control - first.first) as usize / GuideSector::COEFFICIENTS] = true;
            }
        }
        Self { sectors, used }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.sectors.is_empty()
    }

    /// Number of coefficients.
    pub(crate) fn len(&self) -> usize {
        GuideSector::COEFFICIENTS * self.sectors.len()
    }

    /// The sector of a control point that is no vertex.
    pub(crate) fn sector_of(&self, control: u32) -> Option<usize> {
        let first = self.sectors.first()?.first;
        let place = control.checked_sub(first)? as usize;
        Some(place / GuideSector::COEFFICIENTS)
    }

    pub(crate) fn sector(&self, k: usize) -> &GuideSector {
        &self.sectors[k]
    }

    /// All control points from the vertices, each as three coordinates.
    pub(crate) fn extend(&self, positions: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend_from_slice(positions);
        out.resize(positions.len() + LENGTH * self.sectors.len(), 0.0);
        out[positions.len()..]
            .par_chunks_mut(LENGTH)
            .zip(self.sectors.par_iter().zip(&self.used))
            .filter(|(_, (_, used))| **used)
            .for_each(|(coefficients, (sector, _))| {
                for (k, out) in coefficients.chunks_mut(3).enumerate() {
                    let mut sum = [0.0; 3];
                    for (&v, w) in sector.vertices.iter().zip(sector.weights(k)) {
                        let p = &positions[3 * v as usize..3 * v as usize + 3];
                        sum = [sum[0] + w * p[0], sum[1] + w * p[1], sum[2] + w * p[2]];
                    }
                    out.copy_from_slice(&sum);
                }
            });
    }

    /// Adds a gradient by the coefficients, `coefficient(number)`, to that by the vertices.
    pub(crate) fn pull_back(&self, coefficient: impl Fn(usize) -> [f64; 3], gradient: &mut [f64]) {
        for (sector, _) in self.sectors.iter().zip(&self.used).filter(|s| *s.1) {
            for k in 0..GuideSector::COEFFICIENTS {
                let g = coefficient(sector.first as usize + k);
                for (&v, w) in sector.vertices.iter().zip(sector.weights(k)) {
                    for (out, g) in gradient[3 * v as usize..3 * v as usize + 3].iter_mut().zip(g) {
                        *out += w * g;
                    }
                }
            }
        }
    }
}
