//! Planarity of quads as the distance of their diagonals.

use geom_core::DVec3;
use gp_solver::{Elements, Group, ResidualBlock};

/// A point of a quad: a vertex, or a mean of two.
pub type Mix = [(usize, f64); 2];

/// Signed distances of the diagonals of quads whose corners are mixes of vertices, in units of
/// the positions (Shi et al. 2014, §3.2, step 1, option ii):
///
/// ```text
/// residual[k] = n·d       n = p × q / |p × q|,  p = b₂ − b₀,  q = b₃ − b₁,  d = (b₀ + b₂ − b₁ − b₃)/2
/// ∂/∂b₀ =  n/2 − f,  ∂/∂b₁ = −n/2 − g,  ∂/∂b₂ = n/2 + f,  ∂/∂b₃ = −n/2 + g
/// f = q × w / |p × q|,  g = w × p / |p × q|,  w = d − n (n·d)
/// ```
///
/// This is the exact distance of the diagonal lines, since `d` joins their midpoints. Where
/// diagonals are parallel to within 1e-9 the row vanishes: no plane is at fault.
#[derive(Clone, Debug)]
pub struct QuadDistances {
    name: &'static str,
    elements: Elements,
    /// Per quad, how its corners are mixed from the vertices of the element.
    mixes: Vec<[[f64; 6]; 4]>,
}

impl QuadDistances {
    /// Quads with their corners in the group `positions`; a quad has up to six vertices.
    pub fn new(
        name: &'static str,
        positions: Group,
        quads: impl IntoIterator<Item = [Mix; 4]>,
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
                vertices.iter().flat_map(|&v| positions.columns::<3>(v)).collect();
            elements.push(&columns, 1);
            mixes.push(mix);
        }
        Self { name, elements, mixes }
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
        for (e, r) in residuals.iter_mut().enumerate() {
            *r = distance(self.corners(e, x)).0;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        for (e, residual) in residuals.iter_mut().enumerate() {
            let (r, gradient) = distance(self.corners(e, x));
            *residual = r;
            let row = &mut jacobian[self.elements.jacobian_range(e)];
            for (k, to) in row.chunks_exact_mut(3).enumerate() {
                let by_vertex: DVec3 =
                    gradient.iter().zip(&self.mixes[e]).map(|(g, mix)| *g * mix[k]).sum();
                to.copy_from_slice(&by_vertex.to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
