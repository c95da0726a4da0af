//! JSON of the Python libraries geomdl (B-spline surfaces) and COMPAS (meshes and NURBS surfaces).

mod compas;
mod geomdl;

pub use compas::write_compas;
pub use geomdl::write_geomdl;

use crate::error::ReadError;
use crate::model::Model;
use crate::ron_text::MAX_DEPTH;

/// Reads JSON of geomdl or COMPAS, whichever it is.
///
/// # Errors
/// [`ReadError::Text`] names the line at fault, [`ReadError::Content`] the surface or mesh.
pub fn read_json(text: &str) -> Result<Model, ReadError> {
    check_depth(text)?;
    let is_geomdl = text.contains("\"shape\"");
    if is_geomdl { geomdl::read(text) } else { compas::read(text) }
}

pub(crate) fn fault(error: &serde_json::Error) -> ReadError {
    let message = error.to_string();
    // The message repeats the place.
    let what = message.rsplit_once(" at line ").map_or(message.as_str(), |(what, _)| what);
    let what = format!("column {}: {what}", error.column());
    ReadError::text(error.line(), what, "export the file again or correct this line")
}

/// Refuses nesting that no reader here needs, before anything follows it.
pub(crate) fn check_depth(text: &str) -> Result<(), ReadError> {
    let (mut depth, mut line, mut in_text, mut escaped) = (0_usize, 1, false, false);
    for b in text.bytes() {
        line += usize::from(b == b'\n');
        match b {
            _ if escaped => escaped = false,
            b'\\' if in_text => escaped = true,
            b'"' => in_text = !in_text,
            b'[' | b'{' if !in_text => {
                depth += 1;
                if depth > MAX_DEPTH {
                    let what = format!("the nesting is deeper than {MAX_DEPTH}");
                    return Err(ReadError::text(line, what, "no file of geometry needs that"));
                }
            }
            b']' | b'}' if !in_text => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    Ok(())
}

/// A fault of one item, with the library's own words on how to mend it.
fn refused(title: &str, message: &str) -> ReadError {
    let (what, mend) = message.split_once("; ").unwrap_or((message, "correct it"));
    ReadError::content(format!("{title}: {what}"), mend)
}
