//! Options from a RON file below those from flags.

use crate::args::ConfigArgs;
use crate::failure::Failure;
use serde::de::DeserializeOwned;

impl ConfigArgs {
    /// The options of the file, or the default without one.
    ///
    /// The options struct derives `clap::Args` and `serde::Deserialize`, has only `Option`
    /// fields, and carries `#[serde(default, deny_unknown_fields)]`; in the file a value stands
    /// without `Some`. Combine with [`layered!`](crate::layered).
    pub(crate) fn load<T: DeserializeOwned + Default>(&self) -> Result<T, Failure> {
        let Some(path) = &self.config else { return Ok(T::default()) };
        exchange::read_ron(path).map_err(|e| Failure::input(path, e))
    }
}

/// Implements `fn over(self, config: Self) -> Self` for a struct of `Option` fields: a flag that
/// is set wins over the value of the configuration file.
#[macro_export]
macro_rules! layered {
    ($options:ident { $($field:ident),* $(,)? }) => {
        impl $options {
            /// `self`, completed by `config` where `self` says nothing.
            pub(crate) fn over(self, config: Self) -> Self {
                Self { $($field: self.$field.or(config.$field)),* }
            }
        }
    };
}
