//! The dense product `XᵀX` of one element.

use pulp::{Simd, WithSimd};

/// Row length a packed element gets, so that rows begin at whole vectors.
pub(crate) fn padded(columns: usize) -> usize {
    columns.next_multiple_of(4)
}

/// Lower triangle of `XᵀX` for row-major `x` with rows of length `stride` (a multiple of 4, zero
/// beyond `columns`): entry `(a, b)`, `a ≥ b`, goes to `product[b * stride + a]`; what stands
/// above the diagonal is not meant to be read.
pub(crate) fn gram_into(x: &[f64], stride: usize, columns: usize, product: &mut Vec<f64>) {
    product.resize(stride * stride, 0.0);
    if columns <= 8 {
        // Too small for tiles.
        for b in 0..columns {
            for a in b..columns {
                product[b * stride + a] = x.chunks_exact(stride).map(|row| row[b] * row[a]).sum();
            }
        }
        return;
    }
    pulp::Arch::new().dispatch(Gram { x, stride, product });
}

struct Gram<'s> {
    x: &'s [f64],
    stride: usize,
    product: &'s mut [f64],
}

impl WithSimd for Gram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let lanes = S::F64_LANES;
        // Rows are padded to whole vectors of 4; longer vectors leave a rest to the shorter tiles.
        for b in (0..self.stride).step_by(4) {
            let mut a = b;
            while a + 2 * lanes <= self.stride {
                tile::<S, 2>(simd, self.x, self.stride, a, b, self.product);
                a += 2 * lanes;
            }
            while a + lanes <= self.stride {
                tile::<S, 1>(simd, self.x, self.stride, a, b, self.product);
                a += lanes;
            }
            for a in a..self.stride {
                for c in b..b + 4 {
                    self.product[c * self.stride + a] =
                        self.x.chunks_exact(self.stride).map(|row| row[a] * row[c]).sum();
                }
            }
        }
    }
}

/// `R` vectors from row `a` on by 4 columns from `b` on.
#[inline(always)]
fn tile<S: Simd, const R: usize>(
    simd: S,
    x: &[f64],
    stride: usize,
    a: usize,
    b: usize,
    product: &mut [f64],
) {
    let mut sums = [[simd.splat_f64s(0.0); R]; 4];
    for row in x.chunks_exact(stride) {
        let vectors = S::as_simd_f64s(&row[a..a + R * S::F64_LANES]).0;
        let factors: &[f64; 4] = row[b..b + 4].try_into().expect("4 columns");
        for c in 0..4 {
            let y = simd.splat_f64s(factors[c]);
            for r in 0..R {
                sums[c][r] = simd.mul_add_f64s(vectors[r], y, sums[c][r]);
            }
        }
    }
    for c in 0..4 {
        let to = (b + c) * stride + a;
        let to = S::as_mut_simd_f64s(&mut product[to..to + R * S::F64_LANES]).0;
        to[..R].copy_from_slice(&sums[c]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_agree_with_the_definition() {
        for columns in [1, 3, 8, 9, 12, 13, 31, 75, 76] {
            let stride = padded(columns);
            for rows in [1, 5, 9] {
                let mut x = vec![0.0; rows * stride];
                for r in 0..rows {
                    for c in 0..columns {
                        x[r * stride + c] = f64::from((7 * r + 13 * c) as u32 % 29) - 14.0;
                    }
                }
                let mut product = vec![f64::NAN; 3];
                gram_into(&x, stride, columns, &mut product);
                for b in 0..columns {
                    for a in b..columns {
                        let want: f64 = x.chunks(stride).map(|row| row[a] * row[b]).sum();
                        assert_eq!(product[b * stride + a], want, "{columns} {rows} {a} {b}");
                    }
                }
            }
        }
    }
}
