//! What every target does.

use exchange::{decode_model, encode_model};
use std::path::PathBuf;

/// Reads `bytes`; what can be read is written in the same format and must be read again.
///
/// # Panics
/// If a file of our own is refused.
pub fn round_trip(extension: &str, bytes: &[u8]) {
    let Ok(model) = decode_model(extension, bytes.to_vec()) else { return };
    // The writer of meshes in JSON is COMPAS's, that of surfaces geomdl's; both are read again.
    let path = PathBuf::from(format!("again.{extension}"));
    let Ok(again) = encode_model(&path, &model) else { return };
    if let Err(error) = decode_model(extension, again) {
        let writable = model.meshes.iter().all(|m| m.faces.iter().len() > 0);
        assert!(!writable, "our own {extension} file is refused: {error}");
    }
}
