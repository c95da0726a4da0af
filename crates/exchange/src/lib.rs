//! File formats to and from Umbilic's types, with limits against hostile input and atomic writing.

mod error;
mod files;
mod mesh;
mod model;
mod obj;
mod ron_text;

pub use error::{ReadError, WriteError};
pub use files::{check_writable, read_bytes, read_text, write_files};
pub use mesh::{Field, Group, IndexLists, Mesh};
pub use model::{Model, READABLE, WRITABLE, decode_model, encode_model, extension_of, read_model};
pub use obj::{read_obj, write_obj};
pub use ron_text::{from_ron, read_ron, to_ron};
