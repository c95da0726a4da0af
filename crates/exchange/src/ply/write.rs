//! Writing, in little-endian binary with coordinates in full precision.

use crate::color::display;
use crate::mesh::{Field, Mesh};
use crate::obj::one_line;
use crate::unit::LengthUnit;
use std::fmt::Write;

/// Meshes as one PLY file. Fields that only some of the meshes have are NaN on the others; groups
/// are the face property `group` with their names in comments; polylines become edges.
#[must_use]
pub fn write_ply(meshes: &[Mesh], unit: &LengthUnit) -> Vec<u8> {
    let vertices: usize = meshes.iter().map(|m| m.positions.len()).sum();
    let faces: usize = meshes.iter().map(|m| m.faces.len()).sum();
    let edges: usize = meshes.iter().map(|m| m.lines.total() - m.lines.len()).sum();
    let normals = all_have(meshes, |m| m.normals.len());
    let colors = all_have(meshes, |m| m.colors.len());
    let groups = meshes.iter().any(|m| !m.groups.is_empty());
    let vertex_fields = names(meshes, |m| &m.vertex_fields);
    let face_fields = names(meshes, |m| &m.face_fields);
    // Writing into a `String` cannot fail.
    let mut header = String::from("ply\nformat binary_little_endian 1.0\ncomment Umbilic\n");
    let _ = writeln!(header, "comment unit {}", one_line(&unit.to_string()));
    if let [only] = meshes
        && !only.name.is_empty()
    {
        let _ = writeln!(header, "comment name {}", one_line(&only.name));
    }
    for group in meshes.iter().filter(|_| groups).flat_map(group_names) {
        let _ = writeln!(header, "comment group {}", one_line(group));
    }
    let _ = writeln!(header, "element vertex {vertices}");
    let mut property = |kind: &str, name: &str| {
        let _ = writeln!(header, "property {kind} {}", one_line(name).replace(' ', "_"));
    };
    ["x", "y", "z"].iter().for_each(|name| property("double", name));
    if normals {
        ["nx", "ny", "nz"].iter().for_each(|name| property("double", name));
    }
    if colors {
        ["red", "green", "blue"].iter().for_each(|name| property("uchar", name));
    }
    vertex_fields.iter().for_each(|name| property("double", name));
    let _ = writeln!(header, "element face {faces}\nproperty list int int vertex_indices");
    if groups {
        header.push_str("property int group\n");
    }
    for name in &face_fields {
        let _ = writeln!(header, "property double {}", one_line(name).replace(' ', "_"));
    }
    if edges > 0 {
        let _ =
            writeln!(header, "element edge {edges}\nproperty int vertex1\nproperty int vertex2");
    }
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    for mesh in meshes {
        for (v, p) in mesh.positions.iter().enumerate() {
            bytes.extend(p.to_array().iter().flat_map(|x| x.to_le_bytes()));
            if normals {
                bytes.extend(mesh.normals[v].to_array().iter().flat_map(|x| x.to_le_bytes()));
            }
            if colors {
                let byte = |c: f32| (display(f64::from(c)) * 255.0).round() as u8;
                bytes.extend(mesh.colors[v].map(byte));
            }
            values(&mut bytes, &vertex_fields, &mesh.vertex_fields, v);
        }
    }
    let (mut base, mut group_base) = (0, 0);
    for mesh in meshes {
        for (f, corners) in mesh.faces.iter().enumerate() {
            bytes.extend((corners.len() as i32).to_le_bytes());
            bytes.extend(corners.iter().flat_map(|c| (*c as i32 + base).to_le_bytes()));
            if groups {
                let group = mesh.face_group(f).unwrap_or(0) as i32 + group_base;
                bytes.extend(group.to_le_bytes());
            }
            values(&mut bytes, &face_fields, &mesh.face_fields, f);
        }
        base += mesh.positions.len() as i32;
        group_base += group_names(mesh).len() as i32;
    }
    let mut base = 0;
    for mesh in meshes {
        let ends = mesh.lines.iter().flat_map(|line| line.windows(2).flatten());
        bytes.extend(ends.flat_map(|i| (*i as i32 + base).to_le_bytes()));
        base += mesh.positions.len() as i32;
    }
    bytes
}

/// Names of the groups of a mesh; one without groups is a group of its own.
fn group_names(mesh: &Mesh) -> Vec<&str> {
    if mesh.groups.is_empty() {
        return vec![&mesh.name];
    }
    mesh.groups.iter().map(|g| g.name.as_str()).collect()
}

fn all_have(meshes: &[Mesh], len: fn(&Mesh) -> usize) -> bool {
    !meshes.is_empty() && meshes.iter().all(|m| len(m) == m.positions.len())
}

fn names(meshes: &[Mesh], fields: fn(&Mesh) -> &[Field]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for field in meshes.iter().flat_map(fields) {
        if !names.contains(&field.name) {
            names.push(field.name.clone());
        }
    }
    names
}

fn values(bytes: &mut Vec<u8>, names: &[String], fields: &[Field], at: usize) {
    for name in names {
        let field = fields.iter().find(|f| f.name == *name);
        let value = field.and_then(|f| f.values.get(at)).copied().unwrap_or(f64::NAN);
        bytes.extend(value.to_le_bytes());
    }
}
