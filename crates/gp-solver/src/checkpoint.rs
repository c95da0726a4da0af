//! The state of a run between two steps.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::SolverError;

/// Everything a run needs to go on and end with the same bytes as without the interruption.
///
/// What is kept is for the method to say: named vectors of numbers (iterates, dampings, memories)
/// and of counts. The fingerprint ties it to its input and options.
///
/// # Example
/// ```
/// use gp_solver::Checkpoint;
/// let state = Checkpoint::new("fit", 42, 0, 7).with_numbers("x", &[1.0, 2.0]);
/// assert_eq!(state.numbers("x", 2)?, [1.0, 2.0]);
/// assert!(state.numbers("x", 3).is_err()); // a run of another size
/// assert!(state.check("fit", 42).is_ok() && state.check("fit", 43).is_err());
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Version of this format.
    pub schema: u32,
    /// The method, such as `weingarten`.
    pub method: String,
    /// Of the input and the options, see [`Fingerprint`].
    pub fingerprint: u64,
    /// The stage, from 0.
    pub stage: usize,
    /// Steps taken in this stage.
    pub iteration: usize,
    /// Named vectors of numbers.
    #[serde(default)]
    pub numbers: BTreeMap<String, Vec<f64>>,
    /// Named vectors of counts.
    #[serde(default)]
    pub counts: BTreeMap<String, Vec<u64>>,
}

impl Checkpoint {
    /// The version this program writes.
    pub const SCHEMA: u32 = 2;

    /// A checkpoint without content.
    #[must_use]
    pub fn new(method: &str, fingerprint: u64, stage: usize, iteration: usize) -> Self {
        Self {
            schema: Self::SCHEMA,
            method: method.to_owned(),
            fingerprint,
            stage,
            iteration,
            numbers: BTreeMap::new(),
            counts: BTreeMap::new(),
        }
    }

    /// Adds a vector of numbers.
    #[must_use]
    pub fn with_numbers(mut self, name: &str, values: &[f64]) -> Self {
        self.numbers.insert(name.to_owned(), values.to_vec());
        self
    }

    /// Adds a vector of counts.
    #[must_use]
    pub fn with_counts(mut self, name: &str, values: &[u64]) -> Self {
        self.counts.insert(name.to_owned(), values.to_vec());
        self
    }

    /// Whether the checkpoint belongs to this run.
    ///
    /// # Errors
    /// [`SolverError::ForeignCheckpoint`] says what it belongs to instead.
    pub fn check(&self, method: &str, fingerprint: u64) -> Result<(), SolverError> {
        let foreign = |what: &str| Err(SolverError::ForeignCheckpoint { what: what.to_owned() });
        if self.schema != Self::SCHEMA {
            return foreign("another version of the program");
        }
        if self.method != method {
            return foreign(&format!("the method `{}`", self.method));
        }
        if self.fingerprint != fingerprint {
            return foreign("another input or other options");
        }
        Ok(())
    }

    /// The numbers of this name, `len` of them, all finite.
    ///
    /// # Errors
    /// [`SolverError::ForeignCheckpoint`] if they are missing, of another number or not finite.
    pub fn numbers(&self, name: &str, len: usize) -> Result<&[f64], SolverError> {
        match self.numbers.get(name) {
            Some(v) if v.len() == len && v.iter().all(|x| x.is_finite()) => Ok(v),
            _ => Err(self.damaged(name)),
        }
    }

    /// The counts of this name.
    ///
    /// # Errors
    /// [`SolverError::ForeignCheckpoint`] if they are missing.
    pub fn counts(&self, name: &str) -> Result<&[u64], SolverError> {
        self.counts.get(name).map(Vec::as_slice).ok_or_else(|| self.damaged(name))
    }

    fn damaged(&self, name: &str) -> SolverError {
        let what = format!("a run of another size, or its {name} are damaged");
        SolverError::ForeignCheckpoint { what }
    }
}

/// A number that changes with every bit that goes in (FNV-1a, 64 bits).
///
/// ```
/// use gp_solver::Fingerprint;
/// let of = |x: f64| Fingerprint::new().numbers(&[1.0, x]).text("options").finish();
/// assert_eq!(of(2.0), of(2.0));
/// assert_ne!(of(2.0), of(2.0_f64.next_up()));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    /// Of nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    fn eat(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Takes numbers in, bit by bit.
    #[must_use]
    pub fn numbers(mut self, values: &[f64]) -> Self {
        values.iter().for_each(|x| self.eat(&x.to_bits().to_le_bytes()));
        self
    }

    /// Takes counts in.
    #[must_use]
    pub fn counts(mut self, values: impl IntoIterator<Item = u64>) -> Self {
        values.into_iter().for_each(|n| self.eat(&n.to_le_bytes()));
        self
    }

    /// Takes a text in.
    #[must_use]
    pub fn text(mut self, text: &str) -> Self {
        self.eat(text.as_bytes());
        self
    }

    /// The number.
    #[must_use]
    pub fn finish(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkpoint_knows_what_it_belongs_to() {
        let state = Checkpoint::new("weingarten", 7, 1, 4).with_numbers("x", &[1.0, 0.1 + 0.2]);
        let text = serde_json::to_string(&state).unwrap();
        assert_eq!(serde_json::from_str::<Checkpoint>(&text).unwrap(), state);
        assert_eq!(state.check("weingarten", 7), Ok(()));
        assert_eq!(state.numbers("x", 2), Ok(&[1.0, 0.1 + 0.2][..]));
        let refused = [
            state.check("fair", 7),
            state.check("weingarten", 8),
            state.numbers("x", 3).map(|_| ()),
            state.numbers("y", 2).map(|_| ()),
        ];
        let words = ["the method `weingarten`", "other options", "another size", "its y are"];
        for (result, word) in refused.into_iter().zip(words) {
            let message = result.unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
