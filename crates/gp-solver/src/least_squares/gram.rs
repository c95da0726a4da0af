//! The dense product `XᵀX` of one element.

/// Row length a packed element gets, so that rows begin at whole vectors.
pub(crate) fn padded(columns: usize) -> usize {
    columns.next_multiple_of(4)
}

/// Lower triangle of `XᵀX` for row-major `x` with rows of length `stride`, of which the first
/// `columns` count: entry `(a, b)`, `a ≥ b`, goes to `product[b * stride + a]`.
pub(crate) fn gram_into(x: &[f64], stride: usize, columns: usize, product: &mut Vec<f64>) {
    product.clear();
    product.resize(stride * columns, 0.0);
    for row in x.chunks_exact(stride) {
        for b in 0..columns {
            let y = row[b];
            let to = &mut product[b * stride + b..(b + 1) * stride];
            for (t, &value) in to.iter_mut().zip(&row[b..]) {
                *t += y * value;
            }
        }
    }
}
