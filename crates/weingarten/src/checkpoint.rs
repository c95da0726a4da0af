//! A run that can be taken up again.

use bspline::BsplineSurface;
use serde::{Deserialize, Serialize};

use crate::error::WeingartenError;
use crate::options::WeingartenOptions;

/// The state of a run between two steps. Resumed with the same input and options it ends with the
/// same bytes as without the interruption.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Version of this format.
    pub schema: u32,
    /// Of the input and the options.
    pub fingerprint: u64,
    /// The level, from 0.
    pub level: usize,
    /// Steps taken at this level.
    pub iteration: usize,
    /// Damping the next step begins with.
    pub damping: f64,
    /// The unknowns at the start of the level, on the working scale.
    pub start: Vec<f64>,
    /// The unknowns.
    pub x: Vec<f64>,
}

impl Checkpoint {
    /// The version this program writes.
    pub const SCHEMA: u32 = 1;

    /// Whether the checkpoint fits a run.
    pub(crate) fn check(&self, fingerprint: u64, unknowns: usize) -> Result<(), WeingartenError> {
        let foreign = |what| Err(WeingartenError::ForeignCheckpoint { what });
        if self.schema != Self::SCHEMA {
            return foreign("another version of the program");
        }
        if self.fingerprint != fingerprint {
            return foreign("another input or other options");
        }
        let finite = |x: &[f64]| x.len() == unknowns && x.iter().all(|v| v.is_finite());
        if !(finite(&self.start) && finite(&self.x) && self.damping.is_finite()) {
            return foreign("a net of another size, or is damaged");
        }
        Ok(())
    }
}

/// A number that changes with every bit of the input and every option (FNV-1a).
pub(crate) fn fingerprint(surface: &BsplineSurface, options: &WeingartenOptions) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut eat = |bytes: &[u8]| {
        for &byte in bytes {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for point in surface.control_points() {
        point.to_array().iter().for_each(|x| eat(&x.to_bits().to_le_bytes()));
    }
    let knots = [surface.knots_u().knots(), surface.knots_v().knots()];
    for list in knots.into_iter().chain(surface.weights()) {
        list.iter().for_each(|t| eat(&t.to_bits().to_le_bytes()));
    }
    // More steps are no other run: a finished one may be taken further.
    let options = WeingartenOptions { iterations: 0, ..options.clone() };
    eat(format!("{options:?}").as_bytes());
    hash
}
