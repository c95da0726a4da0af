//! Reading: the unit, the layers, and the objects with what they are called.

use super::brep_read::brep_data;
use super::budget::Budget;
use super::codes::{
    ATTRIBUTES, BREP, CUSTOM_UNIT, ClassId, LAYER, LAYERS, MESH, OBJECT, OBJECTS, POINT,
    POINT_CLOUD, RARE_UNITS, SETTINGS, UNITS, class_name, numbered_unit,
};
use super::cursor::Cursor;
use super::curve_read::{Curve, curve_object, is_curve};
use super::lost::Lost;
use super::mesh_read::{cloud_data, mesh_data};
use super::surface_read::{is_surface, surface_data};
use crate::color::linear;
use crate::error::ReadError;
use crate::mesh::Mesh;
use crate::model::{Model, NamedSurface};
use crate::polyline::{PIECES, is_polyline, points_of, points_on};
use crate::unit::LengthUnit;
use std::collections::BTreeMap;

const HEAD: &[u8] = b"3D Geometry File Format ";
/// The head with the version in it.
const HEAD_LENGTH: usize = 32;
/// Versions before this one have chunks of another kind.
const OLDEST: u32 = 50;
/// The colour is that of the object.
const OWN_COLOR: u8 = 1;
/// The object is a part of a block.
const IN_BLOCK: u8 = 3;

/// Reads a `.3dm` file of Rhino 5 or later: splines, planes, surfaces of revolution and sums of
/// curves, bare or as the faces of a Brep with their trims, meshes and points. Curves become
/// polylines: exact ones for lines and polylines, points on the others. Names, layers, colours and
/// the unit are kept. What is left out stands in the warnings by kind and number.
///
/// # Errors
/// [`ReadError`] names the byte of a file that is damaged or of another kind.
pub fn read_3dm(bytes: &[u8]) -> Result<Model, ReadError> {
    let version = bytes.get(HEAD.len()..HEAD_LENGTH).filter(|_| bytes.starts_with(HEAD));
    let version = version.and_then(|v| std::str::from_utf8(v).ok()?.trim().parse::<u32>().ok());
    match version {
        None => return Err(ReadError::binary(0, "not a 3DM file", "save it with Rhino")),
        Some(old) if old < OLDEST => {
            let what = format!("a 3DM file of version {old}");
            return Err(ReadError::binary(24, what, "save it as Rhino 5 or later"));
        }
        Some(_) => {}
    }
    let mut file = Cursor::new(bytes, HEAD_LENGTH);
    let mut reader = Reader {
        model: Model::default(),
        layers: BTreeMap::new(),
        budget: Budget::new(bytes.len()),
        left_out: BTreeMap::new(),
        unsound: BTreeMap::new(),
        sampled: 0,
    };
    while !file.is_at_end() {
        let mut table = file.chunk()?;
        match table.code {
            SETTINGS => reader.each(&mut table.content, UNITS, Reader::unit)?,
            LAYERS => reader.each(&mut table.content, LAYER, Reader::layer)?,
            OBJECTS => reader.each(&mut table.content, OBJECT, Reader::object)?,
            _ => {}
        }
    }
    reader.finish()
}

struct Reader {
    model: Model,
    /// Names by number.
    layers: BTreeMap<usize, String>,
    budget: Budget,
    left_out: BTreeMap<&'static str, usize>,
    /// Numbers of objects, with the first reason.
    unsound: BTreeMap<&'static str, (usize, String)>,
    sampled: usize,
}

/// What goes with the geometry of an object.
#[derive(Default)]
struct Attributes {
    name: String,
    layer: Option<usize>,
    color: Option<[f32; 3]>,
    in_block: bool,
}

impl Reader {
    fn each(
        &mut self,
        table: &mut Cursor<'_>,
        code: u32,
        read: impl Fn(&mut Self, &mut Cursor<'_>) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        while !table.is_at_end() {
            let mut chunk = table.chunk()?;
            if chunk.code == code {
                read(self, &mut chunk.content)?;
            }
        }
        Ok(())
    }

    fn unit(&mut self, data: &mut Cursor<'_>) -> Result<(), ReadError> {
        let version = data.i32()?;
        let number = data.i32()?;
        if version < 102 || number != CUSTOM_UNIT {
            let rare = RARE_UNITS.iter().find(|(n, ..)| *n == number);
            self.model.unit = numbered_unit(number)
                .or_else(|| rare.map(|(_, name, metres)| LengthUnit::from_metres(name, *metres)))
                .unwrap_or_default();
            return Ok(());
        }
        // Tolerances, and how lengths are shown.
        data.take(3 * 8 + 2 * 4)?;
        let metres = data.f64()?;
        let name = data.text()?;
        if metres > 0.0 && metres.is_finite() {
            let name = if name.is_empty() { "unit" } else { &name };
            self.model.unit = LengthUnit::from_metres(name, metres);
        }
        Ok(())
    }

    fn layer(&mut self, record: &mut Cursor<'_>) -> Result<(), ReadError> {
        let (_, mut data) = record.object()?;
        data.version()?;
        data.i32()?;
        let index = data.index()?;
        // Numbers for IGES and the material, the colour, and what is out of use.
        data.take(3 * 4 + 4 + 4 + 16)?;
        let name = data.text()?;
        if let Some(index) = index {
            self.layers.insert(index, name);
        }
        Ok(())
    }

    fn object(&mut self, record: &mut Cursor<'_>) -> Result<(), ReadError> {
        let mut geometry = None;
        let mut attributes = Attributes::default();
        while !record.is_at_end() {
            let mut start = record.clone();
            let chunk = record.chunk()?;
            match chunk.code {
                super::codes::CLASS => {
                    let whole = start.clone();
                    let (class, data) = start.object()?;
                    geometry = Some((class, data, whole));
                }
                ATTRIBUTES => attributes = attributes_of(chunk.content)?,
                _ => {}
            }
        }
        let Some((class, data, whole)) = geometry else { return Ok(()) };
        if attributes.in_block {
            *self.left_out.entry("part of a block").or_default() += 1;
            return Ok(());
        }
        match self.geometry(&class, data, whole, &attributes) {
            Ok(()) => Ok(()),
            Err(lost) => self.lose(lost, class_of(&class)),
        }
    }

    fn geometry(
        &mut self,
        class: &ClassId,
        mut data: Cursor<'_>,
        mut whole: Cursor<'_>,
        attributes: &Attributes,
    ) -> Result<(), Lost> {
        if is_surface(class) {
            let surface = surface_data(class, data)?.spline;
            self.push_surface(attributes, NamedSurface::new("", surface));
        } else if is_curve(class) {
            let curve = curve_object(&mut whole, 0)?;
            self.push_curve(attributes, &curve, &whole)?;
        } else {
            match *class {
                BREP => {
                    for face in brep_data(data, &mut self.budget)? {
                        match face {
                            Ok(face) => {
                                let trim = face.trim;
                                let named = NamedSurface::new("", face.surface);
                                self.push_surface(attributes, NamedSurface { trim, ..named });
                            }
                            Err(lost) => self.lose(lost, "face")?,
                        }
                    }
                }
                MESH => {
                    let mesh = mesh_data(data, &mut self.budget)?;
                    self.push_mesh(attributes, mesh);
                }
                POINT_CLOUD => self.push_mesh(attributes, cloud_data(data)?),
                POINT => {
                    data.version()?;
                    let at = data.point()?;
                    if !at.is_finite() {
                        return Err(Lost::Unsound("a point that is not finite".into()));
                    }
                    self.push_mesh(attributes, Mesh { positions: vec![at], ..Mesh::default() });
                }
                _ => return Err(Lost::Kind(class_name(class))),
            }
        }
        Ok(())
    }

    fn lose(&mut self, lost: Lost, what: &'static str) -> Result<(), ReadError> {
        match lost {
            Lost::Damaged(error) => return Err(error),
            Lost::Kind(kind) => *self.left_out.entry(kind).or_default() += 1,
            Lost::Unsound(reason) => self.unsound.entry(what).or_insert((0, reason)).0 += 1,
        }
        Ok(())
    }

    fn layer_of(&self, attributes: &Attributes) -> String {
        attributes.layer.and_then(|k| self.layers.get(&k)).cloned().unwrap_or_default()
    }

    fn push_surface(&mut self, attributes: &Attributes, surface: NamedSurface) {
        let (name, layer) = (attributes.name.clone(), self.layer_of(attributes));
        let color = attributes.color;
        self.model.surfaces.push(NamedSurface { name, layer, color, ..surface });
    }

    fn push_mesh(&mut self, attributes: &Attributes, mesh: Mesh) {
        let layer = self.layer_of(attributes);
        let name = if attributes.name.is_empty() { layer } else { attributes.name.clone() };
        self.model.meshes.push(Mesh { name, ..mesh });
    }

    fn push_curve(
        &mut self,
        attributes: &Attributes,
        curve: &Curve,
        at: &Cursor<'_>,
    ) -> Result<(), Lost> {
        let spline = curve.whole()?;
        self.budget.spend(points_of(&spline), at)?;
        self.sampled += usize::from(!is_polyline(&spline));
        let mut mesh = Mesh::default();
        mesh.push_polyline(&points_on(&spline));
        self.push_mesh(attributes, mesh);
        Ok(())
    }

    fn finish(mut self) -> Result<Model, ReadError> {
        let with_rhino = "open the file with rhino3dm in Python or with Rhino and turn them into NURBS surfaces or meshes";
        let warnings = &mut self.model.warnings;
        if !self.left_out.is_empty() {
            let kinds: Vec<String> =
                self.left_out.iter().map(|(kind, n)| counted(*n, kind)).collect();
            warnings.push(format!("left out: {}; {with_rhino}", kinds.join(", ")));
        }
        for (what, (count, reason)) in &self.unsound {
            warnings.push(format!(
                "left out: {} that cannot be read ({reason})",
                counted(*count, what)
            ));
        }
        if self.sampled > 0 {
            let curves = counted(self.sampled, "curve");
            warnings.push(format!("{curves} became polylines with {PIECES} pieces per knot span"));
        }
        let Model { surfaces, meshes, .. } = &self.model;
        if surfaces.is_empty() && meshes.is_empty() {
            let what = match self.model.warnings.first() {
                Some(warning) => format!("the file has no surface, mesh or curve ({warning})"),
                None => "the file has no surface, mesh or curve".to_owned(),
            };
            return Err(ReadError::content(what, "save it with NURBS surfaces or meshes"));
        }
        Ok(self.model)
    }
}

fn counted(n: usize, what: &str) -> String {
    match n {
        1 => format!("1 {what}"),
        n if what.ends_with("block") => format!("{n} {}", what.replacen("part", "parts", 1)),
        n => format!("{n} {what}s"),
    }
}

/// The name of a class whose objects are read.
fn class_of(class: &ClassId) -> &'static str {
    match *class {
        MESH => "mesh object",
        BREP => "polysurface",
        _ if is_surface(class) => "surface",
        _ if is_curve(class) => "curve",
        _ => "object",
    }
}

/// Name, layer and colour; the items come in rising order, each with its number before it.
fn attributes_of(mut data: Cursor<'_>) -> Result<Attributes, ReadError> {
    let mut attributes = Attributes::default();
    let (major, _) = data.version()?;
    if major != 2 {
        return Ok(attributes);
    }
    data.id()?;
    attributes.layer = data.index()?;
    let mut color = None;
    while !data.is_at_end() {
        match data.u8()? {
            1 => attributes.name = data.text()?,
            2 => drop(data.text()?),
            // Linetype, material, density of wires.
            3 | 4 | 10 => drop(data.i32()?),
            5 => _ = data.chunk()?,
            6 => {
                let rgb = data.take(4)?;
                color = Some([rgb[0], rgb[1], rgb[2]]);
            }
            7 => drop(data.take(4)?),
            8 => drop(data.f64()?),
            9 | 11 => drop(data.u8()?),
            12 => attributes.in_block = data.u8()? & 15 == IN_BLOCK,
            13 => {
                if data.u8()? == OWN_COLOR {
                    let light = |x: u8| linear(f64::from(x) / 255.0) as f32;
                    attributes.color = Some(color.unwrap_or_default().map(light));
                }
                break;
            }
            _ => break,
        }
    }
    Ok(attributes)
}
