//! Meshes and polylines as openNURBS writes them.

use super::chunks::Chunks;
use super::codes::{MESH, POINT_CLOUD, POLYLINE_CURVE};
use crate::color::display;
use crate::mesh::IndexLists;
use crate::triangulate::triangulate;
use geom_core::{BoundingBox, DVec3};

/// What stands for an interval that is not set.
const UNSET: f64 = -1.23432101234321e308;

/// The part of a mesh that becomes one object: faces over vertices of its own.
#[derive(Default)]
pub(super) struct Part {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) colors: Vec<[f32; 3]>,
    pub(super) faces: IndexLists,
}

impl Chunks {
    /// A mesh; faces with more than four corners are triangles that know their polygon.
    pub(super) fn mesh(&mut self, part: &Part) {
        let (corners, polygons) = triangles_and_quads(part);
        let count = part.positions.len();
        self.object(&MESH, |file| {
            file.u8(0x38);
            file.int(count);
            file.int(corners.len());
            file.f64s(&[UNSET; 8]);
            file.f64s(&[0.0; 2]);
            file.single_bounds(&part.positions);
            // The boxes of the normals and of the texture, not known.
            file.f32s(&[1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
            file.f32s(&[1.0, 1.0, -1.0, -1.0]);
            file.i32(-1);
            // Neither meshing parameters nor statistics of curvature.
            file.zeros(5);
            file.corners(&corners, count);
            file.singles(&part.positions);
            file.singles(&part.normals);
            // Neither texture coordinates nor curvatures.
            file.buffer(&[]);
            file.buffer(&[]);
            let colors: Vec<u8> = part.colors.iter().flat_map(|c| color_bytes(*c)).collect();
            file.buffer(&colors);
            file.i32(0);
            // No mapping of a texture, and no parameters of a surface.
            file.zeros(16);
            file.buffer(&[]);
            file.mapping_tag();
            // Whether manifold, oriented, solid: to be found out.
            file.zeros(3);
            file.polygons(&polygons);
            file.u8(1);
            file.versioned(|file| {
                file.int(count);
                let doubles = part.positions.iter().flat_map(|p| p.to_array());
                let doubles: Vec<u8> = doubles.flat_map(f64::to_le_bytes).collect();
                file.buffer(&doubles);
            });
            file.bounds(part.positions.iter().copied());
        });
    }

    fn single_bounds(&mut self, points: &[DVec3]) {
        let zero = BoundingBox { min: DVec3::ZERO, max: DVec3::ZERO };
        let bounds = BoundingBox::of(points.iter().copied()).unwrap_or(zero);
        // Rounding must not leave a point outside.
        let floor =
            |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
        let ceil = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
        self.f32s(&bounds.min.to_array().map(floor));
        self.f32s(&bounds.max.to_array().map(ceil));
    }

    fn corners(&mut self, corners: &[[u32; 4]], vertices: usize) {
        let flat = corners.iter().flatten();
        match vertices {
            0..=0xFF => {
                self.i32(1);
                flat.for_each(|i| self.u8(*i as u8));
            }
            0x100..=0xFFFF => {
                self.i32(2);
                flat.for_each(|i| self.raw(&(*i as u16).to_le_bytes()));
            }
            _ => {
                self.i32(4);
                flat.for_each(|i| self.u32(*i));
            }
        }
    }

    fn singles(&mut self, vectors: &[DVec3]) {
        let numbers = vectors.iter().flat_map(|p| p.as_vec3().to_array());
        let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        self.buffer(&bytes);
    }

    /// The texture mapping of a mesh that has none.
    fn mapping_tag(&mut self) {
        self.chunk(super::codes::ANONYMOUS, |file| {
            file.i32s(&[1, 1]);
            file.zeros(16);
            file.i32(0);
            for k in 0..16 {
                file.f64(if k % 5 == 0 { 1.0 } else { 0.0 });
            }
            file.i32(0);
        });
    }

    fn polygons(&mut self, polygons: &[Polygon<'_>]) {
        self.u8(u8::from(!polygons.is_empty()));
        if polygons.is_empty() {
            return;
        }
        self.versioned(|file| {
            file.int(polygons.len());
            for polygon in polygons {
                file.int(polygon.corners.len());
                file.int(polygon.faces.len());
                polygon.corners.iter().for_each(|i| file.u32(*i));
                polygon.faces.clone().for_each(|f| file.int(f));
            }
        });
    }

    /// A polyline over the parameters 0, 1, 2 and so on.
    pub(super) fn polyline(&mut self, points: &[DVec3]) {
        self.object(&POLYLINE_CURVE, |file| {
            file.u8(0x10);
            file.int(points.len());
            points.iter().for_each(|p| file.point(*p));
            let parameters: Vec<f64> = (0..points.len()).map(|k| k as f64).collect();
            file.reals(&parameters);
            file.i32(3);
        });
    }

    /// Points without an order.
    pub(super) fn point_cloud(&mut self, points: &[DVec3]) {
        self.object(&POINT_CLOUD, |file| {
            file.u8(0x10);
            file.int(points.len());
            points.iter().for_each(|p| file.point(*p));
            // The plane of the world, with its equation.
            for v in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::Z] {
                file.point(v);
            }
            file.f64(0.0);
            file.bounds(points.iter().copied());
            file.i32(0);
        });
    }
}

/// A polygon of more than four corners, with the triangles it is cut into.
struct Polygon<'a> {
    corners: &'a [u32],
    faces: std::ops::Range<usize>,
}

/// Corners of triangles (the last one twice) and quads.
fn triangles_and_quads(part: &Part) -> (Vec<[u32; 4]>, Vec<Polygon<'_>>) {
    let (mut corners, mut polygons) = (Vec::with_capacity(part.faces.len()), Vec::new());
    let mut triangles = Vec::new();
    for face in part.faces.iter() {
        match *face {
            [a, b, c] => corners.push([a, b, c, c]),
            [a, b, c, d] => corners.push([a, b, c, d]),
            _ => {
                triangles.clear();
                triangulate(&part.positions, face, &mut triangles);
                let first = corners.len();
                corners.extend(triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2], t[2]]));
                polygons.push(Polygon { corners: face, faces: first..corners.len() });
            }
        }
    }
    (corners, polygons)
}

/// A colour as files have it: display values, opaque.
pub(super) fn color_bytes(linear: [f32; 3]) -> [u8; 4] {
    let [r, g, b] = linear.map(|x| (255.0 * display(f64::from(x)).clamp(0.0, 1.0)).round() as u8);
    [r, g, b, 0]
}
