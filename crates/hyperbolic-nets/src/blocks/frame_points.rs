//! Planarity of the frame points of two patches at their common edge.

use gp_solver::{Elements, Group, ResidualBlock};

use super::quad_distances::{Mix, QuadDistances};
use crate::QuadNet;

/// Distances of the diagonals of the frame points of both patches at every inner edge, with the
/// ends of the edge (Shi et al. 2014, §3.2, step 3), as [`QuadDistances`] have them:
///
/// ```text
/// b₀, (b₁ + l b₂)/(1 + l), b₃, (b₅ + r b₄)/(1 + r)
/// ```
///
/// with `l, r` the shape parameters of the left and right patch for their diagonals through `b₀`.
/// The patches join smoothly where this vanishes and the vertex stars are planar. Shape parameters
/// are fixed: for others put a new block in its place ([`gp_solver::System::replace`]).
#[derive(Clone, Debug)]
pub struct FramePoints(QuadDistances);

impl FramePoints {
    /// The rows of `net` with its vertices in the group `positions`, for the shape parameters of the
    /// diagonals 0–2 of its faces.
    ///
    /// # Panics
    /// If there is not one shape parameter for every face.
    #[must_use]
    pub fn new(net: &QuadNet, positions: Group, shape: &[f64]) -> Self {
        assert_eq!(shape.len(), net.quads().len(), "one shape parameter for every face");
        Self(QuadDistances::new("frame points", positions, frame_quads(net, shape)))
    }
}

impl ResidualBlock for FramePoints {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn elements(&self) -> &Elements {
        self.0.elements()
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.0.residuals(x, residuals);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.0.linearize(x, residuals, jacobian);
    }
}

/// The frame points of both patches at every inner edge, with the ends of the edge.
fn frame_quads<'a>(net: &'a QuadNet, shape: &'a [f64]) -> impl Iterator<Item = [Mix; 4]> + 'a {
    net.inner_edges().iter().map(move |e| {
        let through = |side: usize| shape[e.faces[side]].powf(e.exponents[side]);
        let (l, r) = (through(0), through(1));
        let b = e.b;
        [
            [(b[0], 1.0), (b[0], 0.0)],
            [(b[1], 1.0 / (1.0 + l)), (b[2], l / (1.0 + l))],
            [(b[3], 1.0), (b[3], 0.0)],
            [(b[5], 1.0 / (1.0 + r)), (b[4], r / (1.0 + r))],
        ]
    })
}
