//! Numbers in text files.

use crate::error::{ReadError, clip};

/// A finite number from a word of a text file.
pub(crate) fn coordinate(word: &str, line: usize) -> Result<f64, ReadError> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => {
            let what = format!("`{}` is not a finite number", clip(word));
            Err(ReadError::text(line, what, "write coordinates as decimal numbers"))
        }
    }
}
