//! The arithmetic of the band Cholesky factorisation, for the vector unit at hand.
//!
//! Rows come in groups of `G` (three vectors). Group `I` is stored as `blocks + 1` square blocks
//! `G × G`, each by columns: block `b` holds columns `(I − blocks + b) G ..`, the last one is
//! the diagonal block. Blocks left of column 0 are never touched.

use std::ops::Range;

use pulp::{Simd, WithSimd};

/// Columns of a block that are processed before the tile moves on, so that both operands of a
/// tile stay in the first-level cache.
const DEPTH: usize = 96;

/// Panels formed at a time.
pub(super) const PANELS: usize = 4;

/// Rows of a group on this machine.
pub(super) fn group_rows() -> usize {
    struct Lanes;
    impl WithSimd for Lanes {
        type Output = usize;
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }
    if pulp::Arch::new().dispatch(Lanes) == 8 { 24 } else { 12 }
}

/// Where the blocks of the factor stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub(super) size: usize,
    pub(super) half_bandwidth: usize,
    /// Rows of a group.
    pub(super) rows: usize,
    /// Blocks left of the diagonal block.
    pub(super) blocks: usize,
}

impl Layout {
    pub(super) fn new(size: usize, half_bandwidth: usize, rows: usize) -> Self {
        let blocks = half_bandwidth.div_ceil(rows);
        Self { size, half_bandwidth, rows, blocks }
    }

    pub(super) fn groups(self) -> usize {
        self.size.div_ceil(self.rows)
    }

    pub(super) fn group_len(self) -> usize {
        (self.blocks + 1) * self.block_len()
    }

    fn block_len(self) -> usize {
        self.rows * self.rows
    }

    /// One past the last group that reaches into a panel.
    pub(super) fn groups_end(self, panel: usize) -> usize {
        self.groups().min(panel + self.blocks + 1)
    }

    /// Offset of block column `column` in group `group`.
    fn block(self, group: usize, column: usize) -> usize {
        (column + self.blocks - group) * self.block_len()
    }

    /// Copies block `(group, panel)` of the matrix; outside the band it is zero, past the end
    /// of the matrix the identity.
    #[inline(always)]
    fn load<const G: usize>(self, values: &[f64], group: usize, panel: usize, block: &mut [f64]) {
        let (g, n, kd) = (G, self.size, self.half_bandwidth);
        let (i0, j0) = (group * g, panel * g);
        if group > panel && i0 + g <= n && i0 + g <= j0 + kd + 1 {
            // All of it in the matrix and in the band.
            for (c, column) in block.as_chunks_mut::<G>().0.iter_mut().enumerate() {
                let at = (j0 + c) * kd + i0;
                *column = *values[at..].first_chunk().expect("within the band");
            }
            return;
        }
        for (c, column) in block.chunks_exact_mut(g).enumerate() {
            let j = j0 + c;
            let first = i0.max(j).min(i0 + g);
            let end = if j < n { (i0 + g).min(n).min(j + kd + 1).max(first) } else { first };
            column[..first - i0].fill(0.0);
            column[end - i0..].fill(0.0);
            if first < end {
                let at = j * kd;
                column[first - i0..end - i0].copy_from_slice(&values[at + first..at + end]);
            } else if j >= n && group == panel {
                column[c] = 1.0;
            }
        }
    }
}

/// `T −= A Bᵀ` for columns `C · PART ..` of a block, `a` and `b` by columns of length `G`.
#[inline(always)]
fn subtract_product<S: Simd, const R: usize, const C: usize, const G: usize, const PART: usize>(
    simd: S,
    a: &[[S::f64s; R]],
    b: &[[f64; G]],
    target: &mut [[S::f64s; R]],
) {
    let target = &mut target[C * PART..C * (PART + 1)];
    let mut sums = [[simd.splat_f64s(0.0); R]; C];
    for (a, b) in a.iter().zip(b) {
        for c in 0..C {
            let y = simd.splat_f64s(b[C * PART + c]);
            for r in 0..R {
                sums[c][r] = simd.mul_add_e_f64s(a[r], y, sums[c][r]);
            }
        }
    }
    for c in 0..C {
        for r in 0..R {
            target[c][r] = simd.sub_f64s(target[c][r], sums[c][r]);
        }
    }
}

/// `T −= A Bᵀ` for a whole block. `G` rows, `3 C` or `4 C`, make `R` vectors.
#[inline(always)]
fn subtract_block<S: Simd, const R: usize, const C: usize, const G: usize>(
    simd: S,
    a: &[f64],
    b: &[f64],
    target: &mut [f64],
) {
    let a = S::as_simd_f64s(a).0.as_chunks::<R>().0;
    let b = b.as_chunks::<G>().0;
    let target = S::as_mut_simd_f64s(target).0.as_chunks_mut::<R>().0;
    subtract_product::<S, R, C, G, 0>(simd, a, b, target);
    subtract_product::<S, R, C, G, 1>(simd, a, b, target);
    subtract_product::<S, R, C, G, 2>(simd, a, b, target);
    if G == 4 * C {
        subtract_product::<S, R, C, G, 3>(simd, a, b, target);
    }
}

/// Calls `$method` with the tile that suits the vector length. Of 16 registers a tile of 3 × 4
/// would need every one, and the compiler then spills a sum in the innermost loop.
macro_rules! with_tile {
    ($self:ident, $simd:ident, $method:ident) => {
        match S::F64_LANES {
            8 => $self.$method::<S, 3, 8, 24>($simd),
            4 => $self.$method::<S, 3, 3, 12>($simd),
            2 => $self.$method::<S, 6, 3, 12>($simd),
            _ => $self.$method::<S, 12, 3, 12>($simd),
        }
    };
}

/// Forms and factors the diagonal block of a panel; the error is the row of a bad pivot.
pub(super) struct FactorDiagonal<'s> {
    pub(super) layout: Layout,
    pub(super) values: &'s [f64],
    pub(super) shift: &'s [f64],
    pub(super) panel: usize,
    pub(super) group: &'s mut [f64],
}

impl WithSimd for FactorDiagonal<'_> {
    type Output = Result<(), usize>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        with_tile!(self, simd, run)
    }
}

impl FactorDiagonal<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const C: usize, const G: usize>(
        self,
        simd: S,
    ) -> Result<(), usize> {
        let Self { layout, values, shift, panel, group } = self;
        let (left, diagonal) = group.split_at_mut(layout.block(panel, panel));
        layout.load::<G>(values, panel, panel, diagonal);
        for c in 0..G.min(layout.size - panel * G) {
            diagonal[c * G + c] += shift[panel * G + c];
        }
        let left = &left[layout.block(panel, panel.saturating_sub(layout.blocks))..];
        for left in left.chunks(DEPTH * G) {
            subtract_block::<S, R, C, G>(simd, left, left, diagonal);
        }
        for c in 0..G {
            let (column, rest) = diagonal[c * G..].split_at_mut(G);
            let pivot = column[c];
            if !(pivot > 0.0 && pivot < f64::INFINITY) {
                return Err(panel * G + c);
            }
            let inverse = 1.0 / pivot.sqrt();
            // The upper triangle holds the other half of a symmetric product: not part of L.
            column[..c].fill(0.0);
            let column = S::as_mut_simd_f64s(column).0;
            for v in column.iter_mut() {
                *v = simd.mul_f64s(*v, simd.splat_f64s(inverse));
            }
            let column = &*column;
            for (k, other) in rest.chunks_exact_mut(G).enumerate() {
                let factor = simd.splat_f64s(entry::<S, G>(column, c + 1 + k));
                for (to, &from) in S::as_mut_simd_f64s(other).0.iter_mut().zip(column) {
                    *to = simd.sub_f64s(*to, simd.mul_f64s(factor, from));
                }
            }
        }
        Ok(())
    }
}

/// Entry `i` of a column held as vectors.
#[inline(always)]
fn entry<S: Simd, const G: usize>(column: &[S::f64s], i: usize) -> f64 {
    let values: &[f64] = bytemuck_view::<S>(&column[i / S::F64_LANES]);
    values[i % S::F64_LANES]
}

/// The numbers in a vector.
#[inline(always)]
fn bytemuck_view<S: Simd>(vector: &S::f64s) -> &[f64] {
    pulp::bytemuck::cast_slice(std::slice::from_ref(vector))
}

/// Forms the blocks of some panels in groups below them: `X = (A − Σ L Lᵀ) D⁻ᵀ`.
pub(super) struct UpdateGroups<'s> {
    pub(super) layout: Layout,
    pub(super) values: &'s [f64],
    pub(super) panels: Range<usize>,
    /// The panels' own groups, factored.
    pub(super) own: &'s [f64],
    /// Number of the first group of `groups`.
    pub(super) first: usize,
    pub(super) groups: &'s mut [f64],
}

impl WithSimd for UpdateGroups<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        with_tile!(self, simd, run);
    }
}

impl UpdateGroups<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const C: usize, const G: usize>(self, simd: S) {
        let Self { layout, values, panels: all, own, first, groups } = self;
        for (k, group) in groups.chunks_exact_mut(layout.group_len()).enumerate() {
            let index = first + k;
            let start = index.saturating_sub(layout.blocks);
            // The first panel may lie left of this group's band.
            let panels = all.start.max(start)..all.end;
            let own = &own[(panels.start - all.start) * layout.group_len()..];
            let (left, targets) = group.split_at_mut(layout.block(index, panels.start));
            let left = &left[layout.block(index, start)..];
            for (target, panel) in targets.chunks_exact_mut(G * G).zip(panels.clone()) {
                layout.load::<G>(values, index, panel, target);
            }
            for (depth, left) in left.chunks(DEPTH * G).enumerate() {
                let own = own.chunks_exact(layout.group_len()).zip(panels.clone());
                for (target, (own, panel)) in targets.chunks_exact_mut(G * G).zip(own) {
                    let right = &own[layout.block(panel, start) + depth * DEPTH * G..];
                    subtract_block::<S, R, C, G>(simd, left, &right[..left.len()], target);
                }
            }
            for (p, own) in own.chunks_exact(layout.group_len()).take(panels.len()).enumerate() {
                let panel = panels.start + p;
                let (done, target) = targets.split_at_mut(p * G * G);
                let target = &mut target[..G * G];
                let right = &own[layout.block(panel, panels.start)..];
                subtract_block::<S, R, C, G>(simd, done, &right[..done.len()], target);
                let diagonal = own[layout.block(panel, panel)..].as_chunks::<G>().0;
                solve_block::<S, R, G>(simd, diagonal, target);
            }
        }
    }
}

/// `T ← T D⁻ᵀ` with `D` lower triangular.
#[inline(always)]
fn solve_block<S: Simd, const R: usize, const G: usize>(
    simd: S,
    diagonal: &[[f64; G]],
    target: &mut [f64],
) {
    let columns = S::as_mut_simd_f64s(target).0.as_chunks_mut::<R>().0;
    for c in 0..G {
        let inverse = simd.splat_f64s(1.0 / diagonal[c][c]);
        let (done, rest) = columns.split_at_mut(c + 1);
        let x = &mut done[c];
        for r in 0..R {
            x[r] = simd.mul_f64s(x[r], inverse);
        }
        for (other, &l) in rest.iter_mut().zip(&diagonal[c][c + 1..]) {
            let l = simd.splat_f64s(-l);
            for r in 0..R {
                other[r] = simd.mul_add_e_f64s(l, x[r], other[r]);
            }
        }
    }
}

/// Forward substitution for the rows of one group.
pub(super) struct ForwardGroup<'s> {
    pub(super) layout: Layout,
    pub(super) index: usize,
    pub(super) group: &'s [f64],
    pub(super) x: &'s mut [f64],
}

impl WithSimd for ForwardGroup<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        with_tile!(self, simd, run);
    }
}

impl ForwardGroup<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const C: usize, const G: usize>(self, simd: S) {
        let Self { layout, index, group, x } = self;
        let start = index.saturating_sub(layout.blocks);
        let (known, rest) = x.split_at_mut(index * G);
        let known = &known[start * G..];
        let columns = &group[layout.block(index, start)..layout.block(index, index)];
        let columns = S::as_simd_f64s(columns).0.as_chunks::<R>().0;
        // Two sets of sums hide the latency of the multiply-adds.
        let mut sums = [[simd.splat_f64s(0.0); R]; 2];
        for (pair, known) in columns.chunks_exact(2).zip(known.chunks_exact(2)) {
            for h in 0..2 {
                let y = simd.splat_f64s(known[h]);
                for r in 0..R {
                    sums[h][r] = simd.mul_add_e_f64s(pair[h][r], y, sums[h][r]);
                }
            }
        }
        let own = &mut rest[..G];
        let target = S::as_mut_simd_f64s(own).0;
        for r in 0..R {
            target[r] = simd.sub_f64s(target[r], simd.add_f64s(sums[0][r], sums[1][r]));
        }
        let diagonal = group[layout.block(index, index)..].as_chunks::<G>().0;
        for c in 0..G {
            let value = own[c] / diagonal[c][c];
            own[c] = value;
            for i in c + 1..G {
                own[i] -= diagonal[c][i] * value;
            }
        }
    }
}

/// Backward substitution for the rows of one group.
pub(super) struct BackwardGroup<'s> {
    pub(super) layout: Layout,
    pub(super) index: usize,
    pub(super) group: &'s [f64],
    pub(super) x: &'s mut [f64],
}

impl WithSimd for BackwardGroup<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        with_tile!(self, simd, run);
    }
}

impl BackwardGroup<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const C: usize, const G: usize>(self, simd: S) {
        let Self { layout, index, group, x } = self;
        let start = index.saturating_sub(layout.blocks);
        let (open, rest) = x.split_at_mut(index * G);
        let own: &mut [f64; G] = (&mut rest[..G]).try_into().expect("G rows");
        let diagonal = group[layout.block(index, index)..].as_chunks::<G>().0;
        for c in (0..G).rev() {
            let sum: f64 = (c + 1..G).map(|i| diagonal[c][i] * own[i]).sum();
            own[c] = (own[c] - sum) / diagonal[c][c];
        }
        let own = S::as_simd_f64s(own.as_slice()).0;
        let columns = &group[layout.block(index, start)..layout.block(index, index)];
        let columns = S::as_simd_f64s(columns).0.as_chunks::<R>().0;
        for (column, open) in columns.iter().zip(&mut open[start * G..]) {
            let mut sum = simd.mul_f64s(column[0], own[0]);
            for r in 1..R {
                sum = simd.mul_add_e_f64s(column[r], own[r], sum);
            }
            *open -= simd.reduce_sum_f64s(sum);
        }
    }
}
