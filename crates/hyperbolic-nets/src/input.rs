//! What is solved: a net and the surface it is to stay near.

use geom_core::{ClosestPoint, DVec3, Foot, Normalization, NormalizationError, TriMesh};

use crate::net::{AsymptoticField, QuadNet};

/// A net along the asymptotic directions of a surface, and that surface; kept in normalised
/// coordinates (see [`Normalization`]), where everything is computed.
///
/// # Example
/// ```
/// use geom_core::{PolyMesh, TriMesh};
/// use hyperbolic_nets::{Input, QuadNet};
/// let model = fixtures::asymptotic_nets::scherk(6);
/// let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
/// // Near its own faces, or near a mesh of the surface.
/// assert!(Input::new(&net).place().is_ok());
/// let surface = TriMesh::from_poly_mesh(net.mesh());
/// assert_eq!(Input::near_mesh(&net, &surface).given().quads().len(), 36);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Input<'a> {
    given: &'a QuadNet,
    place: Result<Normalization, NormalizationError>,
    net: QuadNet,
    mesh: TriMesh,
    surface: Option<Placed<'a>>,
}

/// A surface seen from normalised coordinates.
struct Placed<'a> {
    surface: &'a dyn ClosestPoint,
    place: Normalization,
}

impl ClosestPoint for Placed<'_> {
    fn closest_point(&self, x: DVec3) -> Foot {
        let foot = self.surface.closest_point(self.place.restore(x));
        Foot { point: self.place.apply(foot.point), ..foot }
    }
}

impl<'a> Input<'a> {
    /// A net that is to stay near its own faces.
    #[must_use]
    pub fn new(net: &'a QuadNet) -> Self {
        let place = Normalization::of(net.positions());
        // Without a place nothing is computed; the error is told when it is asked for.
        let positions = place.as_ref().map_or_else(
            |_| net.positions().to_vec(),
            |place| net.positions().iter().map(|&p| place.apply(p)).collect(),
        );
        let placed = net.clone().with_positions(&positions);
        let mesh = TriMesh::from_poly_mesh(placed.mesh());
        Self { given: net, place, net: placed, mesh, surface: None }
    }

    /// A net that is to stay near a mesh, where that is negatively curved.
    #[must_use]
    pub fn near_mesh(net: &'a QuadNet, reference: &'a TriMesh) -> Self {
        let this = Self::new(net);
        let mesh = this
            .place
            .as_ref()
            .map_or_else(|_| reference.clone(), |place| reference.mapped(|p| place.apply(p)));
        Self { mesh, ..this }
    }

    /// A net that is to stay near a surface of which closest points are known; curvatures are those
    /// of the net's own faces, and nearness counts in full everywhere.
    #[must_use]
    pub fn near_surface(net: &'a QuadNet, reference: &'a dyn ClosestPoint) -> Self {
        let this = Self::new(net);
        let surface = this.place.ok().map(|place| Placed { surface: reference, place });
        Self { surface, ..this }
    }

    /// The net as it was given.
    #[must_use]
    pub fn given(&self) -> &'a QuadNet {
        self.given
    }

    /// Where the net stands and how large it is.
    ///
    /// # Errors
    /// [`NormalizationError`] for a net without extent, too large, too small or too far away.
    pub fn place(&self) -> Result<Normalization, NormalizationError> {
        self.place
    }

    /// The net in normalised coordinates.
    pub(crate) fn net(&self) -> &QuadNet {
        &self.net
    }

    /// The surface to stay near, in normalised coordinates.
    pub(crate) fn reference(&self) -> &dyn ClosestPoint {
        match &self.surface {
            Some(surface) => surface,
            None => &self.mesh,
        }
    }

    /// The mesh whose curvature is the surface's, in normalised coordinates.
    pub(crate) fn mesh(&self) -> &TriMesh {
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
