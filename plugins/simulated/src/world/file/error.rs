//! What is wrong with a world file, where, and what would be right.

use serde_yaml::Location;

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
    /// Something in it is wrong.
    #[error("{file}:{line}:{column}: {problem}")]
    Wrong {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Column, from 1.
        column: u64,
        /// What is wrong there, and what would be right.
        problem: String,
    },
}

impl WorldFileError {
    pub(crate) fn at(file: &str, place: Location, problem: String) -> WorldFileError {
        let (line, column) = (place.line().max(1), place.column().max(1));
        WorldFileError::Wrong { file: file.to_owned(), line, column, problem }
    }

    pub(crate) fn from_yaml(file: &str, text: &str, error: &serde_yaml::Error) -> WorldFileError {
        use serde_yaml::Error as Yaml;
        let place = error.location().unwrap_or(Location::UNKNOWN);
        let problem = match error.without_snippet() {
            Yaml::SerdeUnknownField { field, expected, .. } => unknown("key", field, expected),
            Yaml::SerdeUnknownVariant { variant, expected, .. } => unknown("kind", variant, expected),
            Yaml::SerdeMissingField { field, .. } => format!("the key `{field}` is missing here"),
            Yaml::InvalidScalar { ty, .. } => format!("`{}` is not {}", text_at(text, place), described(ty)),
            Yaml::DuplicateMappingKey { key, .. } => {
                format!("the key `{}` stands here twice", key.as_deref().unwrap_or("?"))
            }
            Yaml::InvalidBooleanStrict { .. } => {
                format!("`{}` is neither true nor false", text_at(text, place))
            }
            Yaml::Eof { .. } => "the file ends before the world is described".to_owned(),
            other => without_place(&other.render()),
        };
        WorldFileError::at(file, place, problem)
    }
}

/// Names the unknown word, what was probably meant, and all that could stand there.
pub(crate) fn unknown(what: &str, word: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|candidate| (strsim::jaro_winkler(word, candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|left, right| left.0.total_cmp(&right.0));
    let meant = nearest.map_or(String::new(), |(_, candidate)| format!(" did you mean `{candidate}`?"));
    let all = known.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
    format!("unknown {what} `{word}`;{meant} known here: {all}")
}

/// The parser's own words, less the place, which stands before them already.
fn without_place(rendered: &str) -> String {
    let line = rendered.lines().next().unwrap_or_default();
    line.split(" at line ").next().unwrap_or(line).to_owned()
}

fn described(scalar: &str) -> &str {
    match scalar {
        kind if kind.contains("float") => "a number",
        kind if kind.contains("integer") => "a whole number",
        other => other,
    }
}

/// The words that stand at a place of the text, on one line.
fn text_at(text: &str, place: Location) -> String {
    let begin =
        place.span().byte_offset().and_then(|offset| usize::try_from(offset).ok()).unwrap_or_default();
    let length = place.span().byte_len().and_then(|length| usize::try_from(length).ok()).unwrap_or_default();
    let words = text.get(begin..begin.saturating_add(length)).unwrap_or_default();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}
