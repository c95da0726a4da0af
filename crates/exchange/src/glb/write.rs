//! Writing meshes with colours, measured values and a material per group.

use crate::color::{field_colors, palette};
use crate::mesh::Mesh;
use crate::triangulate::triangulate;
use crate::unit::LengthUnit;
use geom_core::{BoundingBox, DVec3};
use gltf::Semantic;
use gltf::binary::{Glb, Header};
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::extras::RawValue;
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::Checked::Valid;
use gltf::json::{Accessor, Asset, Buffer, Index, Material, Node, Root, Scene};
use serde_json::json;
use std::collections::BTreeMap;

type Attributes = BTreeMap<gltf::json::validation::Checked<Semantic>, Index<Accessor>>;

/// Meshes and polylines as a GLB file.
///
/// Vertex fields become the attributes `_H`, `_K`, … in the units of the model (1/length and
/// 1/length² for curvatures). Without groups and colours of its own a mesh with the field `K` (or
/// else its first field) gets it as vertex colours: white at 0, red above, blue below, the ends at
/// the 95th percentile of the sizes; the linear `COLOR_0`. With groups each has its material.
///
/// glTF is in metres with y up: positions are written in the unit of the model and z up, relative
/// to the middle of the model (single precision suffices then), and the node of each mesh scales,
/// turns and moves them. What single precision leaves over of the move is a second node.
#[must_use]
pub fn write_glb(meshes: &[Mesh], unit: &LengthUnit) -> Vec<u8> {
    let all = meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
    let center = BoundingBox::of(all).map_or(DVec3::ZERO, BoundingBox::center);
    let mut file = Writer { center, bytes: Vec::new(), root: Root::default(), nodes: Vec::new() };
    for mesh in meshes {
        file.mesh(mesh, unit);
    }
    file.finish(unit)
}

struct Writer {
    center: DVec3,
    bytes: Vec<u8>,
    root: Root,
    /// The nodes of the meshes.
    nodes: Vec<Index<Node>>,
}

impl Writer {
    fn mesh(&mut self, mesh: &Mesh, unit: &LengthUnit) {
        if mesh.faces.is_empty() && mesh.lines.is_empty() {
            return;
        }
        let center = self.center;
        let local: Vec<[f32; 3]> =
            mesh.positions.iter().map(|p| (*p - center).as_vec3().to_array()).collect();
        let position = self.positions(&local);
        let mut primitives = Vec::new();
        if !mesh.faces.is_empty() {
            let mut attributes = Attributes::from([(Valid(Semantic::Positions), position)]);
            self.attributes(mesh, &mut attributes);
            for (material, faces) in self.materials_of(mesh) {
                let mut indices = Vec::new();
                for f in faces {
                    triangulate(&mesh.positions, mesh.faces.get(f), &mut indices);
                }
                let indices = self.indices(&indices);
                primitives.push(primitive(attributes.clone(), indices, material, Mode::Triangles));
            }
        }
        if !mesh.lines.is_empty() {
            let pairs = mesh.lines.iter().flat_map(|line| line.windows(2).flatten());
            let indices: Vec<u32> = pairs.copied().collect();
            let indices = self.indices(&indices);
            let material = self.material("lines", [0.02, 0.02, 0.02]);
            let attributes = Attributes::from([(Valid(Semantic::Positions), position)]);
            primitives.push(primitive(attributes, indices, material, Mode::Lines));
        }
        let name = Some(mesh.name.clone());
        let made = gltf::json::Mesh {
            name: name.clone(),
            primitives,
            weights: None,
            extensions: None,
            extras: None,
        };
        let made = self.root.push(made);
        let s = unit.metres();
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let [_, rest] = in_two(moved(center * s));
        let node = Node {
            name,
            mesh: Some(made),
            // z up becomes y up by a quarter turn about x.
            rotation: Some(UnitQuaternion([-half, 0.0, 0.0, half])),
            scale: Some([s as f32; 3]),
            translation: Some(rest),
            ..Node::default()
        };
        let node = self.root.push(node);
        self.nodes.push(node);
    }

    fn attributes(&mut self, mesh: &Mesh, attributes: &mut Attributes) {
        if !mesh.normals.is_empty() {
            let usable = |n: &DVec3| n.is_finite() && (n.length() - 1.0).abs() < 1e-3;
            // A zero normal is not valid glTF; any unit vector is as good at a singular point.
            let normal = |n: &DVec3| if usable(n) { *n } else { DVec3::Z }.as_vec3();
            let normals: Vec<f32> =
                mesh.normals.iter().flat_map(|n| normal(n).normalize().to_array()).collect();
            let accessor = self.floats(&normals, Type::Vec3);
            attributes.insert(Valid(Semantic::Normals), accessor);
        }
        let colors = if mesh.colors.is_empty() { field_colors(mesh) } else { mesh.colors.clone() };
        if !colors.is_empty() {
            let colors: Vec<f32> = colors.iter().flatten().copied().collect();
            let accessor = self.floats(&colors, Type::Vec3);
            attributes.insert(Valid(Semantic::Colors(0)), accessor);
        }
        for field in &mesh.vertex_fields {
            let values: Vec<f32> = field
                .values
                .iter()
                // Values that are not finite are not valid glTF.
                .map(|v| if (*v as f32).is_finite() { *v as f32 } else { 0.0 })
                .collect();
            let accessor = self.floats(&values, Type::Scalar);
            attributes.insert(Valid(Semantic::Extras(field.name.to_uppercase())), accessor);
        }
    }

    /// Materials with the faces they cover.
    fn materials_of(&mut self, mesh: &Mesh) -> Vec<(Index<Material>, Vec<usize>)> {
        if mesh.groups.is_empty() {
            let colored = !mesh.colors.is_empty() || !mesh.vertex_fields.is_empty();
            let color = if colored { [1.0; 3] } else { [0.6, 0.62, 0.65] };
            return vec![(self.material("surface", color), (0..mesh.faces.len()).collect())];
        }
        let mut faces = vec![Vec::new(); mesh.groups.len()];
        for (f, group) in mesh.face_groups.iter().enumerate() {
            faces[*group as usize].push(f);
        }
        let mut result = Vec::new();
        for (k, (group, faces)) in mesh.groups.iter().zip(faces).enumerate() {
            if !faces.is_empty() {
                let color = group.color.unwrap_or_else(|| palette(k));
                result.push((self.material(&group.name, color), faces));
            }
        }
        result
    }

    fn material(&mut self, name: &str, [r, g, b]: [f32; 3]) -> Index<Material> {
        let factor = [r, g, b, 1.0];
        let same = |m: &Material| {
            m.name.as_deref() == Some(name)
                && m.pbr_metallic_roughness.base_color_factor.0 == factor
        };
        if let Some(known) = self.root.materials.iter().position(same) {
            return Index::new(known as u32);
        }
        self.root.push(Material {
            name: Some(name.to_owned()),
            double_sided: true,
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(factor),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(0.7),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        })
    }

    fn positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let flat: Vec<f32> = positions.iter().flatten().copied().collect();
        let accessor = self.floats(&flat, Type::Vec3);
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for p in positions {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        let made = &mut self.root.accessors[accessor.value()];
        (made.min, made.max) = (Some(json!(low)), Some(json!(high)));
        accessor
    }

    fn floats(&mut self, values: &[f32], type_: Type) -> Index<Accessor> {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let count = values.len() / type_.multiplicity();
        self.accessor(&bytes, Target::ArrayBuffer, ComponentType::F32, type_, count)
    }

    fn indices(&mut self, indices: &[u32]) -> Index<Accessor> {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let target = Target::ElementArrayBuffer;
        self.accessor(&bytes, target, ComponentType::U32, Type::Scalar, indices.len())
    }

    fn accessor(
        &mut self,
        bytes: &[u8],
        target: Target,
        component: ComponentType,
        type_: Type,
        count: usize,
    ) -> Index<Accessor> {
        let view = View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(self.bytes.len().into()),
            byte_stride: None,
            name: None,
            target: Some(Valid(target)),
            extensions: None,
            extras: None,
        };
        self.bytes.extend_from_slice(bytes);
        let view = self.root.push(view);
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: count.into(),
            component_type: Valid(GenericComponentType(component)),
            type_: Valid(type_),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
            extensions: None,
            extras: None,
        })
    }

    fn finish(mut self, unit: &LengthUnit) -> Vec<u8> {
        let unit_name = json!({ "unit": unit.to_string() }).to_string();
        self.root.asset = Asset {
            generator: Some("Umbilic".to_owned()),
            extras: RawValue::from_string(unit_name).ok(),
            ..Asset::default()
        };
        let [most, _] = in_two(moved(self.center * unit.metres()));
        if most != [0.0; 3] && !self.nodes.is_empty() {
            let children = Some(std::mem::take(&mut self.nodes));
            let around = Node { children, translation: Some(most), ..Node::default() };
            let around = self.root.push(around);
            self.nodes.push(around);
        }
        if !self.nodes.is_empty() {
            self.root.buffers.push(Buffer {
                byte_length: self.bytes.len().into(),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
        }
        let scene = Scene { nodes: self.nodes, name: None, extensions: None, extras: None };
        self.root.scene = Some(self.root.push(scene));
        // Neither plain numbers nor the memory they are written to can fail.
        let json = serde_json::to_vec(&self.root).unwrap_or_default();
        let header = Header { magic: *b"glTF", version: 2, length: 0 };
        let bin = (!self.bytes.is_empty()).then_some(self.bytes.into());
        Glb { header, json: json.into(), bin }.to_vec().unwrap_or_default()
    }
}

fn primitive(
    attributes: Attributes,
    indices: Index<Accessor>,
    material: Index<Material>,
    mode: Mode,
) -> Primitive {
    Primitive {
        attributes,
        indices: Some(indices),
        material: Some(material),
        mode: Valid(mode),
        targets: None,
        extensions: None,
        extras: None,
    }
}

/// A move in the axes of glTF.
fn moved(by: DVec3) -> DVec3 {
    DVec3::new(by.x, by.z, -by.y)
}

/// A move in single precision, and what is left of it. Programs read the decimals of the first
/// either in single or in double precision, so the rest is measured from the decimals.
fn in_two(by: DVec3) -> [[f32; 3]; 2] {
    let most = by.as_vec3().to_array();
    let decimals = most.map(|x| x.to_string().parse::<f64>().unwrap_or(f64::from(x)));
    [most, (by - DVec3::from_array(decimals)).as_vec3().to_array()]
}
