//! Where the workspace is, and how programs are started in it.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A chore's failure, as the sentence to print.
pub(crate) type Outcome<T = ()> = Result<T, String>;

/// The root of the workspace.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map_or_else(PathBuf::new, Path::to_path_buf)
}

/// `cargo` in the workspace root, the same one that runs this program.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root()).args(arguments);
    command
}

/// Builds the command line tool together with all tests: with the same features as the test step of
/// `ci`, so that no dependency is compiled twice.
pub(crate) fn build_umbilic() -> Outcome {
    check(cargo(&["test", "--workspace", "--no-run", "--quiet"]))
}

/// Where cargo builds.
pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The command line tool as the last `cargo build` left it, in the workspace root.
pub(crate) fn umbilic() -> Command {
    let mut command = Command::new(
        target().join("debug").join(format!("umbilic{}", std::env::consts::EXE_SUFFIX)),
    );
    command.current_dir(root());
    command
}

/// Runs `command` and fails unless it succeeds.
pub(crate) fn check(mut command: Command) -> Outcome {
    let line = describe(&command);
    let status = command.status().map_err(|e| format!("`{line}` could not start: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("`{line}` failed ({status})")) }
}

/// Whether `program --version` runs.
pub(crate) fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Reads a text file of the workspace.
pub(crate) fn read(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a text file of the workspace.
pub(crate) fn write(path: &Path, text: &str) -> Outcome {
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

fn describe(command: &Command) -> String {
    let arguments: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
    format!("{} {}", command.get_program().to_string_lossy(), arguments.join(" "))
}
