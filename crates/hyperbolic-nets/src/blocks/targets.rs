//! What vertices are held to.

use geom_core::{DVec3, Foot, VertexId, closest_on_segment};

use crate::QuadNet;
use crate::options::Boundary;

/// What a vertex is held to.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// The nearest point of the reference surface.
    Surface,
    /// A point, with the tangent plane of the surface near it.
    Anchor(DVec3),
    /// The nearest point of one of the boundary curves, by number; free along it.
    Curve(usize),
}

/// The target of every vertex, and the curves that targets name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Targets {
    /// One for each vertex.
    pub of_vertices: Vec<Target>,
    /// Polylines in units of the model; a closed one ends where it begins.
    pub curves: Vec<Vec<DVec3>>,
}

impl Targets {
    /// What a treatment of the boundary asks for.
    #[must_use]
    pub fn new(net: &QuadNet, boundary: Boundary) -> Self {
        let mut curves = Vec::new();
        let mut curve_of = vec![0; net.positions().len()];
        if boundary == Boundary::Glide {
            for walk in net.mesh().boundary_loops() {
                let ids: Vec<usize> = walk.iter().map(|&h| net.mesh().origin(h).index()).collect();
                for &v in &ids {
                    curve_of[v] = curves.len();
                }
                let closed = ids.iter().chain(&ids[..1]);
                curves.push(closed.map(|&v| net.positions()[v]).collect());
            }
        }
        let target = |v: usize| {
            let start = net.positions()[v];
            let corner = || net.mesh().valence(VertexId(v as u32)) == 2;
            match boundary {
                _ if !net.boundary()[v] => Target::Surface,
                Boundary::Free => Target::Surface,
                Boundary::Anchored | Boundary::Fixed => Target::Anchor(start),
                Boundary::Glide if corner() => Target::Anchor(start),
                Boundary::Glide => Target::Curve(curve_of[v]),
            }
        };
        Self { of_vertices: (0..net.positions().len()).map(target).collect(), curves }
    }
}

/// Nearest point of an open or closed polyline, with the unit tangent as `normal`.
pub(crate) fn closest_on_polyline(points: &[DVec3], x: DVec3) -> Foot {
    let mut best = (f64::INFINITY, Foot { point: points[0], normal: DVec3::ZERO });
    for pair in points.windows(2) {
        let point = pair[0].lerp(pair[1], closest_on_segment(x, pair[0], pair[1]));
        let distance = point.distance_squared(x);
        if distance < best.0 {
            best = (distance, Foot { point, normal: (pair[1] - pair[0]).normalize_or_zero() });
        }
    }
    best.1
}
