//! Names of stages and of groups of unknowns.

/// The stage that moves bad data: least squares, any block.
pub const RELAXATION: &str = "relaxation";
/// The stage of the boundary curves. From curvatures it is solved exactly: quadratic energies, linear
/// rows and equations in the group [`TORSIONS`]. From normals, and for the energy of the torsion, it
/// is least squares and takes any block.
pub const BOUNDARY: &str = "boundary";
/// The stage of one patch, called `patch 0`, `patch 1`, … after the faces; solved exactly, in the
/// groups [`FIELDS`] and [`CONTROL_POINTS`].
pub const PATCH: &str = "patch";
/// The stage of all patches together, with C1 and G2 joins; solved exactly, in the groups
/// [`FIELDS`] and [`CONTROL_POINTS`], face after face.
pub const JOINT: &str = "joint";

/// Group of torsions: one per vertex, of the curves in the u-direction of the first face.
pub const TORSIONS: &str = "torsions";
/// Group of the free coefficients of the tangent fields.
pub const FIELDS: &str = "fields";
/// Group of control points, `(i, j)` of a patch of degree `n` being number `i (n + 1) + j`, in the
/// coordinates of the stage.
pub const CONTROL_POINTS: &str = "control points";

/// The stages of which [`problem`](crate::problem) tells the problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// [`RELAXATION`].
    Relaxation,
    /// [`BOUNDARY`].
    Boundary,
    /// [`PATCH`] of the first face.
    Patch,
    /// [`JOINT`].
    Joint,
}
