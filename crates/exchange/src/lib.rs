//! File formats to and from Umbilic's types, with limits against hostile input and atomic writing.
//!
//! [`read_model`] reads any file by its extension into a [`Model`]; [`encode_model`] gives the bytes
//! of a file, and [`write_files`] puts several files on the disk at once, or none of them.
//!
//! # Example
//! ```
//! use exchange::{Model, encode_model, decode_model};
//! let scene = "(unit: \"m\", surfaces: [(name: \"saddle\", u: (degree: 1), v: (degree: 1),
//!     control_points: [[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]])])";
//! let model = decode_model("ron", scene.into())?;
//! let step = encode_model("saddle.step".as_ref(), &model)?;
//! assert!(step.starts_with(b"ISO-10303-21;"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod color;
mod csv;
mod drawing;
mod error;
mod files;
mod format;
mod glb;
mod guess;
mod json;
mod meaning;
mod mend;
mod mesh;
mod model;
mod net;
mod obj;
mod obj_freeform;
mod obj_tags;
mod off;
mod places;
mod ply;
mod polyline;
mod replaced;
mod rhino;
mod ron_text;
mod sample;
mod scale;
mod scene;
mod segments;
mod select;
mod step;
mod stl;
mod text_number;
mod triangulate;
mod unit;
mod wrapped;

pub use csv::write_csv;
pub use drawing::{Drawing, DrawnLine, Label, write_dxf, write_svg};
pub use error::{ReadError, WriteError};
pub use files::{check_writable, read_bytes, read_text, write_files, write_files_unless};
pub use format::{
    READABLE, STANDARD_INPUT, WRITABLE, check_format, decode_model, encode_model, extension_of,
    read_model, read_model_as,
};
pub use glb::{read_glb, write_glb};
pub use json::{read_json, write_compas, write_geomdl};
pub use mend::WELD_SHARE;
pub use mesh::{Field, Group, IndexLists, Mesh, Sharpness};
pub use model::{Model, NamedSurface, PointGrid};
pub use net::{Net, read_net, write_net};
pub use obj::{read_obj, write_obj, write_obj_and_materials};
pub use off::read_off;
pub use places::{check_folder, is_same_file, make_folder};
pub use ply::{read_ply, write_ply};
pub use rhino::{read_3dm, write_3dm};
pub use ron_text::{from_ron, read_ron, read_ron_with_infinity, to_ron};
pub use sample::{face_mesh, joined_mesh, surface_mesh};
pub use scene::{read_scene, write_scene};
pub use segments::{Segment, write_segments_csv, write_segments_dxf};
pub use select::{Pick, PickError};
pub use step::{read_step, write_step};
pub use stl::{read_stl, write_stl};
pub use unit::LengthUnit;
