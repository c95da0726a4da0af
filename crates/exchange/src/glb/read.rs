//! Reading triangles.

use crate::error::ReadError;
use crate::json::{check_depth, fault};
use crate::mesh::{Field, Group, Mesh};
use crate::model::Model;
use crate::ron_text::MAX_DEPTH;
use crate::unit::LengthUnit;
use geom_core::DVec3;
use glam::{DMat4, DQuat};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The largest JSON part that is read: the description of a scene, not its coordinates.
const MOST_JSON: usize = 4 << 20;
/// Vertices and corners of all meshes may take this many bytes, and eight times the file.
const MOST_BYTES: usize = 32 << 20;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Document {
    scene: usize,
    scenes: Vec<Scene>,
    nodes: Vec<Node>,
    meshes: Vec<MeshText>,
    materials: Vec<Named>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    extensions_required: Vec<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Scene {
    nodes: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Named {
    name: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Node {
    name: String,
    mesh: Option<usize>,
    children: Vec<usize>,
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct MeshText {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: BTreeMap<String, usize>,
    indices: Option<usize>,
    material: Option<usize>,
    #[serde(default = "triangles")]
    mode: u32,
}

const LINES: u32 = 1;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

fn triangles() -> u32 {
    TRIANGLES
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    #[serde(default)]
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

/// Reads the triangles of the default scene of a GLB file, with y up turned to z up, in metres.
/// Scalar attributes `_NAME` become fields, materials become groups of faces.
///
/// # Errors
/// [`ReadError`] names the byte, or the part of the scene at fault.
pub fn read_glb(bytes: &[u8]) -> Result<Model, ReadError> {
    let (text, binary) = chunks(bytes)?;
    check_depth(text)?;
    let document: Document = serde_json::from_str(text).map_err(|e| fault(&e))?;
    if let Some(extension) = document.extensions_required.first() {
        let what = format!("the file needs the extension {}", crate::error::clip(extension));
        return Err(ReadError::content(what, "export it without compression"));
    }
    let budget = MOST_BYTES.saturating_add(bytes.len().saturating_mul(8));
    let mut reader = Reader { document: &document, binary, meshes: Vec::new(), budget };
    let roots = match document.scenes.get(document.scene) {
        Some(scene) => scene.nodes.clone(),
        None => (0..document.nodes.len()).collect(),
    };
    let mut visited = vec![false; document.nodes.len()];
    // y up to z up: a quarter turn about x, exact.
    let upright = DMat4::from_cols_array(&[
        1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ]);
    for root in roots {
        reader.node(root, upright, &mut visited, 0)?;
    }
    if reader.meshes.is_empty() {
        return Err(ReadError::content("the scene has no triangle", "export it with meshes"));
    }
    Ok(Model { unit: LengthUnit::Metre, meshes: reader.meshes, ..Model::default() })
}

/// The JSON text and the binary part.
fn chunks(bytes: &[u8]) -> Result<(&str, &[u8]), ReadError> {
    let word = |at: usize| -> Option<usize> {
        let raw: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(raw) as usize)
    };
    let mend = "the file is truncated or damaged; export it again";
    if !bytes.starts_with(b"glTF") || word(4) != Some(2) {
        return Err(ReadError::binary(0, "not a GLB file of version 2", "export it as glTF 2.0"));
    }
    match word(8) {
        Some(length) if length <= bytes.len() => {}
        _ => {
            let what = format!("the header announces more than the {} bytes there", bytes.len());
            return Err(ReadError::binary(8, what, mend));
        }
    }
    let chunk = |at: usize, kind: &[u8; 4]| -> Option<&[u8]> {
        let length = word(at)?;
        let body = bytes.get(at + 8..(at + 8).checked_add(length)?)?;
        (bytes.get(at + 4..at + 8)? == kind).then_some(body)
    };
    let Some(json) = chunk(12, b"JSON") else {
        return Err(ReadError::binary(12, "no whole JSON part", mend));
    };
    if json.len() > MOST_JSON {
        let what = format!("a JSON part of {} bytes", json.len());
        return Err(ReadError::binary(12, what, "at most 4 MiB are read; simplify the scene"));
    }
    let text = std::str::from_utf8(json)
        .map_err(|e| ReadError::binary(20 + e.valid_up_to(), "the JSON part is not UTF-8", mend))?;
    let after = 20 + json.len();
    let binary = if bytes.len() > after { chunk(after, b"BIN\0") } else { Some(&[][..]) };
    match binary {
        Some(binary) => Ok((text, binary)),
        None => Err(ReadError::binary(after, "no whole binary part", mend)),
    }
}

struct Reader<'a> {
    document: &'a Document,
    binary: &'a [u8],
    meshes: Vec<Mesh>,
    budget: usize,
}

impl Reader<'_> {
    fn node(
        &mut self,
        index: usize,
        parent: DMat4,
        visited: &mut [bool],
        depth: usize,
    ) -> Result<(), ReadError> {
        let fail = |what: String| Err(ReadError::content(what, "export the scene again"));
        let Some(node) = self.document.nodes.get(index) else {
            return fail(format!("node {index} is named and not there"));
        };
        if std::mem::replace(&mut visited[index], true) {
            return fail(format!("node {index} has two parents or is its own"));
        }
        if depth > MAX_DEPTH {
            return fail(format!("the nodes are nested deeper than {MAX_DEPTH}"));
        }
        let here = parent * local(node);
        if !here.is_finite() {
            return fail(format!("node {index} has a placement that is not finite"));
        }
        if let Some(mesh) = node.mesh {
            self.mesh(mesh, &node.name, here)?;
        }
        for child in &node.children {
            self.node(*child, here, visited, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, index: usize, name: &str, place: DMat4) -> Result<(), ReadError> {
        let Some(text) = self.document.meshes.get(index) else {
            let what = format!("mesh {index} is named and not there");
            return Err(ReadError::content(what, "export the scene again"));
        };
        let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
        // Primitives that share their vertices share them here too.
        let mut bases: BTreeMap<usize, u32> = BTreeMap::new();
        let mut materials: BTreeMap<Option<usize>, u32> = BTreeMap::new();
        let uniform = text.primitives.windows(2).all(|p| p[0].attributes == p[1].attributes);
        for primitive in &text.primitives {
            if !matches!(primitive.mode, LINES | TRIANGLES | STRIP | FAN) {
                continue;
            }
            let Some(&position) = primitive.attributes.get("POSITION") else { continue };
            let base = match bases.get(&position) {
                Some(base) => *base,
                None => {
                    let base = mesh.positions.len() as u32;
                    self.vertices(position, primitive, place, uniform, &mut mesh)?;
                    bases.insert(position, base);
                    base
                }
            };
            let count = mesh.positions.len() as u32 - base;
            let corners = match primitive.indices {
                Some(accessor) => self.indices(accessor, count)?,
                None => (0..count).collect(),
            };
            let next = materials.len() as u32;
            let group = *materials.entry(primitive.material).or_insert_with(|| {
                let named = primitive.material.and_then(|m| self.document.materials.get(m));
                mesh.groups.push(Group::new(named.map_or("", |m| m.name.as_str())));
                next
            });
            let flipped = place.determinant() < 0.0;
            let mut push = |list: &[u32]| {
                let list: Vec<u32> = list.iter().map(|i| i + base).collect();
                match list[..] {
                    // Strips end one part and begin the next with such triangles.
                    [a, b, c] if a == b || b == c || c == a => {}
                    [a, b, c] => {
                        mesh.faces.push(&if flipped { [a, c, b] } else { [a, b, c] });
                        mesh.face_groups.push(group);
                    }
                    _ => mesh.lines.push(&list),
                }
            };
            match primitive.mode {
                LINES => corners.chunks_exact(2).for_each(push),
                TRIANGLES => corners.chunks_exact(3).for_each(push),
                STRIP => corners.windows(3).enumerate().for_each(|(k, t)| {
                    push(&if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] });
                }),
                _ => corners.windows(2).skip(1).for_each(|t| push(&[corners[0], t[0], t[1]])),
            }
        }
        if mesh.groups.len() < 2 || mesh.face_groups.is_empty() {
            mesh.groups.clear();
            mesh.face_groups.clear();
        }
        if !mesh.faces.is_empty() || !mesh.lines.is_empty() {
            self.meshes.push(mesh);
        }
        Ok(())
    }

    fn vertices(
        &mut self,
        position: usize,
        primitive: &Primitive,
        place: DMat4,
        with_data: bool,
        mesh: &mut Mesh,
    ) -> Result<(), ReadError> {
        let points = self.numbers(position, "VEC3")?;
        for p in points.chunks_exact(3) {
            let p = DVec3::new(p[0], p[1], p[2]);
            if !p.is_finite() {
                let what = format!("accessor {position} has the position {p}");
                return Err(ReadError::content(what, "coordinates must be finite"));
            }
            mesh.positions.push(place.transform_point3(p));
        }
        if !with_data {
            return Ok(());
        }
        let count = mesh.positions.len();
        for (name, accessor) in &primitive.attributes {
            let fits = self.document.accessors.get(*accessor).is_some_and(|a| a.count == count);
            if !fits {
                continue;
            }
            if name == "NORMAL" {
                let turn = place.inverse().transpose();
                let normals = self.numbers(*accessor, "VEC3")?;
                let normal = |n: &[f64]| {
                    turn.transform_vector3(DVec3::new(n[0], n[1], n[2])).normalize_or_zero()
                };
                mesh.normals = normals.chunks_exact(3).map(normal).collect();
            } else if name == "COLOR_0" {
                let kind = self.document.accessors[*accessor].kind.clone();
                let per = if kind == "VEC4" { 4 } else { 3 };
                let colors = self.numbers(*accessor, &kind)?;
                let color = |c: &[f64]| [c[0] as f32, c[1] as f32, c[2] as f32];
                mesh.colors = colors.chunks_exact(per).map(color).collect();
            } else if let Some(field) = name.strip_prefix('_')
                && self.document.accessors[*accessor].kind == "SCALAR"
            {
                let values = self.numbers(*accessor, "SCALAR")?;
                mesh.vertex_fields.push(Field { name: field.to_owned(), values });
            }
        }
        Ok(())
    }

    fn indices(&mut self, accessor: usize, vertices: u32) -> Result<Vec<u32>, ReadError> {
        let numbers = self.numbers(accessor, "SCALAR")?;
        match numbers.iter().find(|i| !(**i < f64::from(vertices))) {
            None => Ok(numbers.iter().map(|i| *i as u32).collect()),
            Some(wrong) => {
                let what = format!("accessor {accessor} names vertex {wrong} of {vertices}");
                Err(ReadError::content(what, "export the scene again"))
            }
        }
    }

    /// All numbers of an accessor; bytes and shorts that are no indices are shares of their range.
    fn numbers(&mut self, index: usize, kind: &str) -> Result<Vec<f64>, ReadError> {
        let fail = |what: String| Err(ReadError::content(what, "export the scene again"));
        let Some(accessor) = self.document.accessors.get(index) else {
            return fail(format!("accessor {index} is named and not there"));
        };
        let per = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => {
                return fail(format!(
                    "accessor {index} has the type {}",
                    crate::error::clip(other)
                ));
            }
        };
        if accessor.kind != kind {
            return fail(format!("accessor {index} is not of the type {kind}"));
        }
        if accessor.sparse.is_some() {
            return fail(format!("accessor {index} is sparse"));
        }
        let Some((size, read)) = component(accessor.component_type, kind == "SCALAR") else {
            return fail(format!("accessor {index} has an unknown component type"));
        };
        let Some(view) = accessor.buffer_view.and_then(|v| self.document.buffer_views.get(v))
        else {
            return fail(format!("accessor {index} has no data"));
        };
        let bytes = (view.buffer == 0)
            .then(|| view.byte_offset.checked_add(view.byte_length))
            .flatten()
            .and_then(|end| self.binary.get(view.byte_offset..end))
            .and_then(|bytes| bytes.get(accessor.byte_offset..));
        let Some(bytes) = bytes else {
            return fail(format!("the data of accessor {index} lie outside the file"));
        };
        let item = size * per;
        let stride = view.byte_stride.unwrap_or(item).max(1);
        let needed = accessor.count.saturating_sub(1).checked_mul(stride);
        let needed = needed.and_then(|n| n.checked_add(if accessor.count == 0 { 0 } else { item }));
        if needed.is_none_or(|needed| needed > bytes.len()) {
            let (count, have) = (accessor.count, bytes.len());
            return fail(format!("accessor {index} has {count} items, its data {have} bytes"));
        }
        // Many accessors may share the same bytes, so what they become is limited too.
        let cost = accessor.count.saturating_mul(per * 8);
        self.budget = match self.budget.checked_sub(cost) {
            Some(left) => left,
            None => return fail("the scene repeats its meshes too often".to_owned()),
        };
        let mut numbers = Vec::with_capacity(accessor.count * per);
        for k in 0..accessor.count {
            let item = &bytes[k * stride..k * stride + item];
            numbers.extend(item.chunks_exact(size).map(read));
        }
        Ok(numbers)
    }
}

fn local(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    DMat4::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from),
        node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
        node.translation.map_or(DVec3::ZERO, DVec3::from),
    )
}

type Component = (usize, fn(&[u8]) -> f64);

/// Size and reader of a component type.
fn component(kind: u32, whole: bool) -> Option<Component> {
    Some(match (kind, whole) {
        (5121, true) => (1, |b| f64::from(b[0])),
        (5121, false) => (1, |b| f64::from(b[0]) / 255.0),
        (5123, true) => (2, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
        (5123, false) => (2, |b| f64::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0),
        (5125, _) => (4, |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
        (5126, _) => (4, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
        _ => return None,
    })
}
