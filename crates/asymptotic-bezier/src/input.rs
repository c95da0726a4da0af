//! What is to be bounded by asymptotic curves.

use std::collections::BTreeMap;

use geom_core::{DVec3, PolyMesh};

use crate::data::corners::{AsymptoticNet, CornerData};
use crate::error::Error;
use crate::wishes::TorsionWish;

/// What is to be bounded by asymptotic curves, with wishes for torsions.
///
/// # Example
/// ```
/// use asymptotic_bezier::{Input, InputData};
/// # use geom_core::{DVec3, PolyMesh};
/// # let point = |k: usize| {
/// #     let (p, q) = (0.2 + 0.3 * (k / 4) as f64, 0.1 + 0.3 * (k % 4) as f64);
/// #     let (u, v) = (0.5 * (p + q), 0.5 * (p - q));
/// #     DVec3::new(u - u.powi(3) / 3.0 + u * v * v, v - v.powi(3) / 3.0 + v * u * u, u * u - v * v)
/// # };
/// # let corner = |k: u32| 4 * (k / 3) + k % 3;
/// # let faces: Vec<[u32; 4]> = (0..9).map(corner).map(|a| [a, a + 4, a + 5, a + 1]).collect();
/// // Nine quads along asymptotic lines of Enneper's surface.
/// let mesh = PolyMesh::new((0..16).map(point).collect(), &faces)?;
/// let input = Input::from(mesh);
/// assert!(matches!(input.data, InputData::Mesh(_)) && input.torsions.is_empty());
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Where the curves come from.
    pub data: InputData,
    /// Wishes for the torsion of the u-curves, by corner name (`00`, `10`, `01`, `11`) or vertex
    /// number. Those of the [`Options`](crate::Options) go first.
    pub torsions: BTreeMap<String, TorsionWish>,
}

/// Where the curves come from.
#[derive(Clone, Debug, PartialEq)]
pub enum InputData {
    /// One patch from corner data.
    Patch(Box<CornerData>),
    /// A whole net of curves.
    Net(AsymptoticNet),
    /// Polylines that sample the curves of a net: their ends are the vertices, every closed ring of
    /// four is a face.
    Polylines(Vec<Vec<DVec3>>),
    /// A net from positions: the edges of a quad mesh along asymptotic lines.
    Mesh(PolyMesh),
}

/// Data of one patch or of a net, whatever they were made from.
pub(crate) enum NetData {
    Patch(Box<CornerData>),
    Net(AsymptoticNet),
}

impl InputData {
    /// # Errors
    /// [`Error::Net`] and the faults of [`AsymptoticNet::check`].
    pub(crate) fn resolve(&self) -> Result<NetData, Error> {
        Ok(match self {
            Self::Patch(data) => NetData::Patch(data.clone()),
            Self::Net(net) => NetData::Net(net.clone()),
            Self::Polylines(lines) => NetData::Net(AsymptoticNet::from_polylines(lines)?),
            Self::Mesh(mesh) => NetData::Net(AsymptoticNet::from_mesh(mesh)?),
        })
    }
}

impl From<InputData> for Input {
    fn from(data: InputData) -> Self {
        Self { data, torsions: BTreeMap::new() }
    }
}

impl From<CornerData> for Input {
    fn from(data: CornerData) -> Self {
        InputData::Patch(Box::new(data)).into()
    }
}

impl From<AsymptoticNet> for Input {
    fn from(net: AsymptoticNet) -> Self {
        InputData::Net(net).into()
    }
}

impl From<Vec<Vec<DVec3>>> for Input {
    fn from(polylines: Vec<Vec<DVec3>>) -> Self {
        InputData::Polylines(polylines).into()
    }
}

impl From<PolyMesh> for Input {
    fn from(mesh: PolyMesh) -> Self {
        InputData::Mesh(mesh).into()
    }
}
