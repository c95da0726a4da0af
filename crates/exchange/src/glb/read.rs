//! Reading triangles and lines.

use super::accessor::Numbers;
use super::prescan::check_objects;
use crate::error::ReadError;
use crate::json::{check_depth, fault};
use crate::mesh::{Field, Group, Mesh};
use crate::model::Model;
use crate::ron_text::MAX_DEPTH;
use crate::unit::LengthUnit;
use geom_core::{Budget, DVec3};
use glam::{DMat4, DQuat};
use gltf::json::Root;
use gltf::json::validation::Checked::Valid;
use gltf::json::validation::{Error as Fault, Validate};
use gltf::mesh::Mode;
use gltf::{Document, Semantic};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// The largest JSON part that is read: the description of a scene, not its coordinates.
const MOST_JSON: usize = 4 << 20;
/// Bytes of a vertex with its normal and colour.
const PER_VERTEX: usize = 24 + 24 + 12;
/// Bytes of a corner of a triangle, with its share of what else a face takes.
const PER_CORNER: usize = 8;

const MEND: &str = "export the scene again";

/// Placements in double precision, which the library has in single precision.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Placements {
    nodes: Vec<Placement>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Placement {
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

impl Placement {
    fn matrix(&self) -> DMat4 {
        if let Some(matrix) = &self.matrix {
            return DMat4::from_cols_array(matrix);
        }
        let rotation = self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
        DMat4::from_scale_rotation_translation(
            self.scale.map_or(DVec3::ONE, DVec3::from),
            // Written in single precision, a turn is not quite of unit length.
            if rotation.length() > 0.0 { rotation.normalize() } else { rotation },
            self.translation.map_or(DVec3::ZERO, DVec3::from),
        )
    }
}

/// Reads the triangles and lines of the default scene of a GLB file, with y up turned to z up, in
/// metres. Scalar attributes `_NAME` become fields, materials become groups of faces.
///
/// # Errors
/// [`ReadError`] names the byte, or the part of the scene at fault; scenes that place their meshes
/// so often that they outgrow 32 MiB and eight times the file are refused before they are built.
pub fn read_glb(bytes: &[u8]) -> Result<Model, ReadError> {
    let (text, binary) = chunks(bytes)?;
    check_depth(text)?;
    let budget = Budget::of_file(bytes.len() as u64);
    check_objects(text, budget)?;
    let root: Root = serde_json::from_str(text).map_err(|e| fault(&e))?;
    let placements: Placements = serde_json::from_str(text).map_err(|e| fault(&e))?;
    if let Some(extension) = root.extensions_required.first() {
        let what = format!("the file needs the extension {}", crate::error::clip(extension));
        return Err(ReadError::content(what, "export it without compression"));
    }
    validate(&root)?;
    let document = Document::from_json_without_validation(root);
    let mut scene =
        Scene { document: &document, placements: &placements.nodes, placed: Vec::new() };
    let mut visited = vec![false; document.nodes().len()];
    let default = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<usize> = match default {
        Some(default) => default.nodes().map(|n| n.index()).collect(),
        None => (0..visited.len()).collect(),
    };
    // y up to z up: a quarter turn about x, exact.
    let upright = DMat4::from_cols_array(&[
        1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ]);
    for root in roots {
        scene.walk(root, upright, &mut visited, 0)?;
    }
    let numbers = Numbers { binary };
    scene.check_size(numbers, budget.model_bytes())?;
    let mut meshes = Vec::new();
    for (node, place) in &scene.placed {
        let Some(node) = document.nodes().nth(*node) else { continue };
        if let Some(mesh) = node.mesh() {
            let name = node.name().unwrap_or_default();
            meshes.extend(placed_mesh(&mesh, name, *place, numbers)?);
        }
    }
    if meshes.is_empty() {
        return Err(ReadError::content("the scene has no triangle", "export it with meshes"));
    }
    Ok(Model { unit: LengthUnit::Metre, meshes, ..Model::default() })
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

/// Refuses what the library finds wrong, but for bounds that many exporters leave out, and for
/// primitives without positions, which are passed over.
fn validate(root: &Root) -> Result<(), ReadError> {
    // The library takes this number as it is.
    let positions = Valid(Semantic::Positions);
    let primitives = root.meshes.iter().flat_map(|m| &m.primitives);
    for accessor in primitives.filter_map(|p| p.attributes.get(&positions)) {
        if accessor.value() >= root.accessors.len() {
            let what = format!("accessor {} is named and not there", accessor.value());
            return Err(ReadError::content(what, MEND));
        }
    }
    let mut first = None;
    root.validate(root, gltf::json::Path::new, &mut |path, fault| {
        let path = path().to_string();
        let may_miss = [".min", ".max", "[\"POSITION\"]"].iter().any(|end| path.ends_with(end));
        if first.is_none() && !(may_miss && matches!(fault, Fault::Missing)) {
            first = Some(format!("`{path}`: {fault}"));
        }
    });
    first.map_or(Ok(()), |what| Err(ReadError::content(what.to_lowercase(), MEND)))
}

struct Scene<'a> {
    document: &'a Document,
    placements: &'a [Placement],
    /// Nodes with meshes, and where they stand.
    placed: Vec<(usize, DMat4)>,
}

impl Scene<'_> {
    fn walk(
        &mut self,
        index: usize,
        parent: DMat4,
        visited: &mut [bool],
        depth: usize,
    ) -> Result<(), ReadError> {
        let fail = |what: String| Err(ReadError::content(what, MEND));
        if std::mem::replace(&mut visited[index], true) {
            return fail(format!("node {index} has two parents or is its own"));
        }
        if depth > MAX_DEPTH {
            return fail(format!("the nodes are nested deeper than {MAX_DEPTH}"));
        }
        let here = parent * self.placements.get(index).map_or(DMat4::IDENTITY, Placement::matrix);
        if !here.is_finite() {
            return fail(format!("node {index} has a placement that is not finite"));
        }
        let Some(node) = self.document.nodes().nth(index) else { return Ok(()) };
        if node.mesh().is_some() {
            self.placed.push((index, here));
        }
        for child in node.children() {
            self.walk(child.index(), here, visited, depth + 1)?;
        }
        Ok(())
    }

    /// Refuses scenes that place their meshes too often, before anything is built.
    fn check_size(&self, numbers: Numbers<'_>, budget: usize) -> Result<(), ReadError> {
        let mut sizes: BTreeMap<usize, usize> = BTreeMap::new();
        for mesh in self.document.meshes() {
            let mut bytes = 0_usize;
            let mut counted = BTreeSet::new();
            for primitive in mesh.primitives() {
                let positions = primitive.get(&Semantic::Positions);
                // A count beyond the data is no size.
                positions.iter().try_for_each(|a| numbers.check(a))?;
                primitive.indices().iter().try_for_each(|a| numbers.check(a))?;
                let corners = match primitive.indices() {
                    Some(indices) => indices.count(),
                    None => positions.as_ref().map_or(0, gltf::Accessor::count),
                };
                // Primitives that share their vertices share them in the mesh.
                let is_new = |a: &gltf::Accessor<'_>| counted.insert(a.index());
                let vertices = positions.filter(is_new).map_or(0, |a| a.count());
                // A strip has three corners per index.
                let per_corner = match primitive.mode() {
                    Mode::TriangleStrip | Mode::TriangleFan => 3 * PER_CORNER,
                    _ => PER_CORNER,
                };
                let fields = primitive.attributes().len();
                let here = vertices.saturating_mul(PER_VERTEX + 8 * fields);
                bytes = bytes.saturating_add(here);
                bytes = bytes.saturating_add(corners.saturating_mul(per_corner));
            }
            sizes.insert(mesh.index(), bytes);
        }
        let mut total = 0_usize;
        for (node, _) in &self.placed {
            let mesh = self.document.nodes().nth(*node).and_then(|n| n.mesh());
            total = total.saturating_add(mesh.map_or(0, |m| sizes[&m.index()]));
        }
        if total <= budget {
            return Ok(());
        }
        let what = format!(
            "the scene places its meshes {} times, which takes {} MB where {} are allowed",
            self.placed.len(),
            total >> 20,
            budget >> 20
        );
        Err(ReadError::content(what, "export every mesh once, or fewer instances"))
    }
}

/// One mesh in the coordinates of the scene; none if it has neither faces nor lines.
fn placed_mesh(
    source: &gltf::Mesh<'_>,
    name: &str,
    place: DMat4,
    numbers: Numbers<'_>,
) -> Result<Option<Mesh>, ReadError> {
    let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
    // Primitives that share their vertices share them here too.
    let mut bases: BTreeMap<usize, u32> = BTreeMap::new();
    let mut materials: BTreeMap<Option<usize>, u32> = BTreeMap::new();
    let listed = |p: &gltf::Primitive<'_>| -> Vec<(Semantic, usize)> {
        p.attributes().map(|(semantic, accessor)| (semantic, accessor.index())).collect()
    };
    let mut lists = source.primitives().map(|p| listed(&p));
    let first = lists.next();
    let uniform = lists.all(|list| Some(&list) == first.as_ref());
    for primitive in source.primitives() {
        let mode = primitive.mode();
        if matches!(mode, Mode::Points | Mode::LineLoop | Mode::LineStrip) {
            continue;
        }
        let Some(position) = primitive.get(&Semantic::Positions) else { continue };
        let base = match bases.get(&position.index()) {
            Some(base) => *base,
            None => {
                let base = mesh.positions.len() as u32;
                bases.insert(position.index(), base);
                vertices(position, &primitive, place, uniform, numbers, &mut mesh)?;
                base
            }
        };
        let count = mesh.positions.len() - base as usize;
        let corners = numbers.indices(&primitive, count)?;
        let corners = corners.unwrap_or_else(|| (0..count as u32).collect());
        let next = materials.len() as u32;
        let material = primitive.material();
        let group = *materials.entry(material.index()).or_insert_with(|| {
            mesh.groups.push(Group::new(material.name().unwrap_or_default()));
            next
        });
        push_corners(&mut mesh, &corners, mode, base, group, place.determinant() < 0.0);
    }
    if mesh.groups.len() < 2 || mesh.face_groups.is_empty() {
        mesh.groups.clear();
        mesh.face_groups.clear();
    }
    Ok((!mesh.faces.is_empty() || !mesh.lines.is_empty()).then_some(mesh))
}

fn push_corners(
    mesh: &mut Mesh,
    corners: &[u32],
    mode: Mode,
    base: u32,
    group: u32,
    flipped: bool,
) {
    let mut push = |list: [u32; 3]| {
        let [a, b, c] = list.map(|i| i + base);
        // Strips end one part and begin the next with triangles that are a line.
        if a != b && b != c && c != a {
            mesh.faces.push(&if flipped { [a, c, b] } else { [a, b, c] });
            mesh.face_groups.push(group);
        }
    };
    match mode {
        Mode::Triangles => corners.chunks_exact(3).for_each(|t| push([t[0], t[1], t[2]])),
        Mode::TriangleStrip => corners.windows(3).enumerate().for_each(|(k, t)| {
            push(if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] });
        }),
        Mode::TriangleFan => {
            corners.windows(2).skip(1).for_each(|t| push([corners[0], t[0], t[1]]));
        }
        _ => corners.chunks_exact(2).for_each(|t| mesh.lines.push(&[t[0] + base, t[1] + base])),
    }
}

fn vertices(
    position: gltf::Accessor<'_>,
    primitive: &gltf::Primitive<'_>,
    place: DMat4,
    with_data: bool,
    numbers: Numbers<'_>,
    mesh: &mut Mesh,
) -> Result<(), ReadError> {
    let index = position.index();
    for p in numbers.vectors(position)? {
        let p = DVec3::from_array(p.map(f64::from));
        if !p.is_finite() {
            let what = format!("accessor {index} has the position {p}");
            return Err(ReadError::content(what, "coordinates must be finite"));
        }
        mesh.positions.push(place.transform_point3(p));
    }
    if !with_data {
        return Ok(());
    }
    let count = mesh.positions.len();
    for (semantic, accessor) in primitive.attributes() {
        if accessor.count() != count {
            continue;
        }
        match semantic {
            Semantic::Normals => {
                let turn = place.inverse().transpose();
                let normal = |n: [f32; 3]| {
                    turn.transform_vector3(DVec3::from_array(n.map(f64::from))).normalize_or_zero()
                };
                mesh.normals = numbers.vectors(accessor)?.into_iter().map(normal).collect();
            }
            Semantic::Colors(0) => mesh.colors = numbers.colors(primitive)?.unwrap_or_default(),
            Semantic::Extras(name) => {
                if let Some(values) = numbers.scalars(accessor)? {
                    let name = name.strip_prefix('_').unwrap_or(&name).to_owned();
                    mesh.vertex_fields.push(Field { name, values });
                }
            }
            _ => {}
        }
    }
    Ok(())
}
