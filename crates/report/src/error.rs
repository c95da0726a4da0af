//! Why data was refused.

/// Why a surface view or one of its parts was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum ReportError {
    /// An array has not one value per vertex or triangle.
    #[error("{what} has {found} entries; give one per {of}, {expected} in all")]
    Length { what: String, of: &'static str, expected: usize, found: usize },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {vertex} of {vertices}; number vertices from 0")]
    Index { triangle: usize, vertex: u32, vertices: usize },
    /// A position or normal is NaN or infinite, or a normal is not of length 1.
    #[error("{what} {index} is ({x}, {y}, {z}); {mend}")]
    Vector { what: &'static str, index: usize, x: f64, y: f64, z: f64, mend: &'static str },
    /// A triangle belongs to a group without a name.
    #[error(
        "triangle {triangle} is in group {group} of {what}, which names {groups} groups; number \
         groups from 0 and name each"
    )]
    Group { what: String, triangle: usize, group: u32, groups: usize },
    /// Two parts of one view share an id.
    #[error("the view `{view}` already has `{id}`; give each field, group and line set its own id")]
    Duplicate { view: String, id: String },
    /// A picture could not be encoded.
    #[error("the picture of view `{view}` cannot be encoded: {reason}")]
    Picture { view: String, reason: String },
    /// Nothing to draw.
    #[error("the view `{view}` has no triangles; sample the surface first")]
    Empty { view: String },
}
