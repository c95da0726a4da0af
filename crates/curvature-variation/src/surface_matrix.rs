//! The Gauss-Newton matrix of a surface energy, patch by patch and blend by blend.

use crate::element::{ElementMatrix, Mixture, element_width};
use crate::evaluator::SurfaceEnergy;
use crate::guide_block::{GuideBlock, is_guided};
use crate::rules::{Quadrature, Table};
use rayon::prelude::*;
use subdiv_catmull_clark::SubdivisionSurface;

/// Gauss points per side the metrics use: they need not be exact.
const NODES: Quadrature = Quadrature { regular: 4, extraordinary: 8 };
/// Element matrices computed at a time before they are added up.
const BATCH: usize = 64;
/// Area elements below this share of the mean are raised to it.
const LEAST_AREA: f64 = 1e-3;

/// Asked now and then whether to stop.
pub(crate) type Stop<'s> = &'s mut dyn FnMut() -> bool;

/// What one clique adds: the upper triangle of a symmetric matrix by the coordinates of its control
/// points, rows `width` long.
pub(crate) struct Matrix<'m> {
    pub(crate) values: &'m [f64],
    pub(crate) width: usize,
    pub(crate) controls: &'m [u32],
    /// How many times it counts.
    pub(crate) factor: f64,
}

/// The bases at the nodes of the metrics, and the wide blends.
///
/// Cliques are sets of control points of which all depend on one another, in the order of assembly:
/// those of the patches, then those of wide blends.
pub(crate) struct SurfaceMatrix {
    rules: Vec<Table>,
    blocks: Vec<GuideBlock>,
}

impl SurfaceMatrix {
    /// Of the patches that are evaluated.
    pub(crate) fn new(surface: &SubdivisionSurface, evaluator: &SurfaceEnergy) -> Self {
        let rules = evaluator
            .groups()
            .par_iter()
            .map(|group| {
                let nodes = NODES.nodes(surface, group.basis);
                Table::new(surface, group.basis, nodes)
            })
            .collect();
        Self { rules, blocks: GuideBlock::all(evaluator) }
    }

    /// The vertices of every clique.
    pub(crate) fn cliques<'a>(
        &'a self,
        evaluator: &'a SurfaceEnergy,
    ) -> impl Iterator<Item = &'a [u32]> {
        let groups = evaluator.groups().iter().filter(move |g| !is_guided(evaluator, g));
        let patches = groups.flat_map(|g| g.controls.chunks(g.per_patch));
        patches.chain(self.blocks.iter().map(|b| &b.vertices[..]))
    }

    /// Shows the matrix of every clique, in their order; `None` if it was stopped before the end.
    pub(crate) fn visit(
        &self,
        evaluator: &SurfaceEnergy,
        positions: &[f64],
        area: f64,
        mixture: &Mixture,
        stop: Stop<'_>,
        visit: &mut dyn FnMut(&Matrix<'_>),
    ) -> Option<()> {
        let mean_area = area / evaluator.weighted_patches();
        let mut points = Vec::new();
        evaluator.guides().extend(positions, &mut points);
        let positions = &points[..];
        let element = |group: usize, controls: &[u32], matrix: &mut [f64]| {
            evaluator.arch().dispatch(ElementMatrix {
                rule: &self.rules[group],
                mixture,
                positions,
                controls,
                area,
                least_area: LEAST_AREA * mean_area,
                matrix,
            });
        };
        for (g, group) in evaluator.groups().iter().enumerate() {
            if is_guided(evaluator, group) {
                continue;
            }
            let width = element_width(group.per_patch);
            for controls in group.controls.chunks(BATCH * group.per_patch) {
                if stop() {
                    return None;
                }
                let mut matrices = vec![0.0; controls.len() / group.per_patch * width * width];
                matrices
                    .par_chunks_mut(width * width)
                    .zip(controls.par_chunks(group.per_patch))
                    .for_each(|(matrix, controls)| element(g, controls, matrix));
                for (values, controls) in
                    matrices.chunks(width * width).zip(controls.chunks(group.per_patch))
                {
                    visit(&Matrix { values, width, controls, factor: group.multiplicity });
                }
            }
        }
        for block in &self.blocks {
            if stop() {
                return None;
            }
            let matrix = block.matrix(evaluator, element);
            let (values, width) = (&matrix[..], 3 * block.vertices.len());
            visit(&Matrix { values, width, controls: &block.vertices, factor: 1.0 });
        }
        Some(())
    }
}
