//! Running the program, and what every refusal must keep to.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
#[cfg(unix)]
use std::{
    os::unix::process::ExitStatusExt,
    process::{ExitStatus, Stdio},
    time::{Duration, Instant},
};

pub(crate) const UMBILIC: &str = env!("CARGO_BIN_EXE_umbilic");

/// The root of the repository, where `fixtures/` is.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Runs the program in the root of the repository.
pub(crate) fn umbilic(args: &[&str]) -> Output {
    Command::new(UMBILIC).current_dir(root()).args(args).output().expect("the program starts")
}

/// What a run said on stderr.
pub(crate) fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Writes an input file into `folder` and returns its path.
pub(crate) fn write_into(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    fs::write(&path, text).expect("written");
    path.display().to_string()
}

/// A refusal with `-o` of this file name: exit code 2, a message with these words, nothing written.
pub(crate) fn refused(args: &[&str], out: &str, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join(out).display().to_string();
    let result = umbilic(&[args, &["-o", &out]].concat());
    let message = message(&result);
    assert_eq!(result.status.code(), Some(2), "{args:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{args:?}: {message} lacks {word}");
    }
    assert!(!message.contains("panicked"), "{message}");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0, "{args:?}");
}

/// The command lines a help text gives as examples: after `Example:` or indented below it, a `\`
/// at the end continuing the line.
#[cfg(unix)]
pub(crate) fn examples(help: &str) -> Vec<String> {
    let joined = help.replace("\\\n", " ");
    let lines = joined.lines().map(|l| l.strip_prefix("Example: ").unwrap_or(l).trim_start());
    lines.filter(|l| l.starts_with("umbilic ")).map(str::to_owned).collect()
}

/// A run that was told to stop, which it may have come before.
#[cfg(unix)]
pub(crate) struct Stopped {
    pub(crate) status: ExitStatus,
    /// From the signal to the end.
    pub(crate) took: Duration,
    pub(crate) said: String,
}

#[cfg(unix)]
impl Stopped {
    /// Whether the signal ended it: by its own hand, or by that of the system before it listened.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.status.code() == Some(130) || self.status.signal() == Some(2)
    }
}

/// Starts a program, presses Ctrl-C after some time and waits for its end.
#[cfg(unix)]
pub(crate) fn stopped(command: &mut Command, after: Duration) -> Stopped {
    let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().expect("the program starts");
    std::thread::sleep(after);
    let signal = Instant::now();
    let pid = child.id().to_string();
    // It may have ended by itself.
    let _ = Command::new("kill").args(["-INT", &pid]).stderr(Stdio::null()).status();
    let output = child.wait_with_output().expect("it ends");
    Stopped { status: output.status, took: signal.elapsed(), said: message(&output) }
}

/// The promise, of which a machine busy with other tests may fall short twice.
#[cfg(unix)]
pub(crate) fn stops_within_a_second(what: &str, stop: &dyn Fn() -> Stopped) -> Stopped {
    let first = stop();
    let mut took = vec![first.took];
    while took.last().is_some_and(|t| *t >= Duration::from_secs(1)) {
        assert!(took.len() < 3, "{what} took {took:?} to stop");
        took.push(stop().took);
    }
    first
}

/// The program in the root of the repository.
#[cfg(unix)]
pub(crate) fn program(args: &[&str]) -> Command {
    let mut command = Command::new(UMBILIC);
    command.current_dir(root()).args(args);
    command
}

/// A copy of a folder.
#[cfg(unix)]
pub(crate) fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("a fixture");
    for entry in fs::read_dir(from).expect("a fixture") {
        let path = entry.expect("a fixture").path();
        let target = to.join(path.file_name().expect("a fixture"));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, target).expect("a fixture");
        }
    }
}
