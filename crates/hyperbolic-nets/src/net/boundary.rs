//! What the boundary of a net leaves to it.

use crate::QuadNet;
use crate::blocks::{Target, Targets, closest_on_polyline};
use crate::options::Boundary;

/// What a boundary polygon leaves to an exact net.
///
/// Both edges of the polygon at a boundary vertex lie in its tangent plane, so the polygon alone
/// prescribes the directions `n_k` of all its Lelieuvre normals `ρ_k n_k`. Its edges prescribe
/// the products `ρ_k ρ_{k+1} = |e_k| / |n_k × n_{k+1}|`. Around a loop with an even number of edges
/// all lengths cancel from the alternating product of these, which must therefore be 1: a
/// polygon without this property bounds no exact net at all. Where edges go on nearly straight
/// their plane, and with it the product, is at the mercy of the smallest displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundaryPolygon {
    /// Largest `|Σ ± log(|e_k| / |n_k × n_{k+1}|)|` of the loops with an even number of edges.
    pub closing: f64,
    /// Mean angle between the planes of consecutive edges and the tangent planes of the faces
    /// around, in radians; straight corners are left out.
    pub plane_angle: f64,
}

impl BoundaryPolygon {
    /// Of all boundary loops of a net.
    #[must_use]
    pub fn new(net: &QuadNet) -> Self {
        let (mut closing, mut angles) = (0.0_f64, Vec::new());
        let positions = net.positions();
        let faces = net.vertex_normals(positions);
        for walk in net.mesh().boundary_loops() {
            let ids: Vec<usize> = walk.iter().map(|&h| net.mesh().origin(h).index()).collect();
            let count = ids.len();
            let edge = |k: usize| positions[ids[(k + 1) % count]] - positions[ids[k % count]];
            // The plane at the vertex between edges k − 1 and k, on the side of the faces.
            let plane = |k: usize| {
                let normal = edge(k + count - 1).cross(edge(k)).normalize_or_zero();
                normal * normal.dot(faces[ids[k % count]]).signum()
            };
            let mut sum = 0.0;
            let mut straight = false;
            for k in 0..count {
                let (here, next) = (plane(k), plane(k + 1));
                let (before, after) = (edge(k + count - 1), edge(k));
                let sine = before.cross(after).length() / (before.length() * after.length());
                if sine > STRAIGHT {
                    let n = faces[ids[k]];
                    angles.push(here.cross(n).length().atan2(here.dot(n)));
                } else {
                    straight = true;
                }
                let log = (after.length() / here.cross(next).length().max(1e-300)).ln();
                sum += if k % 2 == 0 { log } else { -log };
            }
            // The plane at a straight corner is free, so nothing is prescribed around the loop.
            if count.is_multiple_of(2) && !straight {
                closing = closing.max(sum.abs());
            }
        }
        let plane_angle = angles.iter().sum::<f64>() / angles.len().max(1) as f64;
        Self { closing, plane_angle }
    }

    /// Largest distance of a boundary vertex of `moved` from where it is in `start`, along the
    /// polygon not counted.
    ///
    /// # Panics
    /// If the nets have not the same faces.
    #[must_use]
    pub fn deviation(start: &QuadNet, moved: &QuadNet) -> f64 {
        assert_eq!(start.quads(), moved.quads(), "one net before and after");
        let targets = Targets::new(start, Boundary::Glide);
        let far = |v: usize| {
            let p = moved.positions()[v];
            match &targets.of_vertices[v] {
                Target::Surface => 0.0,
                Target::Anchor(at) => at.distance(p),
                Target::Curve(k) => closest_on_polyline(&targets.curves[*k], p).point.distance(p),
            }
        };
        (0..moved.positions().len()).map(far).fold(0.0, f64::max)
    }
}

/// Sine of the angle between edges that count as one straight line.
const STRAIGHT: f64 = 1e-9;
