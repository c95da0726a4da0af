//! What is solved: a net and the surface it is to stay near.

use std::borrow::Cow;

use geom_core::{ClosestPoint, TriMesh};

use crate::net::{AsymptoticField, QuadNet};

/// A net along the asymptotic directions of a surface, and that surface.
///
/// # Example
/// ```
/// use geom_core::{PolyMesh, TriMesh};
/// use hyperbolic_nets::{Input, QuadNet};
/// let model = fixtures::asymptotic_nets::scherk(6);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// // Near its own faces, or near a mesh of the surface.
/// assert_eq!(Input::new(&net).mesh().positions().len(), 49);
/// let surface = TriMesh::from_poly_mesh(net.mesh());
/// assert_eq!(Input::near_mesh(&net, &surface).net().quads().len(), 36);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Input<'a> {
    net: &'a QuadNet,
    mesh: Cow<'a, TriMesh>,
    surface: Option<&'a dyn ClosestPoint>,
}

impl<'a> Input<'a> {
    /// A net that is to stay near its own faces.
    #[must_use]
    pub fn new(net: &'a QuadNet) -> Self {
        let mesh = Cow::Owned(TriMesh::from_poly_mesh(net.mesh()));
        Self { net, mesh, surface: None }
    }

    /// A net that is to stay near a mesh, where that is negatively curved.
    #[must_use]
    pub fn near_mesh(net: &'a QuadNet, reference: &'a TriMesh) -> Self {
        Self { net, mesh: Cow::Borrowed(reference), surface: None }
    }

    /// A net that is to stay near a surface of which closest points are known; curvatures are those
    /// of the net's own faces, and nearness counts in full everywhere.
    #[must_use]
    pub fn near_surface(net: &'a QuadNet, reference: &'a dyn ClosestPoint) -> Self {
        Self { surface: Some(reference), ..Self::new(net) }
    }

    /// The net.
    #[must_use]
    pub fn net(&self) -> &'a QuadNet {
        self.net
    }

    /// The surface to stay near.
    #[must_use]
    pub fn reference(&self) -> &dyn ClosestPoint {
        match self.surface {
            Some(surface) => surface,
            None => &*self.mesh,
        }
    }

    /// The mesh whose curvature is the surface's.
    #[must_use]
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Vertices (one flag each) where nearness counts little, since their feet lie where the
    /// reference is not negatively curved.
    pub(crate) fn relaxed(&self, field: &AsymptoticField<'_>) -> Vec<bool> {
        let is_relaxed = |p: &geom_core::DVec3| {
            self.surface.is_none() && field.gaussian_curvature(*p).is_some_and(|k| k >= 0.0)
        };
        self.net.positions().iter().map(is_relaxed).collect()
    }
}
