//! What a YAML reader complains of, in words a user can act on.

use super::error::{Place, suggestion};
use crate::table::Table;

/// What is wrong at a place of `text`, and what would be right.
pub(super) fn reason(error: &serde_yaml::Error, text: &str, place: &Place) -> String {
    match error.without_snippet() {
        serde_yaml::Error::SerdeUnknownField { field, expected, .. } => {
            format!("there is no key `{field}` here{}", suggestion(field, expected.iter().copied()))
        }
        serde_yaml::Error::SerdeUnknownVariant { variant, expected, .. } => {
            format!("`{variant}` is not known here{}", suggestion(variant, expected.iter().copied()))
        }
        serde_yaml::Error::Eof { .. } if text.trim().is_empty() => {
            "the file is empty; `plumb model template ROBOT` writes one to fill in".to_owned()
        }
        serde_yaml::Error::DuplicateMappingKey { key: Some(key), .. } => {
            format!("the key `{key}` stands twice; keep one of them")
        }
        serde_yaml::Error::InvalidScalar { ty, .. } => {
            format!("`{}` is no {}", value_at(text, place), wanted(ty))
        }
        serde_yaml::Error::Unexpected { expected: "mapping start", .. } if place.line == 1 => no_model(text),
        other => plain(&other.to_string()),
    }
}

/// The value that stands at a place of the text.
fn value_at<'t>(text: &'t str, place: &Place) -> &'t str {
    let at = |number: u64| usize::try_from(number).unwrap_or(0).saturating_sub(1);
    let line = text.lines().nth(at(place.line)).unwrap_or("");
    let rest = line.char_indices().nth(at(place.column)).and_then(|(start, _)| line.get(start..));
    let rest = rest.unwrap_or("");
    rest.split([',', ']', '}', '#']).next().unwrap_or("").trim()
}

/// What a YAML reader wanted, in words.
fn wanted(kind: &str) -> &str {
    match kind {
        "floating point" => "number",
        "integer" | "unsigned integer" => "whole number",
        "boolean" => "truth: write true or false",
        other => other,
    }
}

/// What to say of a file that holds no keys at all.
fn no_model(text: &str) -> String {
    match Table::parse("", text) {
        Ok(_) => {
            "this is a table of measurements, no model: the model file comes first, the table after --data"
        }
        Err(_) => "this is no model file: it must hold keys such as `arm:` and `joints:`",
    }
    .to_owned()
}

/// The parser's own words, without the place it repeats.
fn plain(message: &str) -> String {
    let first = message.lines().next().unwrap_or(message);
    if first.contains("tabs disallowed") {
        return "there is a tab; write spaces".to_owned();
    }
    let trimmed = first.split_once(": line ").map_or(first, |(reason, _)| reason);
    trimmed.split(" at line ").next().unwrap_or(trimmed).trim_start_matches("error: ").to_owned()
}
