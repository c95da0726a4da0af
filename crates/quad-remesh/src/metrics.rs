//! What a net is judged by.

use geom_core::{DVec3, PolyMesh, TriMesh, VertexId};
use serde::Serialize;

/// Measures of a net against the surface it was made from.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Metrics {
    /// Faces.
    pub faces: usize,
    /// Vertices.
    pub vertices: usize,
    /// Inner vertices whose valence is not 4.
    pub irregular_vertices: usize,
    /// Inner vertices of odd valence.
    pub odd_valence_vertices: usize,
    /// Vertices less edges plus faces of the net.
    pub euler_characteristic: i64,
    /// The same of the surface.
    pub surface_euler_characteristic: i64,
    /// Points of the surface around which the asymptotic directions turn.
    pub singular_points: usize,
    /// Sum of their indices.
    pub index_sum: f64,
    /// Whole numbers each of the two functions had to choose.
    pub whole_numbers: usize,
    /// Rows that kept these whole numbers from making the net fold.
    pub whole_number_cuts: usize,
    /// Steps, of both functions together, that turned folded triangles back over; none where nothing
    /// folded.
    pub unfolding_steps: usize,
    /// Triangles that the layout turns over: none, since nets with such are refused.
    pub folded_triangles: usize,
    /// Cells within the surface that were left out since they hung on by a corner or a single side.
    pub cells_left_out: usize,
    /// Edge length the net was made with, in model units.
    pub edge_length: f64,
    /// Mean edge length.
    pub edge_length_mean: f64,
    /// Shortest edge over that length.
    pub edge_ratio_min: f64,
    /// Longest edge over that length.
    pub edge_ratio_max: f64,
    /// Least angle of a face, in degrees.
    pub angle_min_deg: f64,
    /// Mean angle between edges and asymptotic directions, weighted with the area of the
    /// triangles under the layout, in degrees.
    pub asymptotic_deviation_mean_deg: f64,
    /// The largest such angle.
    pub asymptotic_deviation_max_deg: f64,
    /// Share of the surface with negative Gaussian curvature.
    pub negative_share: f64,
    /// Share of the surface's sample points whose nearest point of the net is not on its border.
    pub covered_share: f64,
}

/// Shape of the faces: mean edge, shortest and longest, least angle in degrees.
pub(crate) fn shape(mesh: &PolyMesh) -> [f64; 4] {
    let (mut sum, mut low, mut high, mut count) = (0.0, f64::INFINITY, 0.0_f64, 0);
    for h in mesh.edges() {
        let length = mesh.position(mesh.origin(h)).distance(mesh.position(mesh.target(h)));
        sum += length;
        low = low.min(length);
        high = high.max(length);
        count += 1;
    }
    let mut angle = f64::INFINITY;
    for f in mesh.faces() {
        let q: Vec<DVec3> = mesh.face_vertices(f).map(|v| mesh.position(v)).collect();
        for k in 0..q.len() {
            let a = q[(k + 1) % q.len()] - q[k];
            let b = q[(k + q.len() - 1) % q.len()] - q[k];
            angle = angle.min(a.angle_between(b));
        }
    }
    [sum / f64::from(count.max(1)), low, high, angle.to_degrees()]
}

/// Inner vertices whose valence is not 4, and those with an odd one.
pub(crate) fn irregular(mesh: &PolyMesh) -> (usize, usize) {
    let inner =
        mesh.vertices().filter(|&v| mesh.outgoing(v).is_some() && !mesh.is_boundary_vertex(v));
    let valences: Vec<usize> = inner.map(|v| mesh.valence(v)).collect();
    let count = |is: fn(&usize) -> bool| valences.iter().filter(|v| is(v)).count();
    (count(|v| *v != 4), count(|v| v % 2 == 1))
}

/// Share of points, each with its area, whose nearest point of the net is not on its border.
pub(crate) fn covered(mesh: &PolyMesh, samples: &[(DVec3, f64)]) -> f64 {
    let net = TriMesh::from_poly_mesh(mesh);
    let on_border = |v: u32| mesh.is_boundary_vertex(VertexId(v));
    let inside = |p: DVec3| {
        let nearest = net.nearest(p);
        let t = net.triangles()[nearest.triangle];
        let zero = |k: usize| nearest.barycentric[k] <= 1e-9;
        // On the border are border vertices, and places between two of them along a border edge.
        match [0, 1, 2].into_iter().filter(|&k| zero(k)).collect::<Vec<_>>()[..] {
            [] => true,
            [k] => {
                let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                let edge = mesh.half_edge_between(VertexId(a), VertexId(b));
                !edge.is_some_and(|h| mesh.is_boundary_edge(h))
            }
            _ => (0..3).all(|k| zero(k) || !on_border(t[k])),
        }
    };
    let total: f64 = samples.iter().map(|(_, area)| area).sum();
    samples.iter().filter(|(p, _)| inside(*p)).map(|(_, area)| area).sum::<f64>() / total
}
