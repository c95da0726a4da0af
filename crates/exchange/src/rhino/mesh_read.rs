//! Meshes and clouds of points.

use super::budget::Budget;
use super::cursor::Cursor;
use super::lost::Lost;
use crate::color::linear;
use crate::mesh::{IndexLists, Mesh};
use geom_core::DVec3;

/// The data of a mesh of version 3.
pub(super) fn mesh_data(mut data: Cursor<'_>, budget: &mut Budget) -> Result<Mesh, Lost> {
    let (major, minor) = data.version()?;
    if major != 3 {
        return Err(Lost::Unsound(format!("a mesh of version {major}")));
    }
    let count = data.count(0)?;
    let faces = data.count(4)?;
    // Domains and scales of textures and boxes.
    data.take(10 * 8 + 16 * 4)?;
    data.i32()?;
    for _ in 0..5 {
        // How the mesh was made, and statistics.
        if data.u8()? != 0 {
            data.chunk()?;
        }
    }
    budget.spend(faces, &data)?;
    let corners = corners(&mut data, faces, count)?;
    let mut mesh = Mesh::default();
    if count > 0 {
        budget.spend(3 * count, &data)?;
        let positions =
            data.buffer(12 * count)?.ok_or_else(|| data.error("a mesh without points"))?;
        mesh.positions = singles(&positions);
        mesh.normals = data.buffer(12 * count)?.map(|b| singles(&b)).unwrap_or_default();
        // Texture coordinates and curvatures.
        data.skip_buffer()?;
        data.skip_buffer()?;
        let color = |c: &[u8]| [c[0], c[1], c[2]].map(|x| linear(f64::from(x) / 255.0) as f32);
        let colors = data.buffer(4 * count)?.unwrap_or_default();
        mesh.colors = colors.chunks_exact(4).map(color).collect();
    }
    let mut polygons = Vec::new();
    if minor >= 2 {
        data.i32()?;
    }
    if minor >= 3 {
        data.id()?;
        if count > 0 {
            data.skip_buffer()?;
        }
    }
    if minor >= 4 {
        data.chunk()?;
    }
    if minor >= 5 {
        data.take(3)?;
    }
    if minor >= 6 && data.u8()? != 0 {
        polygons = read_polygons(&mut data.versioned()?, faces, count)?;
    }
    if minor >= 7 && data.u8()? != 0 {
        let mut doubles = data.versioned()?;
        let found = doubles.count(0)?;
        if found == count && count > 0 {
            budget.spend(count, &data)?;
            let bytes = doubles.buffer(24 * count)?;
            let bytes = bytes.ok_or_else(|| data.error("a mesh without its points"))?;
            mesh.positions = bytes.chunks_exact(24).map(double).collect();
        }
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(Lost::Unsound("a mesh with a point that is not finite".into()));
    }
    mesh.faces = faces_of(&corners, &polygons);
    Ok(mesh)
}

fn corners(data: &mut Cursor<'_>, faces: usize, vertices: usize) -> Result<Vec<[u32; 4]>, Lost> {
    let width = data.i32()?;
    let number = |b: &[u8]| b.iter().rev().fold(0, |n: u32, byte| n << 8 | u32::from(*byte));
    let width = match width {
        1 | 2 | 4 => width as usize,
        _ if faces == 0 => return Ok(Vec::new()),
        _ => return Err(data.error(format!("corners of {width} bytes")).into()),
    };
    let bytes = data.take(faces.saturating_mul(4 * width))?;
    let corners: Vec<[u32; 4]> = bytes
        .chunks_exact(4 * width)
        .map(|face| [0, 1, 2, 3].map(|k| number(&face[k * width..(k + 1) * width])))
        .collect();
    match corners.iter().flatten().find(|i| **i as usize >= vertices) {
        None => Ok(corners),
        Some(wrong) => Err(data.error(format!("a face names vertex {wrong} of {vertices}")).into()),
    }
}

/// A polygon with the triangles and quads it is made of.
struct Polygon {
    corners: Vec<u32>,
    faces: Vec<usize>,
}

fn read_polygons(
    data: &mut Cursor<'_>,
    faces: usize,
    vertices: usize,
) -> Result<Vec<Polygon>, Lost> {
    let count = data.count(4)?;
    let mut polygons = Vec::new();
    for _ in 0..count {
        let corners = data.count(4)?;
        if corners == 0 {
            continue;
        }
        let parts = data.count(4)?;
        let corners = (0..corners).map(|_| data.u32()).collect::<Result<Vec<_>, _>>()?;
        let parts = (0..parts).map(|_| data.u32()).collect::<Result<Vec<_>, _>>()?;
        let known = corners.iter().all(|v| (*v as usize) < vertices);
        if !known || parts.iter().any(|f| *f as usize >= faces) {
            return Err(data.error("a polygon names what the mesh does not have").into());
        }
        polygons.push(Polygon { corners, faces: parts.iter().map(|f| *f as usize).collect() });
    }
    Ok(polygons)
}

/// Triangles, quads, and the polygons in place of their first parts.
fn faces_of(corners: &[[u32; 4]], polygons: &[Polygon]) -> IndexLists {
    const NOBODY: u32 = u32::MAX;
    let mut owner = vec![NOBODY; corners.len()];
    for (k, polygon) in polygons.iter().enumerate() {
        polygon.faces.iter().for_each(|f| owner[*f] = k as u32);
    }
    let mut done = vec![false; polygons.len()];
    let mut faces = IndexLists::default();
    for (face, owner) in corners.iter().zip(owner) {
        if owner != NOBODY {
            // A polygon stands where its first part stood.
            let polygon = owner as usize;
            if !std::mem::replace(&mut done[polygon], true) {
                faces.push(&polygons[polygon].corners);
            }
        } else if face[2] == face[3] {
            faces.push(&face[..3]);
        } else {
            faces.push(face);
        }
    }
    faces
}

fn singles(bytes: &[u8]) -> Vec<DVec3> {
    let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let point = |b: &[u8]| DVec3::new(number(b), number(&b[4..]), number(&b[8..]));
    bytes.chunks_exact(12).map(point).collect()
}

fn double(bytes: &[u8]) -> DVec3 {
    let number = |k: usize| {
        let mut raw = [0; 8];
        raw.copy_from_slice(&bytes[8 * k..8 * k + 8]);
        f64::from_le_bytes(raw)
    };
    DVec3::new(number(0), number(1), number(2))
}

/// The data of a cloud of points.
pub(super) fn cloud_data(mut data: Cursor<'_>) -> Result<Mesh, Lost> {
    data.version()?;
    let count = data.count(24)?;
    let positions = (0..count).map(|_| data.point()).collect::<Result<Vec<_>, _>>()?;
    if positions.iter().any(|p| !p.is_finite()) {
        return Err(Lost::Unsound("a point that is not finite".into()));
    }
    Ok(Mesh { positions, ..Mesh::default() })
}
