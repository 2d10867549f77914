//! The lab itself, given what a user would hold: the model file and the table.

use plumb_calibration::arm_model::Model;
use plumb_calibration::table::Table;
use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_diagnosis::{Hypothesis, Requested};
use plumb_estimation::Progress;
use plumb_simulated::physics::campaign::Case;
use plumb_simulated::physics::campaign::poses::Chosen;
use serde::Serialize;

use plumb::commands::trial::score::Diagnosis;

/// Source named in the lab's messages.
const SOURCE: &str = "trial";

/// Chance (Holm) below which a card is one to add.
const SIGNIFICANT: f64 = 0.003;

/// Diagnoses a case.
pub(super) fn diagnose(case: &Case) -> Result<Diagnosis, LaboratoryError> {
    as_reported(&open(case)?.diagnose(&Progress::unwatched())?)
}

/// Diagnoses and adds until nothing more can be named.
pub(super) fn grow(case: &Case) -> Result<Diagnosis, LaboratoryError> {
    as_reported(&open(case)?.grow(&Progress::unwatched())?)
}

/// The formula it offers where it names nothing.
pub(super) fn formula(case: &Case) -> Result<Option<Hypothesis>, LaboratoryError> {
    Ok(open(case)?.diagnose_in_full(&Progress::unwatched())?.hypothesis)
}

/// The poses it asks for, to distinguish what it cannot: so many new ones, without the returns that come on top; nothing where it
/// says that no pose would.
pub(super) fn next_poses(case: &Case, count: usize) -> Result<Option<Vec<Chosen>>, LaboratoryError> {
    let expected = Requested { count, keep_out: Vec::new(), payloads: Vec::new() };
    let asked = open(case)?.next_poses(&expected, &Progress::unwatched())?;
    if asked.instead.is_some() {
        return Ok(None);
    }
    let chosen = asked.next.into_iter().take(count).map(|pose| Chosen {
        commanded_deg: pose.q_deg,
        sides: pose.approach.into_iter().map(f64::from).collect(),
        payload_kg: pose.payload_kg,
    });
    Ok(Some(chosen.collect()))
}

fn open(case: &Case) -> Result<Laboratory, LaboratoryError> {
    let model = Model::parse(SOURCE, &case.model_yaml())?;
    let table = Table::parse(SOURCE, &case.table_csv())?;
    Laboratory::new(model, table, Options::default())
}

/// What the lab says, read as any other program would read its JSON.
fn as_reported(diagnosed: &impl Serialize) -> Result<Diagnosis, LaboratoryError> {
    let refused = |error: serde_json::Error| LaboratoryError::Refused(error.to_string());
    let mut diagnosis: Diagnosis =
        serde_json::from_value(serde_json::to_value(diagnosed).map_err(refused)?).map_err(refused)?;
    // The benchmark asks what is found. What is only said not to show is scored in cells, where it is measured further.
    diagnosis.not_shown.clear();
    Ok(diagnosis)
}

/// What the lab says of a case, with all it holds.
pub(super) fn in_full(case: &Case) -> Result<plumb_diagnosis::Diagnosis, LaboratoryError> {
    open(case)?.diagnose(&Progress::unwatched())
}

/// One card.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Card {
    /// What the card says is left in regions left out in turn, mm.
    pub(super) promised_mm: f64,
    /// What cross-validation says once it is added, mm.
    pub(super) validated_mm: f64,
    /// What is left on the rows that were locked away, mm.
    pub(super) locked_mm: f64,
}

/// The first cards that promise something, and what adding each alone delivers.
pub(super) fn cards(case: &Case, most: usize) -> Result<Vec<Card>, LaboratoryError> {
    let (lab, progress) = (open(case)?, Progress::unwatched());
    let diagnosis = lab.diagnose(&progress)?;
    let mut cards = Vec::new();
    for candidate in diagnosis.candidates.iter().filter(|one| one.plausible && one.holm_p < SIGNIFICANT) {
        let Some(promised_mm) = candidate.leaves_mm.filter(|_| cards.len() < most) else { continue };
        let added = lab.add(&candidate.label, &progress)?.rms_mm;
        if let (Some(validated_mm), Some(locked_mm)) = (added.cv, added.check) {
            cards.push(Card { promised_mm, validated_mm, locked_mm });
        }
    }
    Ok(cards)
}

/// A diagnosis of part of a case's rows.
pub(super) fn of_part(model: &str, table: &str) -> Result<plumb_diagnosis::Diagnosis, LaboratoryError> {
    let (model, table) = (Model::parse(SOURCE, model)?, Table::parse(SOURCE, table)?);
    Laboratory::new(model, table, Options::default())?.diagnose(&Progress::unwatched())
}
