//! Claims of `remesh`: a net of quads, its valences and the shape of its faces.

use crate::claims::{Claims, Values};
use crate::content::Mesh;
use crate::edges::Edges;
use crate::shape::angle_deg;

pub(crate) fn recompute(mesh: &Mesh, claims: &Claims, values: &mut Values) {
    let Some(edges) = Edges::new(&mesh.faces, mesh.positions.len()) else { return };
    values.count("faces", mesh.faces.len());
    values.count("vertices", mesh.positions.len());
    let inner = (0..mesh.positions.len()).filter(|v| !edges.on_border[*v] && edges.valence[*v] > 0);
    let valences: Vec<usize> = inner.map(|v| edges.valence[v]).collect();
    values.count("irregular_vertices", valences.iter().filter(|n| **n != 4).count());
    values.count("odd_valence_vertices", valences.iter().filter(|n| **n % 2 == 1).count());
    let used = edges.valence.iter().filter(|n| **n > 0).count();
    let euler = used as f64 - edges.list.len() as f64 + mesh.faces.len() as f64;
    values.number("euler_characteristic", euler);
    let at = |v: usize| mesh.positions[v];
    let length = |[a, b]: [usize; 2]| at(a).distance(at(b));
    let lengths: Vec<f64> = edges.list.iter().map(|edge| length(edge.ends)).collect();
    values.number("edge_length_mean", edges.mean_length(&mesh.positions));
    if let Some(wanted) = claims.number("edge_length") {
        let least = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        values.number("edge_ratio_min", least / wanted);
        values.number("edge_ratio_max", lengths.iter().copied().fold(0.0, f64::max) / wanted);
    }
    let angles = mesh.faces.iter().flat_map(|face| {
        let n = face.len();
        (0..n).map(move |k| {
            let (here, next, last) =
                (at(face[k]), at(face[(k + 1) % n]), at(face[(k + n - 1) % n]));
            angle_deg(next - here, last - here)
        })
    });
    values.number("angle_min_deg", angles.fold(f64::INFINITY, f64::min));
}
