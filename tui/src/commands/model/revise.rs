//! `plumb model add`, `remove` and `grow`: what changes a model writes its next revision.

use std::error::Error;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;

use plumb_calibration::effect::{self, EffectId};
use plumb_calibration::measurement::{ReadingUnit, RmsError};
use plumb_calibration::revision::Entry;
use plumb_diagnosis::laboratory::Addition;
use plumb_diagnosis::{Claim, Growth, Note, Objection};
use plumb_report::{growth_sentence, json, objection_in_words};
use serde::Serialize;

use super::arguments::{
    AcceptArguments, AddArguments, ChangeArguments, GrowArguments, Opened, PairArguments,
};
use super::diagnose;
use super::text::{effects_table, floor_line, placement_lines, rms_line, surface_lines};
use crate::progress::watched;

/// Alternatives of a correction that are listed on its line (mechanisms). Why: with more the line does not fit a screen.
const SHOWN_ALTERNATIVES: usize = 3;

/// What a change says in JSON.
#[derive(Serialize)]
struct Changed<'a> {
    revision: u32,
    file: String,
    did: &'a str,
    added: serde_json::Value,
    before: plumb_diagnosis::laboratory::Rms,
    rms_mm: plumb_diagnosis::laboratory::Rms,
    floor: &'a plumb_diagnosis::noise_floor::Floor,
    moved: &'a [String],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    placed: &'a [plumb_diagnosis::laboratory::Placement],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    surfaces: &'a [plumb_diagnosis::laboratory::FoundSurface],
    sentence: String,
}

/// Adds an effect, after a question where the lab would not.
pub(super) fn add(arguments: &AddArguments) -> Result<String, Box<dyn Error>> {
    let change_arguments = &arguments.change;
    in_order(change_arguments)?;
    let (pair, effect) = (&change_arguments.pair, change_arguments.effect.as_str());
    let opened = pair.open()?;
    // What these rows cannot determine is refused by the fit, with its own reason.
    let addition = watched(|progress| opened.laboratory.add(effect, progress))?;
    if !arguments.yes
        && let Some(objection) = objection(&opened, effect)?
    {
        confirm(effect, &objection_in_words(&objection))?;
    }
    write(pair, &opened, &format!("add {effect}"), &addition)
}

/// Why the lab would not add an effect. Of groups and wildcards it has no opinion: they free numbers rather than claim a mechanism.
fn objection(opened: &Opened, effect: &str) -> Result<Option<Objection>, Box<dyn Error>> {
    let model = opened.laboratory.model();
    let Ok(Ok([one])) = effect::expand(effect, model).map(<[EffectId; 1]>::try_from) else { return Ok(None) };
    Ok(watched(|progress| opened.laboratory.objection(&one, progress))?)
}

/// Asks whether to add what the lab would not; an error where nobody wants it, or nobody can be asked.
fn confirm(effect: &str, objection: &str) -> Result<(), Box<dyn Error>> {
    let doubt = format!(
        "{effect} was not named: {objection}.\nAny effect makes the error in the fit smaller, also one that is not there; a cell with this model then commands its arm by it."
    );
    if !io::stdin().is_terminal() || !io::stderr().is_terminal() {
        return Err(format!("{doubt}\nNothing was added; --yes adds it without asking").into());
    }
    eprint!("{doubt}\nAdd it all the same? [y/N] ");
    io::stderr().flush()?;
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    match answer.trim().to_lowercase().as_str() {
        "y" | "yes" => Ok(()),
        _ => Err("nothing was added".into()),
    }
}

/// Takes an effect out.
pub(super) fn remove(arguments: &ChangeArguments) -> Result<String, Box<dyn Error>> {
    in_order(arguments)?;
    let did = format!("remove {}", arguments.effect);
    let opened = arguments.pair.open()?;
    let removal = watched(|progress| opened.laboratory.remove(&arguments.effect, progress))?;
    write(&arguments.pair, &opened, &did, &removal)
}

/// Refuses an effect where the model file belongs, and a file where the effect does.
fn in_order(arguments: &ChangeArguments) -> Result<(), String> {
    let (model, effect) = (&arguments.pair.model, Path::new(&arguments.effect));
    if model.exists() || !effect.is_file() {
        return Ok(());
    }
    let (model, effect) = (model.display(), effect.display());
    Err(format!("`{effect}` is a file and `{model}` is none: the model file comes first, then the effect"))
}

/// Takes over what the table says of all that is free.
pub(super) fn accept(arguments: &AcceptArguments) -> Result<String, Box<dyn Error>> {
    let did = "accept what was fitted";
    let opened = arguments.pair.open()?;
    let accepted = watched(|progress| opened.laboratory.accept(progress))?;
    write(&arguments.pair, &opened, did, &accepted)
}

/// What became of an error: `reductions from 0.5000 to 0.1000 mm`.
fn change_of_error(before: f64, after: f64, unit: ReadingUnit) -> String {
    let (shown_before, shown_after) = (format!("{before:.4}"), format!("{after:.4}"));
    if shown_before == shown_after {
        return format!("stays at {shown_after} {unit}");
    }
    let way = if after < before { "falls" } else { "rises" };
    format!("{way} from {shown_before} to {shown_after} {unit}")
}

/// Writes the next revision, and says what became of the error.
fn write(
    pair: &PairArguments,
    opened: &Opened,
    did: &str,
    addition: &Addition,
) -> Result<String, Box<dyn Error>> {
    let data = pair.data_name();
    let unit = addition.comparison.unit;
    let rms = Some(RmsError { value: addition.rms_mm.fit, unit });
    let parent = Some(opened.entry.number);
    let entry = opened.family.write(addition.model.clone(), parent, did, Some(&data), rms)?;
    let sentence = format!(
        "{did}: the error {}; revision {} is {}.",
        change_of_error(addition.before.fit, addition.rms_mm.fit, unit),
        entry.number,
        entry.path.display()
    );
    if pair.json {
        let changed = serde_json::to_value(Changed {
            revision: entry.number,
            file: entry.path.display().to_string(),
            did,
            added: json::effects(&addition.added)?,
            before: addition.before,
            rms_mm: addition.rms_mm,
            floor: &addition.comparison.floor,
            moved: &addition.moved,
            placed: &addition.comparison.placed,
            surfaces: &addition.comparison.surfaces,
            sentence,
        })?;
        return Ok(super::json(&json::in_unit(changed, unit))?);
    }
    let mut text = placement_lines(&addition.comparison.placed);
    text.push_str(&surface_lines(&addition.comparison.surfaces));
    text.push_str(&effects_table(&addition.added));
    text.push_str(&format!("before  {}", rms_line(&addition.before, unit)));
    text.push_str(&format!("now     {}", rms_line(&addition.rms_mm, unit)));
    text.push_str(&floor_line(&addition.comparison.floor, unit));
    for moved in &addition.moved {
        text.push_str(&format!("moved by more than two standard errors: {moved}\n"));
    }
    Ok(format!("{text}\n{sentence}\n"))
}

/// The fall of the error, step by step; then by mechanisms alone, and by both, where corrections were added.
fn reduction(growth: &Growth) -> String {
    let unit = growth.diagnosis.unit;
    let mut text = format!("{:<34} fit {:.4} {unit}\n", "start", growth.start.fit);
    for step in &growth.steps {
        let ratio =
            step.floor_ratio.map_or_else(String::new, |ratio| format!(", {ratio:.2} times the noise"));
        let claim = match step.claim {
            Claim::Mechanism => String::new(),
            Claim::Correction => format!("  correction: may be {}", alternatives(&step.may_be)),
        };
        text.push_str(&format!("+ {:<32} fit {:.4} {unit}{ratio}{claim}\n", step.label, step.rms_mm.fit));
    }
    if let (Some(alone), Some(last)) = (growth.mechanisms_alone, growth.steps.last()) {
        text.push_str(&format!(
            "by mechanisms alone: fit {:.4} -> {:.4} {unit}; with corrections: {:.4} {unit}\n",
            growth.start.fit, alone.fit, last.rms_mm.fit
        ));
    }
    if let Some(map) = &growth.residual_map {
        text.push_str(&format!(
            "+ {:<32} fit {:.4} {unit}  not understood: {:.0} % of the variance left, by {}\n",
            "residual_map",
            map.rms_mm.fit,
            100.0 * map.not_understood,
            map.goes_by.join(" and ")
        ));
    }
    text
}

/// What a correction may be, on a line: the likeliest, and how many more there are. JSON and the model file list all.
fn alternatives(may_be: &[String]) -> String {
    match may_be {
        [first, second, .., last] if may_be.len() > SHOWN_ALTERNATIVES => {
            format!("{first}, or {second}, or {} more, or {last}", may_be.len() - SHOWN_ALTERNATIVES)
        }
        few => few.join(", or "),
    }
}

/// What is noted where the files of the findings cannot be written.
fn no_revision(error: &dyn Error) -> Note {
    Note::Noticed(format!("no revision was written: {error}"))
}

/// Diagnoses and adds until nothing more can be named, then goes on with corrections and a residual map.
pub(super) fn grow(arguments: &GrowArguments) -> Result<String, Box<dyn Error>> {
    let opened = arguments.pair.open()?;
    let mut growth = watched(|progress| match (arguments.mechanisms_only, arguments.no_map) {
        (true, _) => opened.laboratory.grow(progress),
        (false, true) => opened.laboratory.grow_with_corrections(progress),
        (false, false) => opened.laboratory.grow_with_map(progress),
    })?;
    if !arguments.dry {
        let data = arguments.pair.data_name();
        let unit = growth.diagnosis.unit;
        let mut parent = opened.entry.number;
        let mut together: Vec<&str> = Vec::new();
        for step in &growth.steps {
            together.push(step.label.as_str());
            let Some(model) = &step.model else { continue };
            let claim = if step.claim == Claim::Correction { " (correction)" } else { "" };
            let did = format!("add {}{claim}", together.join(", "));
            together.clear();
            let rms = Some(RmsError { value: step.rms_mm.fit, unit });
            let written: Result<Entry, _> =
                opened.family.write(model.clone(), Some(parent), &did, Some(&data), rms);
            match written {
                Ok(entry) => parent = entry.number,
                // The findings are worth more than the files.
                Err(error) => {
                    growth.diagnosis.warnings.push(no_revision(&error));
                    break;
                }
            }
        }
        if let Some(step) = &growth.residual_map {
            let (model, rms) = (growth.model.clone(), Some(RmsError { value: step.rms_mm.fit, unit }));
            let did = "add residual_map (not understood)";
            if let Err(error) = opened.family.write(model, Some(parent), did, Some(&data), rms) {
                growth.diagnosis.warnings.push(no_revision(&error));
            }
        }
    }
    if arguments.pair.json {
        return Ok(super::json(&json::growth(&growth)?)?);
    }
    let mut text = reduction(&growth);
    for way in &growth.extrapolation {
        let (with, without) = (way.rms_mm, way.without_mm);
        text.push_str(&format!(
            "left out {:<25} {with:.4} {unit}, {without:.4} {unit} without what was added\n",
            way.left_out,
            unit = way.unit
        ));
    }
    Ok(format!("{text}\n{}", diagnose::describe(&growth.diagnosis, &growth_sentence(&growth))))
}

#[cfg(test)]
mod tests {
    use super::alternatives;

    #[test]
    fn of_many_alternatives_two_are_listed_and_what_has_no_name() {
        let of =
            |listed: &[&str]| alternatives(&listed.iter().map(|one| (*one).to_owned()).collect::<Vec<_>>());
        assert_eq!(of(&["a", "unlisted"]), "a, or unlisted");
        assert_eq!(of(&["a", "b", "unlisted"]), "a, or b, or unlisted");
        assert_eq!(of(&["a", "b", "c", "d", "unlisted"]), "a, or b, or 2 more, or unlisted");
        assert_eq!(of(&[]), "");
    }
}
