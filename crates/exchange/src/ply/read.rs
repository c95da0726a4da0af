//! Reading.

use super::header::{Element, Encoding, Header, Number, Property, read_header};
use crate::color::linear;
use crate::error::{ReadError, clip};
use crate::mesh::{Field, Group, Mesh};
use crate::model::Model;
use crate::unit::LengthUnit;
use geom_core::DVec3;

/// Reads a PLY file; properties of vertices and faces with other names than the usual ones become
/// fields. Lists other than the corners of faces are left out.
///
/// # Errors
/// [`ReadError`] names the line or byte at fault. Nothing is reserved for elements the file is too
/// short for.
pub fn read_ply(bytes: &[u8]) -> Result<Model, ReadError> {
    let header = read_header(bytes)?;
    let mut body =
        Body { bytes, at: header.body, line: header.body_line, encoding: header.encoding };
    let mut model = Model::default();
    let mut mesh = Mesh::default();
    for element in &header.elements {
        body.check_size(element)?;
        match element.name.as_str() {
            "vertex" => read_vertices(&mut body, element, &mut mesh)?,
            "face" => read_faces(&mut body, element, &mut mesh)?,
            "edge" => read_edges(&mut body, element, &mut mesh)?,
            other => {
                model.warnings.push(format!("elements `{}` are left out", clip(other)));
                for _ in 0..element.count {
                    for property in &element.properties {
                        body.skip(property)?;
                    }
                }
            }
        }
    }
    model.warnings.extend(body.rest());
    if mesh.positions.is_empty() {
        return Err(ReadError::content("the file has no vertex", "export it with vertices"));
    }
    apply_comments(&header, &mut model, &mut mesh);
    model.meshes.push(mesh);
    Ok(model)
}

/// Where the numbers are read.
struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    encoding: Encoding,
}

impl Body<'_> {
    /// What to say if something follows the last element.
    fn rest(&self) -> Option<String> {
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        match self.encoding {
            Encoding::Ascii => {
                let after = rest.iter().position(|b| !b.is_ascii_whitespace())?;
                let lines = rest[..after].iter().filter(|b| **b == b'\n').count();
                let line = self.line + lines;
                Some(format!("line {line}: what follows the last element is left out"))
            }
            _ if rest.is_empty() => None,
            _ => Some(format!(
                "byte {}: the {} bytes after the last element are left out",
                self.at,
                rest.len()
            )),
        }
    }

    fn error(&self, what: impl Into<String>, mend: &str) -> ReadError {
        match self.encoding {
            Encoding::Ascii => ReadError::text(self.line, what, mend),
            _ => ReadError::binary(self.at, what, mend),
        }
    }

    /// Refuses counts that the rest of the file cannot hold, before anything is reserved.
    fn check_size(&self, element: &Element) -> Result<(), ReadError> {
        let least: usize = match self.encoding {
            // A digit and a blank for every number.
            Encoding::Ascii => 2 * element.properties.len(),
            _ => element.properties.iter().map(|p| p.length.unwrap_or(p.number).bytes()).sum(),
        };
        let left = self.bytes.len() - self.at + 1;
        let fits = element.count == 0
            || (least > 0 && element.count.checked_mul(least).is_some_and(|need| need <= left));
        if fits {
            return Ok(());
        }
        let what = format!(
            "{} elements `{}` do not fit into the {} bytes left",
            element.count,
            clip(&element.name),
            left - 1
        );
        Err(self.error(what, "correct the header; the file may be truncated"))
    }

    fn number(&mut self, number: Number) -> Result<f64, ReadError> {
        if self.encoding == Encoding::Ascii {
            return self.ascii();
        }
        let size = number.bytes();
        let Some(raw) = self.bytes.get(self.at..self.at + size) else {
            return Err(self.error("the file ends inside an element", "it is truncated"));
        };
        let mut little = [0_u8; 8];
        little[..size].copy_from_slice(raw);
        if self.encoding == Encoding::BigEndian {
            little[..size].reverse();
        }
        self.at += size;
        let bits = u64::from_le_bytes(little);
        Ok(match number {
            Number::Int8 => f64::from(bits as i8),
            Number::Uint8 => f64::from(bits as u8),
            Number::Int16 => f64::from(bits as i16),
            Number::Uint16 => f64::from(bits as u16),
            Number::Int32 => f64::from(bits as i32),
            Number::Uint32 => f64::from(bits as u32),
            Number::Float32 => f64::from(f32::from_bits(bits as u32)),
            Number::Float64 => f64::from_bits(bits),
        })
    }

    fn ascii(&mut self) -> Result<f64, ReadError> {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += usize::from(*b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.error("the file ends inside an element", "it is truncated"));
        }
        let word = String::from_utf8_lossy(&rest[..end.min(200)]);
        let Ok(value) = word.parse() else {
            let what = format!("`{}` is not a number", clip(&word));
            return Err(self.error(what, "write numbers only"));
        };
        self.at += end;
        Ok(value)
    }

    fn finite(&mut self, number: Number) -> Result<f64, ReadError> {
        let value = self.number(number)?;
        if value.is_finite() {
            return Ok(value);
        }
        let what = format!("coordinate {value} is not finite");
        Err(self.error(what, "write coordinates as finite numbers"))
    }

    fn index(&mut self, number: Number, count: usize) -> Result<u32, ReadError> {
        let value = self.number(number)?;
        if value >= 0.0 && value < count as f64 && value.fract() == 0.0 {
            return Ok(value as u32);
        }
        let what = format!("{value} names no vertex");
        Err(self.error(what, &format!("the file has {count} vertices, counted from 0")))
    }

    fn length(&mut self, number: Number) -> Result<usize, ReadError> {
        let value = self.number(number)?;
        let left = (self.bytes.len() - self.at) as f64;
        if (0.0..=left).contains(&value) && value.fract() == 0.0 {
            return Ok(value as usize);
        }
        Err(self.error(format!("a list of {value} entries"), "the file is truncated or damaged"))
    }

    fn skip(&mut self, property: &Property) -> Result<(), ReadError> {
        let times = match property.length {
            Some(length) => self.length(length)?,
            None => 1,
        };
        for _ in 0..times {
            self.number(property.number)?;
        }
        Ok(())
    }
}

/// What a property of a vertex is for.
enum Role {
    Position(usize),
    Normal(usize),
    Color(usize),
    Field(usize),
    Skip,
}

fn read_vertices(body: &mut Body<'_>, element: &Element, mesh: &mut Mesh) -> Result<(), ReadError> {
    let mut fields = Vec::new();
    let mut roles = Vec::new();
    for property in &element.properties {
        roles.push(match (property.name.as_str(), property.length) {
            (_, Some(_)) => Role::Skip,
            ("x" | "y" | "z", _) => Role::Position(axis(&property.name, "xyz")),
            ("nx" | "ny" | "nz", _) => Role::Normal(axis(&property.name[1..], "xyz")),
            ("red" | "green" | "blue", _) => Role::Color(axis(&property.name[..1], "rgb")),
            ("alpha", _) => Role::Skip,
            (name, _) => {
                fields.push(Field { name: name.to_owned(), values: Vec::new() });
                Role::Field(fields.len() - 1)
            }
        });
    }
    let count_of = |is: fn(&Role) -> bool| roles.iter().filter(|r| is(r)).count();
    let (positions, normals, colors) = (
        count_of(|r| matches!(r, Role::Position(_))),
        count_of(|r| matches!(r, Role::Normal(_))),
        count_of(|r| matches!(r, Role::Color(_))),
    );
    if positions != 3 && element.count > 0 {
        return Err(body.error("the vertices have no x, y and z", "add the three properties"));
    }
    for _ in 0..element.count {
        let (mut position, mut normal, mut color) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for (property, role) in element.properties.iter().zip(&roles) {
            match role {
                Role::Position(k) => position[*k] = body.finite(property.number)?,
                Role::Normal(k) => normal[*k] = body.number(property.number)?,
                Role::Color(k) => color[*k] = color_value(property.number, body)?,
                Role::Field(k) => fields[*k].values.push(body.number(property.number)?),
                Role::Skip => body.skip(property)?,
            }
        }
        mesh.positions.push(position.into());
        if normals == 3 {
            mesh.normals.push(DVec3::from(normal));
        }
        if colors == 3 {
            mesh.colors.push(color);
        }
    }
    mesh.vertex_fields = fields;
    Ok(())
}

fn axis(name: &str, letters: &str) -> usize {
    letters.find(name).unwrap_or(0)
}

/// Colours in bytes are display values (sRGB); in floating point they are linear.
fn color_value(number: Number, body: &mut Body<'_>) -> Result<f32, ReadError> {
    let value = body.number(number)?;
    Ok(match number {
        Number::Uint8 => linear(value / 255.0) as f32,
        Number::Uint16 => linear(value / 65535.0) as f32,
        _ => value as f32,
    })
}

fn read_faces(body: &mut Body<'_>, element: &Element, mesh: &mut Mesh) -> Result<(), ReadError> {
    let is_corners = |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    let mut fields: Vec<Option<Field>> = element
        .properties
        .iter()
        .map(|p| {
            let plain = p.length.is_none();
            plain.then(|| Field { name: p.name.clone(), values: Vec::new() })
        })
        .collect();
    let count = mesh.positions.len();
    let mut corners = Vec::new();
    for f in 0..element.count {
        for (property, field) in element.properties.iter().zip(&mut fields) {
            match (property.length, field) {
                (Some(length), _) if is_corners(property) => {
                    corners.clear();
                    let n = body.length(length)?;
                    if n < 3 {
                        let what = format!("face {f} has {n} corners");
                        return Err(body.error(what, "a face needs at least 3"));
                    }
                    for _ in 0..n {
                        corners.push(body.index(property.number, count)?);
                    }
                    mesh.faces.push(&corners);
                }
                (None, Some(field)) => field.values.push(body.number(property.number)?),
                _ => body.skip(property)?,
            }
        }
    }
    if mesh.faces.len() != element.count {
        return Err(body.error("the faces have no `vertex_indices`", "add the list of corners"));
    }
    mesh.face_fields = fields.into_iter().flatten().collect();
    Ok(())
}

fn read_edges(body: &mut Body<'_>, element: &Element, mesh: &mut Mesh) -> Result<(), ReadError> {
    let count = mesh.positions.len();
    for _ in 0..element.count {
        let mut ends = [0_u32; 2];
        for property in &element.properties {
            match (property.name.as_str(), property.length) {
                ("vertex1", None) => ends[0] = body.index(property.number, count)?,
                ("vertex2", None) => ends[1] = body.index(property.number, count)?,
                _ => body.skip(property)?,
            }
        }
        mesh.lines.push(&ends);
    }
    Ok(())
}

/// Unit, name and groups, as our own writer notes them.
fn apply_comments(header: &Header, model: &mut Model, mesh: &mut Mesh) {
    let mut groups = Vec::new();
    for comment in &header.comments {
        if let Some(unit) = comment.strip_prefix("unit ").and_then(LengthUnit::from_symbol) {
            model.unit = unit;
        } else if let Some(name) = comment.strip_prefix("name ") {
            mesh.name = name.to_owned();
        } else if let Some(name) = comment.strip_prefix("group ") {
            groups.push(Group::new(name));
        }
    }
    let Some(k) = mesh.face_fields.iter().position(|f| f.name == "group") else { return };
    let valid = |v: &f64| *v >= 0.0 && *v < groups.len() as f64 && v.fract() == 0.0;
    if !groups.is_empty() && mesh.face_fields[k].values.iter().all(valid) {
        let field = mesh.face_fields.remove(k);
        mesh.face_groups = field.values.iter().map(|v| *v as u32).collect();
        mesh.groups = groups;
    }
}

#[cfg(test)]
mod tests {
    use super::super::write_ply;
    use super::*;

    const SQUARE: &str = "ply\nformat ascii 1.0\ncomment unit m\nelement vertex 4\n\
        property float x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\nproperty double K\nelement face 1\n\
        property list uchar int vertex_indices\nproperty int panel\nend_header\n\
        0 0 0 255 0 0 1.5\n1 0 0 255 0 0 2.5\n1 1 0 0 0 0 -1\n0 1 0.5 0 188 0 0\n4 0 1 2 3 7\n";

    #[test]
    fn ascii_is_read_and_comes_back_binary() {
        let model = read_ply(SQUARE.as_bytes()).unwrap();
        let mesh = &model.meshes[0];
        assert_eq!(model.unit, LengthUnit::Metre);
        assert_eq!(mesh.faces.get(0), [0, 1, 2, 3]);
        assert_eq!(mesh.vertex_fields[0].values, [1.5, 2.5, -1.0, 0.0]);
        assert_eq!(
            (mesh.face_fields[0].name.as_str(), mesh.face_fields[0].values[0]),
            ("panel", 7.0)
        );
        assert_eq!(mesh.colors[0], [1.0, 0.0, 0.0]);
        assert!((mesh.colors[3][1] - 0.5).abs() < 0.01);
        let again = read_ply(&write_ply(&model.meshes, &model.unit)).unwrap();
        assert_eq!(again, model);
    }

    #[test]
    fn big_endian_numbers() {
        let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double x\n\
            property float y\nproperty short z\nend_header\n"
            .to_vec();
        bytes.extend(1.25_f64.to_be_bytes());
        bytes.extend((-2.5_f32).to_be_bytes());
        bytes.extend((-3_i16).to_be_bytes());
        let mesh = &read_ply(&bytes).unwrap().meshes[0];
        assert_eq!(mesh.positions[0], DVec3::new(1.25, -2.5, -3.0));
    }

    #[test]
    fn faults_name_place_and_mend() {
        let change = |from: &str, to: &str| {
            assert!(SQUARE.contains(from), "{from}");
            read_ply(SQUARE.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
        };
        let cases = [
            ("ply\n", "plx\n", "line 1: the file does not begin"),
            ("format ascii 1.0", "format utf9 1.0", "line 2: unknown `format utf9 1.0`"),
            ("format ascii 1.0\n", "", "line 14: no format before"),
            (
                "element vertex 4",
                "element vertex 4000000000",
                "line 16: 4000000000 elements `vertex` do not fit",
            ),
            ("element vertex 4", "element vertex x", "line 4: no count in"),
            ("element vertex 4\n", "", "line 4: no element before"),
            ("property float z\n", "", "line 15: the vertices have no x, y and z"),
            ("float x", "floot x", "line 5: cannot understand"),
            ("list uchar", "list float", "line 13: cannot understand"),
            ("end_header\n", "", "line 15: cannot understand"),
            ("1 1 0 0 0 0 -1", "1 nan 0 0 0 0 -1", "line 18: coordinate NaN is not finite"),
            ("1 1 0 0 0 0 -1", "1 1e999 0 0 0 0 -1", "line 18: coordinate inf is not finite"),
            ("1 1 0 0 0 0 -1", "1 x 0 0 0 0 -1", "line 18: `x` is not a number"),
            ("4 0 1 2 3 7", "4 0 1 2 4 7", "line 20: 4 names no vertex"),
            ("4 0 1 2 3 7", "4 0 1 2 -1 7", "line 20: -1 names no vertex"),
            ("4 0 1 2 3 7", "2 0 1 7", "line 20: face 0 has 2 corners"),
            ("4 0 1 2 3 7", "1e9 0 1 2 3 7", "line 20: a list of 1000000000 entries"),
            ("4 0 1 2 3 7\n", "4 0 1", "line 20: the file ends inside"),
            ("vertex_indices", "corners", "line 20: the faces have no `vertex_indices`"),
            (
                "element face 1",
                "element face 0\nelement void 9",
                "line 20: 9 elements `void` do not fit",
            ),
        ];
        for (from, to, want) in cases {
            let message = change(from, to);
            assert!(message.starts_with(want), "{message}, not {want}");
        }
    }
}
