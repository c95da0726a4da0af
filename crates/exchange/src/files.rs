//! Reading whole files, and writing them so that a reader never sees half of one.

use crate::error::{ReadError, WriteError};
use crate::replaced::{check_unprotected, keep, temporary};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The bytes of a regular file.
///
/// # Errors
/// [`ReadError::NotAFile`] for folders and devices (some of which never end), else
/// [`ReadError::Io`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    if !fs::metadata(path)?.is_file() {
        return Err(ReadError::NotAFile);
    }
    Ok(fs::read(path)?)
}

/// All bytes of standard input, up to 2 GiB.
pub(crate) fn read_standard_input() -> Result<Vec<u8>, ReadError> {
    const MOST: u64 = 2 << 30;
    let mut bytes = Vec::new();
    std::io::stdin().lock().take(MOST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST {
        return Err(ReadError::content("standard input does not end", "pass at most 2 GiB"));
    }
    Ok(bytes)
}

/// The text of a regular file.
///
/// # Errors
/// As [`read_bytes`], and [`ReadError::Binary`] at the first byte that is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    into_text(read_bytes(path)?)
}

/// Bytes as UTF-8 text, without a byte order mark.
pub(crate) fn into_text(bytes: Vec<u8>) -> Result<String, ReadError> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        ReadError::binary(offset, "the text is not UTF-8", "save the file as UTF-8")
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// Whether [`write_files`] could write at `path`: its folder exists and takes new files, and what
/// may be there already is a regular file. Leaves nothing behind.
///
/// # Errors
/// [`WriteError`] says what is in the way.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    Prepared::create(path).map(drop)
}

/// Writes all files, or none of them: every one is first written to a temporary file in its own
/// folder and flushed to the disk, then all are renamed into place. Existing files are replaced as
/// a whole, so that at any moment a reader finds the old or the new content; the new file has the
/// mode and the owner of the old one. A write-protected file is not replaced.
///
/// # Errors
/// [`WriteError::InFile`] names the file at fault. No target was touched, unless a rename itself
/// fails after an earlier one succeeded (another process removed the folder in between).
pub fn write_files(files: &[(&Path, &[u8])]) -> Result<(), WriteError> {
    write_files_unless(files, &|| false).map(drop)
}

/// As [`write_files`], unless `is_stopped` says so before the renaming begins: asked for every
/// megabyte and file. Returns whether the files were written; if not, nothing is left behind.
///
/// # Errors
/// As [`write_files`].
pub fn write_files_unless(
    files: &[(&Path, &[u8])],
    is_stopped: &dyn Fn() -> bool,
) -> Result<bool, WriteError> {
    let named = |path: &Path| {
        let file = path.display().to_string();
        move |error: WriteError| WriteError::InFile { file, error: Box::new(error) }
    };
    let mut prepared = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        let mut file = Prepared::create(path).map_err(named(path))?;
        if !file.fill(bytes, is_stopped).map_err(named(path))? || is_stopped() {
            return Ok(false);
        }
        prepared.push((path, file));
    }
    for (path, file) in prepared {
        file.rename().map_err(named(path))?;
    }
    Ok(true)
}

/// Bytes that are written between two questions whether to stop.
const CHUNK: usize = 1 << 20;

/// A temporary file beside its target; removed when dropped before [`Prepared::rename`].
struct Prepared {
    temporary: PathBuf,
    target: PathBuf,
    file: File,
    renamed: bool,
}

impl Prepared {
    fn create(path: &Path) -> Result<Self, WriteError> {
        // A link is followed, so that the file it points to is replaced and the link stays.
        let target = match fs::symlink_metadata(path) {
            Ok(meta) if meta.is_symlink() => fs::canonicalize(path)?,
            _ => path.to_path_buf(),
        };
        let old = fs::metadata(&target).ok();
        if let Some(meta) = &old {
            if !meta.is_file() {
                return Err(WriteError::NotAFile);
            }
            check_unprotected(&target, meta)?;
        }
        let Some(name) = target.file_name() else { return Err(WriteError::NotAFile) };
        let folder = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(WriteError::NoFolder { folder: folder.display().to_string() });
        }
        let path = folder.join(temporary_name(name));
        let file = temporary(&path, old.as_ref())?;
        let prepared = Self { temporary: path, target, file, renamed: false };
        if let Some(old) = &old {
            keep(&prepared.file, old)?;
        }
        Ok(prepared)
    }

    /// Whether all of it was written and has reached the disk; not if `is_stopped`.
    fn fill(&mut self, bytes: &[u8], is_stopped: &dyn Fn() -> bool) -> Result<bool, WriteError> {
        for chunk in bytes.chunks(CHUNK) {
            if is_stopped() {
                return Ok(false);
            }
            self.file.write_all(chunk)?;
        }
        self.file.sync_all()?;
        Ok(true)
    }

    fn rename(mut self) -> Result<(), WriteError> {
        fs::rename(&self.temporary, &self.target)?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Prepared {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing more can be done about a temporary file that will not go.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

fn temporary_name(name: &std::ffi::OsStr) -> OsString {
    // Process and counter keep two writers of the same target apart.
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    let mut temporary = OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}-{count}.tmp", std::process::id()));
    temporary
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failing_file_leaves_the_others_untouched() {
        let folder = tempfile::tempdir().unwrap();
        let (old, other) = (folder.path().join("old.txt"), folder.path().join("new.txt"));
        fs::write(&old, "before").unwrap();
        let missing = folder.path().join("nowhere").join("x.txt");
        let error = write_files(&[(&old, b"after"), (&other, b"x"), (&missing, b"y")]).unwrap_err();
        assert!(error.to_string().contains("does not exist"), "{error}");
        assert_eq!(fs::read(&old).unwrap(), b"before");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        write_files(&[(&old, b"after"), (&other, b"x")]).unwrap();
        assert_eq!(fs::read(&old).unwrap(), b"after");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_stop_before_the_renaming_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        fs::write(&a, "before").unwrap();
        let large = vec![7; 3 * CHUNK + 1];
        // Two files of one and four chunks: asked before each chunk and after each file.
        for questions in 0..7 {
            let asked = std::cell::Cell::new(0);
            let is_stopped = || asked.replace(asked.get() + 1) == questions;
            let written = write_files_unless(&[(&a, b"after"), (&b, &large)], &is_stopped);
            assert_eq!(written, Ok(false), "question {questions}");
            assert_eq!(fs::read(&a).unwrap(), b"before");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        assert_eq!(write_files_unless(&[(&a, b"after"), (&b, &large)], &|| false), Ok(true));
        assert_eq!((fs::read(&a).unwrap(), fs::read(&b).unwrap()), (b"after".to_vec(), large));
    }

    #[test]
    fn folders_and_devices_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(check_writable(folder.path()), Err(WriteError::NotAFile));
        assert_eq!(check_writable(Path::new("/dev/null")), Err(WriteError::NotAFile));
        assert_eq!(read_bytes(folder.path()), Err(ReadError::NotAFile));
        assert_eq!(read_bytes(Path::new("/dev/zero")), Err(ReadError::NotAFile));
        assert!(matches!(read_bytes(Path::new("/no/such")), Err(ReadError::Io { .. })));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("a"), folder.path().join("b"));
        fs::write(&file, "before").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_files(&[(&link, b"after")]).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"after");
    }

    #[test]
    fn text_must_be_utf8() {
        let error = into_text(vec![b'a', 0xff]).unwrap_err();
        assert_eq!(error.to_string(), "byte 1: the text is not UTF-8; save the file as UTF-8");
        assert_eq!(into_text("\u{feff}v 1".into()).unwrap(), "v 1");
    }
}
