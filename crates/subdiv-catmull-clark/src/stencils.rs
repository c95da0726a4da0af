//! Sparse matrices from old points to new ones.

use geom_core::DVec3;

/// A sparse matrix that makes new points from old ones; every row sums to one.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Creases, refine};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
/// let quad = PolyMesh::new(corners, &[[0, 1, 2, 3]])?;
/// let stencils = refine(&quad, &Creases::none())?.stencils;
/// // The last new point is the middle of the face.
/// assert_eq!(stencils.row(8), (&[0, 1, 2, 3][..], &[0.25; 4][..]));
/// // Refined again with other positions, at the cost of a product.
/// let raised: Vec<DVec3> = quad.positions().iter().map(|p| *p + DVec3::Z).collect();
/// assert_eq!(stencils.apply(&raised)[8], DVec3::new(0.5, 0.5, 1.0));
/// # Ok::<(), subdiv_catmull_clark::SubdivisionError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stencils {
    starts: Vec<usize>,
    columns: Vec<u32>,
    weights: Vec<f64>,
}

impl Stencils {
    pub(crate) fn with_capacity(rows: usize, entries: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self { starts, columns: Vec::with_capacity(entries), weights: Vec::with_capacity(entries) }
    }

    /// Adds a row of columns and weights in any order and empties it.
    pub(crate) fn push(&mut self, row: &mut Vec<(u32, f64)>) {
        row.sort_by_key(|&(column, _)| column);
        for &(column, weight) in row.iter() {
            let fresh = self.columns.len() == self.starts[self.starts.len() - 1]
                || self.columns[self.columns.len() - 1] != column;
            if fresh {
                self.columns.push(column);
                self.weights.push(weight);
            } else if let Some(last) = self.weights.last_mut() {
                *last += weight;
            }
        }
        self.starts.push(self.columns.len());
        row.clear();
    }

    /// The rows of the given new points alone, in this order.
    pub(crate) fn select(&self, rows: impl ExactSizeIterator<Item = usize>) -> Self {
        let mut out = Self::with_capacity(rows.len(), 8 * rows.len());
        for i in rows {
            let (columns, weights) = self.row(i);
            out.columns.extend_from_slice(columns);
            out.weights.extend_from_slice(weights);
            out.starts.push(out.columns.len());
        }
        out
    }

    /// Number of new points.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Old points and weights of new point `i`, sorted by index.
    #[must_use]
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.columns[range.clone()], &self.weights[range])
    }

    /// The new points.
    ///
    /// # Panics
    /// If `old` is shorter than the largest index.
    #[must_use]
    pub fn apply(&self, old: &[DVec3]) -> Vec<DVec3> {
        (0..self.rows())
            .map(|i| {
                let (columns, weights) = self.row(i);
                columns.iter().zip(weights).map(|(&c, &w)| w * old[c as usize]).sum()
            })
            .collect()
    }
}
