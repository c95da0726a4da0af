//! What has no Darboux transform.

/// Why a point or a net cannot be transformed.
///
/// # Example
/// ```
/// use hyperbolic_nets::darboux::{DarbouxMap, Error};
/// let error = DarbouxMap::new(1.0).unwrap_err();
/// assert_eq!(error, Error::BadCentre { c: 1.0 });
/// assert!(error.to_string().ends_with("choose c finite and different from 1"));
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// The centre lies on the hyperplane it projects from.
    #[error("c = {c} is no Darboux transformation; choose c finite and different from 1")]
    BadCentre { c: f64 },
    /// No real image.
    #[error(
        "({x}, {y}, {z}) has no real image (discriminant {discriminant:e}); it lies outside the real domain: choose |c| ≤ 1, a larger |c|, or a gentler cage"
    )]
    OutsideRealDomain { x: f64, y: f64, z: f64, discriminant: f64 },
    /// The image lies at infinity, or on its other side.
    #[error(
        "the image passes through infinity at ({x}, {y}, {z}); choose the other branch or move the net"
    )]
    Infinite { x: f64, y: f64, z: f64 },
    /// All points have the same image.
    #[error("this branch maps every point to one point; choose the other branch")]
    Collapsed,
    /// A map that is not one to one.
    #[error("the cage has no transformation: {0}; move its corners nearer to a box")]
    BadCage(#[from] CageFault),
    /// Nothing that says how to transform.
    #[error("say how to transform: by `c`, or by where at least one `corner` of the cage goes")]
    NoTransformation,
    /// Two ways to transform at once.
    #[error("`c` and `corner` exclude each other; give one of them")]
    TwoTransformations,
    /// A net without vertices.
    #[error("the net has no vertex")]
    NoVertex,
    /// A net without a size one could work with.
    #[error(transparent)]
    Place(#[from] geom_core::NormalizationError),
    /// A patch at fault.
    #[error(transparent)]
    Patch(#[from] crate::PatchError),
}

/// Why a cage has no transformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum CageFault {
    /// A matrix of zeros, or one with infinities.
    #[error("its matrix is zero or not finite")]
    NoMatrix,
    /// A matrix whose rank is less than 4.
    #[error("it maps space to a plane")]
    Flattens,
    /// A corner outside the real domain.
    #[error("corner {corner} has no real image")]
    NoRealImage { corner: usize },
    /// Corners that no one branch takes where they are to go.
    #[error("corners {} and {} lie on different branches", .corners[0], .corners[1])]
    DifferentBranches { corners: [usize; 2] },
    /// NaN or infinity.
    #[error("a corner is not finite")]
    NotFinite,
    /// A flat box.
    #[error("its box has no volume")]
    NoVolume,
}
