//! Two patches along a common edge: when they join smoothly, and by how much they fail to.

use geom_core::DVec3;

/// The control points of two patches with the common edge `b₀b₃` (Shi et al. 2014, Fig. 2).
///
/// Left patch `b₀ b₁ b₂ b₃`, right patch `b₀ b₃ b₄ b₅`. Shape parameters of both are those of
/// the diagonals through `b₀`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeJoin {
    /// Control points `b₀ … b₅`.
    pub b: [DVec3; 6],
}

impl EdgeJoin {
    /// `W_r / W_l` of a smooth join, given planar vertex stars (ibid., Eq. 7).
    ///
    /// Negative if the quads twist in opposite senses (the equitwist condition fails): then no
    /// pair of positive shape parameters joins them smoothly.
    #[must_use]
    pub fn shape_ratio(&self) -> f64 {
        let [b0, b1, b2, b3, b4, b5] = self.b;
        let edge = b3 - b0;
        edge.cross(b5 - b0).dot(b2 - b0) / edge.cross(b1 - b0).dot(b4 - b0)
    }

    /// Normals of the two patches at parameter `t` of the edge (0 at `b₀`, 1 at `b₃`), both
    /// pointing to the same side where the patches join smoothly; not normalised.
    ///
    /// The parameter is that of the weights `(1, 1, W, 1)`, which the two patches share.
    #[must_use]
    pub fn normals(&self, left: f64, right: f64, t: f64) -> [DVec3; 2] {
        let [b0, b1, b2, b3, b4, b5] = self.b;
        let edge = b3 - b0;
        let p = b0.lerp(b3, t);
        // The ruling of each patch that leaves the edge at p ends on the opposite edge at q.
        let across = |a: DVec3, b: DVec3, w: f64| (a * (1.0 - t) + b * (t * w)) / (1.0 - t + t * w);
        [edge.cross(across(b1, b2, left) - p), (across(b5, b4, right) - p).cross(edge)]
    }

    /// Largest angle between the two tangent planes at `samples` points of the edge, ends
    /// included, in radians.
    ///
    /// Normals are oriented and the angle comes from both sine and cosine, so a smooth join reads
    /// 0 to rounding and a fold, whose planes agree as well, reads π.
    ///
    /// # Panics
    /// With fewer than two samples.
    #[must_use]
    pub fn kink(&self, left: f64, right: f64, samples: usize) -> f64 {
        assert!(samples >= 2, "both ends of the edge are sampled");
        (0..samples)
            .map(|k| {
                let [m, n] = self.normals(left, right, k as f64 / (samples - 1) as f64);
                m.cross(n).length().atan2(m.dot(n))
            })
            .fold(0.0, f64::max)
    }

    /// Whether the patches fold back at the edge: in one of the two vertex planes the neighbours
    /// `b₁, b₅` (or `b₂, b₄`) lie on the same side of the edge.
    ///
    /// The smoothness condition of the paper admits this case as well.
    #[must_use]
    pub fn is_folded(&self) -> bool {
        let [b0, b1, b2, b3, b4, b5] = self.b;
        let edge = b3 - b0;
        let same_side =
            |p: DVec3, q: DVec3, o: DVec3| edge.cross(p - o).dot(edge.cross(q - o)) >= 0.0;
        same_side(b1, b5, b0) || same_side(b2, b4, b3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A net around the edge with planar stars: `T₀` is z = 0, `T₃` contains the edge.
    fn smooth_join() -> EdgeJoin {
        let b0 = DVec3::ZERO;
        let b3 = DVec3::new(0.0, 1.0, 0.0);
        let in_t3 = |side: f64, along: f64| {
            let tilt = DVec3::new(1.0, 0.0, 0.4);
            b3 + tilt * side + DVec3::Y * along
        };
        let b1 = DVec3::new(-1.0, 0.1, 0.0);
        let b5 = DVec3::new(1.2, -0.05, 0.0);
        EdgeJoin { b: [b0, b1, in_t3(-0.9, 0.1), b3, in_t3(1.1, 0.03), b5] }
    }

    #[test]
    fn right_ratio_joins_smoothly_along_the_whole_edge() {
        let join = smooth_join();
        let left = 1.4;
        let ratio = join.shape_ratio();
        assert!(ratio > 0.0 && !join.is_folded());
        assert!(join.kink(left, ratio * left, 11) < 1e-15);
        assert!(join.kink(left, 1.3 * ratio * left, 11) > 1e-2);
    }

    #[test]
    fn ratio_between_other_parameters_stays_the_same() {
        let join = smooth_join();
        for left in [0.3, 1.0, 4.0] {
            assert!(join.kink(left, join.shape_ratio() * left, 21) < 1e-14);
        }
    }

    #[test]
    fn fold_reads_half_a_turn_though_its_planes_agree() {
        let mut join = smooth_join();
        // Reflect the right patch to the left side within the two tangent planes.
        join.b[5] = DVec3::new(-1.2, -0.05, 0.0);
        join.b[4] = join.b[3] - (join.b[4] - join.b[3]);
        assert!(join.is_folded());
        let ratio = join.shape_ratio();
        assert!(ratio > 0.0);
        let kink = join.kink(1.0, ratio, 11);
        assert!((kink - std::f64::consts::PI).abs() < 1e-12, "{kink}");
    }

    #[test]
    fn opposite_twist_gives_a_negative_ratio() {
        let mut join = smooth_join();
        let mirrored = join.b[4];
        join.b[4] = DVec3::new(-mirrored.x, mirrored.y, -mirrored.z);
        assert!(join.shape_ratio() < 0.0);
    }
}
