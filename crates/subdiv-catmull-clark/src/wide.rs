//! Guides that cover several rings of patches around an extraordinary vertex.

use crate::blend::septic_step;
use crate::characteristic::{characteristic_ring, subdominant_eigenvalue};
use crate::guide::{CELLS, GAUSS_6, coordinate_jets, sample_rows};
use crate::jet::{Jet, JetWeights, cubic_basis, jet_product, separable_jet};
use crate::monomials::{MONOMIALS, monomial_jets, rotated_monomials};
use numerics::{householder, minimizers};
use std::f64::consts::TAU;

/// A patch of a sector: its lower corner stands at `(a, b)`, the extraordinary vertex at `(0, 0)`.
pub(crate) type Cell = (usize, usize);

/// The surface on `rings × rings` patches of each sector around an extraordinary vertex of a
/// regular neighbourhood.
///
/// `S = (1 − w) S_CC + w q` with the septic step `w = step(u/rings) step(v/rings)` of the sector's
/// parameters and the guide `q`, a polynomial of degree five in the characteristic coordinates. Its
/// coefficients minimise `Σ ∫ |∇³ S|² dξ dη` as those of the one-ring's
/// [`Guide`](crate::guide::Guide) do, and are linear in the control points up to ring `rings + 1`.
/// The control points stand in the order of [`ring_position`].
#[derive(Clone, Debug)]
pub(crate) struct WideGuide {
    valence: usize,
    rings: usize,
    /// Characteristic map on the control points, the last blended ring about one unit away.
    map: Vec<[f64; 2]>,
    /// `MONOMIALS × points()`, row-major.
    coefficients: Vec<f64>,
}

/// Number of control points up to ring `last` around a vertex of valence `n`.
pub(crate) fn ring_points(n: usize, last: usize) -> usize {
    1 + n * last * (last + 1)
}

/// Place of the control point at `(i, j)` of a sector's grid among those up to ring `last`: the
/// centre, then sector by sector the columns `i = 1, 2, …`, each from the edge `j = 0` on.
///
/// Points beyond the sector's edges belong to its neighbours; only one index may be negative.
pub(crate) fn ring_position(n: usize, last: usize, sector: usize, i: isize, j: isize) -> usize {
    match (i, j) {
        (0, 0) => 0,
        _ if i > 0 && j >= 0 => {
            1 + (sector % n) * last * (last + 1) + (i as usize - 1) * (last + 1) + j as usize
        }
        _ if j < 0 => ring_position(n, last, sector + n - 1, -j, i),
        _ => ring_position(n, last, sector + 1, j, -i),
    }
}

/// Characteristic map on the control points up to ring `last`, edge neighbours at distance one.
///
/// `two_ring` holds it for the `2n + 8` control points of a patch. The refined map is `λ` times the
/// map, so that every step of refinement yields further rings.
fn characteristic_rings(n: usize, last: usize, two_ring: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let lambda = subdominant_eigenvalue(n);
    let mut known = 2;
    // The sector's own points (i, j), those of other sectors by rotation.
    let side = last.max(2) + 1;
    let mut own = vec![[0.0; 2]; side * side];
    let ring = characteristic_ring(n);
    own[side] = ring[1];
    own[side + 1] = ring[2];
    let outer = &two_ring[2 * n + 1..];
    (own[2 * side], own[2 * side + 1], own[2 * side + 2]) = (outer[1], outer[2], outer[3]);
    own[side + 2] = outer[4];
    while known < last {
        let next = (2 * known - 1).min(last);
        let at = |i: usize, j: usize, di: isize, dj: isize| {
            sector_point(n, &own, side, i as isize + di, j as isize + dj)
        };
        let mut found = Vec::new();
        for i in 1..=next {
            for j in 0..=next {
                if i.max(j) <= known {
                    continue;
                }
                let (p, q) = (i / 2, j / 2);
                let mut sum = [0.0; 2];
                let [f, g] = [i, j].map(|k| -> &[(isize, f64)] {
                    if k % 2 == 0 {
                        &[(-1, 0.125), (0, 0.75), (1, 0.125)]
                    } else {
                        &[(0, 0.5), (1, 0.5)]
                    }
                });
                for &(di, x) in f {
                    for &(dj, y) in g {
                        let point = at(p, q, di, dj);
                        sum = [sum[0] + x * y * point[0], sum[1] + x * y * point[1]];
                    }
                }
                found.push((i * side + j, sum.map(|x| x / lambda)));
            }
        }
        found.into_iter().for_each(|(place, point)| own[place] = point);
        known = next;
    }
    let mut map = vec![[0.0; 2]; ring_points(n, last)];
    for sector in 0..n {
        for i in 1..=last {
            for j in 0..=last {
                let place = ring_position(n, last, sector, i as isize, j as isize);
                map[place] = rotated(own[i * side + j], n, sector as isize);
            }
        }
    }
    map
}

fn rotated([x, y]: [f64; 2], n: usize, sectors: isize) -> [f64; 2] {
    let (s, c) = (TAU * sectors as f64 / n as f64).sin_cos();
    [c * x - s * y, s * x + c * y]
}

/// The point at `(i, j)` of sector 0's grid from those with `i ≥ 1`, `j ≥ 0`.
fn sector_point(n: usize, own: &[[f64; 2]], side: usize, i: isize, j: isize) -> [f64; 2] {
    let (mut i, mut j, mut turn) = (i, j, 0);
    while (i, j) != (0, 0) && !(i > 0 && j >= 0) {
        (i, j, turn) = if j < 0 { (-j, i, turn - 1) } else { (j, -i, turn + 1) };
    }
    rotated(own[i as usize * side + j as usize], n, turn)
}

impl WideGuide {
    /// Fits the guide: `weights` evaluates the Catmull-Clark patch at the vertex, `map` is the
    /// characteristic map on its `2n + 8` control points.
    pub(crate) fn new(
        n: usize,
        rings: usize,
        map: &[[f64; 2]],
        weights: impl Fn(f64, f64) -> JetWeights,
    ) -> Self {
        let last = rings + 1;
        let mut map = characteristic_rings(n, last, map);
        let edge = map[ring_position(n, last, 0, rings as isize, 0)];
        map.iter_mut().for_each(|p| *p = p.map(|x| x / edge[0]));
        let points = ring_points(n, last);
        let mut this = Self { valence: n, rings, map, coefficients: Vec::new() };
        // The control points of sector 0's patches.
        let cells: Vec<Cell> = (0..rings * rings).map(|k| (k / rings, k % rings)).collect();
        let mut near: Vec<usize> = cells.iter().flat_map(|&cell| this.columns(cell)).collect();
        near.sort_unstable();
        near.dedup();
        let width = MONOMIALS + near.len();
        let mut reduced: Vec<f64> = Vec::new();
        for &cell in &cells {
            let columns: Vec<usize> = this
                .columns(cell)
                .iter()
                .map(|&c| MONOMIALS + near.partition_point(|&k| k < c))
                .collect();
            let local = this.map_of(cell);
            // The patch at the vertex has infinitely many knots, the others none.
            let parts = if cell == (0, 0) { CELLS } else { 1 };
            let mut rows = Vec::new();
            for part in 0..parts * parts {
                let corner = [part / parts, part % parts].map(|c| c as f64 / parts as f64);
                for (x, wx) in GAUSS_6 {
                    for (y, wy) in GAUSS_6 {
                        let (u, v) = (corner[0] + x / parts as f64, corner[1] + y / parts as f64);
                        let measure = wx * wy / (parts * parts) as f64;
                        let plain = this.plain(cell, u, v, &weights);
                        let fade = this.fade(cell, u, v);
                        sample_rows(&plain, None, &local, &fade, measure, &mut rows);
                    }
                }
            }
            let narrow = MONOMIALS + columns.len();
            for row in rows.chunks(narrow) {
                let from = reduced.len();
                reduced.resize(from + width, 0.0);
                reduced[from..from + MONOMIALS].copy_from_slice(&row[..MONOMIALS]);
                for (&c, &value) in columns.iter().zip(&row[MONOMIALS..]) {
                    reduced[from + c] += value;
                }
            }
            householder(&mut reduced, width, MONOMIALS);
            reduced.truncate(MONOMIALS * width);
            for i in 1..MONOMIALS {
                reduced[i * width..i * width + i].fill(0.0);
            }
        }
        // The other sectors see the same integrals in rotated coordinates.
        let wide = MONOMIALS + points;
        let mut stacked = Vec::with_capacity(n * MONOMIALS * wide);
        let per_sector = last * (last + 1);
        for sector in 0..n {
            let rotation = rotated_monomials(TAU * sector as f64 / n as f64);
            for source in reduced.chunks(width) {
                let mut row = vec![0.0; wide];
                for (k, out) in row[..MONOMIALS].iter_mut().enumerate() {
                    let turned = &rotation[k * MONOMIALS..(k + 1) * MONOMIALS];
                    *out = source[..MONOMIALS].iter().zip(turned).map(|(s, t)| s * t).sum();
                }
                for (&c, &value) in near.iter().zip(&source[MONOMIALS..]) {
                    let turned =
                        if c == 0 { 0 } else { 1 + (c - 1 + sector * per_sector) % (points - 1) };
                    row[MONOMIALS + turned] += value;
                }
                stacked.extend(row);
            }
        }
        this.coefficients = minimizers(&mut stacked, wide, MONOMIALS);
        this
    }

    /// Number of control points: the vertex and its `rings + 1` rings.
    pub(crate) fn points(&self) -> usize {
        self.map.len()
    }

    /// Number of rings of patches.
    pub(crate) fn rings(&self) -> usize {
        self.rings
    }

    /// The weights of the control points in coefficient `k`.
    pub(crate) fn coefficient(&self, k: usize) -> &[f64] {
        &self.coefficients[k * self.points()..(k + 1) * self.points()]
    }

    /// Places of a patch's own control points: in the order of
    /// [`LocalPatch`](crate::local::LocalPatch) at the vertex, else the 4×4 grid.
    pub(crate) fn columns(&self, cell: Cell) -> Vec<usize> {
        let (n, last) = (self.valence, self.rings + 1);
        let at = |i: isize, j: isize| ring_position(n, last, 0, i, j);
        if cell == (0, 0) {
            let mut out = vec![0];
            for sector in 0..n {
                out.push(ring_position(n, last, sector, 1, 0));
                out.push(ring_position(n, last, sector, 1, 1));
            }
            let outer = [(2, -1), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (-1, 2)];
            out.extend(outer.map(|(i, j)| at(i, j)));
            return out;
        }
        let (a, b) = (cell.0 as isize - 1, cell.1 as isize - 1);
        (0..16).map(|k| at(a + k / 4, b + k % 4)).collect()
    }

    fn map_of(&self, cell: Cell) -> Vec<[f64; 2]> {
        self.columns(cell).into_iter().map(|c| self.map[c]).collect()
    }

    // The Catmull-Clark surface's weights on the patch's own control points.
    fn plain(
        &self,
        cell: Cell,
        u: f64,
        v: f64,
        weights: &impl Fn(f64, f64) -> JetWeights,
    ) -> JetWeights {
        if cell == (0, 0) {
            return weights(u, v);
        }
        let (bu, bv) = (cubic_basis(u), cubic_basis(v));
        let mut out = JetWeights::zeros(16);
        for k in 0..16 {
            let f = std::array::from_fn(|d| bu[d][k / 4]);
            let g = std::array::from_fn(|d| bv[d][k % 4]);
            out.set_jet(k, &separable_jet(&f, &g));
        }
        out
    }

    fn fade(&self, cell: Cell, u: f64, v: f64) -> Jet {
        let scale = self.rings as f64;
        let step = |t: f64| {
            let mut step = septic_step(t / scale);
            let mut factor = 1.0;
            for value in &mut step {
                *value *= factor;
                factor /= scale;
            }
            step
        };
        separable_jet(&step(cell.0 as f64 + u), &step(cell.1 as f64 + v))
    }

    /// Jets at `(u, v)` of a patch's weights on its own control points, then on the guide's
    /// coefficients; `weights` evaluates the Catmull-Clark patch at the vertex.
    pub(crate) fn local_weights(
        &self,
        cell: Cell,
        weights: impl Fn(f64, f64) -> JetWeights,
        u: f64,
        v: f64,
    ) -> JetWeights {
        let plain = self.plain(cell, u, v, &weights);
        let count = plain.control_points();
        let fade = self.fade(cell, u, v);
        let mut rest = fade.map(|x| -x);
        rest[0] += 1.0;
        let mut out = JetWeights::zeros(count + MONOMIALS);
        for k in 0..count {
            out.set_jet(k, &jet_product(&rest, &plain.jet(k)));
        }
        let coordinates = coordinate_jets(&plain, &self.map_of(cell));
        for (k, monomial) in monomial_jets(&coordinates).iter().enumerate() {
            out.set_jet(count + k, &jet_product(&fade, monomial));
        }
        out
    }

    /// Turns weights on a patch's own control points and the guide's coefficients into weights on
    /// all control points of the guide.
    pub(crate) fn spread(&self, cell: Cell, local: &[f64]) -> Vec<f64> {
        let columns = self.columns(cell);
        let mut out = vec![0.0; self.points()];
        for (&c, w) in columns.iter().zip(local) {
            out[c] += w;
        }
        for (w, row) in local[columns.len()..].iter().zip(self.coefficients.chunks(self.points())) {
            out.iter_mut().zip(row).for_each(|(o, c)| *o += w * c);
        }
        out
    }
}
