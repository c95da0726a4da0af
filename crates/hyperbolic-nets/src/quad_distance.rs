//! Planarity of quads as the distance of their diagonals.

use crate::blocks::{Layout, Weight};
use geom_core::DVec3;
use gp_solver::{Elements, ResidualBlock};

/// A point of a quad: a vertex, or a mean of two.
pub(crate) type Mix = [(usize, f64); 2];

/// Signed distances of the diagonals of quads whose corners are mixes of vertices.
///
/// `r = n·d` with `n` the unit normal of both diagonals and `d = (b₀ + b₂ − b₁ − b₃)/2`
/// (Shi et al. 2014, §3.2). This is the exact distance of the diagonal lines, since `d` joins their
/// midpoints. Where diagonals are parallel to within 1e-9 the row vanishes: no plane is at fault.
pub(crate) struct QuadDistances {
    name: &'static str,
    layout: Layout,
    elements: Elements,
    /// Per quad, how its corners are mixed from the vertices of the element.
    mixes: Vec<[[f64; 6]; 4]>,
    weight: Weight,
}

impl QuadDistances {
    pub(crate) fn new(
        name: &'static str,
        layout: Layout,
        quads: impl Iterator<Item = [Mix; 4]>,
        weight: Weight,
    ) -> Self {
        let mut elements = Elements::new();
        let mut mixes = Vec::new();
        for quad in quads {
            let mut vertices: Vec<usize> = Vec::with_capacity(6);
            let mut mix = [[0.0; 6]; 4];
            for (corner, parts) in quad.iter().enumerate() {
                for &(v, share) in parts.iter().filter(|(_, share)| *share != 0.0) {
                    let at = vertices.iter().position(|&w| w == v).unwrap_or_else(|| {
                        vertices.push(v);
                        vertices.len() - 1
                    });
                    mix[corner][at] += share;
                }
            }
            let columns: Vec<usize> =
                vertices.iter().flat_map(|&v| [0, 1, 2].map(|c| layout.column(v, c))).collect();
            elements.push(&columns, 1);
            mixes.push(mix);
        }
        Self { name, layout, elements, mixes, weight }
    }

    /// Changes how the corners are mixed; every corner keeps its vertices.
    pub(crate) fn set_mixes(&mut self, quads: impl Iterator<Item = [Mix; 4]>) {
        for ((e, quad), mix) in quads.enumerate().zip(&mut self.mixes) {
            *mix = [[0.0; 6]; 4];
            for (corner, parts) in quad.iter().enumerate() {
                for &(v, share) in parts {
                    let first = self.layout.column(v, 0);
                    let columns = self.elements.columns(e).chunks_exact(3);
                    if let Some(at) = columns.map(|c| c[0]).position(|c| c == first) {
                        mix[corner][at] += share;
                    }
                }
            }
        }
    }

    fn corners(&self, e: usize, x: &[f64]) -> [DVec3; 4] {
        let columns = self.elements.columns(e);
        let mut corners = [DVec3::ZERO; 4];
        for (k, c) in columns.chunks_exact(3).enumerate() {
            let p = DVec3::new(x[c[0]], x[c[1]], x[c[2]]);
            for (corner, mix) in corners.iter_mut().zip(&self.mixes[e]) {
                *corner += p * mix[k];
            }
        }
        corners
    }
}

/// Distance of the diagonals and its gradient by the four corners.
fn distance(b: [DVec3; 4]) -> (f64, [DVec3; 4]) {
    let (p, q) = (b[2] - b[0], b[3] - b[1]);
    let d = (b[0] + b[2] - b[1] - b[3]) * 0.5;
    let cross = p.cross(q);
    let length = cross.length();
    if !(length > 1e-9 * p.length() * q.length()) {
        return (0.0, [DVec3::ZERO; 4]);
    }
    let n = cross / length;
    let r = n.dot(d);
    let within = d - n * r;
    let (by_p, by_q) = (q.cross(within) / length, within.cross(p) / length);
    (r, [n * 0.5 - by_p, n * -0.5 - by_q, n * 0.5 + by_p, n * -0.5 + by_q])
}

impl ResidualBlock for QuadDistances {
    fn name(&self) -> &str {
        self.name
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let factor = self.weight.get().sqrt();
        for (e, r) in residuals.iter_mut().enumerate() {
            *r = factor * distance(self.corners(e, x)).0;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let factor = self.weight.get().sqrt();
        for (e, residual) in residuals.iter_mut().enumerate() {
            let (r, gradient) = distance(self.corners(e, x));
            *residual = factor * r;
            let row = &mut jacobian[self.elements.jacobian_range(e)];
            for (k, to) in row.chunks_exact_mut(3).enumerate() {
                let by_vertex: DVec3 =
                    gradient.iter().zip(&self.mixes[e]).map(|(g, mix)| *g * mix[k]).sum();
                to.copy_from_slice(&(by_vertex * factor).to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: Layout = Layout { stride: 3, offset: 0 };

    fn block() -> QuadDistances {
        let plain = |v| [(v, 1.0), (0, 0.0)];
        let quads = [
            [plain(0), plain(1), plain(2), plain(3)],
            [plain(0), [(1, 0.3), (2, 0.7)], plain(3), [(4, 0.6), (5, 0.4)]],
        ];
        QuadDistances::new("planar", LAYOUT, quads.into_iter(), Weight::new(2.5))
    }

    fn start() -> Vec<f64> {
        (0..18).map(|k| (1.7 * f64::from(k)).sin() + 0.1 * f64::from(k % 3)).collect()
    }

    #[test]
    fn jacobian_matches_central_differences() {
        let (block, mut x, h) = (block(), start(), 1e-6);
        let (mut r, mut j) = (vec![0.0; 2], vec![0.0; block.elements().jacobian_len()]);
        block.linearize(&x, &mut r, &mut j);
        for e in 0..2 {
            for (k, &c) in block.elements().columns(e).to_vec().iter().enumerate() {
                let (mut up, mut down) = (vec![0.0; 2], vec![0.0; 2]);
                let old = x[c];
                x[c] = old + h;
                block.residuals(&x, &mut up);
                x[c] = old - h;
                block.residuals(&x, &mut down);
                x[c] = old;
                let want = (up[e] - down[e]) / (2.0 * h);
                let got = j[block.elements().jacobian_range(e)][k];
                assert!((got - want).abs() < 1e-8, "element {e}, column {c}: {got} {want}");
            }
        }
    }

    #[test]
    fn mixes_can_change() {
        let plain = |v| [(v, 1.0), (0, 0.0)];
        let with =
            |a: f64, b: f64| [plain(0), [(1, a), (2, 1.0 - a)], plain(3), [(4, b), (5, 1.0 - b)]];
        let new = |quad| QuadDistances::new("", LAYOUT, std::iter::once(quad), Weight::new(1.0));
        let (mut changed, want) = (new(with(0.3, 0.6)), new(with(0.8, 0.1)));
        changed.set_mixes(std::iter::once(with(0.8, 0.1)));
        assert_eq!(changed.corners(0, &start()), want.corners(0, &start()));
    }

    #[test]
    fn residual_is_the_distance_of_the_lines() {
        let b = [
            DVec3::new(0.0, 0.0, 0.2),
            DVec3::new(2.0, -1.0, -0.3),
            DVec3::new(3.0, 0.0, 0.2),
            DVec3::new(2.0, 5.0, -0.3),
        ];
        let (r, _) = distance(b);
        assert!((r.abs() - 0.5).abs() < 1e-15);
        let (r, g) = distance([b[0], b[0] + DVec3::X, b[2], b[2] + DVec3::X]);
        assert_eq!((r, g), (0.0, [DVec3::ZERO; 4]));
    }
}
