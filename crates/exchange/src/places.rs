//! Where files are: whether two names lead to one file, and folders that are made when needed.

use crate::error::WriteError;
use crate::files::check_writable;
use std::fs;
use std::path::{Path, PathBuf};

/// Whether both names lead to one file, through links too; it need not exist yet.
#[must_use]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    a == b || place(a).is_some_and(|p| place(b) == Some(p))
}

/// What a name leads to: an existing file by its number, another by its folder and name.
#[derive(PartialEq)]
enum Place {
    #[cfg(unix)]
    Number(u64, u64),
    Path(PathBuf),
}

fn place(path: &Path) -> Option<Place> {
    #[cfg(unix)]
    if let Ok(meta) = fs::metadata(path) {
        use std::os::unix::fs::MetadataExt;
        return Some(Place::Number(meta.dev(), meta.ino()));
    }
    if let Ok(whole) = path.canonicalize() {
        return Some(Place::Path(whole));
    }
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(Place::Path(folder.canonicalize().ok()?.join(path.file_name()?)))
}

/// Whether files can be put into this folder, or it can be made. Leaves nothing behind.
///
/// # Errors
/// [`WriteError`] says what is in the way.
pub fn check_folder(folder: &Path) -> Result<(), WriteError> {
    let mut nearest = folder;
    loop {
        match fs::metadata(nearest) {
            Ok(meta) if meta.is_dir() => return check_writable(&nearest.join("file")),
            Ok(_) => {
                return Err(WriteError::NotAFolder { path: nearest.display().to_string() });
            }
            Err(_) => {}
        }
        nearest = match nearest.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) => parent,
            None => return Err(WriteError::NoFolder { folder: folder.display().to_string() }),
        };
    }
}

/// Makes a folder and those above it; one that is there is left alone.
///
/// # Errors
/// [`WriteError::Io`] if the operating system refuses.
pub fn make_folder(folder: &Path) -> Result<(), WriteError> {
    Ok(fs::create_dir_all(folder)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_that_could_be_made_are_not_made_by_asking() {
        let root = tempfile::tempdir().unwrap();
        let deep = root.path().join("a/b/c");
        assert_eq!(check_folder(&deep), Ok(()));
        assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0);
        make_folder(&deep).unwrap();
        assert!(deep.is_dir());
        assert_eq!((check_folder(&deep), make_folder(&deep)), (Ok(()), Ok(())));
        fs::write(root.path().join("file"), "x").unwrap();
        let error = check_folder(&root.path().join("file/b")).unwrap_err().to_string();
        assert!(error.ends_with("file is no folder; name another"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_to_their_files() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        fs::write(at("a"), "x").unwrap();
        fs::write(at("other"), "x").unwrap();
        std::os::unix::fs::symlink(at("a"), at("soft")).unwrap();
        fs::hard_link(at("a"), at("hard")).unwrap();
        fs::create_dir(at("folder")).unwrap();
        for name in ["a", "soft", "hard", "folder/../a"] {
            assert!(is_same_file(&at("a"), &at(name)), "{name}");
        }
        assert!(!is_same_file(&at("a"), &at("other")));
        // Neither is there yet.
        assert!(is_same_file(&at("new"), &at("folder/../new")));
        assert!(!is_same_file(&at("new"), &at("folder/new")));
        assert!(!is_same_file(&at("no/such/x"), &at("no/such/y")));
    }
}
