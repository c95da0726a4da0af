//! What a run takes of its input.

use serde::{Deserialize, Serialize};

/// What was taken of the input, as the user said it; absent where nothing was.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct Choice {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) surface: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) part: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) input_format: Option<String>,
}
