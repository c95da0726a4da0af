//! How much a file may become.

use super::cursor::Cursor;
use crate::error::ReadError;

/// Points that any file may become, and points per byte above that.
const FREE: usize = 1 << 20;
/// See [`FREE`]; a point takes 24 bytes.
const POINTS_PER_BYTE: f64 = 0.25;

/// The points that are still to be had.
pub(super) struct Budget {
    left: usize,
}

impl Budget {
    /// For a file of this many bytes.
    pub(super) fn new(bytes: usize) -> Self {
        Self { left: FREE + (bytes as f64 * POINTS_PER_BYTE) as usize }
    }

    /// Takes so many points.
    pub(super) fn spend(&mut self, points: usize, at: &Cursor<'_>) -> Result<(), ReadError> {
        match self.left.checked_sub(points) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(at.error("the file unpacks to more points than fit into memory")),
        }
    }
}
