//! Rational bilinear patches: the ruled quadrics a hyperbolic net is made of.

use crate::PatchError;
use geom_core::DVec3;

/// A rational bilinear patch with positive weights (Shi et al. 2014, Eq. 1).
///
/// `x(u, v) = Σ B_i w_i b_i / Σ B_i w_i` with `B = (1−u)(1−v), u(1−v), uv, (1−u)v`: corners run
/// around the control quad, corner 1 is at `(1, 0)` and corner 3 at `(0, 1)`. Both families of
/// parameter lines are straight. Corners are finite and weights positive (kept by `new`).
///
/// # Example
/// ```
/// use geom_core::DVec3;
/// use hyperbolic_nets::BilinearPatch;
/// let corners = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
/// let saddle = BilinearPatch::from_shape_parameter(corners, 1.0)?;
/// let centre = saddle.jet(0.5, 0.5);
/// assert_eq!(centre.point, DVec3::new(0.5, 0.5, 0.25)); // z = xy
/// assert!((centre.gaussian_curvature()? + 1.0 / 2.25).abs() < 1e-15);
/// # Ok::<(), hyperbolic_nets::PatchError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilinearPatch {
    corners: [DVec3; 4],
    weights: [f64; 4],
}

/// Position and derivatives of a patch at one parameter pair.
///
/// Second derivatives along the rulings have no normal part, since these are straight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchJet {
    /// The parameters.
    pub uv: [f64; 2],
    /// Position.
    pub point: DVec3,
    /// First derivative by `u`.
    pub du: DVec3,
    /// First derivative by `v`.
    pub dv: DVec3,
    /// Second derivative by `u`.
    pub duu: DVec3,
    /// Mixed second derivative.
    pub duv: DVec3,
    /// Second derivative by `v`.
    pub dvv: DVec3,
}

impl BilinearPatch {
    /// Checks corners and weights.
    ///
    /// # Errors
    /// [`PatchError`] if a corner is not finite or a weight not positive.
    pub fn new(corners: [DVec3; 4], weights: [f64; 4]) -> Result<Self, PatchError> {
        if let Some(corner) = corners.iter().position(|b| !b.is_finite()) {
            let DVec3 { x, y, z } = corners[corner];
            return Err(PatchError::CornerNotFinite { corner, x, y, z });
        }
        if let Some(corner) = weights.iter().position(|&w| !(w > 0.0 && w < f64::INFINITY)) {
            return Err(PatchError::WeightNotPositive { corner, weight: weights[corner] });
        }
        Ok(Self { corners, weights })
    }

    /// The patch with weights `(1, 1, W, 1)`: the diagonal 0–2 carries `W` (ibid., Eqs. 2–4).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_shape_parameter(corners: [DVec3; 4], shape: f64) -> Result<Self, PatchError> {
        Self::new(corners, [1.0, 1.0, shape, 1.0])
    }

    /// Corners in order around the control quad.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 4] {
        self.corners
    }

    /// Weights of the corners.
    #[must_use]
    pub fn weights(&self) -> [f64; 4] {
        self.weights
    }

    /// `W = w₀w₂ / (w₁w₃)` of the diagonal 0–2 (ibid., Eq. 4); the other diagonal has `1/W`.
    ///
    /// Two patches with the same corners lie on the same quadric iff their `W` agree; `W = 1` is
    /// a hyperbolic paraboloid.
    #[must_use]
    pub fn shape_parameter(&self) -> f64 {
        let [w0, w1, w2, w3] = self.weights;
        (w0 / w1) * (w2 / w3)
    }

    /// The same piece of quadric, parametrised with weights `(1, 1, W, 1)`.
    #[must_use]
    pub fn normalized(&self) -> Self {
        Self { corners: self.corners, weights: [1.0, 1.0, self.shape_parameter(), 1.0] }
    }

    /// The same piece of quadric with the weights `(W^¼, W^−¼, W^¼, W^−¼)`, which are those of the
    /// corners whichever of them comes first.
    #[must_use]
    pub fn balanced(&self) -> Self {
        let root = self.shape_parameter().sqrt().sqrt();
        Self { corners: self.corners, weights: [root, 1.0 / root, root, 1.0 / root] }
    }

    /// Position at `(u, v)`.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        let (p, w) = self.combine([(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]);
        p / w
    }

    /// Position and derivatives up to order two at `(u, v)`.
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> PatchJet {
        let (p, w) = self.combine([(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v]);
        let (pu, wu) = self.combine([v - 1.0, 1.0 - v, v, -v]);
        let (pv, wv) = self.combine([u - 1.0, -u, u, 1.0 - u]);
        let (puv, wuv) = self.combine([1.0, -1.0, 1.0, -1.0]);
        let point = p / w;
        let du = (pu - point * wu) / w;
        let dv = (pv - point * wv) / w;
        PatchJet {
            uv: [u, v],
            point,
            du,
            dv,
            duu: du * (-2.0 * wu / w),
            duv: (puv - du * wv - dv * wu - point * wuv) / w,
            dvv: dv * (-2.0 * wv / w),
        }
    }

    fn combine(&self, basis: [f64; 4]) -> (DVec3, f64) {
        let (mut p, mut w) = (DVec3::ZERO, 0.0);
        for k in 0..4 {
            let bw = basis[k] * self.weights[k];
            p += self.corners[k] * bw;
            w += bw;
        }
        (p, w)
    }

    /// End points of the ruling `v = const`, on the edges 3–0 and 1–2.
    #[must_use]
    pub fn ruling_along_u(&self, v: f64) -> [DVec3; 2] {
        [self.point(0.0, v), self.point(1.0, v)]
    }

    /// End points of the ruling `u = const`, on the edges 0–1 and 2–3.
    #[must_use]
    pub fn ruling_along_v(&self, u: f64) -> [DVec3; 2] {
        [self.point(u, 0.0), self.point(u, 1.0)]
    }

    /// Frame points `f_k`, on edge `k`–`k+1`: it is divided in the inverse ratio of the weights
    /// (ibid., §2.1). `f₀f₂` and `f₁f₃` are rulings of the patch.
    #[must_use]
    pub fn frame_points(&self) -> [DVec3; 4] {
        std::array::from_fn(|k| {
            let (i, j) = (k, (k + 1) % 4);
            let (wi, wj) = (self.weights[i], self.weights[j]);
            (self.corners[i] * wi + self.corners[j] * wj) / (wi + wj)
        })
    }

    /// Signed volume `det(b₁ − b₀, b₃ − b₀, b₂ − b₀)`, six times that of the control tetrahedron:
    /// zero for a planar quad, and its sign is the sense in which the patch twists.
    #[must_use]
    pub fn twist(&self) -> f64 {
        let [b0, b1, b2, b3] = self.corners;
        (b1 - b0).cross(b3 - b0).dot(b2 - b0)
    }

    /// The quadric the patch lies on, in closed form.
    ///
    /// With barycentric coordinates `λ_i` of the control tetrahedron it is
    /// `λ₀λ₂ − W λ₁λ₃ = 0`: tangent planes at opposite corners are a degenerate quadric through
    /// all four edges, and `W` picks one from the pencil of the two. The `λ` are left multiplied
    /// by the volume, so that the matrix also exists (and vanishes) for a planar quad.
    #[must_use]
    pub fn implicit_quadric(&self) -> Quadric {
        let planes: [[f64; 4]; 4] = std::array::from_fn(|k| {
            let b = self.corners;
            let others = [b[(k + 1) % 4], b[(k + 2) % 4], b[(k + 3) % 4]];
            let normal = (others[1] - others[0]).cross(others[2] - others[0]);
            // Orientation alternates with the position of the corner left out.
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let n = normal * sign;
            [n.x, n.y, n.z, -n.dot(others[0])]
        });
        let shape = self.shape_parameter();
        let matrix = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let even = planes[0][i] * planes[2][j] + planes[2][i] * planes[0][j];
                let odd = planes[1][i] * planes[3][j] + planes[3][i] * planes[1][j];
                0.5 * (even - shape * odd)
            })
        });
        Quadric { matrix }
    }
}

impl PatchJet {
    /// `x_u × x_v`, left unnormalised: its length tells how near to singular the point is.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.du.cross(self.dv)
    }

    /// Gaussian curvature `K = −(x_uv · N)² / |N|⁴` with `N = x_u × x_v`, in 1/length².
    ///
    /// # Errors
    /// [`PatchError::Singular`] where the two rulings are parallel.
    pub fn gaussian_curvature(&self) -> Result<f64, PatchError> {
        let (m, area) = self.mixed_term()?;
        Ok(-(m / area).powi(2))
    }

    /// Mean curvature `H = −F M / (E G − F²)`, in 1/length; its sign follows `x_u × x_v`.
    ///
    /// `L` and `N` of the second fundamental form vanish, because the parameter lines are
    /// straight.
    ///
    /// # Errors
    /// [`PatchError::Singular`] where the two rulings are parallel.
    pub fn mean_curvature(&self) -> Result<f64, PatchError> {
        let (m, area) = self.mixed_term()?;
        Ok(-self.du.dot(self.dv) / area * (m / area))
    }

    // `M` of the second fundamental form and the area element.
    fn mixed_term(&self) -> Result<(f64, f64), PatchError> {
        let normal = self.normal();
        let area = normal.length();
        if !(area > 1e-14 * self.du.length() * self.dv.length()) {
            let [u, v] = self.uv;
            return Err(PatchError::Singular { u, v });
        }
        Ok((self.duv.dot(normal) / area, area))
    }
}

/// A quadric `Xᵀ Q X = 0` in homogeneous coordinates `X = (x, y, z, 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// The symmetric matrix `Q`.
    pub matrix: [[f64; 4]; 4],
}

impl Quadric {
    /// `Xᵀ Q X` at a point.
    #[must_use]
    pub fn value(&self, p: DVec3) -> f64 {
        let x = [p.x, p.y, p.z, 1.0];
        (0..4).map(|i| x[i] * (0..4).map(|j| self.matrix[i][j] * x[j]).sum::<f64>()).sum()
    }

    /// Gradient of [`Self::value`]: a normal of the quadric at its points.
    #[must_use]
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let x = [p.x, p.y, p.z, 1.0];
        let row = |i: usize| 2.0 * (0..4).map(|j| self.matrix[i][j] * x[j]).sum::<f64>();
        DVec3::new(row(0), row(1), row(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn skew() -> [DVec3; 4] {
        [
            DVec3::new(0.0, 0.1, -0.2),
            DVec3::new(1.1, 0.0, 0.3),
            DVec3::new(1.0, 1.2, -0.4),
            DVec3::new(-0.1, 0.9, 0.5),
        ]
    }

    #[test]
    fn frame_points_are_the_edge_midpoints_of_the_parametrisation() {
        let patch = BilinearPatch::new(skew(), [0.7, 1.3, 0.5, 1.9]).unwrap();
        let want = [
            patch.point(0.5, 0.0),
            patch.point(1.0, 0.5),
            patch.point(0.5, 1.0),
            patch.point(0.0, 0.5),
        ];
        for (got, want) in patch.frame_points().iter().zip(want) {
            assert!(got.distance(want) < 1e-15);
        }
    }

    #[test]
    fn one_sheeted_hyperboloid_has_its_closed_form_curvatures() {
        // x² + y² − z² = 1 has K = −1 / (x² + y² + z²)², and corners on two rulings of each family.
        let on =
            |phi: f64, z: f64| DVec3::new(phi.cos() - z * phi.sin(), phi.sin() + z * phi.cos(), z);
        // Rulings of the other family through the same points are reached by intersecting two of
        // this family with two of that one.
        let meet = |a: f64, b: f64| {
            // Ruling a: (cos a − z sin a, sin a + z cos a); ruling b': (cos b + z sin b, sin b − z cos b).
            let z = ((b - a) / 2.0).tan();
            on(a, z)
        };
        let corners = [meet(0.0, 0.2), meet(0.0, 0.9), meet(0.5, 0.9), meet(0.5, 0.2)];
        let hyperboloid = |p: DVec3| p.x * p.x + p.y * p.y - p.z * p.z - 1.0;
        assert!(corners.iter().all(|&b| hyperboloid(b).abs() < 1e-14));
        // W from one further point of the surface: on the quadric, λ₀λ₂ / (λ₁λ₃) is constant.
        let inside = meet(0.2, 0.6);
        let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
        let [b0, b1, b2, b3] = corners;
        let shape = volume(inside, b1, b2, b3) * volume(b0, b1, inside, b3)
            / (volume(b0, inside, b2, b3) * volume(b0, b1, b2, inside));
        let patch = BilinearPatch::from_shape_parameter(corners, shape).unwrap();
        for (u, v) in [(0.0, 0.0), (0.3, 0.8), (1.0, 0.5), (0.6, 0.1)] {
            let jet = patch.jet(u, v);
            assert!(hyperboloid(jet.point).abs() < 1e-14);
            let want = -1.0 / jet.point.length_squared().powi(2);
            assert!((jet.gaussian_curvature().unwrap() - want).abs() < 1e-12);
            // H of the implicit surface F = x² + y² − z² − 1, against the gradient normal.
            let p = jet.point;
            let g = DVec3::new(p.x, p.y, -p.z);
            let hess = DVec3::new(1.0, 1.0, -1.0);
            let want = (g.dot(hess * g) - g.length_squared() * (hess.x + hess.y + hess.z))
                / (2.0 * g.length().powi(3));
            let sign = jet.normal().dot(g).signum();
            assert!((jet.mean_curvature().unwrap() - sign * want).abs() < 1e-12);
        }
    }

    #[test]
    fn other_diagonal_has_the_inverse_shape_parameter() {
        let patch = BilinearPatch::from_shape_parameter(skew(), 1.7).unwrap();
        let turned = BilinearPatch::new(skew(), [1.0, 1.0 / 1.7, 1.0, 1.0]).unwrap();
        assert!((turned.shape_parameter() - 1.7).abs() < 1e-15);
        assert!(turned.implicit_quadric().value(patch.point(0.3, 0.6)).abs() < 1e-15);
        let wrong = BilinearPatch::from_shape_parameter(skew(), 1.0 / 1.7).unwrap();
        assert!(wrong.implicit_quadric().value(patch.point(0.3, 0.6)).abs() > 1e-3);
    }

    #[test]
    fn bad_patches_are_refused_with_a_reason() {
        let mut corners = skew();
        let weight = BilinearPatch::new(corners, [1.0, -2.0, 1.0, 1.0]).unwrap_err();
        assert_eq!(
            weight.to_string(),
            "weight 1 is -2; weights must be positive and finite, or the patch leaves its control quad"
        );
        corners[2].y = f64::NAN;
        let corner = BilinearPatch::new(corners, [1.0; 4]).unwrap_err();
        assert!(matches!(corner, PatchError::CornerNotFinite { corner: 2, .. }));
        let flat =
            BilinearPatch::new([DVec3::ZERO, DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0], [1.0; 4]);
        let singular = flat.unwrap().jet(0.25, 0.5).gaussian_curvature().unwrap_err();
        assert_eq!(singular, PatchError::Singular { u: 0.25, v: 0.5 });
    }

    proptest! {
        #[test]
        fn derivatives_match_central_differences(
            u in 0.05..0.95_f64, v in 0.05..0.95_f64,
            w in prop::array::uniform4(0.3..3.0_f64),
        ) {
            let patch = BilinearPatch::new(skew(), w).unwrap();
            let (jet, h) = (patch.jet(u, v), 1e-6);
            let du = (patch.point(u + h, v) - patch.point(u - h, v)) / (2.0 * h);
            let dv = (patch.point(u, v + h) - patch.point(u, v - h)) / (2.0 * h);
            // Uneven weights make third derivatives of some thousands, hence the relative bound.
            prop_assert!(jet.du.distance(du) < 1e-8 * (1.0 + du.length()));
            prop_assert!(jet.dv.distance(dv) < 1e-8 * (1.0 + dv.length()));
            let (up, down) = (patch.jet(u + h, v), patch.jet(u - h, v));
            prop_assert!(jet.duu.distance((up.du - down.du) / (2.0 * h)) < 1e-7 * (1.0 + jet.duu.length()));
            prop_assert!(jet.duv.distance((up.dv - down.dv) / (2.0 * h)) < 1e-7 * (1.0 + jet.duv.length()));
            let (up, down) = (patch.jet(u, v + h), patch.jet(u, v - h));
            prop_assert!(jet.dvv.distance((up.dv - down.dv) / (2.0 * h)) < 1e-7 * (1.0 + jet.dvv.length()));
        }

        #[test]
        fn same_shape_parameter_is_the_same_quadric(
            u in 0.0..1.0_f64, v in 0.0..1.0_f64, w in prop::array::uniform4(0.3..3.0_f64),
        ) {
            let patch = BilinearPatch::new(skew(), w).unwrap();
            let quadric = patch.normalized().implicit_quadric();
            let p = patch.point(u, v);
            prop_assert!(quadric.value(p).abs() < 1e-13);
            let n = patch.jet(u, v).normal();
            prop_assert!(quadric.gradient(p).cross(n).length() < 1e-12 * n.length().max(1.0));
        }
    }
}
