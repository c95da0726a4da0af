//! The unknowns behind the control points: free, fixed, or tied by symmetry.

use crate::symmetry::SymmetryGroup;
use geom_core::{DMat3, DVec3};

/// `x = base + B y`: every vertex has up to three unknowns, which vertices of one orbit share.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    base: Vec<DVec3>,
    /// First unknown of every vertex.
    pub(crate) start: Vec<u32>,
    /// Number of unknowns of every vertex, 0 to 3.
    pub(crate) dim: Vec<u8>,
    /// Directions of a vertex's unknowns.
    pub(crate) frame: Vec<DMat3>,
    // How many vertices share an unknown.
    copies: Vec<f64>,
}

impl Freedom {
    /// Unknowns of the vertices that are not fixed; the group keeps the fixed ones.
    pub(crate) fn new(positions: &[DVec3], fixed: &[bool], group: &SymmetryGroup) -> Self {
        let n = positions.len();
        let mut this = Self {
            base: positions.to_vec(),
            start: vec![0; n],
            dim: vec![0; n],
            frame: vec![DMat3::IDENTITY; n],
            copies: Vec::new(),
        };
        let mut seen = vec![false; n];
        for v in 0..n {
            if std::mem::replace(&mut seen[v], true) || fixed[v] {
                continue;
            }
            let (frame, dim) = fixed_directions(group, v);
            let start = this.copies.len();
            let mut orbit = 0.0;
            for s in &group.elements {
                let w = s.vertices[v] as usize;
                if w == v && orbit > 0.0 {
                    continue;
                }
                if w != v && std::mem::replace(&mut seen[w], true) {
                    continue;
                }
                orbit += 1.0;
                this.base[w] = group.centre;
                this.start[w] = start as u32;
                this.dim[w] = dim as u8;
                this.frame[w] = s.matrix * frame;
            }
            this.copies.extend(std::iter::repeat_n(orbit, dim));
        }
        this
    }

    /// Unknowns of single coordinates: `fixed` has three for every vertex. No symmetry is kept.
    pub(crate) fn of_coordinates(positions: &[DVec3], fixed: &[bool]) -> Self {
        let n = positions.len();
        let mut this = Self {
            base: positions.to_vec(),
            start: vec![0; n],
            dim: vec![0; n],
            frame: vec![DMat3::IDENTITY; n],
            copies: Vec::new(),
        };
        for v in 0..n {
            this.start[v] = this.copies.len() as u32;
            let mut dim = 0;
            for c in (0..3).filter(|c| !fixed[3 * v + c]) {
                *this.frame[v].col_mut(dim) = DMat3::IDENTITY.col(c);
                this.base[v][c] = 0.0;
                dim += 1;
            }
            this.dim[v] = dim as u8;
            this.copies.extend(std::iter::repeat_n(1.0, dim));
        }
        this
    }

    /// Number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.copies.len()
    }

    /// For every vertex with unknowns their number in the order of the unknowns, the same for the
    /// vertices that share them, and `u32::MAX` for the others; and first unknown and number of
    /// unknowns of every block.
    pub(crate) fn blocks(&self) -> (Vec<u32>, Vec<(usize, usize)>) {
        let mut first: Vec<(usize, usize)> = Vec::new();
        let mut block_of = vec![u32::MAX; self.base.len()];
        let mut at = vec![u32::MAX; self.len()];
        for v in (0..self.base.len()).filter(|&v| self.dim[v] > 0) {
            let start = self.start[v] as usize;
            if at[start] == u32::MAX {
                at[start] = first.len() as u32;
                first.push((start, self.dim[v] as usize));
            }
            block_of[v] = at[start];
        }
        (block_of, first)
    }

    /// The unknowns that come nearest to `x`.
    pub(crate) fn restrict(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.len()];
        for v in 0..self.base.len() {
            let offset = point(x, v) - self.base[v];
            for k in 0..self.dim[v] as usize {
                y[self.start[v] as usize + k] += self.frame[v].col(k).dot(offset);
            }
        }
        y.iter_mut().zip(&self.copies).for_each(|(y, c)| *y /= c);
        y
    }

    /// Control points from unknowns.
    pub(crate) fn expand(&self, y: &[f64], x: &mut [f64]) {
        for v in 0..self.base.len() {
            let mut p = self.base[v];
            for k in 0..self.dim[v] as usize {
                p += y[self.start[v] as usize + k] * self.frame[v].col(k);
            }
            x[3 * v..3 * v + 3].copy_from_slice(&p.to_array());
        }
    }

    /// `Bᵀ g`.
    pub(crate) fn pull_back(&self, gradient: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for v in 0..self.base.len() {
            let g = point(gradient, v);
            for k in 0..self.dim[v] as usize {
                out[self.start[v] as usize + k] += self.frame[v].col(k).dot(g);
            }
        }
    }
}

fn point(x: &[f64], v: usize) -> DVec3 {
    DVec3::new(x[3 * v], x[3 * v + 1], x[3 * v + 2])
}

/// Directions that all symmetries which keep `v` leave alone, as the first columns of a matrix.
fn fixed_directions(group: &SymmetryGroup, v: usize) -> (DMat3, usize) {
    let mut mean = DMat3::ZERO;
    let mut count = 0.0;
    for s in group.elements.iter().filter(|s| s.vertices[v] as usize == v) {
        mean += s.matrix;
        count += 1.0;
    }
    if count <= 1.0 {
        return (DMat3::IDENTITY, 3);
    }
    // The mean over a group is the orthogonal projection onto what it fixes.
    let projection = mean * (1.0 / count);
    let mut frame = DMat3::ZERO;
    let mut dim = 0;
    for _ in 0..3 {
        let mut best = DVec3::ZERO;
        for k in 0..3 {
            let mut column = projection.col(k);
            for j in 0..dim {
                column = column.reject_from(frame.col(j));
            }
            if column.length() > best.length() {
                best = column;
            }
        }
        if best.length() < 0.1 {
            break;
        }
        *frame.col_mut(dim) = best.normalize();
        dim += 1;
    }
    (frame, dim)
}
