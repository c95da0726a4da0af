//! Faces as files of other programs describe them: a surface, possibly without end, and loops of
//! edges in space around the part that counts.

mod build;
mod chain;
mod chart;
mod close;

use crate::curve::BsplineCurve;
use crate::elementary::Elementary;
use crate::error::SplineError;
use crate::surface::BsplineSurface;
use crate::trim::{Trim, TrimError};

/// The surface under a face.
#[derive(Clone, Debug, PartialEq)]
pub enum Carrier {
    /// A plane, cylinder, cone, sphere or torus, which is cut to the face.
    Elementary(Elementary),
    /// A spline, which stays as it is.
    Spline(BsplineSurface),
}

/// An edge of a loop, run in the direction of the loop.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceEdge {
    /// The curve in space.
    pub curve: BsplineCurve,
    /// The same curve in the parameter plane of a [`Carrier::Spline`], as `(u, v, 0)`, where the
    /// file has it; two for the seam of a closed surface.
    pub parameters: Vec<BsplineCurve>,
}

/// A surface with the part of it that is the face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The surface, in the direction of the carrier's normal.
    pub surface: BsplineSurface,
    /// The part; `None` if it is the whole surface.
    pub trim: Option<Trim>,
}

/// Why loops do not make a face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum FaceError {
    /// No loop bounds a surface that has no end of its own.
    #[error("no loop bounds the endless surface; give the face a border")]
    Unbounded,
    /// An edge away from the surface.
    #[error("an edge lies {distance} away from the surface; its curve belongs to another face")]
    OffSurface { distance: f64 },
    /// Edges that do not meet.
    #[error("edges {index} and {next} of a loop do not meet; give the loop all of its edges")]
    Open { index: usize, next: usize },
    /// Loops that run around a closed surface in a way that bounds no part of it.
    #[error("the loops run around the closed surface without a partner; give the face all loops")]
    Winding,
    /// A problem with the loops in the parameter plane.
    #[error(transparent)]
    Trim(#[from] TrimError),
    /// A problem with a curve or the surface.
    #[error(transparent)]
    Spline(#[from] SplineError),
}

impl Carrier {
    /// The face within `loops`, each of which has the face to its left when seen against the
    /// normal of the carrier; a loop without edges (a single point) is none. Edges that meet and
    /// lie on the surface to within `tolerance` (a length) count as exact.
    ///
    /// An elementary surface is cut to the face, and is the whole face if that is bounded by
    /// lines of constant parameter. A closed spline whose seam lies within the face is cut open
    /// beside it.
    ///
    /// # Errors
    /// [`FaceError`] says what keeps the loops from bounding a part of the surface.
    ///
    /// # Example
    /// ```
    /// use bspline::{Carrier, Elementary, ElementaryKind, Frame};
    /// use geom_core::DVec3;
    /// let frame = Frame::new(DVec3::ZERO, DVec3::Z, None);
    /// let torus = Elementary { frame, kind: ElementaryKind::Torus { major: 3.0, minor: 1.0 } };
    /// let whole = Carrier::Elementary(torus).face(&[], 1e-9)?;
    /// let wanted = 12.0 * std::f64::consts::PI.powi(2);
    /// assert!((whole.surface.curvature_statistics().area / wanted - 1.0).abs() < 1e-12);
    /// # Ok::<(), bspline::FaceError>(())
    /// ```
    pub fn face(&self, loops: &[Vec<FaceEdge>], tolerance: f64) -> Result<Face, FaceError> {
        let chart = chart::Chart::new(self, loops, tolerance)?;
        let mut chains = Vec::new();
        for edges in loops.iter().filter(|edges| !edges.is_empty()) {
            chains.extend(chain::Chain::walk(edges, &chart)?);
        }
        let chains = close::close(chains, &chart)?;
        build::build(self, &chart, chains)
    }
}
