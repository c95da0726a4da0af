//! Views of meshes: flat faces or smooth vertex normals, with the fields and groups they carry.

use crate::failure::{Failure, refused};
use exchange::Mesh;
use geom_core::{DVec3, TriMesh, VertexCurvature, vertex_curvatures};
use report::{FaceGroups, LineRole, LineSet, ScalarField, SurfaceView};

/// A view of a mesh with its own normals (or those averaged at its vertices), its vertex fields,
/// its groups and its edges. Fields called `H`, `K`, `k1` and `k2` feed the curvature diagram;
/// without `H` and `K` they are estimated.
pub(crate) fn mesh_view(
    name: &str,
    mesh: &Mesh,
    length_unit: &str,
) -> Result<SurfaceView, Failure> {
    let (mut triangles, mut of_triangle) = (Vec::new(), Vec::new());
    let mut edges = Vec::new();
    for (f, face) in mesh.faces.iter().enumerate() {
        for i in 1..face.len().saturating_sub(1) {
            triangles.push([face[0], face[i], face[i + 1]]);
            of_triangle.push(mesh.face_group(f).unwrap_or(0) as u32);
        }
        for (i, &a) in face.iter().enumerate() {
            let b = face[(i + 1) % face.len()];
            edges.push((a.min(b), a.max(b)));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    let point = |v: u32| mesh.positions[v as usize];
    let edges = edges.into_iter().map(|(a, b)| vec![point(a), point(b)]).collect();
    let normals = match mesh.normals.is_empty() {
        false => mesh.normals.clone(),
        true => averaged_normals(&mesh.positions, &triangles)?,
    };
    let mut view = SurfaceView::new(name, mesh.positions.clone(), normals, triangles)
        .and_then(|v| v.with_lines(LineSet::new("edges", "mesh edges", LineRole::Mesh, edges)))
        .map_err(refused)?;
    if mesh.normals.is_empty() {
        view = view.with_averaged_normals();
    }
    if !mesh.lines.is_empty() {
        let curves = (0..mesh.lines.len()).map(|k| mesh.polyline(k).collect()).collect();
        let mut set = LineSet::new("curves", "curves", LineRole::Curves, curves);
        set.visible = true;
        view = view.with_lines(set).map_err(refused)?;
    }
    for field in &mesh.vertex_fields {
        view = view
            .with_field(known_field(&field.name, &field.values, length_unit))
            .map_err(refused)?;
    }
    if view.field("H").is_none() && view.field("K").is_none() {
        view = with_estimated_curvatures(view, mesh, length_unit)?;
    }
    if mesh.groups.len() > 1 {
        let names = mesh.groups.iter().map(|g| g.name.clone()).collect();
        let (id, label) = ("groups".to_owned(), "groups".to_owned());
        view = view.with_groups(FaceGroups { id, label, of_triangle, names }).map_err(refused)?;
    }
    Ok(view)
}

/// Adds H and K fitted to the neighbourhood of each vertex, where the mesh is a manifold.
fn with_estimated_curvatures(
    view: SurfaceView,
    mesh: &Mesh,
    length_unit: &str,
) -> Result<SurfaceView, Failure> {
    let Ok(manifold) = mesh.to_poly_mesh() else { return Ok(view) };
    let fitted = vertex_curvatures(&manifold);
    let field = |of: fn(&VertexCurvature) -> f64| -> Vec<f64> {
        fitted.iter().map(|c| c.as_ref().map_or(f64::NAN, of)).collect()
    };
    let mut mean = ScalarField::mean_curvature(field(|c| c.mean), length_unit);
    let mut gaussian = ScalarField::gaussian_curvature(field(|c| c.gaussian), length_unit);
    mean.label += ", estimated";
    gaussian.label += ", estimated";
    view.with_field(mean).and_then(|v| v.with_field(gaussian)).map_err(refused)
}

fn averaged_normals(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<Vec<DVec3>, Failure> {
    let mesh = TriMesh::new(positions.to_vec(), triangles.to_vec()).map_err(Failure::other)?;
    // A vertex without an area around it has no normal; any direction will do.
    let whole = |n: &DVec3| if n.is_normalized() { *n } else { DVec3::Z };
    Ok(mesh.vertex_normals().iter().map(whole).collect())
}

fn known_field(name: &str, values: &[f64], length_unit: &str) -> ScalarField {
    let values = values.to_vec();
    match name {
        "H" => ScalarField::mean_curvature(values, length_unit),
        "K" => ScalarField::gaussian_curvature(values, length_unit),
        "k1" | "K1" => ScalarField::kappa1(values, length_unit),
        "k2" | "K2" => ScalarField::kappa2(values, length_unit),
        "deviation" => ScalarField::deviation(values, length_unit),
        other => ScalarField::signed(other, other, "", values),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_edges_fields_and_groups_arrive() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0]];
        let positions = corners.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec();
        let mut mesh = Mesh::new(positions, [vec![0, 1, 2, 3], vec![1, 4, 2]]);
        mesh.groups = ["quad", "triangle"].map(exchange::Group::new).to_vec();
        mesh.face_groups = vec![0, 1];
        mesh.vertex_fields.push(exchange::Field { name: "k1".into(), values: vec![0.5; 5] });
        let view = mesh_view("net", &mesh, "").unwrap();
        assert_eq!(view.triangles().len(), 3);
        assert_eq!(view.lines()[0].polylines.len(), 6);
        assert!(view.field("kappa1").is_some());
        assert_eq!(view.groups()[0].of_triangle, [0, 0, 1]);
        assert!(view.normals().iter().all(|n| *n == DVec3::Z));
    }
}
