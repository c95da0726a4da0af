//! What a file that is replaced keeps: its mode and its owner.

use crate::error::WriteError;
use std::fs::{File, Metadata, OpenOptions};
use std::path::Path;

/// A new file beside `path` for what is to replace it.
///
/// Until it has the mode of the file it replaces, nobody else may read it: that one may be private.
pub(crate) fn temporary(path: &Path, replaces: Option<&Metadata>) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if replaces.is_some() {
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    let _ = replaces;
    options.open(path)
}

/// Refuses a file that is write-protected, for its owner or for this user: renaming over it would
/// get around the protection.
///
/// # Errors
/// [`WriteError::Protected`].
pub(crate) fn check_unprotected(path: &Path, old: &Metadata) -> Result<(), WriteError> {
    // Opening for writing changes nothing, not even the time of the last change.
    let is_open = || OpenOptions::new().write(true).open(path).is_ok();
    // The system's administrator may write what is protected, and does not mean to.
    if old.permissions().readonly() || !is_open() { Err(WriteError::Protected) } else { Ok(()) }
}

/// Gives `file` the owner and the mode of the file it is to replace.
///
/// # Errors
/// [`WriteError::Owner`] if this user may not give files to that owner.
pub(crate) fn keep(file: &File, old: &Metadata) -> Result<(), WriteError> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let new = file.metadata()?;
        let (user, group) = (old.uid(), old.gid());
        // Before the mode: a change of the owner takes some bits of it away.
        if (new.uid(), new.gid()) != (user, group) {
            std::os::unix::fs::fchown(file, Some(user), Some(group))
                .map_err(|_| WriteError::Owner { user, group })?;
        }
    }
    file.set_permissions(old.permissions())?;
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

    use crate::error::WriteError;
    use crate::files::{check_writable, write_files};
    use std::fs;
    use std::os::unix::fs::{MetadataExt, PermissionsExt};

    fn mode(path: &std::path::Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o7777
    }

    #[test]
    fn a_private_file_stays_private() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("secret.ron");
        fs::write(&file, "before").unwrap();
        for bits in [0o600, 0o640, 0o664, 0o755] {
            fs::set_permissions(&file, fs::Permissions::from_mode(bits)).unwrap();
            write_files(&[(&file, b"after")]).unwrap();
            assert_eq!(mode(&file), bits);
        }
    }

    #[test]
    fn the_owner_stays() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.ron");
        fs::write(&file, "before").unwrap();
        // Giving a file away takes an administrator.
        if std::os::unix::fs::chown(&file, Some(65534), Some(65534)).is_err() {
            eprintln!("SKIPPED the_owner_stays: only an administrator can give files away");
            return;
        }
        write_files(&[(&file, b"after")]).unwrap();
        let meta = fs::metadata(&file).unwrap();
        assert_eq!((meta.uid(), meta.gid()), (65534, 65534));
        assert_eq!(fs::read(&file).unwrap(), b"after");
    }

    #[test]
    fn a_write_protected_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (file, other) = (folder.path().join("a.ron"), folder.path().join("b.ron"));
        fs::write(&file, "before").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o444)).unwrap();
        assert_eq!(check_writable(&file), Err(WriteError::Protected));
        let error = write_files(&[(&other, b"x"), (&file, b"after")]).unwrap_err().to_string();
        assert!(error.ends_with("is write-protected; make it writable or name another file"));
        assert_eq!((fs::read(&file).unwrap(), mode(&file)), (b"before".to_vec(), 0o444));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
