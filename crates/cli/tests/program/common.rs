//! Running the program, and what every refusal must keep to.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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
