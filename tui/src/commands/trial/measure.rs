//! `plumb trial measure`: takes further poses on the arm of a trial, as a user would before asking again.

use std::path::{Path, PathBuf};

use plumb_simulated::physics::campaign;
use plumb_simulated::physics::campaign::poses::{self, Chosen};
use serde::Deserialize;

use crate::commands::trial::error::TrialError;
use crate::commands::trial::files::{SEALED, TABLE, open, read, write};
use crate::commands::trial::outcome::Outcome;

/// Options of `plumb trial measure`.
#[derive(Debug, clap::Args)]
pub(crate) struct MeasureArguments {
    /// The trial's directory; the readings are added to its table.csv.
    directory: PathBuf,
    /// The poses: the JSON of `plumb model next` or `plumb model diagnose` (its `next`).
    #[arg(long, value_name = "FILE")]
    poses: PathBuf,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Poses {
    Within { next: Vec<Pose> },
    Alone(Vec<Pose>),
}

#[derive(Debug, Deserialize)]
struct Pose {
    q_deg: Vec<f64>,
    #[serde(default)]
    approach: Vec<f64>,
    #[serde(default)]
    payload_kg: f64,
}

/// Measures and adds to the table.
pub(super) fn run(arguments: &MeasureArguments) -> Result<Outcome, TrialError> {
    let sealed = open(&arguments.directory.join(SEALED))?;
    let (specification, seed) = (&sealed.specification, sealed.truth.seed);
    let joints = specification.arm.joints.len();
    let path = arguments.directory.join(TABLE);
    let table = read(&path)?;
    let planned = poses::plan(specification, seed).len();
    let mut chosen = taken_before(&path, &table, planned, joints)?;
    let before = chosen.len();
    chosen.extend(asked(&arguments.poses, joints)?);
    let case = campaign::generate_further(specification, seed, &chosen)?;
    let added: String = (planned + before..planned + chosen.len()).map(|row| case.table_row(row)).collect();
    let line_end = if table.is_empty() || table.ends_with('\n') { "" } else { "\n" };
    write(&path, &format!("{table}{line_end}{added}"))?;
    let count = chosen.len() - before;
    Ok(Outcome::done(format!(
        "{count} more readings are in {}: {} in all.\n",
        path.display(),
        planned + chosen.len()
    )))
}

fn asked(path: &Path, joints: usize) -> Result<Vec<Chosen>, TrialError> {
    let refuse = |reason: String| TrialError::Poses { path: path.to_owned(), reason };
    let poses: Poses = serde_json::from_str(&read(path)?).map_err(|error| refuse(error.to_string()))?;
    let poses = match poses {
        Poses::Within { next } | Poses::Alone(next) => next,
    };
    let check = |(index, pose): (usize, Pose)| {
        if pose.q_deg.len() != joints || pose.q_deg.iter().any(|angle| !angle.is_finite()) {
            return Err(refuse(format!("pose {} needs {joints} joint angles in `q_deg`", index + 1)));
        }
        if !(pose.payload_kg.is_finite() && pose.payload_kg >= 0.0) {
            return Err(refuse(format!(
                "pose {}: payload_kg {} is not zero or more",
                index + 1,
                pose.payload_kg
            )));
        }
        Ok(Chosen { commanded_deg: pose.q_deg, sides: pose.approach, payload_kg: pose.payload_kg })
    };
    poses.into_iter().enumerate().map(check).collect()
}

/// Poses that earlier calls have added to the table: they belong to the arm's history.
fn taken_before(path: &Path, table: &str, planned: usize, joints: usize) -> Result<Vec<Chosen>, TrialError> {
    let rows = table.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).skip(1 + planned);
    let chosen = |(index, line): (usize, &str)| {
        let refuse = |reason: &str| TrialError::Table {
            path: path.to_owned(),
            line: index + 1,
            reason: reason.to_owned(),
        };
        let numbers: Vec<f64> =
            line.split(',').take(2 * joints + 1).map_while(|cell| cell.trim().parse().ok()).collect();
        if numbers.len() < 2 * joints + 1 {
            return Err(refuse("joint angles, sides and payload cannot be read"));
        }
        let (commanded, rest) = numbers.split_at(joints);
        let (sides, payload) = rest.split_at(joints);
        Ok(Chosen {
            commanded_deg: commanded.to_vec(),
            sides: sides.to_vec(),
            payload_kg: payload.first().copied().unwrap_or(0.0),
        })
    };
    rows.map(chosen).collect()
}
