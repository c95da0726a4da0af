//! Claims of `fit`: distances of the input's points from the written surface.

use crate::ball::diameter;
use crate::claims::Values;
use crate::content::{Content, diagonal};
use crate::spline::{NearestGrid, Spline};
use glam::DVec3;
use rayon::prelude::*;

pub(crate) fn recompute(surface: &Spline, input: Option<&Content>, values: &mut Values) {
    let [n_u, n_v] = surface.different_counts();
    values.count("control_points", n_u * n_v);
    values.count("control_points_u", n_u);
    values.count("control_points_v", n_v);
    values.count("degree", surface.degree()[0]);
    let Some(mesh) = input.and_then(|i| i.meshes.first()) else { return };
    // Of a mesh the vertices that faces use, else all points.
    let points: Vec<DVec3> = if mesh.faces.is_empty() {
        mesh.positions.clone()
    } else {
        let used: std::collections::BTreeSet<usize> =
            mesh.faces.iter().flatten().copied().collect();
        used.into_iter().map(|v| mesh.positions[v]).collect()
    };
    values.count("points", points.len());
    let grid = NearestGrid::new(surface);
    let distances: Vec<f64> = points.par_iter().map(|p| surface.nearest(&grid, *p).1).collect();
    let count = distances.len().max(1) as f64;
    let most = distances.iter().copied().fold(0.0, f64::max);
    values.number("distance_mean", distances.iter().sum::<f64>() / count);
    values.number("distance_rms", (distances.iter().map(|d| d * d).sum::<f64>() / count).sqrt());
    values.number("distance_max", most);
    if let Some(size) = diameter(points.iter().copied()) {
        values.number("distance_max_percent", 100.0 * most / size);
    }
    if let Some(length) = diagonal(points.into_iter()).filter(|d| *d > 0.0) {
        values.number("distance_max_percent_box", 100.0 * most / length);
    }
}
