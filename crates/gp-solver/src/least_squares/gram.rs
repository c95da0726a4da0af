//! Adding the product `XᵀX` of one element to the normal matrix.
//!
//! Columns of an element that follow one another in the system form a *run*. Packed, every run
//! begins at a whole vector and ends padded with zeros, so that the product of two runs is made of
//! register tiles each of which goes straight to where it belongs: entries of a column of the
//! matrix that belong to one run stand side by side. The padding adds zeros to what stands there.

use pulp::{Simd, WithSimd};

/// Consecutive positions of an element's sorted columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// First column of the element in this run, and one past its last.
    pub(crate) begin: u32,
    pub(crate) end: u32,
    /// Where the run begins when packed.
    pub(crate) at: u32,
}

impl Run {
    pub(crate) fn len(self) -> usize {
        (self.end - self.begin) as usize
    }

    /// Where the next run begins when packed.
    pub(crate) fn packed_end(self) -> u32 {
        self.at + (self.end - self.begin).next_multiple_of(PADDING)
    }
}

/// Runs are padded to a multiple of this: whole vectors of up to 512 bits.
const PADDING: u32 = 8;

/// Where the products of an element go.
#[derive(Clone, Copy)]
pub(crate) enum Targets<'a> {
    /// Band storage: entry `(i, j)` stands at `j · stride + i`.
    Band { stride: usize, positions: &'a [u32] },
    /// For each column `b` of the element and each run from its own on: where the entry of the
    /// run's first row (of row `b` in its own run) stands.
    Columns(&'a [u32]),
}

impl Targets<'_> {
    /// Where the entry of the first row of run `other` and column `c` of run `own` stands; `before` is
    /// the number of table entries of the columns of earlier runs.
    #[inline(always)]
    fn of(self, runs: &[Run], before: usize, own: usize, c: usize, other: usize) -> usize {
        match self {
            Targets::Band { stride, positions } => {
                let column = positions[runs[own].begin as usize + c] as usize;
                column * stride + positions[runs[other].begin as usize] as usize
            }
            Targets::Columns(table) => {
                let entry = table[before + c * (runs.len() - own) + other - own] as usize;
                // In its own run a column's entry is the diagonal one.
                if other == own { entry - c } else { entry }
            }
        }
    }
}

/// Adds the lower triangle of `XᵀX` to the matrix and puts `Xᵀr` into `products`, by packed column;
/// `x` holds packed rows of length `stride`.
pub(crate) struct AddGram<'a> {
    pub(crate) x: &'a [f64],
    pub(crate) stride: usize,
    pub(crate) runs: &'a [Run],
    pub(crate) targets: Targets<'a>,
    pub(crate) residuals: &'a [f64],
    pub(crate) values: &'a mut [f64],
    pub(crate) products: &'a mut Vec<f64>,
}

impl WithSimd for AddGram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { x, stride, runs, targets, residuals, values, products } = self;
        products.clear();
        products.resize(stride, 0.0);
        for (row, &r) in x.chunks_exact(stride).zip(residuals) {
            let r = simd.splat_f64s(r);
            let sums = S::as_mut_simd_f64s(products).0;
            for (sum, &value) in sums.iter_mut().zip(S::as_simd_f64s(row).0) {
                *sum = simd.mul_add_e_f64s(value, r, *sum);
            }
        }
        if residuals.len() <= FEW_ROWS {
            return add_few_rows(x, stride, runs, targets, values);
        }
        let lanes = S::F64_LANES;
        // Number of targets of the columns of earlier runs.
        let mut before = 0;
        for (own, run) in runs.iter().enumerate() {
            let from_here = runs.len() - own;
            for c in (0..run.len()).step_by(2) {
                let columns = (run.len() - c).min(2);
                for (other, rows) in runs.iter().enumerate().skip(own) {
                    let mut to = [0; 2];
                    for (q, to) in to[..columns].iter_mut().enumerate() {
                        *to = targets.of(runs, before, own, c + q, other);
                    }
                    let pair = Pair { at: run.at as usize + c, targets: &to[..columns] };
                    let (first, diagonal) =
                        if other == own { (c / lanes * lanes, Some(c)) } else { (0, None) };
                    add_products(simd, (x, stride), *rows, first, diagonal, pair, values);
                }
            }
            before += run.len() * from_here;
        }
    }
}

/// Tiles do not pay for elements of up to this many rows.
const FEW_ROWS: usize = 2;

/// Adds the products of a row or two entry by entry.
#[inline(always)]
fn add_few_rows(x: &[f64], stride: usize, runs: &[Run], targets: Targets<'_>, values: &mut [f64]) {
    let mut before = 0;
    for (own, run) in runs.iter().enumerate() {
        for c in 0..run.len() {
            for (other, rows) in runs.iter().enumerate().skip(own) {
                let first = if other == own { c } else { 0 };
                let begin = targets.of(runs, before, own, c, other) + first;
                let to = &mut values[begin..begin + rows.len() - first];
                for row in x.chunks_exact(stride) {
                    let factor = row[run.at as usize + c];
                    let from = &row[rows.at as usize + first..];
                    for (to, &value) in to.iter_mut().zip(from) {
                        *to += factor * value;
                    }
                }
            }
        }
        before += run.len() * (runs.len() - own);
    }
}

/// `sums[c][r] = Σ_k x[k][b + c] · (vector r of x[k] from a on)`.
#[inline(always)]
fn tile<S: Simd, const R: usize>(
    simd: S,
    x: &[f64],
    stride: usize,
    a: usize,
    b: usize,
) -> [[S::f64s; R]; 2] {
    let mut sums = [[simd.splat_f64s(0.0); R]; 2];
    for row in x.chunks_exact(stride) {
        let vectors = &S::as_simd_f64s(&row[a..a + R * S::F64_LANES]).0[..R];
        let factors = &row[b..b + 2];
        let (first, second) = (simd.splat_f64s(factors[0]), simd.splat_f64s(factors[1]));
        for r in 0..R {
            sums[0][r] = simd.mul_add_e_f64s(vectors[r], first, sums[0][r]);
            sums[1][r] = simd.mul_add_e_f64s(vectors[r], second, sums[1][r]);
        }
    }
    sums
}

/// A pair of columns and where their products go.
#[derive(Clone, Copy)]
struct Pair<'a> {
    /// The first of them in the packed rows.
    at: usize,
    /// For each column, where the entry of the first row of a run stands.
    targets: &'a [usize],
}

/// The products of a pair of columns with the rows of a run, from row `first` on; entries of
/// column `q` of the pair above row `diagonal + q` are left alone.
#[inline(always)]
fn add_products<S: Simd>(
    simd: S,
    x: (&[f64], usize),
    rows: Run,
    first: usize,
    diagonal: Option<usize>,
    pair: Pair<'_>,
    values: &mut [f64],
) {
    let lanes = S::F64_LANES;
    let mut k = first;
    while k + 3 * lanes < rows.len() {
        add_tile::<S, 4>(simd, x, rows, k, diagonal, pair, values);
        k += 4 * lanes;
    }
    while k + lanes < rows.len() {
        add_tile::<S, 2>(simd, x, rows, k, diagonal, pair, values);
        k += 2 * lanes;
    }
    if k < rows.len() {
        add_tile::<S, 1>(simd, x, rows, k, diagonal, pair, values);
    }
}

/// `R` vectors of rows from row `k` of the run on.
#[inline(always)]
fn add_tile<S: Simd, const R: usize>(
    simd: S,
    (x, stride): (&[f64], usize),
    rows: Run,
    k: usize,
    diagonal: Option<usize>,
    pair: Pair<'_>,
    values: &mut [f64],
) {
    let mut sums = tile::<S, R>(simd, x, stride, rows.at as usize + k, pair.at);
    if let Some(diagonal) = diagonal {
        // Other entries stand above the diagonal: they get nothing added.
        let numbers = S::as_simd_f64s(&NUMBERS[..R * S::F64_LANES]).0;
        for (q, sums) in sums.iter_mut().enumerate() {
            let least = simd.splat_f64s((diagonal + q) as f64 - k as f64);
            for r in 0..R {
                let below = simd.greater_than_or_equal_f64s(numbers[r], least);
                sums[r] = simd.select_f64s(below, sums[r], simd.splat_f64s(0.0));
            }
        }
    }
    for (sums, &target) in sums.iter().zip(pair.targets) {
        let begin = target + k;
        if let Some(to) = values.get_mut(begin..begin + R * S::F64_LANES) {
            let to = &mut S::as_mut_simd_f64s(to).0[..R];
            for r in 0..R {
                to[r] = simd.add_f64s(to[r], sums[r]);
            }
        } else {
            // The padding would reach past the end of the matrix.
            let numbers: &[f64] = pulp::bytemuck::cast_slice(sums);
            for (to, &value) in values[begin..target + rows.len()].iter_mut().zip(numbers) {
                *to += value;
            }
        }
    }
}

/// Row numbers of a tile.
const NUMBERS: [f64; 32] = {
    let mut numbers = [0.0; 32];
    let mut k = 0;
    while k < 32 {
        numbers[k] = k as f64;
        k += 1;
    }
    numbers
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs columns `0..k` in runs that end before the columns `breaks`.
    fn runs(k: usize, breaks: &[usize]) -> (Vec<Run>, usize) {
        let mut runs: Vec<Run> = Vec::new();
        let mut at = 0;
        let mut begin = 0;
        for end in breaks.iter().copied().chain([k]) {
            let run = Run { begin: begin as u32, end: end as u32, at };
            runs.push(run);
            at = run.packed_end();
            begin = end;
        }
        (runs, at as usize)
    }

    #[test]
    fn tiles_agree_with_the_definition_and_touch_nothing_else() {
        let cases: [(usize, &[usize]); 7] = [
            (1, &[]),
            (3, &[1]),
            (9, &[]),
            (13, &[4, 9]),
            (31, &[15, 30]),
            (75, &[15, 30, 45, 60]),
            (40, &[1, 2, 3, 20, 37]),
        ];
        for (k, breaks) in cases {
            let (runs, stride) = runs(k, breaks);
            // A gap between runs, so that positions are not columns.
            let positions: Vec<u32> = (runs.iter().enumerate())
                .flat_map(|(r, run)| (run.begin..run.end).map(move |c| c + 2 * r as u32))
                .collect();
            let size = positions[k - 1] as usize + 1;
            for rows in [1, 2, 5, 9] {
                let mut x = vec![0.0; rows * stride];
                for r in 0..rows {
                    for run in &runs {
                        for c in run.begin..run.end {
                            let number = f64::from((7 * r as u32 + 13 * c) % 29) - 14.0;
                            x[r * stride + (run.at + c - run.begin) as usize] = number;
                        }
                    }
                }
                let entry =
                    |r: usize, c: usize| f64::from((7 * r as u32 + 13 * c as u32) % 29) - 14.0;
                let band = size - 1;
                let mut values = vec![0.5; size * size];
                let residuals = [1.0, -2.0, 3.0, 0.5, 4.0, -1.0, 2.0, 0.25, 8.0];
                let mut products = vec![f64::NAN; 3];
                pulp::Arch::new().dispatch(AddGram {
                    x: &x,
                    stride,
                    runs: &runs,
                    targets: Targets::Band { stride: band, positions: &positions },
                    residuals: &residuals[..rows],
                    values: &mut values,
                    products: &mut products,
                });
                for run in &runs {
                    for c in run.begin..run.end {
                        let c = c as usize;
                        let want: f64 = (0..rows).map(|r| entry(r, c) * residuals[r]).sum();
                        assert_eq!(products[run.at as usize + c - run.begin as usize], want);
                    }
                }
                for b in 0..k {
                    for a in b..k {
                        let want: f64 = (0..rows).map(|r| entry(r, a) * entry(r, b)).sum();
                        let slot =
                            &mut values[positions[b] as usize * band + positions[a] as usize];
                        assert_eq!(*slot, 0.5 + want, "{k} {rows} {a} {b}");
                        *slot = 0.5;
                    }
                }
                assert!(values.iter().all(|&v| v == 0.5), "{k} {rows}");
            }
        }
    }
}
