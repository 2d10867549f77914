//! Where a model says the arm's point is: what a cell commands and converts by.

use nalgebra::Vector3;

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
    /// Side each joint arrived from: -1, 0 (not known), 1; may be empty.
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
    all.filter(|added| is_left_out(added)).map(|added| model.label(&added.id)).collect()
}

fn is_left_out(added: &AddedEffect) -> bool {
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
    let place = match target {
        None => 0,
        Some(name) => model.targets.iter().position(|target| target.name == name).ok_or_else(|| {
            let known: Vec<&str> = model.targets.iter().map(|target| target.name.as_str()).collect();
            PredictionError::UnknownTarget(name.to_owned(), format!("there are {}", known.join(", ")))
        })?,
    };
    let target = model.targets.get(place).ok_or(PredictionError::NoTarget)?;
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
        payloads.push(pose.payload);
    }
    table.payload = Some(payloads);
    table.positions.push(measured);
    let observations = Observations::new(model, &table)?;
    let effects: Vec<AddedEffect> =
        model.fitted.iter().chain(&model.effects).filter(|added| !is_left_out(added)).cloned().collect();
    let machine = ResidualModel::new(model, &table, &observations, &effects)?;
    let state = machine.start();
    Ok((0..poses.len()).map(|row| machine.believed_target(&state, place, row)).collect())
}
