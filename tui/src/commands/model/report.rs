//! `plumb model report`.

use std::error::Error;

use plumb_diagnosis::report::Chapter;
use plumb_report::model_report::html;
use plumb_report::{diagnosis_sentence, json};

use super::arguments::ReportArguments;
use crate::progress::watched;

/// Gathers the report and writes it; prints JSON if asked for.
pub(super) fn run(arguments: &ReportArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let mut story = Vec::new();
    for entry in opened.family.history()?.into_iter().filter(|entry| entry.number <= opened.entry.number) {
        let revision = entry.model.revision.as_ref();
        story.push(Chapter {
            number: entry.number,
            did: revision
                .map_or_else(|| "the model as it was written".to_owned(), |revision| revision.did.clone()),
            rms: revision.and_then(|revision| revision.rms),
        });
    }
    let report = watched(|progress| opened.laboratory.report(story, progress))?;
    let path = &arguments.output;
    std::fs::write(path, html(&report)).map_err(|error| super::not_written(path, &error))?;
    if arguments.pair.json {
        return Ok(super::json(&json::report(&report)?)?);
    }
    Ok(format!("{}\nWritten to {}.\n", diagnosis_sentence(&report.diagnosis), path.display()))
}
