//! Wavefront OBJ: polygons with groups, polylines, points and free-form surfaces. Texture
//! coordinates, normals and materials are skipped when reading.

use crate::color::{display, palette};
use crate::error::{ReadError, clip};
use crate::mesh::{Group, Mesh};
use crate::model::{Model, NamedSurface};
use crate::obj_freeform::{self, FreeForm, Vertices};
use crate::obj_tags::{self, Tag};
use crate::polyline::{PIECES, points_of, points_on};
use crate::text_number::coordinate;
use geom_core::DVec3;
use std::collections::HashMap;
use std::fmt::Write;

/// Reads an OBJ file. Faces, lines and points share one list of vertices, in the order of the file.
/// B-spline and Bezier surfaces are surfaces with their trims; curves become polylines, exact ones
/// if they are of degree 1.
///
/// # Errors
/// [`ReadError::Text`] names the first line at fault.
pub fn read_obj(text: &str) -> Result<Model, ReadError> {
    let mut reader = Reader::default();
    reader.free_form.allow(text.len());
    let mut joined = String::new();
    for (k, line) in text.lines().enumerate() {
        // A backslash at the end continues the statement on the next line.
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
            continue;
        }
        if joined.is_empty() {
            reader.statement(line, k + 1)?;
        } else {
            joined.push_str(line);
            reader.statement(&joined, k + 1)?;
            joined.clear();
        }
    }
    reader.statement(&joined, text.lines().count())?;
    reader.finish()
}

#[derive(Default)]
struct Reader {
    mesh: Mesh,
    group: String,
    group_ids: HashMap<String, u32>,
    corners: Vec<u32>,
    /// Weights of the first vertices, up to the last one that has one.
    weights: Vec<f64>,
    free_form: obj_freeform::Reader,
    degree_one: bool,
    model: Model,
    /// Polylines in place of curves, apart from the vertices of the file.
    curves: Vec<Mesh>,
    /// Kinds of free-form geometry and tags that are not read, with the line of the first.
    unknown: Vec<(String, usize)>,
    /// Line of the last tag that names vertices.
    last_tag: usize,
}

impl Reader {
    fn statement(&mut self, line: &str, number: usize) -> Result<(), ReadError> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => self.vertex(words, number),
            Some("f") => self.face(words, number),
            Some("l") => self.line(words, number),
            Some("g" | "o") => {
                self.group = words.collect::<Vec<_>>().join(" ");
                Ok(())
            }
            Some("t") => self.tag(words, number),
            // A curve of degree 1 is the polyline of its control points, behind two parameters.
            Some("curv") if self.degree_one => self.line(words.skip(2), number),
            Some(keyword) => {
                let words: Vec<&str> = words.collect();
                if keyword == "deg" {
                    self.degree_one = words.first() == Some(&"1");
                }
                self.free_form(keyword, &words, number)
            }
            None => Ok(()),
        }
    }

    /// `t crease` and `t corner`; their vertices may come later, and are checked at the end.
    fn tag<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), ReadError> {
        match obj_tags::read(words, number)? {
            Tag::Crease(edge, sharpness) => {
                self.mesh.sharpness.edges.push((edge, sharpness));
                self.last_tag = number;
            }
            Tag::Corner(vertex, sharpness) => {
                self.mesh.sharpness.vertices.push((vertex, sharpness));
                self.last_tag = number;
            }
            Tag::Unknown(name) => {
                let name = format!("tag {name}");
                if !self.unknown.iter().any(|(known, _)| *known == name) {
                    self.unknown.push((name, number));
                }
            }
        }
        Ok(())
    }

    fn free_form(&mut self, keyword: &str, words: &[&str], number: usize) -> Result<(), ReadError> {
        let vertices = Vertices { positions: &self.mesh.positions, weights: &self.weights };
        match self.free_form.statement(keyword, words, number, vertices)? {
            None | Some(FreeForm::Planar) => {}
            Some(FreeForm::Surface(surface, trim)) => {
                let named = NamedSurface::new(self.group.clone(), surface);
                self.model.surfaces.push(NamedSurface { trim, ..named });
            }
            Some(FreeForm::Curve(curve)) => {
                self.free_form.spend(points_of(&curve), number)?;
                let mut mesh = Mesh { name: self.group.clone(), ..Mesh::default() };
                mesh.push_polyline(&points_on(&curve));
                self.curves.push(mesh);
            }
            Some(FreeForm::Unknown(kind)) => {
                if !self.unknown.iter().any(|(known, _)| *known == kind) {
                    self.unknown.push((kind, number));
                }
            }
        }
        Ok(())
    }

    fn vertex<'a>(
        &mut self,
        mut words: impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), ReadError> {
        let mut xyz = [0.0_f64; 3];
        for (value, axis) in xyz.iter_mut().zip(["x", "y", "z"]) {
            let word = words.next().ok_or_else(|| {
                let what = format!("vertex without {axis}");
                ReadError::text(number, what, "a vertex needs three coordinates")
            })?;
            *value = coordinate(word, number)?;
        }
        if self.mesh.positions.len() >= u32::MAX as usize {
            return Err(ReadError::text(number, "more than 2^32 vertices", "split the file"));
        }
        self.mesh.positions.push(DVec3::from_array(xyz));
        // One number more is a weight, three are a colour.
        if let (Some(weight), None) = (words.next(), words.next()) {
            self.weights.resize(self.mesh.positions.len() - 1, 1.0);
            self.weights.push(coordinate(weight, number)?);
        }
        Ok(())
    }

    fn face<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), ReadError> {
        self.indices(words, number)?;
        let n = self.corners.len();
        if n < 3 {
            let what = format!("face with {n} corners");
            return Err(ReadError::text(number, what, "a face needs at least 3"));
        }
        if let Some(twice) = repeated(&self.corners) {
            let what = format!("the face visits vertex {} twice", twice + 1);
            return Err(ReadError::text(number, what, "drop or split the face"));
        }
        self.mesh.faces.push(&self.corners);
        let next = self.group_ids.len() as u32;
        let id = match self.group_ids.get(&self.group) {
            Some(&id) => id,
            None => {
                self.group_ids.insert(self.group.clone(), next);
                self.mesh.groups.push(Group::new(self.group.clone()));
                next
            }
        };
        self.mesh.face_groups.push(id);
        Ok(())
    }

    fn line<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), ReadError> {
        self.indices(words, number)?;
        if self.corners.len() < 2 {
            let what = format!("line with {} point", self.corners.len());
            return Err(ReadError::text(number, what, "a line needs at least 2"));
        }
        self.mesh.lines.push(&self.corners);
        Ok(())
    }

    /// Vertex numbers into `corners`, counted from 0; negative ones count back from the last.
    fn indices<'a>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        number: usize,
    ) -> Result<(), ReadError> {
        self.corners.clear();
        let count = self.mesh.positions.len();
        for word in words {
            let vertex = word.split('/').next().unwrap_or_default();
            let index = vertex.parse::<i64>().ok().and_then(|i| match i {
                1.. => usize::try_from(i - 1).ok(),
                0 => None,
                _ => {
                    usize::try_from(i.unsigned_abs()).ok().and_then(|back| count.checked_sub(back))
                }
            });
            match index {
                Some(index) if index < count => self.corners.push(index as u32),
                _ => {
                    let what = format!("`{}` names no vertex", clip(word));
                    let mend = format!("{count} vertices come before this line");
                    return Err(ReadError::text(number, what, mend));
                }
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Model, ReadError> {
        let mesh = &mut self.mesh;
        if mesh.positions.is_empty() {
            let what = "the file has no vertex";
            return Err(ReadError::content(what, "export it again as polygons"));
        }
        let sharp = &mesh.sharpness;
        let named = sharp.edges.iter().flat_map(|(edge, _)| edge);
        let largest = named.chain(sharp.vertices.iter().map(|(v, _)| v)).max();
        if let Some(beyond) = largest.filter(|v| **v as usize >= mesh.positions.len()) {
            let what = format!("a tag names vertex {beyond}");
            let mend = format!("there are {}, counted from 0 in tags", mesh.positions.len());
            return Err(ReadError::text(self.last_tag, what, mend));
        }
        if let [only] = mesh.groups.as_slice() {
            // One group is no grouping; its name is the name of the object.
            mesh.name = only.name.clone();
            mesh.groups.clear();
            mesh.face_groups.clear();
        }
        let mut model = self.model;
        for (kind, line) in self.unknown {
            let what = match kind.strip_prefix("tag ") {
                Some(tag) => format!("the tag `{tag}` of a control mesh"),
                None => format!("free-form `{kind}` geometry"),
            };
            model.warnings.push(format!("line {line}: {what} is left out"));
        }
        if !self.curves.is_empty() {
            let count = self.curves.len();
            let what =
                format!("{count} curves became polylines with {PIECES} pieces per knot span");
            model.warnings.push(what);
        }
        // Vertices that only serve free-form geometry are no points of their own.
        let serves = self.mesh.faces.is_empty() && self.mesh.lines.is_empty();
        if !serves || (model.surfaces.is_empty() && self.curves.is_empty()) {
            model.meshes.push(self.mesh);
        }
        model.meshes.extend(self.curves);
        Ok(model)
    }
}

/// The first entry that occurs again, without quadratic cost for huge polygons.
fn repeated(corners: &[u32]) -> Option<u32> {
    if corners.len() <= 16 {
        let again = |&k: &usize| corners[..k].contains(&corners[k]);
        return (1..corners.len()).find(again).map(|k| corners[k]);
    }
    let mut sorted = corners.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}

/// OBJ text of several meshes, each an object (if named) with its groups; coordinates are written
/// so that they read back bit-equal.
#[must_use]
pub fn write_obj(meshes: &[Mesh]) -> String {
    let mut text = String::new();
    let mut base = 1;
    for mesh in meshes {
        write_mesh(&mut text, mesh, base);
        base += mesh.positions.len();
    }
    text
}

/// OBJ text as [`write_obj`] gives it that names a library of materials, and that library: one
/// material per group with its colour (display values, as programs expect them).
#[must_use]
pub fn write_obj_and_materials(meshes: &[Mesh], library: &str) -> [String; 2] {
    let mut materials = String::new();
    for mesh in meshes {
        for (g, group) in mesh.groups.iter().enumerate() {
            let [r, g, b] =
                group.color.unwrap_or_else(|| palette(g)).map(|c| display(f64::from(c)));
            let name = one_line(&group.name);
            let _ = writeln!(materials, "newmtl {name}\nKd {r:.4} {g:.4} {b:.4}");
        }
    }
    [format!("mtllib {}\n{}", one_line(library), write_obj(meshes)), materials]
}

fn write_mesh(text: &mut String, mesh: &Mesh, base: usize) {
    // Writing into a `String` cannot fail.
    if !mesh.name.is_empty() {
        let _ = writeln!(text, "o {}", one_line(&mesh.name));
    }
    for p in &mesh.positions {
        let _ = writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z);
    }
    let mut current = None;
    for (f, corners) in mesh.faces.iter().enumerate() {
        let group = mesh.face_group(f);
        if group != current {
            current = group;
            let name = group.and_then(|g| mesh.groups.get(g)).map_or("", |g| g.name.as_str());
            let name = one_line(name);
            let _ = writeln!(text, "g {name}");
            // One material per group, which programs give a colour of its own.
            if !name.is_empty() {
                let _ = writeln!(text, "usemtl {name}");
            }
        }
        indices(text, "f", corners, base);
    }
    for line in mesh.lines.iter() {
        indices(text, "l", line, base);
    }
    obj_tags::write(text, &mesh.sharpness, base - 1);
}

fn indices(text: &mut String, keyword: &str, list: &[u32], base: usize) {
    text.push_str(keyword);
    for &i in list {
        let _ = write!(text, " {}", i as usize + base);
    }
    text.push('\n');
}

/// A name must not break the line it stands on, nor steer the terminal it is shown in.
pub(crate) fn one_line(name: &str) -> String {
    let words = name.split_whitespace().collect::<Vec<_>>().join(" ");
    words.chars().map(|c| if c == '#' || c.is_control() { '_' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quads_groups_lines_and_negative_indices() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5 # half up\ng left\nf 1/1/1 2/2/2 -2//3 \\\n -1\n\
                    g right\nf 1 2 3\nl 1 3 -1\nvn 0 0 1\n";
        let model = read_obj(text).unwrap();
        let mesh = model.meshes[0].clone();
        assert_eq!(mesh.faces.iter().collect::<Vec<_>>(), [&[0, 1, 2, 3][..], &[0, 1, 2]]);
        assert_eq!(mesh.lines.get(0), [0, 2, 3]);
        assert_eq!(mesh.groups, [Group::new("left"), Group::new("right")]);
        assert_eq!(mesh.face_groups, [0, 1]);
        assert_eq!(mesh.positions[3], DVec3::new(0.0, 1.0, 0.5));
        assert!(model.warnings.is_empty());
        let written = write_obj(std::slice::from_ref(&mesh));
        assert!(written.contains("g left\nusemtl left\nf 1 2 3 4\ng right\nusemtl right\n"));
        let [with, materials] = write_obj_and_materials(std::slice::from_ref(&mesh), "a.mtl");
        assert_eq!(with, format!("mtllib a.mtl\n{written}"));
        assert!(materials.starts_with("newmtl left\nKd 0.0000 0.4470 0.6980\nnewmtl right\nKd "));
        assert_eq!(read_obj(&with).unwrap(), model);
        assert_eq!(read_obj(&written).unwrap(), model);
    }

    #[test]
    fn names_carry_no_control_characters() {
        let name = "a\0b\u{1b}[31m\r\nv 0 0 0\u{85}c\u{7f}";
        assert_eq!(one_line(name), "a_b_[31m v 0 0 0 c_");
        let named = Mesh { name: name.to_owned(), ..Mesh::default() };
        let text = write_obj(std::slice::from_ref(&named));
        assert_eq!(text, "o a_b_[31m v 0 0 0 c_\n");
        let ply = crate::write_ply(&[named], &crate::LengthUnit::default());
        assert!(ply.iter().take_while(|b| **b != 0).all(|b| *b == b'\n' || !b.is_ascii_control()));
        assert!(String::from_utf8_lossy(&ply).contains("comment name a_b_[31m v 0 0 0 c_\n"));
    }

    #[test]
    fn faults_name_line_and_mend() {
        let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        let cases = [
            (
                "f 1 2 99999999999\n",
                "line 4: `99999999999` names no vertex; 3 vertices come before this line",
            ),
            ("f -7 1 2\n", "line 4: `-7` names no vertex"),
            ("f 0 1 2\n", "line 4: `0` names no vertex"),
            ("f 1 1 1\n", "line 4: the face visits vertex 1 twice; drop or split the face"),
            ("f 1 2\n", "line 4: face with 2 corners; a face needs at least 3"),
            ("l 1\n", "line 4: line with 1 point"),
            ("v 0 nan 0\n", "line 4: `nan` is not a finite number"),
            ("v 0 1e999 0\n", "line 4: `1e999` is not a finite number"),
            ("v 0 1\n", "line 4: vertex without z; a vertex needs three coordinates"),
            ("f -9223372036854775808 1 2\n", "line 4: `-9223372036854775808` names no vertex"),
        ];
        for (line, want) in cases {
            let message = read_obj(&format!("{v}{line}")).unwrap_err().to_string();
            assert!(message.starts_with(want), "{line}: {message}");
        }
        assert!(read_obj("").unwrap_err().to_string().contains("no vertex"));
    }
}
