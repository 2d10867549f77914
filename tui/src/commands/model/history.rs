//! `plumb model history` and `undo`.

use std::error::Error;

use plumb_calibration::measurement::RmsError;
use plumb_calibration::revision::{Entry, Family};
use serde::Serialize;

use super::arguments::FamilyArguments;

/// A revision as JSON.
#[derive(Serialize)]
struct Line {
    revision: u32,
    file: String,
    did: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    data: Option<String>,
    #[serde(flatten)]
    rms: Option<RmsError>,
    effects: Vec<String>,
}

impl Line {
    fn of(entry: &Entry) -> Self {
        let revision = entry.model.revision.as_ref();
        Self {
            revision: entry.number,
            file: entry.path.display().to_string(),
            did: revision.map_or_else(|| "original".to_owned(), |revision| revision.did.clone()),
            data: revision.and_then(|revision| revision.data.clone()),
            rms: revision.and_then(|revision| revision.rms),
            effects: entry.model.effects.iter().map(|added| entry.model.label(&added.id)).collect(),
        }
    }

    fn describe(&self) -> String {
        let rms = self.rms.map_or_else(String::new, |rms| format!("  {rms}"));
        format!("{:>4}  {:<40}{rms}  {}\n", self.revision, self.did, self.file)
    }
}

/// Lists the revisions.
pub(super) fn list(arguments: &FamilyArguments) -> Result<String, Box<dyn Error>> {
    let lines: Vec<Line> = Family::of(&arguments.model)?.history()?.iter().map(Line::of).collect();
    if arguments.json {
        return Ok(super::json(&serde_json::json!({ "revisions": lines }))?);
    }
    Ok(lines.iter().map(Line::describe).collect())
}

/// Takes the last change back.
pub(super) fn undo(arguments: &FamilyArguments) -> Result<String, Box<dyn Error>> {
    let entry = Family::of(&arguments.model)?.undo()?;
    let line = Line::of(&entry);
    Ok(if arguments.json { super::json(&line)? } else { line.describe() })
}
