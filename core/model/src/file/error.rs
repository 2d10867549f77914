//! What can be wrong with a model file, with the place and what would be right.

use std::fmt;

use strsim::damerau_levenshtein;
use thiserror::Error;

use crate::opened::why;

/// A place in a file, counted from 1; line 0 when the place is not known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Place {
    /// The file.
    pub path: String,
    /// Line.
    pub line: u64,
    /// Column.
    pub column: u64,
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(formatter, "{}", self.path),
            line => write!(formatter, "{}: line {line}, column {}", self.path, self.column),
        }
    }
}

/// Why a model file cannot be used.
#[derive(Debug, Error)]
pub enum ModelFileError {
    /// It cannot be opened or read.
    #[error("{path}: {}", why(cause))]
    Open {
        /// The file.
        path: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The YAML is broken or does not have the expected shape.
    #[error("{place}: {reason}")]
    Syntax {
        /// Where.
        place: Place,
        /// What is wrong and what would be right.
        reason: String,
    },
    /// It is well formed but says something that cannot be.
    #[error("{place}: {reason}")]
    Meaning {
        /// Where.
        place: Place,
        /// What is wrong and what would be right.
        reason: String,
    },
}

impl ModelFileError {
    /// Where the mistake is, if known.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::Open { .. } => None,
            Self::Syntax { place, .. } | Self::Meaning { place, .. } => Some(place),
        }
    }
}

/// `; did you mean ...?` for the known name closest to a mistyped one, or the list of what there is.
pub(crate) fn suggestion<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let lower = typed.to_lowercase();
    let distance = |name: &&&str| damerau_levenshtein(&name.to_lowercase(), &lower);
    match known.iter().min_by_key(distance) {
        Some(best) if distance(&best) <= 1 + typed.chars().count() / 3 => format!("; did you mean `{best}`?"),
        _ if known.is_empty() => String::new(),
        _ => format!("; there is {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::suggestion;

    #[test]
    fn the_closest_name_is_offered_and_else_all_are_listed() {
        assert_eq!(suggestion("sholder", ["waist", "shoulder"]), "; did you mean `shoulder`?");
        assert_eq!(suggestion("xyzzy", ["waist", "shoulder"]), "; there is waist, shoulder");
        assert_eq!(suggestion("xyzzy", []), "");
    }
}
