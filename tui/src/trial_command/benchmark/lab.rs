//! The lab itself, given what a user would hold: the model file and the table.

use plumb_model::file::Model;
use plumb_model::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_model::progress::Progress;
use plumb_model::table::Table;
use plumb_simulated::physics::campaign::Case;
use serde::Serialize;

use crate::trial_command::score::Diagnosis;

/// Source named in the lab's messages.
const SOURCE: &str = "trial";

/// Diagnoses a case.
pub(super) fn diagnose(case: &Case) -> Result<Diagnosis, LaboratoryError> {
    as_told(&open(case)?.diagnose(&Progress::unwatched())?)
}

/// Diagnoses and adds until nothing more can be named.
pub(super) fn grow(case: &Case) -> Result<Diagnosis, LaboratoryError> {
    as_told(&open(case)?.grow(&Progress::unwatched())?)
}

fn open(case: &Case) -> Result<Laboratory, LaboratoryError> {
    let model = Model::parse(SOURCE, &case.model_yaml())?;
    let table = Table::parse(SOURCE, &case.table_csv())?;
    Laboratory::new(model, table, Options::default())
}

/// What the lab says, read as any other program would read its JSON.
fn as_told(said: &impl Serialize) -> Result<Diagnosis, LaboratoryError> {
    let refused = |error: serde_json::Error| LaboratoryError::Refused(error.to_string());
    serde_json::from_value(serde_json::to_value(said).map_err(refused)?).map_err(refused)
}
