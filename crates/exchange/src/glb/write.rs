//! Writing meshes with colours, measured values and a material per group.

use crate::color::{field_colors, palette};
use crate::mesh::Mesh;
use crate::triangulate::triangulate;
use crate::unit::LengthUnit;
use geom_core::{BoundingBox, DVec3};
use serde_json::{Value, json};

/// Meshes and polylines as a GLB file.
///
/// Vertex fields become the attributes `_H`, `_K`, … in the units of the model (1/length and
/// 1/length² for curvatures). Without groups and colours of its own a mesh with the field `K` (or
/// else its first field) gets it as vertex colours: white at 0, red above, blue below, the ends at
/// the 95th percentile of the sizes; the linear `COLOR_0`. With groups each has its material.
///
/// glTF is in metres with y up: positions are written in the unit of the model and z up, relative
/// to the middle of the model (single precision suffices then), and the node of each mesh scales,
/// turns and moves them.
#[must_use]
pub fn write_glb(meshes: &[Mesh], unit: &LengthUnit) -> Vec<u8> {
    let all = meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
    let center = BoundingBox::of(all).map_or(DVec3::ZERO, BoundingBox::center);
    let mut file = Glb { center, ..Glb::default() };
    for mesh in meshes {
        file.mesh(mesh, unit);
    }
    file.finish(unit)
}

#[derive(Default)]
struct Glb {
    center: DVec3,
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    nodes: Vec<Value>,
}

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINES: u32 = 1;

impl Glb {
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
            let mut attributes = json!({ "POSITION": position });
            self.attributes(mesh, &mut attributes);
            for (material, faces) in self.materials_of(mesh) {
                let mut indices = Vec::new();
                for f in faces {
                    triangulate(&mesh.positions, mesh.faces.get(f), &mut indices);
                }
                let indices = self.indices(&indices);
                primitives.push(json!({
                    "attributes": attributes, "indices": indices, "material": material
                }));
            }
        }
        if !mesh.lines.is_empty() {
            let pairs = mesh.lines.iter().flat_map(|line| line.windows(2).flatten());
            let indices: Vec<u32> = pairs.copied().collect();
            let indices = self.indices(&indices);
            let material = self.material("lines", [0.02, 0.02, 0.02]);
            primitives.push(json!({
                "attributes": { "POSITION": position }, "indices": indices,
                "material": material, "mode": LINES
            }));
        }
        let s = unit.metres();
        let (half, c) = (std::f64::consts::FRAC_1_SQRT_2, center * s);
        self.nodes.push(json!({
            "name": mesh.name, "mesh": self.meshes.len(),
            // z up becomes y up by a quarter turn about x.
            "rotation": [-half, 0.0, 0.0, half],
            "scale": [s, s, s],
            "translation": [c.x, c.z, -c.y],
        }));
        self.meshes.push(json!({ "name": mesh.name, "primitives": primitives }));
    }

    fn attributes(&mut self, mesh: &Mesh, attributes: &mut Value) {
        if !mesh.normals.is_empty() {
            let usable = |n: &DVec3| n.is_finite() && (n.length() - 1.0).abs() < 1e-3;
            // A zero normal is not valid glTF; any unit vector is as good at a singular point.
            let normal = |n: &DVec3| if usable(n) { *n } else { DVec3::Z }.as_vec3();
            let normals: Vec<f32> =
                mesh.normals.iter().flat_map(|n| normal(n).normalize().to_array()).collect();
            attributes["NORMAL"] = self.floats(&normals, 3, "VEC3").into();
        }
        let colors = if mesh.colors.is_empty() { field_colors(mesh) } else { mesh.colors.clone() };
        if !colors.is_empty() {
            let colors: Vec<f32> = colors.iter().flatten().copied().collect();
            attributes["COLOR_0"] = self.floats(&colors, 3, "VEC3").into();
        }
        for field in &mesh.vertex_fields {
            let values: Vec<f32> = field
                .values
                .iter()
                // Values that are not finite are not valid glTF.
                .map(|v| if (*v as f32).is_finite() { *v as f32 } else { 0.0 })
                .collect();
            let name = format!("_{}", field.name.to_uppercase());
            attributes[name] = self.floats(&values, 1, "SCALAR").into();
        }
    }

    /// Materials with the faces they cover.
    fn materials_of(&mut self, mesh: &Mesh) -> Vec<(usize, Vec<usize>)> {
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

    fn material(&mut self, name: &str, [r, g, b]: [f32; 3]) -> usize {
        let material = json!({
            "name": name, "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7
            }
        });
        if let Some(same) = self.materials.iter().position(|m| *m == material) {
            return same;
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let flat: Vec<f32> = positions.iter().flatten().copied().collect();
        let accessor = self.floats(&flat, 3, "VEC3");
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for p in positions {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        self.accessors[accessor]["min"] = json!(low);
        self.accessors[accessor]["max"] = json!(high);
        accessor
    }

    fn floats(&mut self, values: &[f32], per_item: usize, kind: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes, ARRAY_BUFFER);
        self.accessors.push(json!({
            "bufferView": view, "componentType": FLOAT,
            "count": values.len() / per_item, "type": kind
        }));
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, ELEMENT_ARRAY_BUFFER);
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT,
            "count": indices.len(), "type": "SCALAR"
        }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: u32) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "target": target
        }));
        self.views.len() - 1
    }

    fn finish(self, unit: &LengthUnit) -> Vec<u8> {
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut document = json!({
            "asset": {
                "version": "2.0", "generator": "Umbilic",
                "extras": { "unit": unit.to_string() }
            },
            "scene": 0, "scenes": [{}],
        });
        // Empty lists are not valid glTF.
        let mut insert = |key: &str, list: Vec<Value>| {
            if !list.is_empty() {
                document[key] = list.into();
            }
        };
        insert("nodes", self.nodes);
        insert("meshes", self.meshes);
        insert("materials", self.materials);
        insert("accessors", self.accessors);
        insert("bufferViews", self.views);
        if !nodes.is_empty() {
            document["scenes"][0]["nodes"] = nodes.into();
            document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut file = Vec::with_capacity(text.len() + self.bytes.len() + 28);
        let binary = if self.bytes.is_empty() { 0 } else { 8 + self.bytes.len() };
        let total = 12 + 8 + text.len() + binary;
        file.extend_from_slice(b"glTF");
        file.extend_from_slice(&2_u32.to_le_bytes());
        file.extend_from_slice(&(total as u32).to_le_bytes());
        file.extend_from_slice(&(text.len() as u32).to_le_bytes());
        file.extend_from_slice(b"JSON");
        file.extend_from_slice(&text);
        if binary > 0 {
            file.extend_from_slice(&(self.bytes.len() as u32).to_le_bytes());
            file.extend_from_slice(b"BIN\0");
            file.extend_from_slice(&self.bytes);
        }
        file
    }
}
