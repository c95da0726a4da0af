//! The one clock of the crate: wall time where there is one, nothing at all in WebAssembly, where
//! asking for the time would end the program.

use std::time::Duration;

/// A moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instant(#[cfg(not(target_family = "wasm"))] std::time::Instant);

impl Instant {
    /// This moment.
    pub(crate) fn now() -> Self {
        Self(
            #[cfg(not(target_family = "wasm"))]
            std::time::Instant::now(),
        )
    }

    /// Time since then.
    pub(crate) fn elapsed(self) -> Duration {
        #[cfg(not(target_family = "wasm"))]
        return self.0.elapsed();
        #[cfg(target_family = "wasm")]
        Duration::ZERO
    }
}
