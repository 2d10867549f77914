//! What is wrong with a world file, where, and what would be right.

use plumb_document::FileProblems;

/// Why a world file was refused.
#[derive(Debug, thiserror::Error)]
pub enum WorldFileError {
    /// The file could not be read at all.
    #[error("cannot read world file {file}: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// A sealed file could not be written.
    #[error("cannot write {file}: {source}")]
    Unwritable {
        /// The file.
        file: String,
        /// Why.
        source: std::io::Error,
    },
    /// What is under the seal is no world.
    #[error("{file}: the sealed world does not open: it was edited or cut")]
    BrokenSeal {
        /// The file.
        file: String,
    },
    /// Something in it is wrong: every mistake of the file, or of the arm file that it names.
    #[error("{}", .0.to_string().trim_end())]
    Wrong(Box<FileProblems>),
}

impl From<FileProblems> for WorldFileError {
    fn from(problems: FileProblems) -> Self {
        Self::Wrong(Box::new(problems))
    }
}
