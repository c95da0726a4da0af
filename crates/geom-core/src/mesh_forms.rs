//! Second fundamental forms of a triangle mesh at a length of one's choice.

use crate::tri_mesh::TriMesh;
use crate::worst_direction::{self, Pairs, add_pairs};
use glam::{DMat3, DVec3};
use numerics::least_squares;
use rayon::prelude::*;

/// Terms of a piece of degree two and three, the constant included.
const QUADRATIC: usize = 6;
const CUBIC: usize = 10;
/// A cubic is fitted to at least so many points, a quadratic to at least so many.
const CUBIC_POINTS: usize = 18;
const QUADRATIC_POINTS: usize = 8;
/// Factor from one radius to the next, and how often a radius grows: to find enough points, and to
/// average noise out.
const GROWTH: f64 = 1.4;
const GROWTHS_FOR_POINTS: usize = 10;
const GROWTHS_FOR_NOISE: usize = 3;
/// Largest deviation of the curvatures, as a share of the larger principal one, that is taken
/// without a look farther away; and by what factor that look must improve it.
const NOISE: f64 = 0.06;
const IMPROVEMENT: f64 = 0.75;
/// Fits that magnify an error of the heights by more, columns made of length one, tell nothing: three
/// rows of points cannot tell `x³` from `x²` and `x`.
const MOST_GAIN: f64 = 60.0;
/// Points farther than this share of the radius weigh less than `e^(-1/2)`.
const SPREAD: f64 = 0.6;
/// Points at most; of more, every second, third or further one counts.
const MOST_POINTS: usize = 160;
/// Normals of points that count stay within 78 degrees.
const LEAST_COSINE: f64 = 0.2;

/// What a triangle mesh says about the curvature of its surface at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexForm {
    /// Unit normal of the fitted piece, on the side of the triangles' normals.
    pub normal: DVec3,
    /// `κ₁ d₁d₁ᵀ + κ₂ d₂d₂ᵀ` for the principal directions, in 1/length; the sign follows the normal.
    pub tensor: DMat3,
    /// Standard deviation of the curvatures, from what the fit leaves, in 1/length.
    pub deviation: f64,
    /// Radius of the piece.
    pub radius: f64,
}

/// Second fundamental form at every vertex from the surface within `radius` of it, `None` where it
/// is not determined.
///
/// A cubic graph over the mean normal is fitted by weighted least squares to the vertices that are
/// reached along edges within the radius (Cazals and Pouget 2005). Where these are too few the
/// radius grows; and where noise leaves the curvatures uncertain it grows up to 2.7-fold, so that
/// a clean part of the surface is not smoothed for the sake of a noisy one. Thin triangles do not
/// matter, since lengths count and not rings.
///
/// # Example
/// ```
/// use geom_core::{DVec3, TriMesh, vertex_forms};
/// // The saddle z = xy / 2 on a grid; its vertex number 60 is flat along x and y.
/// let at = |k: u32| (0.1 * (f64::from(k / 11) - 5.0), 0.1 * (f64::from(k % 11) - 5.0));
/// let points = (0..121).map(at).map(|(x, y)| DVec3::new(x, y, 0.5 * x * y)).collect();
/// let corners = (0..100).map(|k| 11 * (k / 10) + k % 10);
/// let triangles = corners.flat_map(|a| [[a, a + 11, a + 12], [a, a + 12, a + 1]]).collect();
/// let mesh = TriMesh::new(points, triangles)?;
/// let form = vertex_forms(&mesh, 0.3)[60].expect("enough points");
/// assert!((form.tensor.x_axis.y - 0.5).abs() < 1e-9 && form.tensor.x_axis.x.abs() < 1e-9);
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[must_use]
pub fn vertex_forms(mesh: &TriMesh, radius: f64) -> Vec<Option<VertexForm>> {
    let around = Around::new(mesh);
    (0..mesh.positions().len())
        .into_par_iter()
        .with_min_len(64)
        .map_init(|| Visits::new(mesh), |seen, v| around.form(v, radius, seen))
        .collect()
}

/// Which vertices the walk in hand has been to.
struct Visits {
    walk: u32,
    last: Vec<u32>,
}

impl Visits {
    fn new(mesh: &TriMesh) -> Self {
        Self { walk: 0, last: vec![0; mesh.positions().len()] }
    }

    fn begin(&mut self) {
        self.walk += 1;
    }

    fn is_first(&mut self, v: u32) -> bool {
        std::mem::replace(&mut self.last[v as usize], self.walk) != self.walk
    }
}

/// A mesh with the neighbours of its vertices.
struct Around<'m> {
    mesh: &'m TriMesh,
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl<'m> Around<'m> {
    fn new(mesh: &'m TriMesh) -> Self {
        let sides = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let sides = mesh.triangles().iter().flat_map(sides);
        let mut pairs: Vec<(u32, u32)> = sides.flat_map(|(a, b)| [(a, b), (b, a)]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; mesh.positions().len() + 1];
        pairs.iter().for_each(|(a, _)| starts[*a as usize + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        Self { mesh, starts, neighbours: pairs.into_iter().map(|(_, b)| b).collect() }
    }

    /// Vertices within the radius that a walk along edges within it reaches, `v` first.
    fn within(&self, v: usize, radius: f64, seen: &mut Visits) -> Vec<u32> {
        let (points, normals) = (self.mesh.positions(), self.mesh.vertex_normals());
        seen.begin();
        seen.is_first(v as u32);
        let mut found = vec![v as u32];
        let mut at = 0;
        while at < found.len() {
            let w = found[at] as usize;
            at += 1;
            for &x in &self.neighbours[self.starts[w] as usize..self.starts[w + 1] as usize] {
                let near = points[x as usize].distance_squared(points[v]) <= radius * radius;
                let alike = normals[x as usize].dot(normals[v]) >= LEAST_COSINE;
                if near && alike && seen.is_first(x) {
                    found.push(x);
                }
            }
        }
        found
    }

    fn form(&self, v: usize, radius: f64, seen: &mut Visits) -> Option<VertexForm> {
        let first = self.mesh.vertex_normals()[v];
        if first == DVec3::ZERO || self.starts[v] == self.starts[v + 1] {
            return None;
        }
        let mut radius = radius;
        let mut best: Option<VertexForm> = None;
        let (mut for_points, mut for_noise) = (0, 0);
        loop {
            let near = self.within(v, radius, seen);
            let last = for_points == GROWTHS_FOR_POINTS;
            let is_tried = near.len() >= CUBIC_POINTS || last;
            match if is_tried { self.fit(v, radius, &near) } else { None } {
                Some(found) => {
                    let improves = |old: &VertexForm| found.deviation < IMPROVEMENT * old.deviation;
                    if best.as_ref().is_some_and(|old| !improves(old)) {
                        return best;
                    }
                    best = Some(found);
                    let columns = [0, 1, 2].map(|k| found.tensor.col(k).length_squared());
                    let certain =
                        found.deviation <= NOISE * columns.into_iter().sum::<f64>().sqrt();
                    if certain || last || for_noise == GROWTHS_FOR_NOISE {
                        return best;
                    }
                    for_noise += 1;
                }
                // Too few points, or all on a line.
                None if last || best.is_some() => return best,
                None => for_points += 1,
            }
            radius *= GROWTH;
        }
    }

    fn fit(&self, v: usize, radius: f64, near: &[u32]) -> Option<VertexForm> {
        let stride = near.len().div_ceil(MOST_POINTS);
        let near: Vec<usize> = near.iter().step_by(stride).map(|&w| w as usize).collect();
        let (points, normals) = (self.mesh.positions(), self.mesh.vertex_normals());
        let weight = |w: usize| {
            let share = points[w].distance(points[v]) / (SPREAD * radius);
            (-0.5 * share * share).exp()
        };
        let normal = near.iter().map(|&w| normals[w] * weight(w)).sum::<DVec3>();
        let normal = normal.normalize_or_zero();
        if normal == DVec3::ZERO || near.len() < QUADRATIC_POINTS {
            return None;
        }
        let (x, y) = normal.any_orthonormal_pair();
        // Right-handed, so that z = f(x, y) has its normal on the side of `normal`.
        let (x, y) = if x.cross(y).dot(normal) > 0.0 { (x, y) } else { (y, x) };
        let terms = if near.len() >= CUBIC_POINTS { CUBIC } else { QUADRATIC };
        let mut matrix = Vec::with_capacity(near.len() * terms);
        let mut heights = Vec::with_capacity(near.len());
        let mut moments = Pairs::default();
        for &w in &near {
            let d = (points[w] - points[v]) / radius;
            let (s, t, z, weight) = (d.dot(x), d.dot(y), d.dot(normal), weight(w));
            let (ss, st, tt) = (s * s, s * t, t * t);
            let row = [1.0, s, t, 0.5 * ss, st, 0.5 * tt, ss * s, ss * t, s * tt, tt * t];
            matrix.extend(row[..terms].iter().map(|value| weight * value));
            add_pairs(&mut moments, [row[3], row[4], row[5]].map(|value| weight * value));
            heights.push(weight * z);
        }
        least_squares(&mut matrix, terms, &mut heights, 1).ok()?;
        let covariance = covariance(&matrix, terms);
        if !(worst_direction::gain(&covariance, &moments) <= MOST_GAIN) {
            return None;
        }
        let left: f64 = heights[terms..].iter().map(|r| r * r).sum();
        let spare = (near.len() - terms).max(1) as f64;
        let noise = (left / spare).sqrt();
        let (a, b) = (heights[1], heights[2]);
        let slope = (1.0 + a * a + b * b).sqrt();
        let [l, m, n] = [heights[3], heights[4], heights[5]].map(|h| h / (slope * radius));
        // The form takes vectors of the tangent plane by their components along x and y; the rows
        // below give those of any vector's part in the tangent plane.
        let fitted = (normal - a * x - b * y) / slope;
        let (e, f, g) = (1.0 + a * a, a * b, 1.0 + b * b);
        let (first, second) = (x + a * normal, y + b * normal);
        let determinant = e * g - f * f;
        let (dual_x, dual_y) =
            ((g * first - f * second) / determinant, (e * second - f * first) / determinant);
        let outer = |p: DVec3, q: DVec3| DMat3::from_cols(p * q.x, p * q.y, p * q.z);
        let tensor = outer(dual_x, dual_x) * l
            + (outer(dual_x, dual_y) + outer(dual_y, dual_x)) * m
            + outer(dual_y, dual_y) * n;
        let deviation = noise * worst_direction::deviation(&covariance) / radius;
        Some(VertexForm { normal: fitted, tensor, deviation, radius })
    }
}

/// Covariance of the curvature terms for heights of standard deviation 1: their rows of the inverse
/// of an upper triangle, times themselves.
fn covariance(triangle: &[f64], terms: usize) -> Pairs {
    let curvature = 3..6;
    let mut sum = Pairs::default();
    let mut column = [0.0; CUBIC];
    for c in curvature.start..terms {
        column.fill(0.0);
        for i in (curvature.start..=c).rev() {
            let known: f64 = (i + 1..=c).map(|k| triangle[i * terms + k] * column[k]).sum();
            column[i] = (f64::from(u8::from(i == c)) - known) / triangle[i * terms + i];
        }
        add_pairs(&mut sum, [column[3], column[4], column[5]]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The inner part of a torus with radii 2 and 1, `n` by `2 n` vertices whose triangles are
    /// `stretch` times as long as wide, moved by `noise` along the normal.
    fn torus(n: u32, stretch: f64, noise: f64) -> (TriMesh, Vec<f64>) {
        let m = (f64::from(n) * stretch) as u32;
        let mut state = 1_u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) as f64 / f64::from(1_u32 << 31)) - 0.5
        };
        let (mut points, mut gaussian) = (Vec::new(), Vec::new());
        for k in 0..n * m {
            let u = 1.2 * f64::from(k / m) / f64::from(n - 1);
            let v = 2.2 + 1.9 * f64::from(k % m) / f64::from(m - 1);
            let r = 2.0 + v.cos() * (1.0 + noise * random());
            let height = v.sin() * (1.0 + noise * random());
            points.push(DVec3::new(r * u.cos(), r * u.sin(), height));
            gaussian.push(v.cos() / (2.0 + v.cos()));
        }
        let cells = (0..(n - 1) * (m - 1)).map(|k| m * (k / (m - 1)) + k % (m - 1));
        let triangles = cells.flat_map(|a| [[a, a + m, a + m + 1], [a, a + m + 1, a + 1]]);
        (TriMesh::new(points, triangles.collect()).unwrap(), gaussian)
    }

    /// Root of the mean square of the errors of K.
    fn error(n: u32, stretch: f64, noise: f64, radius: f64) -> f64 {
        let (mesh, exact) = torus(n, stretch, noise);
        let forms = vertex_forms(&mesh, radius);
        let gaussian = |form: &VertexForm| {
            let (x, y) = form.normal.any_orthonormal_pair();
            let t = form.tensor;
            x.dot(t * x) * y.dot(t * y) - x.dot(t * y).powi(2)
        };
        let squares = forms.iter().zip(&exact).map(|(f, k)| (gaussian(&f.unwrap()) - k).powi(2));
        (squares.sum::<f64>() / exact.len() as f64).sqrt()
    }

    #[test]
    fn errors_fall_with_the_square_of_the_radius() {
        let (coarse, fine) = (error(60, 1.0, 0.0, 0.4), error(60, 1.0, 0.0, 0.2));
        assert!(fine < 0.01 && coarse / fine > 3.0, "{coarse} {fine}");
    }

    #[test]
    fn thin_triangles_do_not_matter() {
        let even = error(40, 1.0, 0.0, 0.25);
        let thin = error(12, 50.0, 0.0, 0.25);
        assert!(thin < 3.0 * even && thin < 0.03, "{thin} {even}");
    }

    #[test]
    fn noise_is_averaged_where_it_is() {
        let noisy = error(40, 1.0, 0.02, 0.2);
        assert!(noisy < 0.3, "{noisy}");
    }
}
