//! Everything a file can hold, and the choice of reader and writer by extension.

use crate::error::{ReadError, WriteError};
use crate::files::{into_text, read_bytes};
use crate::mesh::Mesh;
use crate::obj::{read_obj, write_obj};
use std::path::Path;

/// The content of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Meshes, polylines and points.
    pub meshes: Vec<Mesh>,
    /// What the reader had to leave out.
    pub warnings: Vec<String>,
}

/// Extensions that [`read_model`] knows.
pub const READABLE: &str = "obj";
/// Extensions that [`encode_model`] knows.
pub const WRITABLE: &str = "obj";

/// Reads any file of geometry, by its extension.
///
/// # Errors
/// [`ReadError`] of the reader, or [`ReadError::UnknownFormat`].
pub fn read_model(path: &Path) -> Result<Model, ReadError> {
    let extension = extension_of(path);
    if !READABLE.split(", ").any(|known| known == extension) {
        return Err(ReadError::UnknownFormat { extension, known: READABLE });
    }
    decode_model(&extension, read_bytes(path)?)
}

/// Reads the bytes of a file with this (lower case) extension.
///
/// # Errors
/// As [`read_model`].
pub fn decode_model(extension: &str, bytes: Vec<u8>) -> Result<Model, ReadError> {
    match extension {
        "obj" => {
            let (mesh, warnings) = read_obj(&into_text(bytes)?)?;
            Ok(Model { meshes: vec![mesh], warnings })
        }
        _ => Err(ReadError::UnknownFormat { extension: extension.into(), known: READABLE }),
    }
}

/// The bytes of a file at `path`, by its extension.
///
/// # Errors
/// [`WriteError::UnknownFormat`], or [`WriteError::Unsupported`] for content that the format
/// cannot hold.
pub fn encode_model(path: &Path, model: &Model) -> Result<Vec<u8>, WriteError> {
    let extension = extension_of(path);
    match extension.as_str() {
        "obj" => Ok(write_obj(&model.meshes).into_bytes()),
        _ => Err(WriteError::UnknownFormat { extension, known: WRITABLE }),
    }
}

/// The extension in lower case, empty if there is none.
#[must_use]
pub fn extension_of(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
