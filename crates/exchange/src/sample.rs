//! Surfaces as meshes with exact normals and curvatures, for formats that know no splines.

use crate::mesh::{Field, IndexLists, Mesh};
use crate::model::NamedSurface;
use bspline::{BsplineSurface, KnotVector};
use geom_core::{BoundingBox, SurfaceJet, principal_curvatures};

/// Most cells in one direction of a sampled surface.
const MOST_CELLS: usize = 256;
/// How far beside a pole curvatures are taken, as a share of the domain.
const BESIDE: f64 = 1e-4;
/// Points are at the same place within this share of the size of the surface.
const SAME_PLACE: f64 = 1e-9;

/// Quads over a grid of `cells` (u, v) equal parameter cells, by default about four per knot span,
/// with exact unit normals `S_u × S_v` and the fields `H`, `K`, `k1`, `k2` per vertex. Borders of a
/// closed surface that lie on each other are joined, and a side that is one point (a pole) is one
/// vertex with triangles around it.
///
/// At a singular point normal and curvatures are taken slightly towards the middle of the domain,
/// and are zero where that is singular too.
#[must_use]
pub fn surface_mesh(name: &str, surface: &BsplineSurface, cells: Option<(usize, usize)>) -> Mesh {
    let (ku, kv) = (surface.knots_u(), surface.knots_v());
    let (cells_u, cells_v) = cells.unwrap_or_else(|| (default_cells(ku), default_cells(kv)));
    let (us, vs) = (parameters(ku, cells_u), parameters(kv, cells_v));
    let jets = surface.jet_grid(&us, &vs, 2);
    let at = |k: usize| [us[k / vs.len()], vs[k % vs.len()]];
    let (same, poles) = same_places(&jets, us.len(), vs.len());
    let faces = grid_faces([us.len(), vs.len()], [cells_u, cells_v], &same);
    let mesh = with_curvatures(name, surface, &jets, at, |k| poles[k], faces);
    if same.iter().enumerate().all(|(k, first)| k == *first) { mesh } else { joined(mesh, &same) }
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
    with_curvatures(&face.name, &face.surface, &jets, |k| made.parameters[k], |_| false, faces)
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

/// The mesh over jets at parameters, with normals and curvatures: those of poles from beside them,
/// since rounding may leave a tangent there.
fn with_curvatures(
    name: &str,
    surface: &BsplineSurface,
    jets: &[SurfaceJet],
    at: impl Fn(usize) -> [f64; 2],
    is_pole: impl Fn(usize) -> bool,
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
        let here = if is_pole(k) { None } else { measure(jet) };
        let beside = || measure(&surface.jet(inwards(ku, u), inwards(kv, v), 2));
        let measured = here.or_else(beside);
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

/// The first grid point at the place of each: another one for the last row of a closed direction
/// and for all but one along a pole; and what is a pole.
fn same_places(jets: &[SurfaceJet], n_u: usize, n_v: usize) -> (Vec<usize>, Vec<bool>) {
    let at = |k: usize| jets[k].position();
    let size = BoundingBox::of((0..jets.len()).map(at)).map_or(0.0, BoundingBox::diagonal);
    let near = |a: usize, b: usize| at(a).distance(at(b)) <= SAME_PLACE * size;
    let mut same: Vec<usize> = (0..jets.len()).collect();
    let mut poles = vec![false; jets.len()];
    let row = |i: usize| move |j: usize| i * n_v + j;
    let column = |j: usize| move |i: usize| i * n_v + j;
    let mut join = |first: &dyn Fn(usize) -> usize, last: &dyn Fn(usize) -> usize, n: usize| {
        if first(0) != last(0) && (0..n).all(|k| near(first(k), last(k))) {
            (0..n).for_each(|k| same[last(k)] = first(k));
        }
        for side in [first, last] {
            if n > 1 && (1..n).all(|k| near(side(k), side(0))) {
                (1..n).for_each(|k| same[side(k)] = side(0));
                (0..n).for_each(|k| poles[side(k)] = true);
            }
        }
    };
    join(&row(0), &row(n_u - 1), n_v);
    join(&column(0), &column(n_v - 1), n_u);
    for k in 0..same.len() {
        let mut first = same[k];
        while same[first] != first {
            first = same[first];
        }
        same[k] = first;
    }
    (same, poles)
}

/// Cells of a grid as quads, as triangles where two corners are the same.
fn grid_faces([n_u, n_v]: [usize; 2], cells: [usize; 2], same: &[usize]) -> IndexLists {
    let mut faces = IndexLists::default();
    let vertex = |i: usize, j: usize| same[(i % n_u) * n_v + j % n_v] as u32;
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            let quad = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            let (mut corners, mut n) = ([0; 4], 0);
            for corner in quad {
                if !corners[..n].contains(&corner) {
                    corners[n] = corner;
                    n += 1;
                }
            }
            if n > 2 {
                faces.push(&corners[..n]);
            }
        }
    }
    faces
}

/// A mesh without the vertices that have an earlier one at their place, whose normal becomes the
/// mean: around the apex of a cone, and along a closed seam with a crease.
fn joined(mesh: Mesh, same: &[usize]) -> Mesh {
    let mut normals = mesh.normals.clone();
    for (k, &first) in same.iter().enumerate().filter(|(k, first)| k != *first) {
        normals[first] += mesh.normals[k];
    }
    let kept: Vec<usize> = (0..same.len()).filter(|k| same[*k] == *k).collect();
    let mut place = vec![0; same.len()];
    kept.iter().enumerate().for_each(|(new, old)| place[*old] = new as u32);
    let moved = |corners: &[u32]| corners.iter().map(|v| place[*v as usize]).collect::<Vec<u32>>();
    let field = |f: Field| {
        let values = kept.iter().map(|k| f.values[*k]).collect();
        Field { name: f.name, values }
    };
    Mesh {
        positions: kept.iter().map(|k| mesh.positions[*k]).collect(),
        faces: mesh.faces.iter().map(moved).collect(),
        normals: kept.iter().map(|k| normals[*k].normalize_or_zero()).collect(),
        vertex_fields: mesh.vertex_fields.into_iter().map(field).collect(),
        name: mesh.name,
        ..Mesh::default()
    }
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

    /// Edges with other than two faces.
    fn open_edges(mesh: &Mesh) -> usize {
        let mut uses = std::collections::HashMap::new();
        for face in mesh.faces.iter() {
            for (k, a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                *uses.entry((*a.min(&b), *a.max(&b))).or_insert(0) += 1;
            }
        }
        uses.values().filter(|n| **n != 2).count()
    }

    #[test]
    fn closed_surfaces_have_no_seam_and_poles_are_triangles() {
        use bspline::{Elementary, ElementaryKind, Frame};
        use std::f64::consts::{FRAC_PI_2, TAU};
        let frame = Frame::new(DVec3::new(1.0, 2.0, 3.0), DVec3::Z, None);
        let turn = [0.0, TAU];
        let torus = Elementary { frame, kind: ElementaryKind::Torus { major: 50.0, minor: 20.0 } };
        let mesh = surface_mesh("torus", &torus.surface(turn, turn).unwrap(), Some((32, 32)));
        assert_eq!((mesh.positions.len(), mesh.faces.len(), open_edges(&mesh)), (1024, 1024, 0));
        let ball = Elementary { frame, kind: ElementaryKind::Sphere { radius: 50.0 } };
        let sphere = ball.surface(turn, [-FRAC_PI_2, FRAC_PI_2]).unwrap();
        let mesh = surface_mesh("sphere", &sphere, Some((32, 16)));
        assert_eq!((mesh.positions.len(), open_edges(&mesh)), (32 * 15 + 2, 0));
        let triangles = mesh.faces.iter().filter(|f| f.len() == 3).count();
        assert_eq!((triangles, mesh.faces.len()), (64, 32 * 16));
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert_close(n.dot(*p - frame.origin).abs(), 50.0, 1e-6);
        }
        let h = mesh.vertex_fields[0].values.iter();
        h.for_each(|h| assert_close(h.abs(), 0.02, 1e-6));
        // Half of a cone: one pole, nothing closed.
        let cone = Elementary { frame, kind: ElementaryKind::Cone { radius: 0.0, slope: 0.5 } };
        let half = cone.surface([0.0, 2.0], [0.0, 3.0]).unwrap();
        let mesh = surface_mesh("cone", &half, Some((8, 4)));
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (9 * 4 + 1, 32));
    }
}
