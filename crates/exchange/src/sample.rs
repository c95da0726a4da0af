//! Surfaces as meshes with exact normals and curvatures, for formats that know no splines.

use crate::mesh::{Field, IndexLists, Mesh};
use crate::model::NamedSurface;
use bspline::{BsplineSurface, KnotVector};
use geom_core::{SurfaceJet, principal_curvatures};

/// Most cells in one direction of a sampled surface.
const MOST_CELLS: usize = 256;
/// How far beside a pole curvatures are taken, as a share of the domain.
const BESIDE: f64 = 1e-4;

/// Quads over a grid of `cells` (u, v) equal parameter cells, by default about four per knot span,
/// with exact unit normals `S_u × S_v` and the fields `H`, `K`, `k1`, `k2` per vertex.
///
/// At a singular point (a pole) normal and curvatures are taken slightly towards the middle of the
/// domain, and are zero where that is singular too.
#[must_use]
pub fn surface_mesh(name: &str, surface: &BsplineSurface, cells: Option<(usize, usize)>) -> Mesh {
    let (ku, kv) = (surface.knots_u(), surface.knots_v());
    let (cells_u, cells_v) = cells.unwrap_or_else(|| (default_cells(ku), default_cells(kv)));
    let (us, vs) = (parameters(ku, cells_u), parameters(kv, cells_v));
    let jets = surface.jet_grid(&us, &vs, 2);
    let at = |k: usize| [us[k / vs.len()], vs[k % vs.len()]];
    let faces = grid_faces(us.len(), vs.len(), cells_u, cells_v);
    with_curvatures(name, surface, &jets, at, faces)
}

/// As [`surface_mesh`], of the part that counts: triangles where the surface is trimmed.
#[must_use]
pub fn face_mesh(face: &NamedSurface, cells: Option<(usize, usize)>) -> Mesh {
    let Some(trim) = &face.trim else { return surface_mesh(&face.name, &face.surface, cells) };
    let (ku, kv) = (face.surface.knots_u(), face.surface.knots_v());
    let (cells_u, cells_v) = cells.unwrap_or_else(|| (default_cells(ku), default_cells(kv)));
    let made =
        trim.triangles(&ku.uniform_parameters(cells_u + 1), &kv.uniform_parameters(cells_v + 1));
    let jets = face.surface.jets(&made.parameters, 2);
    let faces = made.triangles.iter().collect();
    with_curvatures(&face.name, &face.surface, &jets, |k| made.parameters[k], faces)
}

/// The meshes of [`face_mesh`] of several faces as one.
#[must_use]
pub fn joined_mesh<'a>(name: &str, faces: impl IntoIterator<Item = &'a NamedSurface>) -> Mesh {
    let mut all = Mesh { name: name.to_owned(), ..Mesh::default() };
    for face in faces {
        let mesh = face_mesh(face, None);
        let first = all.positions.len() as u32;
        for corners in mesh.faces.iter() {
            let moved: Vec<u32> = corners.iter().map(|i| first + i).collect();
            all.faces.push(&moved);
        }
        all.positions.extend(mesh.positions);
        all.normals.extend(mesh.normals);
        if all.vertex_fields.is_empty() {
            all.vertex_fields = mesh.vertex_fields;
        } else {
            for (field, more) in all.vertex_fields.iter_mut().zip(mesh.vertex_fields) {
                field.values.extend(more.values);
            }
        }
    }
    all
}

/// The mesh over jets at parameters, with normals and curvatures.
fn with_curvatures(
    name: &str,
    surface: &BsplineSurface,
    jets: &[SurfaceJet],
    at: impl Fn(usize) -> [f64; 2],
    faces: IndexLists,
) -> Mesh {
    let (ku, kv) = (surface.knots_u(), surface.knots_v());
    let mut mesh = Mesh {
        name: name.to_owned(),
        positions: jets.iter().map(SurfaceJet::position).collect(),
        faces,
        ..Mesh::default()
    };
    let mut fields = ["H", "K", "k1", "k2"]
        .map(|name| Field { name: name.to_owned(), values: Vec::with_capacity(jets.len()) });
    for (k, jet) in jets.iter().enumerate() {
        let [u, v] = at(k);
        let measured =
            measure(jet).or_else(|| measure(&surface.jet(inwards(ku, u), inwards(kv, v), 2)));
        let (normal, values) = measured.unwrap_or_default();
        mesh.normals.push(normal.into());
        fields.iter_mut().zip(values).for_each(|(field, value)| field.values.push(value));
    }
    mesh.vertex_fields = fields.into();
    mesh
}

/// Normal, and H, K, k1, k2.
fn measure(jet: &SurfaceJet) -> Option<([f64; 3], [f64; 4])> {
    let normal = jet.normal().ok()?;
    let (first, second) = (jet.first_form(), jet.second_form().ok()?);
    let principal = principal_curvatures(first, second).ok()?;
    let (h, k) = (jet.mean_curvature().ok()?, jet.gaussian_curvature().ok()?);
    Some((normal.to_array(), [h, k, principal.k1, principal.k2]))
}

fn default_cells(knots: &KnotVector) -> usize {
    (4 * (knots.breaks().len() - 1)).clamp(32, MOST_CELLS)
}

/// Ends of the cells; the last is left out in a periodic direction, where it is the first again.
fn parameters(knots: &KnotVector, cells: usize) -> Vec<f64> {
    knots.uniform_parameters(if knots.is_periodic() { cells } else { cells + 1 })
}

fn inwards(knots: &KnotVector, t: f64) -> f64 {
    let (start, end) = knots.domain();
    t + BESIDE * (0.5 * (start + end) - t)
}

fn grid_faces(n_u: usize, n_v: usize, cells_u: usize, cells_v: usize) -> IndexLists {
    let mut faces = IndexLists::default();
    let vertex = |i: usize, j: usize| ((i % n_u) * n_v + j % n_v) as u32;
    for i in 0..cells_u {
        for j in 0..cells_v {
            faces.push(&[vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use bspline::{BsplineCurve, Degree, Trim, TrimCurve, TrimLoop};
    use geom_core::{DVec3, assert_close};

    #[test]
    fn only_the_part_that_counts_is_sampled() {
        let line = || KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let square = BsplineSurface::new(line(), line(), corners, None).unwrap();
        let at = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| DVec3::new(u, v, 0.0));
        let side = |k: usize| TrimCurve {
            parameters: BsplineCurve::segment(at[k], at[(k + 1) % 3], 0.0, 1.0).unwrap(),
            edge: None,
        };
        let triangle = TrimLoop::new((0..3).map(side).collect(), 0.0).unwrap();
        let whole = NamedSurface::new("whole", square);
        let half = NamedSurface { trim: Some(Trim::new(vec![triangle]).unwrap()), ..whole.clone() };
        let area = |mesh: &Mesh| -> f64 {
            let faces = mesh.faces.iter().map(|f| {
                let p = |k: usize| mesh.positions[f[k] as usize] - mesh.positions[f[0] as usize];
                (2..f.len()).map(|k| 0.5 * p(k - 1).cross(p(k)).z).sum::<f64>()
            });
            faces.sum()
        };
        assert_close(area(&face_mesh(&half, Some((5, 7)))), 0.5, 1e-12);
        let both = joined_mesh("both", [&whole, &half]);
        assert_close(area(&both), 1.5, 1e-12);
        assert!(both.vertex_fields.iter().all(|f| f.values.len() == both.positions.len()));
    }
}
