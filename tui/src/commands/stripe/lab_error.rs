//! Why scans cannot be looked at.

use std::path::PathBuf;

use plumb_calibration::effect::EffectNameError;
use plumb_calibration::file::ModelFileError;
use plumb_diagnosis::laboratory::LaboratoryError;
use plumb_diagnosis::stripe::{AdjustError, ScansError, SceneError};
use plumb_light_stripe::geometry::RigFileError;
use plumb_record::RecordError;

/// Why there is nothing to look at.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LabError {
    #[error("{0}")]
    Cell(String),
    #[error("{}: {what}", cell.display())]
    NoStripe { cell: PathBuf, what: &'static str },
    #[error(transparent)]
    Rig(#[from] RigFileError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error("the record's corrections of the rig cannot be used: {0}")]
    Corrections(String),
    #[error(transparent)]
    Model(#[from] ModelFileError),
    #[error(transparent)]
    Scans(#[from] ScansError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    #[error(transparent)]
    Adjust(#[from] AdjustError),
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
    #[error("{}: {what}", path.display())]
    Write { path: PathBuf, what: String },
}
