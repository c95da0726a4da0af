//! JSON of the Python libraries geomdl (B-spline surfaces) and COMPAS (meshes and NURBS surfaces).

mod compas;
mod fault;
mod geomdl;

pub use compas::write_compas;
pub(crate) use fault::{check_depth, fault};
pub use geomdl::write_geomdl;

use crate::error::ReadError;
use crate::model::Model;

/// Reads JSON of geomdl or COMPAS, whichever it is.
///
/// # Errors
/// [`ReadError::Text`] names the line at fault, [`ReadError::Content`] the surface or mesh.
pub fn read_json(text: &str) -> Result<Model, ReadError> {
    check_depth(text)?;
    let is_geomdl = text.contains("\"shape\"");
    if is_geomdl { geomdl::read(text) } else { compas::read(text) }
}
