//! A net brought to the origin and to a size near one.

use super::hyperbolic_net::HyperbolicNet;
use geom_core::{DVec3, Normalization, NormalizationError};

/// A net in normalised coordinates, with what brings it back where the model stands.
///
/// A net that is solved far from the origin loses digits when it is brought back; what is computed
/// from it further begins here.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use hyperbolic_nets::{HyperbolicNet, PlacedNet, QuadNet};
/// let points = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (1e6 + f64::from(x), f64::from(y)));
/// let points = points.map(|(x, y)| DVec3::new(x, y, (x - 1e6) * y)).to_vec();
/// let net = QuadNet::new(&PolyMesh::new(points, &[[0, 1, 2, 3]])?)?;
/// let placed = PlacedNet::new(&HyperbolicNet::new(net, None, vec![1.0])?)?;
/// assert!(placed.net().net().positions().iter().all(|p| p.length() < 1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PlacedNet {
    net: HyperbolicNet,
    place: Normalization,
}

impl PlacedNet {
    /// Brings a net to the origin; its Lelieuvre normals, which depend on size, are left out.
    ///
    /// # Errors
    /// [`NormalizationError`] for a net without a size.
    pub fn new(surface: &HyperbolicNet) -> Result<Self, NormalizationError> {
        let given = surface.net().positions();
        let place = Normalization::of(given)?;
        let positions: Vec<DVec3> = given.iter().map(|p| place.apply(*p)).collect();
        let net = surface.net().clone().with_positions(&positions);
        Ok(Self { net: surface.with_net(net), place })
    }

    /// A net that has been solved in normalised coordinates.
    pub(crate) fn solved(net: HyperbolicNet, place: Normalization) -> Self {
        Self { net, place }
    }

    /// The net in normalised coordinates.
    #[must_use]
    pub fn net(&self) -> &HyperbolicNet {
        &self.net
    }

    /// What brings a point of the model to normalised coordinates.
    #[must_use]
    pub fn place(&self) -> &Normalization {
        &self.place
    }
}
