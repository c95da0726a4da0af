//! What keeps an object from being read.

use crate::error::ReadError;
use bspline::{FaceError, KnotError, SplineError, TrimError};

/// Why there is no geometry of an object.
pub(super) enum Lost {
    /// The file is damaged.
    Damaged(ReadError),
    /// It is of a kind that is not read.
    Kind(&'static str),
    /// The numbers make no sound geometry.
    Unsound(String),
}

impl From<ReadError> for Lost {
    fn from(error: ReadError) -> Self {
        Self::Damaged(error)
    }
}

macro_rules! unsound {
    ($($error:ty),*) => {$(
        impl From<$error> for Lost {
            fn from(error: $error) -> Self {
                Self::Unsound(error.to_string())
            }
        }
    )*};
}
unsound!(SplineError, KnotError, TrimError, FaceError);
