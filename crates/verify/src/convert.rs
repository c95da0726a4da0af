//! Claims of `convert`: what the input holds is in the output.

use crate::claims::Values;
use crate::content::{Content, centroid};

/// Counts and the mean of all points. Surfaces that were sampled are another content, and say
/// nothing; so do triangles without common corners.
pub(crate) fn recompute(content: &Content, values: &mut Values) {
    let has_surfaces = !content.surfaces.is_empty();
    if has_surfaces {
        values.count("surfaces", content.surfaces.len());
        let net = |s: &crate::spline::Spline| s.different_counts().iter().product::<usize>();
        values.count("control_points", content.surfaces.iter().map(net).sum());
    } else {
        values.count("vertices", content.meshes.iter().map(|m| m.positions.len()).sum());
        values.count("faces", content.meshes.iter().map(|m| m.faces.len()).sum());
    }
    // A closed direction counts its first control points once.
    let nets = content.surfaces.iter().flat_map(|s| {
        let [n_u, n_v] = s.different_counts();
        (0..n_u).flat_map(move |i| (0..n_v).map(move |j| s.control_point(i, j).0))
    });
    let vertices = content.meshes.iter().flat_map(|m| m.positions.iter().copied());
    let centre = if has_surfaces { centroid(nets) } else { centroid(vertices) };
    if let Some(centre) = centre {
        values.place("centroid", centre);
    }
}
