//! Darboux transformations: hyperbolic nets to smooth surfaces of Darboux cyclide patches.

use super::error::{CageFault, Error};
use crate::net::{BilinearPatch, Quadric};
use geom_core::{DMat3, DVec3};
use glam::DMat4;
use gp_solver::choices;
use numerics::{dot, norm};
use serde::{Deserialize, Serialize};

/// Which of the two images of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Branch {
    /// For `c` alone the one that is regular at the origin; for a cage the one through its corners.
    #[default]
    Regular,
    /// The other one: inverse to it in the sphere Λ.
    Other,
}

choices!(Branch { Regular = "regular", Other = "other" });

/// A transformation given by its rational inverse `X ~ N (y, |y|², 1)`, `N` a 4 × 5 matrix.
///
/// A Darboux transformation `x → y` composed with projective maps is two-valued, its inverse is
/// not: for `c` alone `x = 2 (1 − c) y / (|y|² + c² − 1)` (Shi et al. 2014, Eq. 12, solved for
/// `x`). Planes `aᵀX = 0` become spheres `aᵀN (y, |y|², 1) = 0`, lines circles, and quadrics
/// `XᵀQX = 0` Darboux cyclides (Pottmann et al. 2012). The general `N` has 19 degrees of freedom:
/// 15 of a projective map, `c`, and a translation of the image.
///
/// Images come from the quadratic equation for the point of the line `N⁻¹X` on the quadric
/// `|y|² = m s` of lifted points `(y, m, s)`, in a form without cancellation. Both roots depend
/// continuously on `x` where the discriminant is positive, so one sign is one branch for a
/// whole model.
#[derive(Clone, Debug, PartialEq)]
pub struct DarbouxMap {
    n: [[f64; 5]; 4],
    kernel: [f64; 5],
    /// `N⁺`, the particular solution of least length.
    pseudo_inverse: [[f64; 4]; 5],
    /// Sign of the root that [`Branch::Regular`] means.
    regular: f64,
}

/// The image of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImageCircle {
    /// A circle.
    Circle {
        /// Its centre.
        center: DVec3,
        /// Unit normal of its plane.
        normal: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// A straight line: a circle through infinity.
    Line {
        /// A point of it.
        point: DVec3,
        /// Its unit direction.
        direction: DVec3,
    },
}

/// A Darboux cyclide `Yᵀ M Y = 0` with `Y = (y, |y|², 1)`: an exact implicit equation of degree 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cyclide {
    /// The symmetric matrix `M`.
    pub matrix: [[f64; 5]; 5],
}

impl DarbouxMap {
    /// The transformation of a centre `c`, as published: Λ is `|y|² = c² − 1`, real points have
    /// `|x|² ≤ (c − 1)/(c + 1)` for `|c| > 1`, and all are real for `|c| ≤ 1`.
    ///
    /// # Errors
    /// [`Error::BadCentre`] for `c = 1` and what is not finite.
    pub fn new(c: f64) -> Result<Self, Error> {
        if !c.is_finite() || c == 1.0 {
            return Err(Error::BadCentre { c });
        }
        let mut n = [[0.0; 5]; 4];
        for i in 0..3 {
            n[i][i] = 2.0 * (1.0 - c);
        }
        n[3][3] = 1.0;
        n[3][4] = c * c - 1.0;
        let mut map = Self::from_matrix(n)?;
        // Of the two images of the origin, one is the origin and the other at infinity.
        let at = |sign: f64| map.lift(DVec3::ZERO, sign).map_or(0.0, |y| y[4].abs() / norm(&y));
        map.regular = if at(1.0) >= at(-1.0) { 1.0 } else { -1.0 };
        Ok(map)
    }

    /// The map with a given matrix; `Regular` is the positive root until [`Self::through`] says
    /// otherwise.
    ///
    /// # Errors
    /// [`Error::BadCage`] if `N` has not rank 4.
    pub fn from_matrix(n: [[f64; 5]; 4]) -> Result<Self, Error> {
        let size = n.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        if !(size > 0.0 && size.is_finite()) {
            return Err(CageFault::NoMatrix.into());
        }
        let n = n.map(|row| row.map(|v| v / size));
        // The kernel is the vector of signed 4 × 4 minors.
        let kernel: [f64; 5] = std::array::from_fn(|skip| {
            let minor = n.map(|row| {
                let mut kept = row.iter().enumerate().filter(|(k, _)| *k != skip).map(|(_, v)| *v);
                std::array::from_fn(|_| kept.next().unwrap_or(0.0))
            });
            let sign = if skip % 2 == 0 { 1.0 } else { -1.0 };
            sign * DMat4::from_cols_array_2d(&minor).determinant()
        });
        let length = norm(&kernel);
        if !(length > 1e-14) {
            return Err(CageFault::Flattens.into());
        }
        let kernel = kernel.map(|v| v / length);
        let mut gram = [[0.0; 4]; 4];
        for i in 0..4 {
            for j in 0..4 {
                gram[i][j] = (0..5).map(|k| n[i][k] * n[j][k]).sum();
            }
        }
        let inverse = DMat4::from_cols_array_2d(&gram).inverse();
        if !inverse.is_finite() {
            return Err(CageFault::Flattens.into());
        }
        let inverse = inverse.to_cols_array_2d();
        let pseudo_inverse = std::array::from_fn(|k| {
            std::array::from_fn(|j| (0..4).map(|i| n[i][k] * inverse[i][j]).sum())
        });
        Ok(Self { n, kernel, pseudo_inverse, regular: 1.0 })
    }

    /// The same map in a frame: coordinates of model and image counted from `origin` in units
    /// of `unit`.
    ///
    /// # Errors
    /// As [`Self::from_matrix`].
    pub fn in_frame(&self, origin: DVec3, unit: f64) -> Result<Self, Error> {
        // y' = (y − o)/u lifts linearly: |y'|² = (|y|² − 2 o·y + |o|²)/u².
        let o = origin.to_array();
        let mut lift = [[0.0; 5]; 5];
        for i in 0..3 {
            lift[i][i] = 1.0 / unit;
            lift[i][4] = -o[i] / unit;
            lift[3][i] = -2.0 * o[i] / (unit * unit);
        }
        lift[3][3] = 1.0 / (unit * unit);
        lift[3][4] = origin.length_squared() / (unit * unit);
        lift[4][4] = 1.0;
        let mut n = [[0.0; 5]; 4];
        for j in 0..5 {
            let column: [f64; 4] =
                std::array::from_fn(|i| (0..5).map(|k| self.n[i][k] * lift[k][j]).sum());
            for i in 0..3 {
                n[i][j] = unit * column[i] + o[i] * column[3];
            }
            n[3][j] = column[3];
        }
        let mut map = Self::from_matrix(n)?;
        // The kernel may come with the other sign; a point shows which root is which.
        let (x, sign) = (origin, self.regular);
        if let (Ok(want), Ok(got)) = (self.lift(DVec3::ZERO, sign), map.lift(x, 1.0)) {
            let image: [f64; 5] =
                std::array::from_fn(|i| (0..5).map(|k| lift[i][k] * got[k]).sum());
            map.regular = if parallel(&image, &want) { 1.0 } else { -1.0 };
        }
        Ok(map)
    }

    /// The same map with `Regular` the branch on which the pairs `x → y` lie.
    ///
    /// # Errors
    /// [`Error::BadCage`] if they lie on both.
    pub fn through(mut self, pairs: &[(DVec3, DVec3)]) -> Result<Self, Error> {
        let mut votes = [Vec::new(), Vec::new()];
        for (k, &(x, y)) in pairs.iter().enumerate() {
            // A branch without an image here is no candidate.
            let far = |sign: f64| {
                let image = self.lift(x, sign).ok().and_then(|lifted| project(&lifted));
                image.map_or(f64::INFINITY, |p| p.distance(y))
            };
            let (plus, minus) = (far(1.0), far(-1.0));
            if plus.min(minus) == f64::INFINITY {
                return Err(CageFault::NoRealImage { corner: k }.into());
            }
            votes[usize::from(minus < plus)].push(k);
        }
        if let ([a, ..], [b, ..]) = (votes[0].as_slice(), votes[1].as_slice()) {
            return Err(CageFault::DifferentBranches { corners: [*a, *b] }.into());
        }
        self.regular = if votes[0].is_empty() { -1.0 } else { 1.0 };
        Ok(self)
    }

    /// The matrix `N`, largest entry 1.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 5]; 4] {
        self.n
    }

    /// The image of a point.
    ///
    /// # Errors
    /// [`Error`] outside the real domain, at infinity, or on a branch that collapses.
    pub fn image(&self, x: DVec3, branch: Branch) -> Result<DVec3, Error> {
        let lifted = self.lift(x, self.sign(branch))?;
        project(&lifted).ok_or(Error::Infinite { x: x.x, y: x.y, z: x.z })
    }

    /// The point with a given image; rational and single-valued. `None` at infinity.
    #[must_use]
    pub fn preimage(&self, y: DVec3) -> Option<DVec3> {
        let lifted = lifted(y);
        let x: [f64; 4] = std::array::from_fn(|i| dot(&self.n[i], &lifted));
        let size = norm(&lifted);
        (x[3].abs() > 1e-14 * size).then(|| DVec3::new(x[0], x[1], x[2]) / x[3])
    }

    /// Derivative of the image by the point, from that of the rational inverse.
    ///
    /// # Errors
    /// As [`Self::image`]; the derivative does not exist on the border of the real domain.
    pub fn derivative(&self, x: DVec3, branch: Branch) -> Result<(DVec3, DMat3), Error> {
        let y = self.image(x, branch)?;
        let lifted = lifted(y);
        let bottom = dot(&self.n[3], &lifted);
        let slope = |i: usize, c: usize| self.n[i][c] + 2.0 * y[c] * self.n[i][3];
        let column = |c: usize| {
            let d = |i: usize| (slope(i, c) - x[i] * slope(3, c)) / bottom;
            DVec3::new(d(0), d(1), d(2))
        };
        let backward = DMat3::from_cols(column(0), column(1), column(2));
        let forward = backward.inverse();
        if !(bottom.abs() > 1e-14 * norm(&lifted)) || !forward.is_finite() {
            return Err(Error::Collapsed);
        }
        Ok((y, forward))
    }

    /// Checks that all points of a convex hull spanned by `points` have finite real images on one
    /// side of infinity; rational bilinear patches lie within the hull of their corners.
    ///
    /// For `c` alone the real domain is a ball, so corners decide for the patches between them.
    ///
    /// # Errors
    /// [`Error`] names the first point at fault.
    pub fn check(&self, points: &[DVec3], branch: Branch) -> Result<(), Error> {
        let mut side = 0.0_f64;
        for &p in points {
            let lifted = self.lift(p, self.sign(branch))?;
            // Scaled so that N Y = (x, 1): the last entry then changes sign only through infinity.
            let scale = dot(&self.n[3], &lifted);
            let here = (lifted[4] / scale).signum();
            if project(&lifted).is_none() || (side != 0.0 && here != side) {
                return Err(Error::Infinite { x: p.x, y: p.y, z: p.z });
            }
            side = here;
        }
        Ok(())
    }

    /// The exact implicit equation of the image of a patch; both images satisfy it.
    #[must_use]
    pub fn cyclide(&self, patch: &BilinearPatch) -> Cyclide {
        self.cyclide_of(&patch.implicit_quadric())
    }

    /// The image of a quadric.
    #[must_use]
    pub fn cyclide_of(&self, quadric: &Quadric) -> Cyclide {
        let q = quadric.matrix;
        let mut matrix = [[0.0; 5]; 5];
        for a in 0..5 {
            for b in 0..5 {
                for i in 0..4 {
                    for j in 0..4 {
                        matrix[a][b] += self.n[i][a] * q[i][j] * self.n[j][b];
                    }
                }
            }
        }
        Cyclide { matrix }
    }

    /// The sphere (or plane) `a·y + b |y|² + d = 0` a plane `n·x = h` becomes, as `(a, b, d)`.
    #[must_use]
    pub fn sphere(&self, normal: DVec3, height: f64) -> (DVec3, f64, f64) {
        let plane = [normal.x, normal.y, normal.z, -height];
        let s: [f64; 5] = std::array::from_fn(|k| (0..4).map(|i| plane[i] * self.n[i][k]).sum());
        (DVec3::new(s[0], s[1], s[2]), s[3], s[4])
    }

    /// The circle that carries the images of the line through two points, both images alike.
    #[must_use]
    pub fn circle(&self, p: DVec3, q: DVec3) -> ImageCircle {
        let (n1, n2) = (q - p).normalize().any_orthonormal_pair();
        let (a, b, d) = self.sphere(n1, n1.dot(p));
        let (e, f, g) = self.sphere(n2, n2.dot(p));
        // Of the pencil of both spheres, the plane and the sphere orthogonal to it.
        let length = b.hypot(f);
        if !(length > 1e-14 * (a.length() + e.length())) {
            let direction = a.cross(e).normalize();
            let point =
                (e.cross(direction) * -d + direction.cross(a) * -g) / a.cross(e).dot(direction);
            return ImageCircle::Line { point, direction };
        }
        let (cos, sin) = (b / length, f / length);
        let plane = (a * sin - e * cos, d * sin - g * cos);
        let sphere = (a * cos + e * sin, d * cos + g * sin);
        let scale = plane.0.length();
        let (normal, height) = (plane.0 / scale, -plane.1 / scale);
        let middle = sphere.0 / (-2.0 * length);
        let square = middle.length_squared() - sphere.1 / length;
        let off = normal.dot(middle) - height;
        let center = middle - normal * off;
        ImageCircle::Circle { center, normal, radius: (square - off * off).max(0.0).sqrt() }
    }

    fn sign(&self, branch: Branch) -> f64 {
        match branch {
            Branch::Regular => self.regular,
            Branch::Other => -self.regular,
        }
    }

    /// The point `(y, m, s)` with `|y|² = m s` and `N (y, m, s) ~ (x, 1)`, of one root.
    fn lift(&self, x: DVec3, sign: f64) -> Result<[f64; 5], Error> {
        let target = [x.x, x.y, x.z, 1.0];
        let start: [f64; 5] =
            std::array::from_fn(|k| (0..4).map(|i| self.pseudo_inverse[k][i] * target[i]).sum());
        // Scaled to length 1, so that both directions of the line weigh alike.
        let length = norm(&start);
        let start = start.map(|v| v / length);
        let (a, b, c) =
            (form(&self.kernel, &self.kernel), form(&self.kernel, &start), form(&start, &start));
        let discriminant = b * b - a * c;
        if !(discriminant >= 0.0) {
            return Err(Error::OutsideRealDomain { x: x.x, y: x.y, z: x.z, discriminant });
        }
        let root = discriminant.sqrt();
        // (t : τ) = (−b ± root : a) = (c : −b ∓ root); the form whose sum does not cancel.
        let (t, tau) = if b * sign <= 0.0 { (-b + sign * root, a) } else { (c, -b - sign * root) };
        let lifted: [f64; 5] = std::array::from_fn(|k| tau * start[k] + t * self.kernel[k]);
        if !(tau.abs() > 1e-14 * (t.abs() + tau.abs())) {
            return Err(Error::Collapsed);
        }
        Ok(lifted)
    }
}

impl Cyclide {
    /// `Yᵀ M Y`.
    #[must_use]
    pub fn value(&self, y: DVec3) -> f64 {
        let lifted = lifted(y);
        (0..5).map(|i| lifted[i] * dot(&self.matrix[i], &lifted)).sum()
    }

    /// Gradient of [`Self::value`].
    #[must_use]
    pub fn gradient(&self, y: DVec3) -> DVec3 {
        let lifted = lifted(y);
        let my: [f64; 5] = std::array::from_fn(|i| dot(&self.matrix[i], &lifted));
        (DVec3::new(my[0], my[1], my[2]) + y * (2.0 * my[3])) * 2.0
    }

    /// Mean curvature (for the normal along the gradient) and Gaussian curvature at a point of
    /// the cyclide: `H = (gᵀ A g − |g|² tr A) / (2 |g|³)`, `K = gᵀ adj(A) g / |g|⁴` with the
    /// gradient `g` and the Hessian `A`.
    #[must_use]
    pub fn curvatures(&self, y: DVec3) -> (f64, f64) {
        let lifted = lifted(y);
        let g = self.gradient(y);
        let m = &self.matrix;
        let bend = 4.0 * dot(&m[3], &lifted);
        let entry = |i: usize, j: usize| {
            let slope =
                m[i][j] + 2.0 * y[j] * m[i][3] + 2.0 * y[i] * m[3][j] + 4.0 * y[i] * y[j] * m[3][3];
            2.0 * slope + if i == j { bend } else { 0.0 }
        };
        let column = |j: usize| DVec3::new(entry(0, j), entry(1, j), entry(2, j));
        let (a, b, c) = (column(0), column(1), column(2));
        let hessian = DMat3::from_cols(a, b, c);
        let adjugate = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
        let square = g.length_squared();
        let trace = a.x + b.y + c.z;
        let mean = (g.dot(hessian * g) - square * trace) / (2.0 * square * square.sqrt());
        (mean, g.dot(adjugate * g) / (square * square))
    }
}

fn lifted(y: DVec3) -> [f64; 5] {
    [y.x, y.y, y.z, y.length_squared(), 1.0]
}

fn project(lifted: &[f64; 5]) -> Option<DVec3> {
    let y = DVec3::new(lifted[0], lifted[1], lifted[2]) / lifted[4];
    (lifted[4].abs() > 1e-14 * norm(lifted) && y.is_finite()).then_some(y)
}

/// The bilinear form of `|y|² − m s`.
fn form(a: &[f64; 5], b: &[f64; 5]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - 0.5 * (a[3] * b[4] + a[4] * b[3])
}

fn parallel(a: &[f64; 5], b: &[f64; 5]) -> bool {
    dot(a, b).abs() > (1.0 - 1e-6) * norm(a) * norm(b)
}

#[cfg(test)]
#[path = "map_tests.rs"]
mod tests;
