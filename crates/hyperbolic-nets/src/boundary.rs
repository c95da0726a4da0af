//! What a solve does with the vertices on the boundary.

use crate::QuadNet;
use crate::blocks::Target;
use geom_core::VertexId;

/// How boundary vertices are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Boundary {
    /// Each is drawn to where it started, with the weight of the proximity to nearest points.
    /// Without this the outermost faces may slide along the surface and collapse.
    #[default]
    Anchored,
    /// As the vertices inside: near the surface, free within it.
    Free,
    /// Each stays exactly where it started.
    Fixed,
    /// Each stays near the boundary curve of the start and may slide along it; corners (vertices
    /// with a single face) are anchored.
    Glide,
}

impl Boundary {
    /// Vertices whose positions may not change at all.
    pub(crate) fn fixed_vertices(self, net: &QuadNet) -> Vec<bool> {
        net.boundary().iter().map(|&b| b && self == Self::Fixed).collect()
    }
}

/// The target of every vertex, and the boundary curves that targets name.
pub(crate) fn targets(
    net: &QuadNet,
    boundary: Boundary,
) -> (Vec<Target>, Vec<Vec<geom_core::DVec3>>) {
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
    ((0..net.positions().len()).map(target).collect(), curves)
}
