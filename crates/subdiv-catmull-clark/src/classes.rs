//! Patches that look alike share their evaluation: a class per local connectivity.

use crate::characteristic::limit_masks;
use crate::crease::MAX_DEPTH;
use crate::jet::JetWeights;
use crate::local::{LocalPatch, grid_weights};
use crate::stencils::Stencils;
use std::collections::HashMap;

#[derive(Clone, Debug)]
struct Class {
    vertex_count: usize,
    /// Edges at the first corner, if that is the only extraordinary one and no crease is near.
    interior: Option<usize>,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// A bi-cubic B-spline patch on combinations of local vertices.
    Regular(Box<[Vec<(usize, f64)>; 16]>),
    /// Four sub-patches: class and matrix of the step down to it.
    Split(Box<[(usize, Stencils); 4]>),
    /// Being built.
    Pending,
}

/// Local connectivities met so far, with the matrices that lead from one to the next.
///
/// An extraordinary corner leads back to its own class (Stam's subdivision matrix powers), every
/// other sub-patch to a regular one, so a parameter is reached after finitely many steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Classes {
    classes: Vec<Class>,
    by_key: HashMap<Vec<u64>, usize>,
}

impl Classes {
    /// The class of `local`, made if it is new; `None` if its refinement is not a manifold.
    pub(crate) fn insert(&mut self, local: &LocalPatch) -> Option<usize> {
        let key = local.key();
        if let Some(&id) = self.by_key.get(&key) {
            return Some(id);
        }
        let id = self.classes.len();
        self.by_key.insert(key, id);
        let (vertex_count, interior) = (local.mesh.vertex_count(), local.interior_valence());
        self.classes.push(Class { vertex_count, interior, kind: Kind::Pending });
        self.classes[id].kind = match local.regular_grid() {
            Some(grid) => Kind::Regular(Box::new(grid)),
            None => {
                let [a, b, c, d] = local.children()?;
                let mut below =
                    |(local, matrix): (LocalPatch, Stencils)| Some((self.insert(&local)?, matrix));
                Kind::Split(Box::new([below(a)?, below(b)?, below(c)?, below(d)?]))
            }
        };
        Some(id)
    }

    pub(crate) fn vertex_count(&self, class: usize) -> usize {
        self.classes[class].vertex_count
    }

    /// The B-spline control points of a regular class, see [`LocalPatch::regular_grid`].
    pub(crate) fn grid(&self, class: usize) -> Option<&[Vec<(usize, f64)>; 16]> {
        match &self.classes[class].kind {
            Kind::Regular(grid) => Some(grid),
            _ => None,
        }
    }

    /// Matrix from a class's control points to those of its first sub-patch, if that is of the
    /// same class: the subdivision matrix of an extraordinary corner.
    pub(crate) fn subdivision_matrix(&self, class: usize) -> Option<&Stencils> {
        match &self.classes[class].kind {
            Kind::Split(below) if below[0].0 == class => Some(&below[0].1),
            _ => None,
        }
    }

    /// Jets of the control points' weights at `(u, v)` in the unit square; a parameter nearer than
    /// `2^-48` to an extraordinary corner is moved off it, but has the corner's position.
    pub(crate) fn weights(&self, class: usize, u: f64, v: f64) -> JetWeights {
        let (mut class, mut u, mut v) = (class, u, v);
        let mut path: Vec<(usize, &Stencils)> = Vec::new();
        let mut corner = None;
        loop {
            match &self.classes[class].kind {
                Kind::Regular(grid) => {
                    let count = self.classes[class].vertex_count;
                    let mut weights = grid_weights(grid, count, u, v);
                    weights.rescale((1_u64 << path.len()) as f64);
                    for &(columns, matrix) in path.iter().rev() {
                        weights = weights.times(matrix, columns);
                    }
                    if let Some(valence) = corner {
                        let position = self.limit_position(valence, &path);
                        weights.row_mut(0).copy_from_slice(&position);
                    }
                    return weights;
                }
                Kind::Split(below) => {
                    if path.len() == MAX_DEPTH {
                        // Where many sectors meet a step shrinks the ring by a third only.
                        corner = self.classes[class].interior.filter(|_| u < 0.5 && v < 0.5);
                        (u, v) = (1.0 - u.round(), 1.0 - v.round());
                    }
                    let child = match (u < 0.5, v < 0.5) {
                        (true, true) => 0,
                        (false, true) => 1,
                        (false, false) => 2,
                        (true, false) => 3,
                    };
                    u = if u < 0.5 { 2.0 * u } else { 2.0 * u - 1.0 };
                    v = if v < 0.5 { 2.0 * v } else { 2.0 * v - 1.0 };
                    path.push((self.classes[class].vertex_count, &below[child].1));
                    class = below[child].0;
                }
                Kind::Pending => unreachable!("a class is finished before it can be evaluated"),
            }
        }
    }

    /// Weights of the limit position of an extraordinary corner that a path leads to.
    fn limit_position(&self, valence: usize, path: &[(usize, &Stencils)]) -> Vec<f64> {
        let mut weights = limit_masks(valence).position;
        // The last matrix leaves the corner's neighbourhood, the others lead to it.
        for &(columns, matrix) in path[..path.len() - 1].iter().rev() {
            let mut before = vec![0.0; columns];
            for (k, w) in weights.iter().enumerate() {
                let (at, row) = matrix.row(k);
                at.iter().zip(row).for_each(|(&c, m)| before[c as usize] += w * m);
            }
            weights = before;
        }
        weights
    }
}
