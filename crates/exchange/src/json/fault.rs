//! Faults of JSON texts, and the nesting that is refused.

use crate::error::ReadError;
use crate::ron_text::MAX_DEPTH;

pub(crate) fn fault(error: &serde_json::Error) -> ReadError {
    let message = error.to_string();
    // The message repeats the place.
    let what = message.rsplit_once(" at line ").map_or(message.as_str(), |(what, _)| what);
    let what = format!("column {}: {what}", error.column());
    ReadError::text(error.line(), what, "export the file again or correct this line")
}

/// Refuses nesting that no reader here needs, before anything follows it.
pub(crate) fn check_depth(text: &str) -> Result<(), ReadError> {
    let (mut depth, mut line, mut in_text, mut escaped) = (0_usize, 1, false, false);
    for b in text.bytes() {
        line += usize::from(b == b'\n');
        match b {
            _ if escaped => escaped = false,
            b'\\' if in_text => escaped = true,
            b'"' => in_text = !in_text,
            b'[' | b'{' if !in_text => {
                depth += 1;
                if depth > MAX_DEPTH {
                    let what = format!("the nesting is deeper than {MAX_DEPTH}");
                    return Err(ReadError::text(line, what, "no file of geometry needs that"));
                }
            }
            b']' | b'}' if !in_text => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    Ok(())
}

/// A fault of one item, with the library's own words on how to mend it.
pub(super) fn refused(title: &str, message: &str) -> ReadError {
    let (what, mend) = message.split_once("; ").unwrap_or((message, "correct it"));
    ReadError::content(format!("{title}: {what}"), mend)
}
