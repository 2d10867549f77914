//! `plumb trial reveal`: opens the seal, and holds a diagnosis against it.

use std::path::{Path, PathBuf};

use plumb_document::{FileKind, read_text};
use plumb_simulated::physics::campaign::Truth;

use super::score::{Diagnosis, Score};
use super::shown::shown_size;
use crate::commands::trial::cell;
use crate::commands::trial::error::TrialError;
use crate::commands::trial::files::{SEALED, answer, open};
use crate::commands::trial::outcome::Outcome;

/// Options of `plumb trial reveal`.
#[derive(Debug, clap::Args)]
pub(crate) struct RevealArguments {
    /// The trial's directory.
    directory: PathBuf,
    /// A diagnosis to score, as `plumb model diagnose --json` or `plumb model grow --json` writes it. Exit status 1 when it is wrong.
    #[arg(long, value_name = "FILE")]
    diagnosis: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Opens, scores, prints.
pub(super) fn run(arguments: &RevealArguments) -> Result<Outcome, TrialError> {
    let of_cell = arguments.directory.join(cell::WORLD).exists();
    let truth = match of_cell {
        true => cell::open(&arguments.directory)?,
        false => open(&arguments.directory.join(SEALED))?.truth,
    };
    let score = match &arguments.diagnosis {
        Some(path) => Some(Score::of(&read_diagnosis(path)?, &truth)),
        None => None,
    };
    let message = if arguments.json {
        format!("{:#}\n", serde_json::json!({"truth": answer(&truth), "score": score}))
    } else {
        format!("{}{}", describe(&truth), score.as_ref().map_or_else(String::new, describe_score))
    };
    Ok(Outcome { message, right: score.is_none_or(|score| score.right), failed: false })
}

fn read_diagnosis(path: &Path) -> Result<Diagnosis, TrialError> {
    let text = read_text(path, FileKind::TRIAL)
        .map_err(|source| TrialError::Read { path: path.to_owned(), source: source.into() })?;
    serde_json::from_str(&text).map_err(|source| TrialError::Diagnosis { path: path.to_owned(), source })
}

fn describe(truth: &Truth) -> String {
    let mut text = String::new();
    if truth.hidden.is_empty() {
        text.push_str(
            "Nothing was hidden: small joint zeros, the base and the target were all there was to find.\n",
        );
    }
    for hidden in &truth.hidden {
        let details: Vec<String> =
            hidden.details.iter().map(|(key, value)| format!("{key} {value}")).collect();
        let details = if details.is_empty() { String::new() } else { format!(" ({})", details.join(", ")) };
        let size = match hidden.size != 0.0 {
            true => format!(", {}", shown_size(hidden.size, &hidden.unit)),
            false => String::new(),
        };
        let moves = match hidden.over_noise > 0.0 {
            true => format!(
                "; it moves the readings by {:.1} times the noise of {}",
                hidden.over_noise, truth.noise
            ),
            false => String::new(),
        };
        text.push_str(&format!("Hidden: {} at {}{size}{details}{moves}.\n", hidden.effect, hidden.site));
    }
    if !truth.outlier_rows.is_empty() {
        let rows: Vec<String> = truth.outlier_rows.iter().map(usize::to_string).collect();
        text.push_str(&format!("Grossly wrong readings: rows {}.\n", rows.join(", ")));
    }
    let verdicts: Vec<String> = truth
        .accept_verdict
        .iter()
        .filter_map(|one| serde_json::to_value(one).ok())
        .map(|one| one.to_string())
        .collect();
    text.push_str(&format!("Accepted verdicts: {}.\n", verdicts.join(", ").replace('"', "")));
    text
}

fn describe_score(score: &Score) -> String {
    let word = |yes: bool| if yes { "yes" } else { "no" };
    let mut text = format!("The diagnosis is {}.\n", if score.right { "right" } else { "wrong" });
    for (question, answer) in [
        ("verdict among the right ones", score.verdict_right),
        ("truth ranked first", score.truth_first),
        ("truth named, tied or in the family", score.truth_in_set),
        ("place right", score.site_right),
        ("something named that is not there", score.false_name),
    ] {
        text.push_str(&format!("  {question}: {}\n", word(answer)));
    }
    if let Some(error) = score.size_error_over_se {
        text.push_str(&format!("  size off by {error:+.1} of its standard errors\n"));
    }
    text
}
