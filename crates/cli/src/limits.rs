//! Limits of the system on the size of files.

use crate::failure::Failure;

/// Lets a file that becomes too large be an error of the write, which is told and cleaned up after,
/// instead of the end of the program, which would leave temporary files behind.
pub(crate) fn heed_file_size() -> Result<(), Failure> {
    #[cfg(unix)]
    {
        use signal_hook::consts::SIGXFSZ;
        use std::sync::Arc;
        use std::sync::atomic::AtomicBool;
        // The flag is not looked at: with a handler in place the write itself fails.
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
            .map_err(|e| Failure::other(format!("cannot listen for SIGXFSZ: {e}")))?;
    }
    Ok(())
}
