//! The polynomial that stands in for the surface near an extraordinary vertex.

use crate::blend::{septic_step, weight_jet};
use crate::jet::{JET_LEN, Jet, JetWeights, cubic_basis, jet_product, separable_jet};
use crate::modes::{rotational_minimizers, two_ring_columns};
use crate::monomials::{MONOMIALS, monomial_jets};
use numerics::gauss_jordan;

/// Cells per side and Gauss points per cell side of the integral the guide minimises.
pub(crate) const CELLS: usize = 4;
pub(crate) const GAUSS_6: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// The surface near an extraordinary vertex as a linear function of its two-ring.
///
/// `S = (1 − w) (S_CC + Σ d N) + w q` on the patches around the vertex, with `w` the septic step over
/// the whole ring. The guide `q` is a polynomial of degree five in the characteristic coordinates
/// `(ξ, η)`. `N` are the basis functions of the twice refined mesh that leave the ring's outer
/// boundary alone; they repair the Catmull-Clark surface where it fades out, which cannot hold a
/// quadratic. The coefficients of `q` and the `d` minimise `Σ ∫ |∇³ S|² dξ dη`. As that measures just
/// the third derivatives, no ripples are left in the blend, and `q` may have any curvature.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    valence: usize,
    /// `(MONOMIALS + points()) × points()`, row-major: the polynomial's coefficients, then the `d`
    /// in the order of the two-ring.
    coefficients: Vec<f64>,
}

/// Position among the `2n + 8` control points around an extraordinary vertex of the one at `(i, j)`
/// of sector 0's grid, the vertex itself at `(0, 0)`; `None` outside of the two-ring.
fn grid_position(n: usize, i: isize, j: isize) -> Option<usize> {
    Some(match (i, j) {
        (0, 0) => 0,
        (1, 0) => 1,
        (1, 1) => 2,
        (0, 1) => 3,
        (-1, 1) => 4,
        (-1, 0) => 1 + 4 % (2 * n),
        (0, -1) => 2 * n - 1,
        (1, -1) => 2 * n,
        (2, -1) => 2 * n + 1,
        (2, 0) => 2 * n + 2,
        (2, 1) => 2 * n + 3,
        (2, 2) => 2 * n + 4,
        (1, 2) => 2 * n + 5,
        (0, 2) => 2 * n + 6,
        (-1, 2) => 2 * n + 7,
        _ => return None,
    })
}

/// Jets at `(u, v)` in sector 0 of the basis functions of the twice refined mesh's `2n + 8` vertices
/// around the extraordinary one.
fn repair_weights(
    n: usize,
    weights: &impl Fn(f64, f64) -> JetWeights,
    u: f64,
    v: f64,
) -> JetWeights {
    let cells = CELLS as f64;
    let (a, b) = ((cells * u).min(cells - 1.0).floor(), (cells * v).min(cells - 1.0).floor());
    let (s, t) = (cells * u - a, cells * v - b);
    let mut out = if a + b == 0.0 {
        weights(s, t)
    } else {
        let (along, across) = (cubic_basis(s), cubic_basis(t));
        let mut out = JetWeights::zeros(2 * n + 8);
        for (i, j) in (0..16).map(|k| (k / 4, k % 4)) {
            let place = grid_position(n, a as isize + i as isize - 1, b as isize + j as isize - 1);
            if let Some(place) = place {
                let [f, g] =
                    [(&along, i), (&across, j)].map(|(b, k)| std::array::from_fn(|d| b[d][k]));
                out.set_jet(place, &separable_jet(&f, &g));
            }
        }
        out
    };
    out.rescale(cells);
    out
}

impl Guide {
    /// Fits the guide of valence `n`: `weights` evaluates the Catmull-Clark patch, `map` is the
    /// characteristic map on its control points.
    pub(crate) fn new(
        n: usize,
        map: &[[f64; 2]],
        weights: impl Fn(f64, f64) -> JetWeights,
    ) -> Self {
        let mut rows = Vec::new();
        for cell in 0..CELLS * CELLS {
            let corner = [cell / CELLS, cell % CELLS].map(|c| c as f64 / CELLS as f64);
            for (x, wx) in GAUSS_6 {
                for (y, wy) in GAUSS_6 {
                    let u = corner[0] + x / CELLS as f64;
                    let v = corner[1] + y / CELLS as f64;
                    let measure = wx * wy / (CELLS * CELLS) as f64;
                    let repair = repair_weights(n, &weights, u, v);
                    let fade = weight_jet(septic_step, u, v);
                    sample_rows(&weights(u, v), Some(&repair), map, &fade, measure, &mut rows);
                }
            }
        }
        Self { valence: n, coefficients: rotational_minimizers(n, &rows) }
    }

    /// Number of control points: the vertex and its two rings.
    pub(crate) fn points(&self) -> usize {
        6 * self.valence + 1
    }

    /// Jets at `(u, v)` of the control points' weights on the blended patch of sector 0; `weights`
    /// evaluates the Catmull-Clark patch.
    pub(crate) fn blend(
        &self,
        weights: impl Fn(f64, f64) -> JetWeights,
        map: &[[f64; 2]],
        u: f64,
        v: f64,
    ) -> JetWeights {
        let plain = weights(u, v);
        let repair = repair_weights(self.valence, &weights, u, v);
        let fade = weight_jet(septic_step, u, v);
        let mut rest = fade.map(|x| -x);
        rest[0] += 1.0;
        let columns = two_ring_columns(self.valence, 0);
        let points = self.points();
        // What every coefficient adds.
        let mut terms: Vec<(usize, Jet)> = monomial_jets(&coordinate_jets(&plain, map))
            .iter()
            .map(|m| jet_product(&fade, m))
            .enumerate()
            .collect();
        terms.extend(
            columns
                .iter()
                .enumerate()
                .map(|(k, &c)| (MONOMIALS + c, jet_product(&rest, &repair.jet(k))))
                // All but sixteen, except next to the vertex.
                .filter(|(_, term)| term.iter().any(|&x| x != 0.0)),
        );
        let mut wide = vec![[0.0; JET_LEN]; points];
        for (k, &c) in columns.iter().enumerate() {
            wide[c] = jet_product(&rest, &plain.jet(k));
        }
        for (row, term) in &terms {
            let row = &self.coefficients[row * points..(row + 1) * points];
            for (jet, coefficient) in wide.iter_mut().zip(row) {
                for d in 0..JET_LEN {
                    jet[d] += coefficient * term[d];
                }
            }
        }
        let mut out = JetWeights::zeros(points);
        for (c, jet) in wide.iter().enumerate() {
            out.set_jet(c, jet);
        }
        out
    }
}

/// Jets of the characteristic coordinates.
pub(crate) fn coordinate_jets(plain: &JetWeights, map: &[[f64; 2]]) -> [Jet; 2] {
    [0, 1].map(|axis| {
        std::array::from_fn(|d| plain.row(d).iter().zip(map).map(|(w, p)| w * p[axis]).sum())
    })
}

/// The four weighted third derivatives by `(ξ, η)` at one sample: of `w` times each monomial, then
/// of `1 − w` times each repair and each control point's weight.
pub(crate) fn sample_rows(
    plain: &JetWeights,
    repair: Option<&JetWeights>,
    map: &[[f64; 2]],
    fade: &Jet,
    measure: f64,
    rows: &mut Vec<f64>,
) {
    let coordinates = coordinate_jets(plain, map);
    let area =
        (coordinates[0][1] * coordinates[1][2] - coordinates[1][1] * coordinates[0][2]).abs();
    let mut local = coordinates;
    local[0][0] = 0.0;
    local[1][0] = 0.0;
    // Column k: the (u, v) jet of the k-th local monomial; solving with it turns (u, v) jets into
    // Taylor coefficients in (ξ, η).
    let taylor = monomial_jets(&local);
    let mut system = [[0.0; JET_LEN]; JET_LEN];
    for d in 0..JET_LEN {
        for k in 0..JET_LEN {
            system[d][k] = taylor[k][d];
        }
    }
    let mut rest = fade.map(|x| -x);
    rest[0] += 1.0;
    let mut columns: Vec<Jet> =
        monomial_jets(&coordinates).iter().map(|m| jet_product(fade, m)).collect();
    for weights in repair.into_iter().chain([plain]) {
        columns.extend((0..weights.control_points()).map(|k| jet_product(&rest, &weights.jet(k))));
    }
    gauss_jordan(&mut system, &mut columns);
    // |∇³f|² = f_xxx² + 3 f_xxy² + 3 f_xyy² + f_yyy², with f_xxx = 6 c₃₀ and f_xxy = 2 c₂₁.
    let factors = [6.0, 12.0_f64.sqrt(), 12.0_f64.sqrt(), 6.0];
    for (i, factor) in factors.into_iter().enumerate() {
        let scale = factor * (measure * area).sqrt();
        rows.extend(columns.iter().map(|c| scale * c[6 + i]));
    }
}
