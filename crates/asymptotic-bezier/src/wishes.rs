//! Wishes for torsions and Gaussian curvatures at corners and vertices.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::boundary::options::TorsionHandle;
use crate::data::corners::AsymptoticNet;
use crate::data::vertex::{arm_signs, bilinear_torsions, vertex_frames};
use crate::error::Error;
use crate::faults::DataFault;

/// Names of the corners of a patch.
pub(crate) const CORNERS: [&str; 4] = ["00", "10", "01", "11"];

/// A wish for the torsion at a corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum TorsionWish {
    /// This value, in 1/length.
    Fixed(f64),
    /// Between two values.
    Between(f64, f64),
    /// The Gaussian curvature (at most zero) and the sign of the torsion; zero takes the twist of
    /// the vertices around.
    Gaussian(f64, f64),
    /// The Gaussian curvature between two values, and the sign.
    GaussianBetween(f64, f64, f64),
}

impl TorsionWish {
    /// What no vertex can have.
    fn fault(self, name: &str) -> Option<DataFault> {
        let name = name.to_owned();
        let numbers: &[f64] = match &self {
            Self::Fixed(tau) => &[*tau],
            Self::Between(min, max) => &[*min, *max],
            Self::Gaussian(k, sign) => &[*k, *sign],
            Self::GaussianBetween(min, max, sign) => &[*min, *max, *sign],
        };
        if numbers.iter().any(|n| n.is_nan()) {
            return Some(DataFault::WishNotANumber { name });
        }
        match self {
            Self::Gaussian(k, _) | Self::GaussianBetween(_, k, _) if k > 0.0 => {
                Some(DataFault::WishAboveZero { name, curvature: k })
            }
            _ => None,
        }
    }

    /// The handle; `sign` is that of the torsion where the wish leaves it open.
    fn handle(self, sign: f64) -> TorsionHandle {
        let open = |wished: f64| if wished == 0.0 { sign } else { wished };
        match self {
            Self::Fixed(tau) => TorsionHandle::Fixed(tau),
            Self::Between(min, max) => TorsionHandle::Between(min, max),
            Self::Gaussian(k, wished) => TorsionHandle::gaussian(k, open(wished)),
            Self::GaussianBetween(min, max, wished) => {
                TorsionHandle::gaussian_between(min, max, open(wished))
            }
        }
    }
}

/// The torsion handles per corner or vertex that wishes by corner name or vertex number stand for.
///
/// Wishes for the Gaussian curvature that leave the sign of the torsion open (zero) get that of
/// the bilinear patches over the vertices.
///
/// # Errors
/// [`Error::Data`] names the wish without a corner or vertex.
pub(crate) fn torsion_handles(
    net: &AsymptoticNet,
    wishes: &BTreeMap<String, TorsionWish>,
) -> Result<Vec<TorsionHandle>, Error> {
    if wishes.is_empty() {
        return Ok(Vec::new());
    }
    let twists = twist_signs(net);
    let vertices = twists.len();
    let mut handles = vec![TorsionHandle::Free; vertices];
    for (name, wish) in wishes {
        let v = if net.single {
            let corner = CORNERS.iter().position(|c| c == name);
            corner.ok_or_else(|| DataFault::WishAtNoCorner { name: name.clone() })
        } else {
            let vertex = name.parse::<usize>().ok().filter(|v| *v < vertices);
            vertex.ok_or_else(|| DataFault::WishAtNoVertex { name: name.clone(), vertices })
        }?;
        if let Some(fault) = wish.fault(name) {
            return Err(fault.into());
        }
        handles[v] = wish.handle(twists[v]);
    }
    Ok(handles)
}

/// Signs of the torsions that the bilinear patches of a net have; data at fault give `+1`, the
/// solver names the fault.
fn twist_signs(net: &AsymptoticNet) -> Vec<f64> {
    let mut projected = net.clone();
    match vertex_frames(&mut projected, f64::INFINITY) {
        Ok(frames) => {
            let torsions = bilinear_torsions(net, &arm_signs(net, &frames), &frames);
            torsions.into_iter().map(f64::signum).collect()
        }
        Err(_) => vec![1.0; net.positions().len()],
    }
}
