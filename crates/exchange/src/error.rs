//! What readers and writers can refuse.

/// Why a file could not be read. The message says what, where, and how to mend; it does not name
/// the file, which the caller knows.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot be read ({reason}); check the path and its permissions")]
    Io { reason: String },
    /// A folder, a device or a pipe.
    #[error("is not a regular file; name a file")]
    NotAFile,
    /// An extension without a reader.
    #[error("no reader for the extension `{extension}`; use one of {known}")]
    UnknownFormat { extension: String, known: &'static str },
    /// A fault in a text file.
    #[error("line {line}: {what}; {mend}")]
    Text { line: usize, what: String, mend: String },
    /// A fault in a binary file.
    #[error("byte {offset}: {what}; {mend}")]
    Binary { offset: usize, what: String, mend: String },
    /// The file can be parsed and does not hold what is asked for.
    #[error("{what}; {mend}")]
    Content { what: String, mend: String },
}

impl ReadError {
    /// A fault on a line (counted from 1) of a text file.
    pub fn text(line: usize, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::Text { line, what: what.into(), mend: mend.into() }
    }

    /// A fault at a byte (counted from 0) of a binary file.
    pub fn binary(offset: usize, what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::Binary { offset, what: what.into(), mend: mend.into() }
    }

    /// A fault of the whole file.
    pub fn content(what: impl Into<String>, mend: impl Into<String>) -> Self {
        Self::Content { what: what.into(), mend: mend.into() }
    }
}

impl From<std::io::Error> for ReadError {
    fn from(error: std::io::Error) -> Self {
        Self::Io { reason: error.to_string() }
    }
}

/// Why files could not be written; none of them was touched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum WriteError {
    /// The folder is not there.
    #[error("the folder {folder} does not exist; create it first")]
    NoFolder { folder: String },
    /// The path names a folder, a device or a pipe.
    #[error("is not a regular file; name a file")]
    NotAFile,
    /// A file in the place of a folder.
    #[error("{path} is no folder; name another")]
    NotAFolder { path: String },
    /// An existing file that must not be changed.
    #[error("is write-protected; make it writable or name another file")]
    Protected,
    /// An existing file whose owner the new one could not keep.
    #[error(
        "belongs to user {user}, group {group}, whom this user cannot give the new file to; remove it first or name another file"
    )]
    Owner { user: u32, group: u32 },
    /// The operating system refused.
    #[error("cannot be written ({reason}); check permissions and free space")]
    Io { reason: String },
    /// An extension without a writer.
    #[error("no writer for the extension `{extension}`; use one of {known}")]
    UnknownFormat { extension: String, known: &'static str },
    /// The format cannot hold this content.
    #[error("{format} cannot hold {what}; {mend}")]
    Unsupported { format: &'static str, what: String, mend: String },
    /// The same, while writing several files.
    #[error("{file}: {error}")]
    InFile { file: String, error: Box<WriteError> },
}

impl From<std::io::Error> for WriteError {
    fn from(error: std::io::Error) -> Self {
        Self::Io { reason: error.to_string() }
    }
}

/// The beginning of a word, fit for a message.
pub(crate) fn clip(word: &str) -> String {
    const LONGEST: usize = 24;
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}
