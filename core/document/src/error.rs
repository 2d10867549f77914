//! Why a file from outside is not read.

use std::io;

use crate::FileKind;

/// Why a file is not read. Shown, it says what is wrong and what to do; the file's name is the caller's to say.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The system does not give it.
    #[error("{}{}", in_words(.0), hint(.0))]
    System(#[from] io::Error),
    /// A folder, pipe, socket or device.
    #[error("this is {what}; {help}")]
    NoFile {
        /// What it is, with its article.
        what: &'static str,
        /// What to do.
        help: &'static str,
    },
    /// Larger than any file of its kind.
    #[error("it has {}; {} has at most {}: see whether this is the right file", size(*bytes), kind.name, size(kind.most_bytes))]
    TooLarge {
        /// Its size, bytes.
        bytes: u64,
        /// What it was read as.
        kind: FileKind,
    },
    /// It went on past its limit while it was read.
    #[error("it goes on past {}, the most {} has: see whether this is the right file", size(kind.most_bytes), kind.name)]
    Endless {
        /// What it was read as.
        kind: FileKind,
    },
    /// A line longer than any line of its kind.
    #[error("line {line} is longer than {}: see whether this is the right file", size(*most_bytes))]
    LongLine {
        /// Counted from 1.
        line: usize,
        /// The longest that is read, bytes.
        most_bytes: u64,
    },
    /// Bytes that are no text.
    #[error("line {line} is not UTF-8 text; save the file as UTF-8")]
    NoText {
        /// Counted from 1.
        line: usize,
    },
}

impl ReadError {
    /// Whether there is no such file.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::System(error) if error.kind() == io::ErrorKind::NotFound)
    }

    /// The kind that the standard library has for it.
    fn io_kind(&self) -> io::ErrorKind {
        match self {
            Self::System(error) => error.kind(),
            Self::NoFile { what: FOLDER, .. } => io::ErrorKind::IsADirectory,
            Self::NoFile { .. } => io::ErrorKind::InvalidInput,
            Self::TooLarge { .. } | Self::Endless { .. } | Self::LongLine { .. } => {
                io::ErrorKind::FileTooLarge
            }
            Self::NoText { .. } => io::ErrorKind::InvalidData,
        }
    }
}

/// How a folder is called.
pub(crate) const FOLDER: &str = "a folder";

/// For callers whose errors carry what the system said.
impl From<ReadError> for io::Error {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::System(error) => error,
            other => io::Error::new(other.io_kind(), other),
        }
    }
}

fn in_words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "it may not be read".to_owned(),
        _ => format!("it cannot be read: {error}"),
    }
}

fn hint(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "; see who owns it",
        _ => "",
    }
}

/// Bytes in the unit people use for so many.
fn size(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => {
            let tenths = (u128::from(bytes) * 10).div_ceil(u128::from(*unit));
            match tenths % 10 {
                0 => format!("{} {name}", tenths / 10),
                tenth => format!("{}.{tenth} {name}", tenths / 10),
            }
        }
        None => format!("{bytes} bytes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_reported_in_the_unit_people_use_and_never_below_what_they_are() {
        assert_eq!(size(17), "17 bytes");
        assert_eq!(size(1 << 20), "1 MiB");
        assert_eq!(size((1 << 20) + 1), "1.1 MiB");
        assert_eq!(size(u64::MAX), "17179869184 GiB");
    }

    #[test]
    fn an_error_of_the_system_keeps_its_kind_on_the_way_out() {
        let kind = |error: ReadError| io::Error::from(error).kind();
        assert_eq!(kind(io::Error::from(io::ErrorKind::NotFound).into()), io::ErrorKind::NotFound);
        assert_eq!(kind(ReadError::NoFile { what: FOLDER, help: "" }), io::ErrorKind::IsADirectory);
        assert_eq!(kind(ReadError::Endless { kind: FileKind::CELL }), io::ErrorKind::FileTooLarge);
    }
}
