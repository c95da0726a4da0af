//! What stays where it is while a surface is faired.

use geom_core::PolyMesh;
use serde::{Deserialize, Serialize};
use subdiv_catmull_clark::Stencils;

/// Constraints of a fairing, by vertex numbers of the input mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Constraints {
    /// Control vertices that do not move. On finer levels the vertex itself and all new vertices
    /// that depend on fixed ones alone stay fixed.
    pub vertices: Vec<u32>,
    /// Vertices whose limit points are pinned, each to a place or, with `None`, to where it is.
    pub limit_points: Vec<(u32, Option<[f64; 3]>)>,
    /// Vertices whose limit tangent planes are pinned, each by its normal or, with `None`, as it
    /// is.
    pub tangent_planes: Vec<(u32, Option<[f64; 3]>)>,
    /// Vertices whose limit points are pulled to where they are: the energy gains
    /// `weight · distance² / A`, `A` the area of the input, so that a weight means the same at any
    /// size of the model.
    pub weights: Vec<(u32, f64)>,
    /// Fixes the boundary and the two rings next to it on every level, which keeps position,
    /// tangents and curvatures along the boundary (Joshi 2008, sec. 8), and leaves the quads at
    /// the boundary out of the energy.
    pub clamp_boundary: bool,
}

impl Constraints {
    /// Whether nothing holds the surface in place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether points or planes of the limit surface are asked for, exactly or by weights.
    pub(crate) fn concern_limits(&self) -> bool {
        !(self.limit_points.is_empty() && self.tangent_planes.is_empty() && self.weights.is_empty())
    }

    /// The largest vertex number used.
    pub(crate) fn largest_vertex(&self) -> Option<u32> {
        let lists = self.limit_points.iter().chain(&self.tangent_planes).map(|p| p.0);
        let weighted = self.weights.iter().map(|w| w.0);
        self.vertices.iter().copied().chain(lists).chain(weighted).max()
    }
}

/// The boundary and `rings` rings of vertices next to it.
pub(crate) fn boundary_band(mesh: &PolyMesh, rings: usize) -> Vec<bool> {
    let mut band: Vec<bool> = mesh.vertices().map(|v| mesh.is_boundary_vertex(v)).collect();
    for _ in 0..rings {
        let before = band.clone();
        for f in mesh.faces() {
            if mesh.face_vertices(f).any(|v| before[v.index()]) {
                mesh.face_vertices(f).for_each(|v| band[v.index()] = true);
            }
        }
    }
    band
}

/// The fixed vertices of a refined mesh.
pub(crate) fn refine_fixed(fixed: &[bool], stencils: &Stencils) -> Vec<bool> {
    (0..stencils.rows())
        .map(|i| {
            fixed.get(i).copied().unwrap_or(false)
                || stencils.row(i).0.iter().all(|&v| fixed[v as usize])
        })
        .collect()
}
