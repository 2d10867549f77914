//! Where a model says the arm's point is: what a cell commands and converts by.

use nalgebra::{IsometryMatrix3, Vector3};

use crate::arm_model::{AddedEffect, Model};
use crate::effect::{self, EffectNameError};
use crate::fit::ResidualModel;
use crate::measurement::Observations;
use crate::measurement::ObservationsError;
use crate::table::{PositionColumns, Table};

/// Circumstances of a pose.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pose {
    /// Commanded coordinates, rad or mm, one a joint.
    pub q: Vec<f64>,
    /// The way in which each joint arrives, as in [`Table::approach`]; may be empty.
    pub approach: Vec<i8>,
    /// Load, kg.
    pub payload: f64,
}

/// Why nothing can be predicted.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum PredictionError {
    /// An effect of the model cannot act.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// The poses and the model do not go together.
    #[error(transparent)]
    Poses(#[from] ObservationsError),
    /// There is no such point.
    #[error("the model has no target `{0}`; of its targets {1}")]
    UnknownTarget(String, String),
    /// There is no point.
    #[error("the model has no target, so it has no point to bring anywhere: give it one under `targets:`")]
    NoTarget,
}

/// What of a model is not used to predict, as people write it: steps that were lost are put right by a new initialization.
pub fn left_out(model: &Model) -> Vec<String> {
    let all = model.fitted.iter().chain(&model.effects);
    all.filter(|added| is_event(added)).map(|added| model.label(&added.id)).collect()
}

/// The model without what is not used to predict.
pub(crate) fn without_events(model: &Model) -> Model {
    let mut model = model.clone();
    model.effects.retain(|added| !is_event(added));
    model.fitted.retain(|added| !is_event(added));
    model
}

/// Whether it happened once, between two rows.
pub(crate) fn is_event(added: &AddedEffect) -> bool {
    // What happened once is put right by finding the zeros anew: nothing to command by.
    effect::kind(&added.id.name).is_some_and(|kind| kind.is_event)
}

/// Where a target (the first, where none is named) is at each pose, mm, frame of the measurements: by the whole model, with everything that was found
/// and added.
///
/// # Errors
/// [`PredictionError`]
pub fn points(
    model: &Model,
    target: Option<&str>,
    poses: &[Pose],
) -> Result<Vec<Vector3<f64>>, PredictionError> {
    Ok(bodies(model, target, poses)?.iter().map(|body| body.translation.vector).collect())
}

/// The same with how the target is turned there, by its axes on the flange.
///
/// # Errors
/// [`PredictionError`]
pub fn bodies(
    model: &Model,
    target: Option<&str>,
    poses: &[Pose],
) -> Result<Vec<IsometryMatrix3<f64>>, PredictionError> {
    let index = match target {
        None => 0,
        Some(name) => model.targets.iter().position(|target| target.name == name).ok_or_else(|| {
            let known: Vec<&str> = model.targets.iter().map(|target| target.name.as_str()).collect();
            PredictionError::UnknownTarget(name.to_owned(), format!("there are {}", known.join(", ")))
        })?,
    };
    let target = model.targets.get(index).ok_or(PredictionError::NoTarget)?;
    // The fit's own model predicts: what a cell is given is what was fitted.
    let joints = model.chain.len();
    let mut table =
        Table { source: "pose".to_owned(), joints, approach: Some(Vec::new()), ..Table::default() };
    let measured =
        PositionColumns { number: 0, target: target.name.clone(), xyz: vec![[0.0; 3]; poses.len()] };
    let mut payloads = Vec::new();
    for (row, pose) in poses.iter().enumerate() {
        table.q.extend((0..joints).map(|joint| pose.q.get(joint).copied().unwrap_or(0.0)));
        if let Some(approach) = &mut table.approach {
            approach.extend((0..joints).map(|joint| pose.approach.get(joint).copied().unwrap_or(0)));
        }
        table.lines.push(u32::try_from(row).unwrap_or(u32::MAX));
        table.note(None, None);
        // A load is of a pose, not of the table.
        payloads.push(pose.payload);
    }
    table.payload = Some(payloads);
    table.positions.push(measured);
    let observations = Observations::new(model, &table)?;
    let effects: Vec<AddedEffect> =
        model.fitted.iter().chain(&model.effects).filter(|added| !is_event(added)).cloned().collect();
    let problem = ResidualModel::new(model, &table, &observations, &effects)?;
    let state = problem.start();
    Ok((0..poses.len()).map(|row| problem.believed_body(&state, index, row)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A beam of 1 m that turns in the vertical plane, 2 kg at its end, with everything found of it.
    const BEAM: &str = "
arm: beam
convention: distal
joints: [{name: pivot, a_mm: 1000}]
links: [{after: pivot, mass_kg: 2, centre_mm: [0, 0, 0]}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [90, 0, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0]}, p2: {xyz_mm: [100, 0, 0]}}
measured_from: world
effects:
  - {effect: joint_compliance, where: pivot, values: {compliance: 1.0e-6}}
  - {effect: joint_backlash, where: pivot, values: {play_deg: 0.2}}
  - {effect: joint_step, where: pivot, searched: 5, values: {step_deg: 3}}
fitted: [{effect: joint_zero, where: pivot, values: {zero_deg: 1}}]
";

    fn at(target: Option<&str>, pose: Pose) -> Vector3<f64> {
        let model = Model::parse("beam.yaml", BEAM).unwrap();
        points(&model, target, &[pose]).unwrap()[0]
    }

    fn level() -> Pose {
        Pose { q: vec![0.0], ..Pose::default() }
    }

    #[test]
    fn everything_found_counts_but_what_happened_once() {
        let model = Model::parse("beam.yaml", BEAM).unwrap();
        assert_eq!(left_out(&model), ["joint_step(pivot)"]);
        // The zero lifts the end, its weight lets it down: 2 kg at 1 m, 1e-6 rad/(N m).
        let angle = 1_f64.to_radians() - 2.0 * 9.80665 * 1_f64.to_radians().cos() * 1e-6;
        let expected = Vector3::new(1000.0 * angle.cos(), 0.0, 1000.0 * angle.sin());
        assert!((at(None, level()) - expected).norm() < 1e-4, "{} {expected}", at(None, level()));
    }

    #[test]
    fn a_load_and_the_side_of_approach_of_the_pose_count() {
        let plain = at(None, level()).z;
        let loaded = at(None, Pose { payload: 3.0, ..level() }).z;
        assert!((loaded - plain + 3.0 * 9.80665 * 1e-6 * 1000.0).abs() < 1e-4, "{}", loaded - plain);
        let side = |side: i8| at(None, Pose { approach: vec![side], ..level() }).z;
        let play = 0.2_f64.to_radians() * 1000.0;
        assert!((side(-1) - side(1) - play).abs() < 0.01, "{}", side(-1) - side(1));
    }

    #[test]
    fn a_target_is_taken_by_its_name() {
        assert!((at(Some("p2"), level()) - at(Some("p1"), level())).norm() - 100.0 < 1e-9);
        assert_eq!(at(Some("p1"), level()), at(None, level()));
        let model = Model::parse("beam.yaml", BEAM).unwrap();
        let unknown = points(&model, Some("p7"), &[level()]).unwrap_err().to_string();
        assert!(unknown.contains("no target `p7`") && unknown.contains("p1, p2"), "{unknown}");
    }
}
