//! What a user should know although there is a result.

use crate::net::{BoundaryPolygon, QuadNet};

/// What is unusual about an input or a result without making it unusable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Warning {
    /// Some of the surface is not negatively curved.
    #[error(
        "{percent:.0} % of the surface is not negatively curved; the net will leave the surface there, trim it away if that is too far"
    )]
    NotEverywhereNegative { percent: f64 },
    /// Edges stray from the asymptotic directions.
    #[error(
        "edges run {mean_deg:.1} degrees off the asymptotic directions in the mean; remesh along these if the result moves too far"
    )]
    Misaligned { mean_deg: f64 },
    /// Some edges twist the wrong way.
    #[error(
        "{wrong} of {edges} edges twist against their family; look for folded or very flat faces and remesh there"
    )]
    WrongTwists { wrong: usize, edges: usize },
    /// The net folds back.
    #[error(
        "the input folds back at {edges} edges; untangle or remesh these faces if the result does so too"
    )]
    Folds { edges: usize },
    /// Faces without twist.
    #[error(
        "{count} faces are planar (first: {first}); the surface is flat there and the net may lose its shape: use larger faces there"
    )]
    PlanarFaces { count: usize, first: usize },
    /// A boundary polygon that an exact net near the input cannot have.
    #[error(
        "the boundary moves by up to {moved:.1e} edge lengths so that the net can be exact: its polygon prescribes the tangent planes along it ({angle_deg:.1} degrees off the faces in the mean) and around a loop an alternating product that is off from 1 by {excess:.1e}; move its vertices onto a smoother curve, or let them slide along it (boundary glide)"
    )]
    BoundaryPrescribed { angle_deg: f64, excess: f64, moved: f64 },
    /// No alternating colouring.
    #[error(
        "vertices cannot be coloured alternately around some hole (an odd number of edges leads around it): the shape parameters are unique and no common factor can be chosen"
    )]
    NotTwoColourable,
    /// The result folds back.
    #[error("the result folds back at {edges} edges; remesh the input there or raise `proximity`")]
    ResultFolds { edges: usize },
    /// The joint method has ended without an exact net.
    #[error("the patches do not join exactly; free the boundary or use more faces")]
    NotExact,
}

impl Warning {
    /// Why a fixed boundary moved by `moved` edge lengths.
    #[must_use]
    pub fn boundary(net: &QuadNet, moved: f64) -> Self {
        let BoundaryPolygon { closing, plane_angle } = BoundaryPolygon::new(net);
        let (angle_deg, excess) = (plane_angle.to_degrees(), closing.exp_m1());
        Self::BoundaryPrescribed { angle_deg, excess, moved }
    }
}
