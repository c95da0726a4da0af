//! What is wrong with input files and nets.

/// Why an input file does not describe a patch or a net.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum DataFault {
    /// A patch and a net in one file.
    #[error("both `X` and `vertices` are given; keep one of patch and net")]
    PatchAndNet,
    /// Neither of the two.
    #[error("neither `X` nor `vertices` is given; one of patch and net is needed")]
    Empty,
    /// A field that is needed.
    #[error("field `{field}` is missing; add it")]
    Missing { field: &'static str },
    /// No curvatures.
    #[error("field `signed_k` or `unsigned_k` is missing; add it")]
    NoCurvatures,
    /// Two kinds of curvatures.
    #[error("both `signed_k` and `unsigned_k` are given; keep one")]
    TwoCurvatures,
    /// A corner that is needed.
    #[error("`X` has no corner \"{name}\"; 00, 10, 01, 11 are needed")]
    NoCorner { name: &'static str },
    /// More than four corners.
    #[error("`X` has more than the corners 00, 10, 01, 11; drop the others")]
    MoreCorners,
    /// A curve that ends nowhere.
    #[error("curve {curve} ends at vertex {vertex}, but there are {vertices} vertices")]
    NoVertex { curve: usize, vertex: usize, vertices: usize },
    /// A wish for a corner that a patch has not.
    #[error("`torsions` has \"{name}\"; use 00, 10, 01 or 11")]
    WishAtNoCorner { name: String },
    /// A wish for a vertex that a net has not.
    #[error("`torsions` has \"{name}\"; use a vertex number below {vertices}")]
    WishAtNoVertex { name: String, vertices: usize },
    /// A wish that is no number.
    #[error("`torsions` of \"{name}\": a number is NaN; give numbers")]
    WishNotANumber { name: String },
    /// A wish for an elliptic corner.
    #[error(
        "`torsions` of \"{name}\": the Gaussian curvature {curvature} is above zero, but it is \
         minus the torsion squared; give at most 0"
    )]
    WishAboveZero { name: String, curvature: f64 },
}

/// Why curves and faces do not make a net.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum NetFault {
    /// A curve from a vertex to itself or to none.
    #[error(
        "net: curve {curve} joins vertices {a} and {b}, but there are {vertices} vertices; use two \
         different ones"
    )]
    Ends { curve: usize, a: usize, b: usize, vertices: usize },
    /// Two curves along one edge.
    #[error("net: two curves join vertices {a} and {b}; drop one")]
    Doubled { a: usize, b: usize },
    /// Nothing to fill.
    #[error("net: no faces; give at least one quad")]
    NoFaces,
    /// An edge of a face without a curve.
    #[error("net: face {face} has no curve between vertices {a} and {b}; add it")]
    NoCurve { face: usize, a: usize, b: usize },
    /// Two faces on one side of a curve.
    #[error(
        "net: faces {first} and {second} lie on the same side of the curve between vertices {a} and \
         {b}; orient all faces alike and let a curve bound at most two"
    )]
    SameSide { first: usize, second: usize, a: usize, b: usize },
    /// A face that is no quad.
    #[error("net: face {face} has {corners} corners; an asymptotic net has quads only")]
    NotQuad { face: usize, corners: usize },
    /// A polyline too short for a curvature.
    #[error("net: polyline {polyline} has {points} points; three are needed for a curvature")]
    ShortPolyline { polyline: usize, points: usize },
    /// NaN or infinity.
    #[error("net: polyline {polyline} has a point that is not finite")]
    PolylineNotFinite { polyline: usize },
    /// Points that coincide.
    #[error("net: polyline {polyline} repeats its points; drop the repetitions")]
    RepeatedPoints { polyline: usize },
    /// A polyline on no ring of four, or on more than two.
    #[error(
        "net: the polyline between vertices {a} and {b} lies on {rings} rings of four, so the faces \
         cannot be told; complete the rings, or give vertices, quads and curves in a RON file"
    )]
    Rings { a: usize, b: usize, rings: usize },
}
