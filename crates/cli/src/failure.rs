//! Why a command could not give a result, and the exit code that says so.

use std::fmt;
use std::io::Write;
use std::path::Path;

/// A result was written.
pub(crate) const OK: u8 = 0;
/// Anything that is neither the user's input nor an interruption.
pub(crate) const DEFECT: u8 = 1;
/// Bad input or usage.
pub(crate) const USAGE: u8 = 2;
/// `--require-converged` and another status.
pub(crate) const NOT_CONVERGED: u8 = 3;
/// The result is no use where it was looked at more closely.
pub(crate) const FAILED: u8 = 4;
/// Ctrl-C.
pub(crate) const INTERRUPTED: u8 = 130;

/// One sentence for the user and an exit code; no output file was touched.
#[derive(Debug)]
pub(crate) struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    /// Bad content of `file`: the one place where the file name joins the library's message.
    pub(crate) fn input(file: &Path, error: impl fmt::Display) -> Self {
        Self { code: USAGE, message: format!("{}: {error}", file.display()) }
    }

    /// Flags that cannot be honoured.
    pub(crate) fn usage(message: impl fmt::Display) -> Self {
        Self { code: USAGE, message: message.to_string() }
    }

    /// Everything else: not the user's fault.
    pub(crate) fn other(message: impl fmt::Display) -> Self {
        Self { code: DEFECT, message: message.to_string() }
    }

    pub(crate) fn code(&self) -> u8 {
        self.code
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The promise is one sentence on one line, whatever a library's message contains.
        let words: Vec<&str> = self.message.split_whitespace().collect();
        f.write_str(&words.join(" "))
    }
}

/// A view that was refused is a slip of ours, not of the user.
pub(crate) fn refused(error: report::ReportError) -> Failure {
    Failure::other(format!("cannot draw the result: {error}"))
}

/// One line on stderr, in the name of the program.
pub(crate) fn say(message: &str) {
    let _ = writeln!(std::io::stderr().lock(), "umbilic: {message}");
}

/// Two results for one file.
pub(crate) fn twice(path: &Path, other: &Path) -> Failure {
    let message = "two results would be written to this file; name another for one";
    if path == other {
        return Failure::usage(format!("{}: {message}", path.display()));
    }
    Failure::usage(format!("{} and {}: {message}", other.display(), path.display()))
}
