//! Dense kernels of the fronts, by faer; always on the calling thread, because faer's result bits
//! depend on the number of threads it may use.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};

/// Replaces the first `own` columns of a symmetric matrix with `size` rows, lower triangle by
/// columns, by those of its Cholesky factor.
///
/// # Errors
/// The column whose pivot is not positive, or not finite.
pub(super) fn eliminate_leading(panel: &mut [f64], own: usize, size: usize) -> Result<(), usize> {
    if own == 0 {
        return Ok(());
    }
    let mut memory =
        MemBuffer::new(cholesky_in_place_scratch::<f64>(own, Par::Seq, Default::default()));
    let matrix = MatMut::from_column_major_slice_mut(panel, size, own);
    let (mut square, below) = matrix.split_at_row_mut(own);
    let done = cholesky_in_place(
        square.rb_mut(),
        Default::default(),
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    );
    if let Err(LltError::NonPositivePivot { index }) = done {
        return Err(index);
    }
    solve_lower_triangular_in_place(square.rb(), below.transpose_mut(), Par::Seq);
    // NaN passes some comparisons, so the pivots themselves are the witness.
    match (0..own).find(|&k| !(panel[k * size + k] > 0.0 && panel[k * size + k].is_finite())) {
        Some(k) => Err(k),
        None => Ok(()),
    }
}

/// What a product does with what is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Product {
    IsAdded,
    Replaces,
}

/// `update −= B Bᵀ` or `update = −B Bᵀ` in the lower triangle, `B` the rows from `own` on of a
/// factored panel; what stands above the diagonal is left alone.
pub(super) fn subtract_lower(
    update: &mut [f64],
    panel: &[f64],
    own: usize,
    size: usize,
    product: Product,
) {
    let rest = size - own;
    if rest == 0 {
        return;
    }
    let accumulate = match product {
        Product::IsAdded => Accum::Add,
        Product::Replaces => Accum::Replace,
    };
    let below = MatRef::from_column_major_slice(panel, size, own).split_at_row(own).1;
    matmul(
        MatMut::from_column_major_slice_mut(update, rest, rest),
        BlockStructure::TriangularLower,
        accumulate,
        below,
        BlockStructure::Rectangular,
        below.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        Par::Seq,
    );
}
