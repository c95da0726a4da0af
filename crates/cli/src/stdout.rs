//! Standard output: a reader that goes away is no error, a full disk is.

use crate::failure::Failure;
use std::io::{self, ErrorKind, Write};

/// Stands for standard output, and as an input for standard input.
pub(crate) const STDOUT: &str = "-";

/// Writes these bytes and flushes them.
pub(crate) fn write(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    judged(out.write_all(bytes).and_then(|()| out.flush()))
}

/// What an attempt to write to standard output means.
pub(crate) fn judged(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Ok(()) => Ok(()),
        // A closed pipe (`umbilic … | head`) is the reader's choice.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::other(format!(
            "standard output cannot be written ({error}); check free space"
        ))),
    }
}
