//! Writing: a table of layers and a table of objects, between the tables that must be there.

use super::brep_write::Brep;
use super::chunks::Chunks;
use super::codes::{
    AFTER_OBJECTS, ATTRIBUTES, BEFORE_LAYERS, BEFORE_OBJECTS, COMMENT, CUSTOM_UNIT, END_OF_FILE,
    END_OF_TABLE, LAYER, LAYER_CLASS, LAYERS, LIBRARY_VERSION, OBJECT, OBJECT_END, OBJECT_TYPE,
    OBJECTS, PROPERTIES, SETTINGS, UNITS, unit_number,
};
use super::mesh_write::{Part, color_bytes};
use crate::color::{field_colors, palette};
use crate::mesh::Mesh;
use crate::model::{Model, NamedSurface};
use crate::unit::LengthUnit;
use bspline::SplineError;
use geom_core::{BoundingBox, DVec3};
use std::collections::HashMap;

/// The first bytes: the format, and the version that Rhino 6 and later read.
const HEAD: &[u8; 32] = b"3D Geometry File Format       60";
const ABOUT: &[u8] = b"written by Umbilic\n\x1a\0";
/// The version of the library whose layouts are followed: 6.30, with 367 numbers for the days of
/// each year since 2000.
const FOLLOWED: u64 = 0x8000_0000 | 6 << 25 | 30 << 18 | (20 * 367 + 60) << 2;
/// Points this share of the size of the model apart are one vertex of a trim.
const SAME_POINT: f64 = 1e-7;
/// What programs may take for equal, as a share of the size of the model.
const TOLERANCE: f64 = 1e-5;
/// Layers without a colour of their own are black.
const BLACK: [f32; 3] = [0.0; 3];

/// Kinds of objects, by the numbers of the format.
#[derive(Clone, Copy)]
enum Kind {
    Points = 2,
    Curve = 4,
    Surface = 8,
    Brep = 16,
    Mesh = 32,
}

/// The model as a `.3dm` file of version 6, which Rhino 6 and later and programs on openNURBS
/// read. Surfaces are NURBS surfaces, trimmed ones faces with their curves; meshes keep their
/// polygons, colours and positions in double precision; polylines are curves, grids and loose
/// points clouds of points. Every group of a mesh is an object on a layer of its name and colour;
/// surfaces stand on the layer they name. Knots and the control points of polynomial splines are
/// exact; rational ones are stored times their weights, which costs the last bit of some.
///
/// # Errors
/// [`SplineError`] if the numbers of an extreme surface leave the range of `f64`.
pub fn write_3dm(model: &Model) -> Result<Vec<u8>, SplineError> {
    let size = size(model);
    let mut layers = Layers::default();
    let mut objects = Objects { file: Chunks::new(b""), count: 0 };
    for named in &model.surfaces {
        objects.surface(named, layers.of(&named.layer, "surfaces", None), SAME_POINT * size)?;
    }
    for mesh in &model.meshes {
        objects.mesh(mesh, &mut layers);
    }
    for grid in &model.grids {
        let layer = layers.of("", "points", None);
        objects.add(Kind::Points, &grid.name, layer, None, |file| file.point_cloud(&grid.points));
    }
    let mut file = Chunks::new(HEAD);
    file.chunk(COMMENT, |file| file.raw(ABOUT));
    file.table(PROPERTIES, |file| file.short(LIBRARY_VERSION, FOLLOWED));
    file.table(SETTINGS, |file| file.units(&model.unit, size));
    BEFORE_LAYERS.into_iter().for_each(|table| file.table(table, |_| ()));
    file.table(LAYERS, |file| layers.write(file));
    BEFORE_OBJECTS.into_iter().for_each(|table| file.table(table, |_| ()));
    file.table(OBJECTS, |file| file.raw(&objects.file.finish()));
    file.table(AFTER_OBJECTS, |_| ());
    // The end states the length of the file, itself included.
    let length = file.len() + 20;
    file.chunk(END_OF_FILE, |file| file.raw(&(length as u64).to_le_bytes()));
    Ok(file.finish())
}

impl Chunks {
    fn table(&mut self, code: u32, fill: impl FnOnce(&mut Self)) {
        self.chunk(code, |file| {
            fill(file);
            file.short(END_OF_TABLE, 0);
        });
    }

    fn units(&mut self, unit: &LengthUnit, size: f64) {
        self.chunk(UNITS, |file| {
            let number = unit_number(unit);
            let is_custom = number == CUSTOM_UNIT;
            file.i32(102);
            file.i32(number);
            file.f64(10.0_f64.powf((TOLERANCE * size).log10().floor()));
            // One degree between directions, one percent between lengths.
            file.f64(std::f64::consts::PI / 180.0);
            file.f64(0.01);
            // Lengths are shown as decimal numbers with this many digits.
            file.i32(0);
            file.i32(3);
            file.f64(if is_custom { unit.metres() } else { 1.0 });
            file.text(&if is_custom { unit.to_string() } else { String::new() });
        });
    }
}

/// Layers in the order of their first use.
#[derive(Default)]
struct Layers {
    list: Vec<(String, Option<[f32; 3]>)>,
    by_name: HashMap<String, usize>,
}

impl Layers {
    /// The number of a layer; `otherwise` is its name where there is none.
    fn of(&mut self, name: &str, otherwise: &str, color: Option<[f32; 3]>) -> usize {
        // Two colons would make a layer within another one.
        let name = crate::obj::one_line(name).replace("::", ":");
        let name = if name.is_empty() { otherwise.to_owned() } else { name };
        let k = *self.by_name.entry(name).or_insert_with_key(|name| {
            self.list.push((name.clone(), None));
            self.list.len() - 1
        });
        self.list[k].1 = self.list[k].1.or(color);
        k
    }

    fn write(&self, file: &mut Chunks) {
        for (k, (name, color)) in self.list.iter().enumerate() {
            file.chunk(LAYER, |file| {
                file.object(&LAYER_CLASS, |file| {
                    file.u8(0x16);
                    file.i32(0);
                    file.int(k);
                    // Neither a number for IGES nor a material.
                    file.i32s(&[-1, -1, 0]);
                    file.raw(&color_bytes(color.unwrap_or(BLACK)));
                    file.i32(0);
                    file.f64s(&[0.0, 1.0]);
                    file.text(name);
                    file.u8(1);
                    // A continuous line, printed in the colour of the layer; not locked.
                    file.i32(-1);
                    file.raw(&[0xFF; 4]);
                    file.f64(0.0);
                    file.u8(0);
                    file.raw(&identifier(name.as_bytes(), k));
                    // At the top of the tree, unfolded.
                    file.zeros(16);
                    file.u8(1);
                });
            });
        }
    }
}

/// Object records so far.
struct Objects {
    file: Chunks,
    count: usize,
}

impl Objects {
    fn add(
        &mut self,
        kind: Kind,
        name: &str,
        layer: usize,
        color: Option<[f32; 3]>,
        write: impl FnOnce(&mut Chunks),
    ) {
        let count = self.count;
        self.count += 1;
        self.file.chunk(OBJECT, |file| {
            file.short(OBJECT_TYPE, kind as u64);
            let start = file.len();
            write(file);
            let id = identifier(file.since(start), count);
            file.chunk(ATTRIBUTES, |file| {
                file.u8(0x20);
                file.raw(&id);
                file.int(layer);
                if !name.is_empty() {
                    file.u8(1);
                    file.text(name);
                }
                if let Some(color) = color {
                    file.u8(6);
                    file.raw(&color_bytes(color));
                    // The colour is that of the object, not of the layer.
                    file.u8(13);
                    file.u8(1);
                }
                file.u8(0);
            });
            file.short(OBJECT_END, 0);
        });
    }

    fn surface(
        &mut self,
        named: &NamedSurface,
        layer: usize,
        tolerance: f64,
    ) -> Result<(), SplineError> {
        let NamedSurface { name, surface, trim, color, .. } = named;
        match trim {
            None => {
                self.add(Kind::Surface, name, layer, *color, |file| file.nurbs_surface(surface));
            }
            Some(trim) => {
                let brep = Brep::new(surface, trim, tolerance)?;
                self.add(Kind::Brep, name, layer, *color, |file| brep.write(file));
            }
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: &Mesh, layers: &mut Layers) {
        for group in 0..mesh.groups.len().max(1) {
            let part = part(mesh, group);
            if part.faces.is_empty() {
                continue;
            }
            let (layer, name) = match mesh.groups.get(group) {
                None => (layers.of(&mesh.name, "meshes", None), mesh.name.clone()),
                Some(named) => {
                    let color = named.color.unwrap_or_else(|| palette(group));
                    let layer = layers.of(&named.name, &format!("group {group}"), Some(color));
                    (layer, named.name.clone())
                }
            };
            self.add(Kind::Mesh, &name, layer, None, |file| file.mesh(&part));
        }
        for k in 0..mesh.lines.len() {
            let points: Vec<DVec3> = mesh.polyline(k).collect();
            let layer = layers.of(&mesh.name, "curves", None);
            self.add(Kind::Curve, &mesh.name, layer, None, |file| file.polyline(&points));
        }
        if mesh.faces.is_empty() && mesh.lines.is_empty() && !mesh.positions.is_empty() {
            let layer = layers.of("", "points", None);
            let points = &mesh.positions;
            self.add(Kind::Points, &mesh.name, layer, None, |file| file.point_cloud(points));
        }
    }
}

/// The faces of one group over the vertices they use, in the order of the mesh.
fn part(mesh: &Mesh, group: usize) -> Part {
    let colors = if mesh.colors.is_empty() { field_colors(mesh) } else { mesh.colors.clone() };
    let mut numbers = vec![u32::MAX; mesh.positions.len()];
    let ours = |f: &usize| mesh.face_group(*f).is_none_or(|g| g == group);
    let faces: Vec<usize> = (0..mesh.faces.len()).filter(ours).collect();
    // Marked first and numbered then, so that vertices keep their order.
    faces.iter().flat_map(|f| mesh.faces.get(*f)).for_each(|&v| numbers[v as usize] = 0);
    let mut part = Part::default();
    for (v, number) in numbers.iter_mut().enumerate().filter(|(_, n)| **n == 0) {
        *number = part.positions.len() as u32;
        part.positions.push(mesh.positions[v]);
        part.normals.extend(mesh.normals.get(v));
        part.colors.extend(colors.get(v));
    }
    let renumbered =
        |f: usize| -> Vec<u32> { mesh.faces.get(f).iter().map(|&v| numbers[v as usize]).collect() };
    part.faces = faces.into_iter().map(renumbered).collect();
    part
}

/// The diagonal of the box around everything; 1 without extent.
fn size(model: &Model) -> f64 {
    let surfaces = model.surfaces.iter().flat_map(|s| s.surface.control_points());
    let meshes = model.meshes.iter().flat_map(|m| &m.positions);
    let grids = model.grids.iter().flat_map(|g| &g.points);
    let bounds = BoundingBox::of(surfaces.chain(meshes).chain(grids).copied());
    let size = bounds.map_or(1.0, BoundingBox::diagonal);
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}

/// An identifier that only depends on the content and its number (RFC 9562, version 8), by the
/// hash of Fowler, Noll and Vo.
fn identifier(content: &[u8], number: usize) -> [u8; 16] {
    let hash = |seed: u64, bytes: &[u8]| {
        let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3);
        bytes.iter().fold(seed, step)
    };
    let first = hash(0xCBF2_9CE4_8422_2325, content);
    let second = hash(first, &(number as u64).to_le_bytes());
    let mut id = [0; 16];
    id[..8].copy_from_slice(&first.to_le_bytes());
    id[8..].copy_from_slice(&second.to_le_bytes());
    id[7] = 0x80 | id[7] & 0x0F;
    id[8] = 0x80 | id[8] & 0x3F;
    id
}
