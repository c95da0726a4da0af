//! One interface to the three factorisations, and the choice between them.

use super::ordering::{half_bandwidth, reverse_cuthill_mckee};
use super::{BandCholesky, SymmetricPattern};
#[cfg(feature = "sparse")]
use super::{MultifrontalCholesky, SparseCholesky};
use crate::error::SolverError;

/// Speeds of the two factorisations (flops per second) their costs are compared with. Only the
/// ratio matters; measured on AVX2 and AVX-512 machines.
const BAND_SPEED: f64 = 40e9;
#[cfg(feature = "sparse")]
const SPARSE_SPEED: f64 = 12e9;
/// Seconds the sparse factorisation spends per stored value of the factor besides arithmetic.
#[cfg(feature = "sparse")]
const SPARSE_OVERHEAD: f64 = 2e-9;
/// A band with at least this share of structural nonzeros is taken without a look at the
/// sparse alternative.
const DENSE_BAND: f64 = 0.25;
/// Systems this small are factored as dense.
const SMALL: usize = 64;

/// Which factorisation the normal equations get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Factorization {
    /// Nested dissection if the problem has [runs](crate::Variables::set_runs), else band or sparse,
    /// whichever the structure makes cheaper.
    #[default]
    Auto,
    /// Our band Cholesky, in the caller's order or reverse Cuthill-McKee.
    Band,
    /// faer's supernodal Cholesky in approximate minimum degree order.
    Sparse,
    /// Our multifrontal Cholesky in nested dissection order; needs
    /// [runs](crate::Variables::set_runs), else as `Auto`.
    Dissection,
}

/// A factorisation that fits the structure.
pub(crate) enum Factor {
    Band(BandCholesky),
    #[cfg(feature = "sparse")]
    Sparse {
        cholesky: Box<SparseCholesky>,
        shifted: Vec<f64>,
    },
    #[cfg(feature = "sparse")]
    Dissected {
        cholesky: Box<MultifrontalCholesky>,
        shifted: Vec<f64>,
    },
}

/// Where the values of the normal matrix stand.
pub(crate) enum Storage<'a> {
    Band {
        stride: usize,
    },
    #[cfg_attr(not(feature = "sparse"), expect(dead_code, reason = "only bands there"))]
    Columns(&'a SymmetricPattern),
}

impl Factor {
    /// Chooses a factorisation for the pattern whose cliques are `groups` (positions in the
    /// natural order, each sorted). Returns it with the order to use: `order[k]` is the natural
    /// position that comes `k`-th, or `None` for the natural order. `together` numbers the positions
    /// that belong together, if the problem does.
    pub(crate) fn choose<'a>(
        size: usize,
        groups: impl Iterator<Item = &'a [u32]> + Clone,
        together: Option<&[usize]>,
        wanted: Factorization,
    ) -> Result<(Self, Option<Vec<usize>>), SolverError> {
        #[cfg(not(feature = "sparse"))]
        let _ = together;
        #[cfg(feature = "sparse")]
        if let Some(together) = together
            && (wanted == Factorization::Dissection
                || wanted == Factorization::Auto && size > SMALL)
        {
            let pattern = SymmetricPattern::from_cliques(size, groups);
            let cholesky = Box::new(MultifrontalCholesky::new(pattern, together)?);
            return Ok((Self::Dissected { cholesky, shifted: Vec::new() }, None));
        }
        let span = |g: &[u32]| g.last().zip(g.first()).map_or(0, |(b, a)| (b - a) as usize);
        let natural_kd = groups.clone().map(span).max().unwrap_or(0);
        if size <= SMALL && wanted != Factorization::Sparse {
            return Ok((Self::Band(BandCholesky::new(size, natural_kd)), None));
        }
        let pattern = SymmetricPattern::from_cliques(size, groups);
        let fill = pattern.len() as f64 / (size * (natural_kd + 1)).max(1) as f64;
        if fill >= DENSE_BAND && wanted != Factorization::Sparse {
            return Ok((Self::Band(BandCholesky::new(size, natural_kd)), None));
        }
        let seconds = |kd: usize| size as f64 * (kd as f64).powi(2) / BAND_SPEED;
        let mut band = (natural_kd, None);
        if wanted != Factorization::Sparse {
            let order = reverse_cuthill_mckee(&pattern);
            let mut position = vec![0; size];
            for (k, &i) in order.iter().enumerate() {
                position[i] = k;
            }
            let kd = half_bandwidth(&pattern, &position);
            // The caller's order stays unless the other is clearly better.
            if seconds(kd) < 0.8 * seconds(natural_kd) {
                band = (kd, Some(order));
            }
        }
        if wanted == Factorization::Band {
            return Ok((Self::Band(BandCholesky::new(size, band.0)), band.1));
        }
        Self::sparse_or_band(pattern, band, &seconds, wanted)
    }

    /// Without a sparse factorisation there is the band, whatever it costs.
    #[cfg(not(feature = "sparse"))]
    fn sparse_or_band(
        pattern: SymmetricPattern,
        band: (usize, Option<Vec<usize>>),
        _seconds: &dyn Fn(usize) -> f64,
        wanted: Factorization,
    ) -> Result<(Self, Option<Vec<usize>>), SolverError> {
        if wanted == Factorization::Sparse {
            return Err(SolverError::NeedsSparse);
        }
        Ok((Self::Band(BandCholesky::new(pattern.size(), band.0)), band.1))
    }

    /// The cheaper of the band and the sparse factorisation.
    #[cfg(feature = "sparse")]
    fn sparse_or_band(
        pattern: SymmetricPattern,
        band: (usize, Option<Vec<usize>>),
        seconds: &dyn Fn(usize) -> f64,
        wanted: Factorization,
    ) -> Result<(Self, Option<Vec<usize>>), SolverError> {
        let size = pattern.size();
        let cholesky = Box::new(SparseCholesky::new(pattern)?);
        let sparse_seconds =
            cholesky.flops() / SPARSE_SPEED + cholesky.factor_len() as f64 * SPARSE_OVERHEAD;
        if wanted != Factorization::Sparse && seconds(band.0) < sparse_seconds {
            return Ok((Self::Band(BandCholesky::new(size, band.0)), band.1));
        }
        Ok((Self::Sparse { cholesky, shifted: Vec::new() }, None))
    }

    pub(crate) fn storage(&self) -> Storage<'_> {
        match self {
            Self::Band(band) => Storage::Band { stride: band.slot(0, 1) },
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, .. } => Storage::Columns(cholesky.pattern()),
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, .. } => Storage::Columns(cholesky.pattern()),
        }
    }

    /// The half bandwidth, of a band; else that of a full matrix.
    pub(crate) fn half_bandwidth(&self) -> usize {
        match self {
            Self::Band(band) => band.half_bandwidth(),
            #[cfg(feature = "sparse")]
            Self::Sparse { .. } | Self::Dissected { .. } => usize::MAX,
        }
    }

    pub(crate) fn values_len(&self) -> usize {
        match self {
            Self::Band(band) => band.values_len(),
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, .. } => cholesky.pattern().len(),
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, .. } => cholesky.pattern().len(),
        }
    }

    /// Where diagonal entry `i` stands.
    pub(crate) fn diagonal_slot(&self, i: usize) -> usize {
        match self {
            Self::Band(band) => band.slot(i, i),
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, .. } => cholesky.pattern().column_starts()[i],
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, .. } => cholesky.pattern().column_starts()[i],
        }
    }

    /// Where the entry of two coupled positions stands, in either order; none if the structure has no
    /// place for it.
    pub(crate) fn slot(&self, a: usize, b: usize) -> Option<usize> {
        let (i, j) = (a.max(b), a.min(b));
        match self {
            Self::Band(band) => (i - j <= band.half_bandwidth()).then(|| band.slot(i, j)),
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, .. } => cholesky.pattern().slot(i, j),
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, .. } => cholesky.pattern().slot(i, j),
        }
    }

    /// Factors `A + diag(shift)`.
    pub(crate) fn factor(&mut self, values: &[f64], shift: &[f64]) -> Result<(), SolverError> {
        match self {
            Self::Band(band) => band.factor(values, shift),
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, shifted } => {
                add_to_diagonal(cholesky.pattern(), values, shift, shifted);
                cholesky.factor(shifted)
            }
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, shifted } => {
                add_to_diagonal(cholesky.pattern(), values, shift, shifted);
                cholesky.factor(shifted)
            }
        }
    }

    pub(crate) fn solve_in_place(&self, rhs: &mut [f64]) {
        match self {
            Self::Band(band) => band.solve_in_place(rhs),
            #[cfg(feature = "sparse")]
            Self::Sparse { cholesky, .. } => cholesky.solve_in_place(rhs),
            #[cfg(feature = "sparse")]
            Self::Dissected { cholesky, .. } => cholesky.solve_in_place(rhs),
        }
    }

    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Band(_) => "band",
            #[cfg(feature = "sparse")]
            Self::Sparse { .. } => "sparse",
            #[cfg(feature = "sparse")]
            Self::Dissected { .. } => "dissection",
        }
    }
}

/// `shifted = A + diag(shift)`.
#[cfg(feature = "sparse")]
fn add_to_diagonal(
    pattern: &SymmetricPattern,
    values: &[f64],
    shift: &[f64],
    shifted: &mut Vec<f64>,
) {
    shifted.clear();
    shifted.extend_from_slice(values);
    for (&start, s) in pattern.column_starts().iter().zip(shift) {
        shifted[start] += s;
    }
}
