//! Curvature of a triangle mesh, and the directions in which it vanishes.

use super::quad_net::QuadNet;
use geom_core::{
    DMat3, DVec2, DVec3, FirstForm, SecondForm, TriMesh, asymptotic_directions,
    principal_curvatures,
};
use numerics::least_squares;
use rayon::prelude::*;

/// Second fundamental forms at the vertices of a triangle mesh, from cubic fits.
///
/// The heights of at least 20 vertices from at least two rings around, over the plane of the
/// vertex normal, get a cubic polynomial with Gaussian weights by least squares (a jet fit).
#[derive(Debug)]
pub struct AsymptoticField<'a> {
    mesh: &'a TriMesh,
    /// `κ₁ d₁d₁ᵀ + κ₂ d₂d₂ᵀ` at every vertex, `None` where the fit is not determined.
    tensors: Vec<Option<DMat3>>,
}

const RINGS: usize = 2;
const POINTS: usize = 20;

impl<'a> AsymptoticField<'a> {
    /// Fits all vertices.
    #[must_use]
    pub fn new(mesh: &'a TriMesh) -> Self {
        let n = mesh.positions().len();
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); n];
        for t in mesh.triangles() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                neighbours[a as usize].push(b);
                neighbours[b as usize].push(a);
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        let tensors = (0..n).into_par_iter().map(|v| fit(mesh, &neighbours, v)).collect();
        Self { mesh, tensors }
    }

    /// Share of the area with negative Gaussian curvature, 0 to 1; of the area where a fit is
    /// determined, 0 if it is nowhere.
    #[must_use]
    pub fn negative_share(&self) -> f64 {
        self.known_negative_share().unwrap_or(0.0)
    }

    /// As [`Self::negative_share`], `None` if no fit is determined anywhere.
    pub(crate) fn known_negative_share(&self) -> Option<f64> {
        let (mut negative, mut all) = (0.0, 0.0);
        for t in 0..self.mesh.triangles().len() {
            let [a, b, c] = self.mesh.corners(t);
            let normal = (b - a).cross(c - a);
            let Some(form) = self.form(t, [1.0 / 3.0; 3], normal.normalize_or_zero()) else {
                continue;
            };
            let area = normal.length();
            all += area;
            if form.0.l * form.0.n - form.0.m * form.0.m < 0.0 {
                negative += area;
            }
        }
        (all > 0.0).then(|| negative / all)
    }

    /// Gaussian curvature at the foot of a point, `None` where no fit is determined.
    #[must_use]
    pub fn gaussian_curvature(&self, p: DVec3) -> Option<f64> {
        let nearest = self.mesh.nearest(p);
        let [a, b, c] = self.mesh.corners(nearest.triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let (form, ..) = self.form(nearest.triangle, nearest.barycentric, normal)?;
        Some(form.l * form.n - form.m * form.m)
    }

    /// Angle between a direction at a point and the nearer asymptotic direction at its foot, in
    /// radians; `None` where the curvature is not negative or not determined.
    #[must_use]
    pub fn misalignment(&self, p: DVec3, direction: DVec3) -> Option<f64> {
        let nearest = self.mesh.nearest(p);
        let [i, j, k] = self.mesh.triangles()[nearest.triangle];
        let n = self.mesh.vertex_normals();
        let [u, v, w] = nearest.barycentric;
        let normal =
            (n[i as usize] * u + n[j as usize] * v + n[k as usize] * w).normalize_or_zero();
        let (form, x, y) = self.form(nearest.triangle, nearest.barycentric, normal)?;
        if !(form.l * form.n - form.m * form.m < 0.0) {
            return None;
        }
        let flat = FirstForm { e: 1.0, f: 0.0, g: 1.0 };
        let directions = asymptotic_directions(flat, form).ok()??;
        let d = DVec2::new(direction.dot(x), direction.dot(y));
        let angle = |a: DVec2| d.perp_dot(a).abs().atan2(d.dot(a).abs());
        Some(directions.map(angle).into_iter().fold(f64::INFINITY, f64::min))
    }

    /// Mean of the angle between the edges of a net and the asymptotic directions under their
    /// midpoints, in radians; edges where there are none do not count.
    #[must_use]
    pub fn mean_misalignment(&self, net: &QuadNet) -> f64 {
        let angle = |[a, b]: [DVec3; 2]| self.misalignment((a + b) / 2.0, b - a);
        let ends = net.edges().iter().map(|e| e.ends.map(|v| net.positions()[v]));
        let angles: Vec<f64> = ends.filter_map(angle).collect();
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
    }

    /// Second form in an orthonormal frame of the plane of `normal`, and the frame.
    fn form(
        &self,
        triangle: usize,
        barycentric: [f64; 3],
        normal: DVec3,
    ) -> Option<(SecondForm, DVec3, DVec3)> {
        let mut sum = DMat3::ZERO;
        for (&v, share) in self.mesh.triangles()[triangle].iter().zip(barycentric) {
            sum += self.tensors[v as usize]? * share;
        }
        if normal == DVec3::ZERO {
            return None;
        }
        let (x, y) = normal.any_orthonormal_pair();
        let form = SecondForm { l: x.dot(sum * x), m: x.dot(sum * y), n: y.dot(sum * y) };
        Some((form, x, y))
    }
}

fn fit(mesh: &TriMesh, neighbours: &[Vec<u32>], v: usize) -> Option<DMat3> {
    let around = rings(neighbours, v);
    if around.len() < 10 || mesh.vertex_normals()[v] == DVec3::ZERO {
        return None;
    }
    let (centre, normal) = (mesh.positions()[v], mesh.vertex_normals()[v]);
    let (x, y) = normal.any_orthonormal_pair();
    let offsets: Vec<DVec3> =
        around.iter().map(|&w| mesh.positions()[w as usize] - centre).collect();
    let radius =
        (offsets.iter().map(|d| d.length_squared()).sum::<f64>() / offsets.len() as f64).sqrt();
    let (mut a, mut b) =
        (Vec::with_capacity(10 * offsets.len()), Vec::with_capacity(offsets.len()));
    for d in &offsets {
        let (s, t, z) = (d.dot(x) / radius, d.dot(y) / radius, d.dot(normal) / radius);
        let weight = (-0.5 * (s * s + t * t)).exp();
        let monomials =
            [1.0, s, t, s * s, s * t, t * t, s * s * s, s * s * t, s * t * t, t * t * t];
        a.extend(monomials.map(|m| weight * m));
        b.push(weight * z);
    }
    least_squares(&mut a, 10, &mut b, 1).ok()?;
    // Height h: S_x = (1, 0, h_x), S_y = (0, 1, h_y), normal (−h_x, −h_y, 1)/√(1 + h_x² + h_y²).
    let (hx, hy) = (b[1], b[2]);
    let root = (1.0 + hx * hx + hy * hy).sqrt() * radius;
    let first = FirstForm { e: 1.0 + hx * hx, f: hx * hy, g: 1.0 + hy * hy };
    let second = SecondForm { l: 2.0 * b[3] / root, m: b[4] / root, n: 2.0 * b[5] / root };
    let principal = principal_curvatures(first, second).ok()?;
    let lift = |d: DVec2| x * d.x + y * d.y + normal * (hx * d.x + hy * d.y);
    let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    let d1 = lift(principal.direction1).normalize_or_zero();
    let d2 = lift(principal.direction2).normalize_or_zero();
    Some(outer(d1) * principal.k1 + outer(d2) * principal.k2)
}

/// The vertex and enough rings around it.
fn rings(neighbours: &[Vec<u32>], v: usize) -> Vec<u32> {
    let mut found = vec![v as u32];
    let mut first = 0;
    for ring in 0.. {
        if ring >= RINGS && found.len() >= POINTS {
            break;
        }
        let end = found.len();
        for k in first..end {
            for &w in &neighbours[found[k] as usize] {
                if !found.contains(&w) {
                    found.push(w);
                }
            }
        }
        if found.len() == end {
            break;
        }
        first = end;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::asymptotic_nets;
    use geom_core::PolyMesh;

    #[test]
    fn catenoid_edges_are_asymptotic_and_its_curvature_is_negative() {
        let model = asymptotic_nets::catenoid(44, 32);
        let mesh = PolyMesh::new(model.positions.clone(), &model.quads).unwrap();
        let triangles = TriMesh::from_poly_mesh(&mesh);
        let field = AsymptoticField::new(&triangles);
        assert!(field.negative_share() > 0.999);
        for p in model.positions.iter().filter(|p| p.z.abs() < 0.8) {
            // K = −1 / cosh⁴ v.
            let want = -1.0 / p.z.cosh().powi(4);
            let got = field.gaussian_curvature(*p).unwrap();
            // Quartic terms over three edges of 0.07 are what the cubic misses.
            assert!((got - want).abs() < 0.06, "{got} {want}");
        }
        for q in &model.quads {
            let [a, b] = [q[0], q[1]].map(|v| model.positions[v as usize]);
            let off = field.misalignment((a + b) / 2.0, b - a).unwrap();
            assert!(off.to_degrees() < 1.0, "{}", off.to_degrees());
            let c = model.positions[q[2] as usize];
            let diagonal = field.misalignment((a + c) / 2.0, c - a).unwrap();
            assert!((diagonal.to_degrees() - 45.0).abs() < 3.0);
        }
    }

    #[test]
    fn flat_and_tiny_meshes_have_no_directions() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::ONE - DVec3::Z, DVec3::Y].to_vec();
        let mesh = TriMesh::new(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let field = AsymptoticField::new(&mesh);
        assert_eq!(field.negative_share(), 0.0);
        assert_eq!(field.misalignment(DVec3::ZERO, DVec3::X), None);
    }
}
