//! Options from a RON file, below those from flags.

use crate::args::ConfigArgs;
use crate::failure::Failure;
use serde::de::DeserializeOwned;

impl ConfigArgs {
    /// The options of the file, or the default without one.
    ///
    /// In the file a value stands without `Some`; keys are the names of the options' table.
    pub(crate) fn load<T: DeserializeOwned + Default>(&self) -> Result<T, Failure> {
        let Some(path) = &self.config else { return Ok(T::default()) };
        exchange::read_ron(path).map_err(|e| Failure::input(path, e))
    }
}
