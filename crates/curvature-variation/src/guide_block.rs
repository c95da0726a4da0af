//! What a wide blend adds to a Gauss-Newton matrix.

use crate::element::element_width;
use crate::evaluator::{Group, SurfaceEnergy};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use subdiv_catmull_clark::GuideSector;

/// Element matrices computed at a time before they are added up.
const BATCH: usize = 16;
const COEFFICIENTS: usize = GuideSector::COEFFICIENTS;

/// Whether the patches of a group have coefficients of a guide among their control points.
pub(crate) fn is_guided(evaluator: &SurfaceEnergy, group: &Group) -> bool {
    group.controls.last().is_some_and(|&c| evaluator.guides().sector_of(c).is_some())
}

/// All patches of a blend of several rings.
///
/// Their matrices are by few vertices `x` and the coefficients `q = C x` of their sector's guide;
/// with the sums `V, T, D` of the parts by (vertices, vertices), (vertices, coefficients) and
/// (coefficients, coefficients) the matrix by all vertices is
/// `V + (T + Cᵀ D/2) C + ((T + Cᵀ D/2) C)ᵀ`, summed over the sectors.
pub(crate) struct GuideBlock {
    /// Vertices of the blend.
    pub(crate) vertices: Vec<u32>,
    sectors: Vec<BlockSector>,
}

struct BlockSector {
    sector: usize,
    /// Group and patch.
    patches: Vec<(usize, usize)>,
}

impl GuideBlock {
    /// The blends with patches that are evaluated.
    pub(crate) fn all(evaluator: &SurfaceEnergy) -> Vec<Self> {
        let guides = evaluator.guides();
        let mut by_sector: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
        for (g, group) in evaluator.groups().iter().enumerate() {
            for (p, controls) in group.controls.chunks(group.per_patch).enumerate() {
                if let Some(sector) = controls.last().and_then(|&c| guides.sector_of(c)) {
                    by_sector.entry(sector).or_default().push((g, p));
                }
            }
        }
        let mut blocks: Vec<Self> = Vec::new();
        for (sector, patches) in by_sector {
            let vertices = &guides.sector(sector).vertices;
            let part = BlockSector { sector, patches };
            match blocks.last_mut().filter(|b| b.vertices[0] == vertices[0]) {
                Some(block) => block.sectors.push(part),
                None => {
                    let mut met = std::collections::HashSet::new();
                    let vertices = vertices.iter().copied().filter(|&v| met.insert(v)).collect();
                    blocks.push(Self { vertices, sectors: vec![part] });
                }
            }
        }
        blocks
    }

    /// The matrix by the coordinates of the block's vertices, upper triangle; `element` fills that
    /// of one patch from its group and its control points.
    pub(crate) fn matrix(
        &self,
        evaluator: &SurfaceEnergy,
        element: impl Fn(usize, &[u32], &mut [f64]) + Sync,
    ) -> Vec<f64> {
        let size = 3 * self.vertices.len();
        let place: HashMap<u32, usize> =
            self.vertices.iter().enumerate().map(|(k, &v)| (v, k)).collect();
        let mut matrix = vec![0.0; size * size];
        for part in &self.sectors {
            // `mixed[(row · 3 + c) · COEFFICIENTS + k]`: by coordinate c of coefficient k.
            let mut mixed = vec![0.0; size * 3 * COEFFICIENTS];
            let mut square = vec![0.0; 9 * COEFFICIENTS * COEFFICIENTS];
            for batch in part.patches.chunks(BATCH) {
                let elements: Vec<Vec<f64>> = batch
                    .par_iter()
                    .map(|&(g, p)| {
                        let group = &evaluator.groups()[g];
                        let width = element_width(group.per_patch);
                        let mut matrix = vec![0.0; width * width];
                        element(g, controls_of(group, p), &mut matrix);
                        matrix
                    })
                    .collect();
                for (&(g, p), element) in batch.iter().zip(&elements) {
                    let group = &evaluator.groups()[g];
                    let own = group.per_patch - COEFFICIENTS;
                    let rows: Vec<usize> = controls_of(group, p)[..own]
                        .iter()
                        .flat_map(|v| (0..3).map(|c| 3 * place[v] + c))
                        .collect();
                    let width = element_width(group.per_patch);
                    for (r, &row) in rows.iter().enumerate() {
                        for (s, &column) in rows.iter().enumerate().skip(r) {
                            // A vertex that stands in the list twice meets itself both ways.
                            let twice = if r != s && row == column { 2.0 } else { 1.0 };
                            matrix[row.min(column) * size + row.max(column)] +=
                                twice * group.multiplicity * element[r * width + s];
                        }
                        for s in 0..3 * COEFFICIENTS {
                            mixed[(3 * row + s % 3) * COEFFICIENTS + s / 3] +=
                                group.multiplicity * element[r * width + 3 * own + s];
                        }
                    }
                    for r in 0..3 * COEFFICIENTS {
                        for s in r..3 * COEFFICIENTS {
                            let value =
                                group.multiplicity * element[(3 * own + r) * width + 3 * own + s];
                            square[r * 3 * COEFFICIENTS + s] += value;
                            if s > r {
                                square[s * 3 * COEFFICIENTS + r] += value;
                            }
                        }
                    }
                }
            }
            self.add_coefficients(evaluator, part.sector, &place, mixed, &square, &mut matrix);
        }
        matrix
    }

    fn add_coefficients(
        &self,
        evaluator: &SurfaceEnergy,
        sector: usize,
        place: &HashMap<u32, usize>,
        mut mixed: Vec<f64>,
        square: &[f64],
        matrix: &mut [f64],
    ) {
        let size = 3 * self.vertices.len();
        let sector = evaluator.guides().sector(sector);
        // `weights[v · COEFFICIENTS + k]`
        let mut weights = vec![0.0; self.vertices.len() * COEFFICIENTS];
        for k in 0..COEFFICIENTS {
            for (v, w) in sector.vertices.iter().zip(sector.weights(k)) {
                weights[place[v] * COEFFICIENTS + k] += w;
            }
        }
        mixed.par_chunks_mut(3 * COEFFICIENTS).enumerate().for_each(|(row, mixed)| {
            let own = &weights[row / 3 * COEFFICIENTS..(row / 3 + 1) * COEFFICIENTS];
            for (k, w) in own.iter().enumerate() {
                let from = (3 * k + row % 3) * 3 * COEFFICIENTS;
                for s in 0..3 * COEFFICIENTS {
                    mixed[s % 3 * COEFFICIENTS + s / 3] += 0.5 * w * square[from + s];
                }
            }
        });
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let weights_of = |row: usize| &weights[row / 3 * COEFFICIENTS..][..COEFFICIENTS];
        let mixed_of =
            |row: usize, c: usize| &mixed[(3 * row + c) * COEFFICIENTS..][..COEFFICIENTS];
        matrix.par_chunks_mut(size).enumerate().for_each(|(row, values)| {
            for (column, value) in values.iter_mut().enumerate().skip(row) {
                *value += dot(mixed_of(row, column % 3), weights_of(column))
                    + dot(mixed_of(column, row % 3), weights_of(row));
            }
        });
    }
}

fn controls_of(group: &Group, patch: usize) -> &[u32] {
    &group.controls[patch * group.per_patch..(patch + 1) * group.per_patch]
}
