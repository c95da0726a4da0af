//! Quadrature rules and the bases tabulated at their nodes.

pub(crate) use numerics::gauss_legendre;
use subdiv_catmull_clark::{BasisId, SubdivisionSurface, cubic_basis};

/// Widest vector the kernels meet; tables are padded to it.
pub(crate) const MAX_LANES: usize = 8;

/// Gauss-Legendre points per side of a patch; a text such as `8x16` in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quadrature {
    /// On bi-cubic patches.
    pub regular: usize,
    /// On patches with an extraordinary corner, at the boundary and at creases.
    pub extraordinary: usize,
}

impl Quadrature {
    /// For descending: 4×4 and 16×16 points.
    pub const COARSE: Self = Self { regular: 4, extraordinary: 16 };
    /// For reporting: 8×8 and 16×16 points.
    pub const NORMAL: Self = Self { regular: 8, extraordinary: 16 };
    /// The check on [`Self::NORMAL`]: 12×12 and 32×32 points.
    pub const FINE: Self = Self { regular: 12, extraordinary: 32 };
}

impl Quadrature {
    /// Points per side of the patches of a basis.
    ///
    /// Three quarters of those on other patches with an extraordinary corner are enough at the vertex
    /// of a blend of several rings, where little is left of the Catmull-Clark surface's knots.
    pub(crate) fn nodes(self, surface: &SubdivisionSurface, basis: BasisId) -> usize {
        if surface.is_smooth(basis) {
            self.regular
        } else if surface.is_wide(basis) {
            (3 * self.extraordinary).div_ceil(4)
        } else {
            self.extraordinary
        }
    }
}

impl Default for Quadrature {
    fn default() -> Self {
        Self::NORMAL
    }
}

/// `n` nodes on `[0, 1]`, a Gauss-Legendre rule on each quarter if `n` is a multiple of 4: patches
/// that are not bi-cubic have knots at the quarters, where third derivatives jump.
pub(crate) fn quartered(n: usize) -> Vec<(f64, f64)> {
    if !n.is_multiple_of(4) {
        return gauss_legendre(n);
    }
    let rule = gauss_legendre(n / 4);
    let quarter = |q: u8| rule.iter().map(move |&(x, w)| (0.25 * (f64::from(q) + x), 0.25 * w));
    (0..4).flat_map(quarter).collect()
}

/// A tensor-product rule on bi-cubic patches, evaluated one direction after the other.
#[derive(Clone, Debug)]
pub(crate) struct SeparableRule {
    pub(crate) nodes: usize,
    /// `basis[node][d][k]`: derivative `d` of B-spline `k`.
    pub(crate) basis: Vec<[[f64; 4]; 4]>,
    /// `weights[i · nodes + j]` of a pair of nodes.
    pub(crate) weights: Vec<f64>,
    /// Position of grid point `4 i + j` among the patch's control points.
    pub(crate) order: [usize; 16],
}

impl SeparableRule {
    pub(crate) fn new(surface: &SubdivisionSurface, basis: BasisId, nodes: usize) -> Option<Self> {
        let grid = surface.b_spline_grid(basis)?;
        let order = std::array::from_fn(|k| grid[k][0].0);
        let rule = gauss_legendre(nodes);
        let basis = rule.iter().map(|&(x, _)| cubic_basis(x)).collect();
        let weights = rule.iter().flat_map(|a| rule.iter().map(|b| a.1 * b.1)).collect();
        Some(Self { nodes, basis, weights, order })
    }
}

/// A basis tabulated at all nodes.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// Number of control points.
    pub(crate) controls: usize,
    /// Number of samples, a multiple of [`MAX_LANES`].
    pub(crate) samples: usize,
    /// Derivative `d` (the nine after the position) of control point `k`'s weight at all samples, in
    /// blocks of [`MAX_LANES`] of them: sample `s` stands at
    /// `((s / MAX_LANES · 9 + d) · controls + k) · MAX_LANES + s % MAX_LANES`. What one vector of
    /// samples needs lies together, which the caches of a table this size ask for.
    pub(crate) values: Vec<f64>,
    pub(crate) weights: Vec<f64>,
}

impl Table {
    pub(crate) fn new(surface: &SubdivisionSurface, basis: BasisId, nodes: usize) -> Self {
        let rule = if surface.is_smooth(basis) { gauss_legendre(nodes) } else { quartered(nodes) };
        let samples = (nodes * nodes).next_multiple_of(MAX_LANES);
        let controls = surface.weights(basis, 0.5, 0.5).control_points();
        let mut values = vec![0.0; 9 * controls * samples];
        let mut weights = vec![0.0; samples];
        for s in 0..samples {
            let node = s.min(nodes * nodes - 1);
            let ((u, wu), (v, wv)) = (rule[node / nodes], rule[node % nodes]);
            let table = surface.weights(basis, u, v);
            for d in 0..9 {
                for (k, &w) in table.row(d + 1).iter().enumerate() {
                    let block = (s / MAX_LANES * 9 + d) * controls + k;
                    values[block * MAX_LANES + s % MAX_LANES] = w;
                }
            }
            if s < nodes * nodes {
                weights[s] = wu * wv;
            }
        }
        Self { controls, samples, values, weights }
    }

    /// Where the vectors of a chunk of `lanes` samples begin among all vectors of that width, and
    /// the distance from one control point to the next.
    #[inline(always)]
    pub(crate) fn chunk(&self, chunk: usize, lanes: usize) -> (usize, usize) {
        let per_block = MAX_LANES / lanes;
        let block = chunk / per_block * 9 * self.controls;
        (block * per_block + chunk % per_block, per_block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_polynomials_exactly() {
        for n in [1, 2, 4, 8, 12, 16, 32] {
            let quarters = if n % 4 == 0 { n / 4 } else { n };
            for (rule, exact) in [(gauss_legendre(n), n), (quartered(n), quarters)] {
                for power in 0..2 * exact {
                    let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                    let want = 1.0 / (power as f64 + 1.0);
                    assert!((sum - want).abs() < 1e-14, "{n} points, power {power}: {sum}");
                }
            }
        }
    }
}
