//! A Bezier patch and its derivatives.

use geom_core::DVec3;

use crate::curve::bernstein::bernstein_into;

/// A bi-degree-n Bezier patch; control point `(i, j)` stands at `i (n + 1) + j`, `i` along u.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    degree: usize,
    points: Vec<DVec3>,
}

/// Position, first and second derivatives of a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchJet {
    /// `R`
    pub position: DVec3,
    /// `R_u`
    pub u: DVec3,
    /// `R_v`
    pub v: DVec3,
    /// `R_uu`
    pub uu: DVec3,
    /// `R_uv`
    pub uv: DVec3,
    /// `R_vv`
    pub vv: DVec3,
}

impl PatchJet {
    /// `R_u × R_v`, whose length tells how regular the point is.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.u.cross(self.v)
    }

    /// Sine of the angle between the parameter lines.
    #[must_use]
    pub fn sine(&self) -> f64 {
        self.normal().length() / (self.u.length() * self.v.length())
    }

    /// Second fundamental form `L, M, N` with respect to the unit normal.
    #[must_use]
    pub fn second_form(&self) -> [f64; 3] {
        let n = self.normal().normalize_or_zero();
        [self.uu.dot(n), self.uv.dot(n), self.vv.dot(n)]
    }

    /// Gaussian curvature `(LN − M²) / (EG − F²)`.
    #[must_use]
    pub fn gaussian_curvature(&self) -> f64 {
        let [l, m, n] = self.second_form();
        (l * n - m * m) / self.normal().length_squared()
    }

    /// Mean curvature `(EN − 2FM + GL) / (2 (EG − F²))`.
    #[must_use]
    pub fn mean_curvature(&self) -> f64 {
        let [l, m, n] = self.second_form();
        let (e, f, g) = (self.u.dot(self.u), self.u.dot(self.v), self.v.dot(self.v));
        (e * n - 2.0 * f * m + g * l) / (2.0 * self.normal().length_squared())
    }
}

/// Bernstein values and two derivatives at fixed parameters.
#[derive(Clone, Debug)]
pub(crate) struct BasisTable {
    pub(crate) parameters: Vec<f64>,
    size: usize,
    // [derivative][parameter * size + j]
    values: [Vec<f64>; 3],
}

impl BasisTable {
    pub(crate) fn new(degree: usize, parameters: &[f64]) -> Self {
        let size = degree + 1;
        let mut values: [Vec<f64>; 3] = Default::default();
        let mut low = vec![0.0; size];
        for &t in parameters {
            for (order, out) in values.iter_mut().enumerate() {
                low.fill(0.0);
                bernstein_into(degree - order, t, &mut low[..=degree - order]);
                // d^k B_j^n = n (n−1) … Δ^k of the lower basis.
                for step in 0..order {
                    let d = (degree - order + 1 + step) as f64;
                    for j in (0..=degree - order + 1 + step).rev() {
                        let here = if j <= degree - order + step { low[j] } else { 0.0 };
                        let before = if j > 0 { low[j - 1] } else { 0.0 };
                        low[j] = d * (before - here);
                    }
                }
                out.extend_from_slice(&low);
            }
        }
        Self { parameters: parameters.to_vec(), size, values }
    }

    /// Evenly spaced, both ends included.
    pub(crate) fn uniform(degree: usize, count: usize) -> Self {
        let t: Vec<f64> = (0..count).map(|i| i as f64 / (count - 1) as f64).collect();
        Self::new(degree, &t)
    }

    pub(crate) fn row(&self, order: usize, parameter: usize) -> &[f64] {
        &self.values[order][parameter * self.size..(parameter + 1) * self.size]
    }

    pub(crate) fn len(&self) -> usize {
        self.parameters.len()
    }
}

impl Patch {
    /// The patch with these control points.
    ///
    /// # Panics
    /// When there are not `(degree + 1)²` of them or the degree is below 2.
    #[must_use]
    pub fn new(degree: usize, points: Vec<DVec3>) -> Self {
        assert!(degree >= 2, "second derivatives need degree two");
        assert_eq!(points.len(), (degree + 1) * (degree + 1), "a square control net");
        Self { degree, points }
    }

    /// Degree in both parameters.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Control points, `(i, j)` at `i (degree + 1) + j`.
    #[must_use]
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Control point `(i, j)`.
    #[must_use]
    pub fn point(&self, i: usize, j: usize) -> DVec3 {
        self.points[i * (self.degree + 1) + j]
    }

    /// Length of the bounding box diagonal of the corners, the size of the patch.
    #[must_use]
    pub fn size(&self) -> f64 {
        let n = self.degree;
        let d = self.point(n, n) - self.point(0, 0);
        let e = self.point(n, 0) - self.point(0, n);
        d.length().max(e.length())
    }

    /// Position and derivatives at `(u, v)`.
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> PatchJet {
        let (bu, bv) = (BasisTable::new(self.degree, &[u]), BasisTable::new(self.degree, &[v]));
        let mut out = PatchJet::default();
        self.jets_row(&bu, 0, &bv, |_, jet| out = jet);
        out
    }

    /// Calls `visit` with the jets at parameter `iu` of `bu` and all parameters of `bv`.
    pub(crate) fn jets_row(
        &self,
        bu: &BasisTable,
        iu: usize,
        bv: &BasisTable,
        mut visit: impl FnMut(usize, PatchJet),
    ) {
        let m = self.degree + 1;
        // Contract the u-direction first: three curves in v.
        let mut curves = [[DVec3::ZERO; 16]; 3];
        for i in 0..m {
            let weights = [bu.row(0, iu)[i], bu.row(1, iu)[i], bu.row(2, iu)[i]];
            for (j, point) in self.points[i * m..(i + 1) * m].iter().enumerate() {
                for (curve, w) in curves.iter_mut().zip(weights) {
                    curve[j] += *point * w;
                }
            }
        }
        for iv in 0..bv.len() {
            let (b0, b1, b2) = (bv.row(0, iv), bv.row(1, iv), bv.row(2, iv));
            let mut jet = PatchJet::default();
            for j in 0..m {
                jet.position += curves[0][j] * b0[j];
                jet.u += curves[1][j] * b0[j];
                jet.v += curves[0][j] * b1[j];
                jet.uu += curves[2][j] * b0[j];
                jet.uv += curves[1][j] * b1[j];
                jet.vv += curves[0][j] * b2[j];
            }
            visit(iv, jet);
        }
    }

    /// The jet at one parameter pair of two tables.
    pub(crate) fn jet_at(
        &self,
        bu: &BasisTable,
        iu: usize,
        bv: &BasisTable,
        iv: usize,
        jet: &mut PatchJet,
    ) {
        let m = self.degree + 1;
        *jet = PatchJet::default();
        let (v0, v1, v2) = (bv.row(0, iv), bv.row(1, iv), bv.row(2, iv));
        for i in 0..m {
            let weights = [bu.row(0, iu)[i], bu.row(1, iu)[i], bu.row(2, iu)[i]];
            // On the boundary most weights vanish.
            if weights == [0.0; 3] {
                continue;
            }
            let (mut r, mut rv, mut rvv) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for (j, point) in self.points[i * m..(i + 1) * m].iter().enumerate() {
                r += *point * v0[j];
                rv += *point * v1[j];
                rvv += *point * v2[j];
            }
            jet.position += r * weights[0];
            jet.u += r * weights[1];
            jet.v += rv * weights[0];
            jet.uu += r * weights[2];
            jet.uv += rv * weights[1];
            jet.vv += rvv * weights[0];
        }
    }

    /// Appends the positions at parameter `iu` and all parameters of `table`.
    pub(crate) fn positions_row(&self, table: &BasisTable, iu: usize, out: &mut Vec<DVec3>) {
        let m = self.degree + 1;
        let mut curve = [DVec3::ZERO; 16];
        for (i, w) in table.row(0, iu).iter().enumerate() {
            for (j, point) in self.points[i * m..(i + 1) * m].iter().enumerate() {
                curve[j] += *point * *w;
            }
        }
        for iv in 0..table.len() {
            out.push(curve.iter().zip(table.row(0, iv)).map(|(c, b)| *c * *b).sum());
        }
    }

    /// Position at `(u, v)`.
    #[must_use]
    pub fn position(&self, u: f64, v: f64) -> DVec3 {
        self.jet(u, v).position
    }

    /// Least sine between parameter lines on a grid of `(count + 1)²` points, signed: negative
    /// where the normal has turned away from its neighbour.
    #[must_use]
    pub fn least_sine(&self, count: usize) -> f64 {
        let table = BasisTable::uniform(self.degree, count + 1);
        let mut least = f64::INFINITY;
        let mut above: Vec<DVec3> = Vec::new();
        for iu in 0..table.len() {
            let mut row: Vec<DVec3> = Vec::with_capacity(table.len());
            self.jets_row(&table, iu, &table, |iv, jet| {
                let n = jet.normal();
                let mut sine = jet.sine();
                let turned = |m: Option<&DVec3>| m.is_some_and(|m| m.dot(n) < 0.0);
                if turned(row.last()) || turned(above.get(iv)) || sine.is_nan() {
                    sine = -1.0;
                }
                least = least.min(sine);
                row.push(n);
            });
            above = row;
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jets_of_the_saddle_are_exact() {
        // R = (u, v, uv) in degree 3.
        let points = (0..4)
            .flat_map(|i| {
                (0..4).map(move |j| {
                    let (u, v) = (f64::from(i) / 3.0, f64::from(j) / 3.0);
                    DVec3::new(u, v, u * v)
                })
            })
            .collect();
        let patch = Patch::new(3, points);
        let jet = patch.jet(0.3, 0.8);
        assert!((jet.position - DVec3::new(0.3, 0.8, 0.24)).length() < 1e-14);
        assert!((jet.u - DVec3::new(1.0, 0.0, 0.8)).length() < 1e-13);
        assert!((jet.uv - DVec3::Z).length() < 1e-12);
        assert!(jet.uu.length() < 1e-12 && jet.vv.length() < 1e-12);
        let w = 1.0 + 0.09 + 0.64_f64;
        assert!((jet.gaussian_curvature() + 1.0 / (w * w)).abs() < 1e-12);
    }
}
