//! What the user should know.

use std::fmt;

/// Something about the input or the result that is worth a sentence.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Warning {
    /// Faces without an area.
    Dropped { faces: usize },
    /// Faces on the same corners.
    Repeated { faces: usize },
    /// Faces turned over so that all are oriented alike.
    Turned { faces: usize },
    /// Vertices where fans of faces touched, or edges of more than two faces.
    Split { vertices: usize },
    /// Parts of which the largest was taken.
    Parts { parts: usize },
    /// Part of the surface has no asymptotic lines.
    NotEverywhereNegative { percent: f64 },
    /// The families meet at less than the least angle.
    Clamped { percent: f64, degrees: f64 },
    /// Longer edges would fold.
    Shortened { asked: f64, used: f64 },
    /// The net and the surface differ in topology.
    Topology { net: i64, surface: i64 },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dropped { faces } => write!(f, "{faces} faces without an area were dropped"),
            Self::Repeated { faces } => {
                write!(f, "{faces} faces on the same corners as another were dropped")
            }
            Self::Turned { faces } => {
                write!(f, "{faces} faces were turned over so that all are oriented alike")
            }
            Self::Split { vertices } => write!(
                f,
                "the mesh was split at {vertices} vertices where parts only touched or more than two faces met"
            ),
            Self::Parts { parts } => {
                write!(f, "the largest of {parts} parts was taken; give the others separately")
            }
            Self::NotEverywhereNegative { percent } => write!(
                f,
                "{percent:.1} % of the surface is not negatively curved and has no asymptotic lines; the net bridges these places and leaves the surface there"
            ),
            Self::Clamped { percent, degrees } => write!(
                f,
                "on {percent:.1} % of the surface the asymptotic lines meet at less than {degrees:.0}°; the net keeps to that angle and leaves them there"
            ),
            Self::Shortened { asked, used } => write!(
                f,
                "edges of {asked:.4} would make the net fold; they were shortened to {used:.4}"
            ),
            Self::Topology { net, surface } => write!(
                f,
                "the net has Euler characteristic {net} and the surface {surface}: holes or necks narrower than a cell were lost; set a shorter `edge_length`"
            ),
        }
    }
}
