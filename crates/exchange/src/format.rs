//! The choice of reader and writer by extension.

use crate::drawing::{Drawing, DrawnLine, write_dxf, write_svg};
use crate::error::{ReadError, WriteError};
use crate::files::{into_text, read_bytes, read_standard_input};
use crate::glb::{read_glb, write_glb};
use crate::guess::{Guess, guess, is_same};
use crate::json::{read_json, write_compas, write_geomdl};
use crate::mesh::Mesh;
use crate::model::Model;
use crate::obj::{read_obj, write_obj};
use crate::off::read_off;
use crate::ply::{read_ply, write_ply};
use crate::rhino::{read_3dm, write_3dm};
use crate::sample::face_mesh;
use crate::scene::{read_scene, write_scene};
use crate::step::{read_step, write_step};
use crate::stl::{read_stl, write_stl};
use geom_core::DVec3;
use std::borrow::Cow;
use std::path::Path;

/// Extensions that [`read_model`] knows.
pub const READABLE: &str = "ron, step, stp, 3dm, obj, ply, off, stl, glb, json";
/// Coordinates that single precision can hold, distances between them included.
const SINGLE_PRECISION: f64 = 1e38;

/// Extensions that [`encode_model`] knows.
pub const WRITABLE: &str = "ron, step, stp, 3dm, obj, ply, stl, glb, json, svg, dxf";

/// The path that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// Reads any file of geometry, by its extension; by its content where the extension is missing,
/// unknown or certainly wrong, which a warning says. The path `-` is standard input.
///
/// # Errors
/// [`ReadError`] of the reader, or [`ReadError::UnknownFormat`].
pub fn read_model(path: &Path) -> Result<Model, ReadError> {
    read_model_as(path, None)
}

/// As [`read_model`], in a format of [`READABLE`] whatever name and content say.
///
/// # Errors
/// As [`read_model`].
pub fn read_model_as(path: &Path, format: Option<&str>) -> Result<Model, ReadError> {
    if let Some(format) = format {
        let format = format.to_lowercase();
        if !is_listed(READABLE, &format) {
            return Err(ReadError::UnknownFormat { extension: format, known: READABLE });
        }
        return decode_model(&format, input_bytes(path)?);
    }
    let extension = if is_standard_input(path) { String::new() } else { extension_of(path) };
    let known = is_listed(READABLE, &extension);
    let bytes = input_bytes(path)?;
    let (format, warning) = match guess(&bytes) {
        Some(Guess::Sure(other)) if known && !is_same(&extension, other) => {
            (other, Some(format!("the content is {} whatever the name says", other.to_uppercase())))
        }
        _ if known => (extension.as_str(), None),
        Some(Guess::Sure(found) | Guess::Likely(found)) => (found, None),
        None => return Err(ReadError::UnknownFormat { extension, known: READABLE }),
    };
    let mut model = decode_model(format, bytes)?;
    model.warnings.extend(warning);
    Ok(model)
}

/// Whether a path stands for standard input.
fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == STANDARD_INPUT
}

fn input_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    if is_standard_input(path) { read_standard_input() } else { read_bytes(path) }
}

/// Reads the bytes of a file with this (lower case) extension.
///
/// # Errors
/// As [`read_model`].
pub fn decode_model(extension: &str, bytes: Vec<u8>) -> Result<Model, ReadError> {
    let model = match extension {
        "ron" => read_scene(&into_text(bytes)?),
        "step" | "stp" => read_step(&bytes),
        "3dm" => read_3dm(&bytes),
        "obj" => read_obj(&into_text(bytes)?),
        "ply" => read_ply(&bytes),
        "off" => read_off(&into_text(bytes)?).map(of_mesh),
        "stl" => read_stl(&bytes).map(of_mesh),
        "glb" => read_glb(&bytes),
        "json" => read_json(&into_text(bytes)?),
        _ => Err(ReadError::UnknownFormat { extension: extension.into(), known: READABLE }),
    }?;
    crate::meaning::check(&model)?;
    Ok(model)
}

/// Refuses extensions that [`encode_model`] does not know: to be asked before a long computation.
///
/// # Errors
/// [`WriteError::UnknownFormat`].
pub fn check_format(path: &Path) -> Result<(), WriteError> {
    let extension = extension_of(path);
    if is_listed(WRITABLE, &extension) {
        Ok(())
    } else {
        Err(WriteError::UnknownFormat { extension, known: WRITABLE })
    }
}

/// `NAME.compas.json` asks for the layout of COMPAS where geomdl's would do.
fn is_compas(path: &Path) -> bool {
    path.to_string_lossy().to_lowercase().ends_with(".compas.json")
}

/// The bytes of a file at `path`, by its extension. Formats without surfaces get sampled meshes
/// of them, with curvatures where the format can carry them.
///
/// # Errors
/// [`WriteError::UnknownFormat`], or [`WriteError::Unsupported`] for content that the format
/// cannot hold.
pub fn encode_model(path: &Path, model: &Model) -> Result<Vec<u8>, WriteError> {
    let extension = extension_of(path);
    match extension.as_str() {
        "ron" => {
            no_meshes("a RON scene", model)?;
            let text =
                write_scene(model).map_err(|e| unsupported("a RON scene", &e.to_string()))?;
            Ok(text.into_bytes())
        }
        "step" | "stp" => {
            no_meshes("STEP", model)?;
            if model.surfaces.is_empty() {
                return Err(unsupported("STEP", "a model without surfaces"));
            }
            let text = write_step(model).map_err(|e| unsupported("STEP", &e.to_string()))?;
            Ok(text.into_bytes())
        }
        "3dm" => {
            let is_empty = model.surfaces.is_empty() && model.grids.is_empty();
            if is_empty && model.meshes.iter().all(|m| m.positions.is_empty()) {
                return Err(unsupported("3DM", "a model without surfaces, meshes and points"));
            }
            no_far_meshes("3DM", &model.meshes)?;
            write_3dm(model).map_err(|e| unsupported("3DM", &e.to_string()))
        }
        "obj" => Ok(write_obj(&sampled(model)).into_bytes()),
        "ply" => Ok(write_ply(&sampled(model), &model.unit)),
        "stl" => {
            let meshes = sampled(model);
            if meshes.iter().all(|m| m.faces.is_empty()) {
                return Err(unsupported("STL", "a model without faces"));
            }
            Ok(write_stl(&meshes))
        }
        "glb" => {
            let meshes = sampled(model);
            no_far_meshes("GLB", &meshes)?;
            Ok(write_glb(&meshes, &model.unit))
        }
        // COMPAS has meshes and surfaces, geomdl surfaces only: the plain one where it suffices.
        "json" if model.meshes.is_empty() && !model.surfaces.is_empty() && !is_compas(path) => {
            Ok(write_geomdl(&model.surfaces).into_bytes())
        }
        "json" if !model.meshes.is_empty() || is_compas(path) => {
            Ok(write_compas(model).into_bytes())
        }
        "json" => Err(unsupported("JSON", "a model without surfaces and meshes")),
        "svg" => Ok(write_svg(&polylines(model, "SVG")?, &model.unit).into_bytes()),
        "dxf" => Ok(write_dxf(&polylines(model, "DXF")?, &model.unit).into_bytes()),
        _ => Err(WriteError::UnknownFormat { extension, known: WRITABLE }),
    }
}

/// All polylines as a drawing, each mesh on a layer of its name.
fn polylines(model: &Model, format: &'static str) -> Result<Drawing, WriteError> {
    let mut drawing = Drawing::default();
    for mesh in &model.meshes {
        for k in 0..mesh.lines.len() {
            let points = mesh.polyline(k).collect();
            drawing.lines.push(DrawnLine { layer: mesh.name.clone(), points, closed: false });
        }
    }
    if drawing.lines.is_empty() {
        return Err(unsupported(format, "a model without polylines"));
    }
    Ok(drawing)
}

/// The meshes, after sampled meshes of the surfaces.
fn sampled(model: &Model) -> Cow<'_, [Mesh]> {
    if model.surfaces.is_empty() {
        return Cow::Borrowed(&model.meshes);
    }
    let sampled = model.surfaces.iter().map(|s| face_mesh(s, None));
    Cow::Owned(sampled.chain(model.meshes.iter().cloned()).collect())
}

fn of_mesh((mesh, warnings): (Mesh, Vec<String>)) -> Model {
    Model { meshes: vec![mesh], warnings, ..Model::default() }
}

fn no_meshes(format: &'static str, model: &Model) -> Result<(), WriteError> {
    if model.meshes.is_empty() { Ok(()) } else { Err(unsupported(format, "meshes")) }
}

fn no_far_meshes(format: &'static str, meshes: &[Mesh]) -> Result<(), WriteError> {
    let far = |p: &DVec3| !(p.abs().max_element() < SINGLE_PRECISION);
    if meshes.iter().any(|mesh| mesh.positions.iter().any(far)) {
        return Err(unsupported(format, "coordinates of 1e38 and beyond"));
    }
    Ok(())
}

fn unsupported(format: &'static str, what: &str) -> WriteError {
    let mend = "choose another extension, or fit surfaces first".to_owned();
    WriteError::Unsupported { format, what: what.to_owned(), mend }
}

fn is_listed(list: &str, extension: &str) -> bool {
    list.split(", ").any(|known| known == extension)
}

/// The extension in lower case, empty if there is none.
#[must_use]
pub fn extension_of(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
