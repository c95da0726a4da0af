//! How much a file may become.

use super::cursor::Cursor;
use crate::error::ReadError;
use geom_core::Budget;

/// Bytes of a control point with its weight.
const POINT_BYTES: usize = 32;

/// The points that are still to be had.
pub(super) struct Points {
    left: usize,
}

impl Points {
    /// For a file of this many bytes.
    pub(super) fn new(bytes: usize) -> Self {
        Self { left: Budget::of_file(bytes as u64).model_bytes() / POINT_BYTES }
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
