//! What a cell file gives under `config:`.

use std::path::{Path, PathBuf};

use plumb_plugin::{PluginError, Value};
use serde::{Deserialize, Serialize};

use crate::extract::{Centre, Noise, Pieces, Settings, Threshold};
use crate::geometry::RigCorrections;

/// How the sensor works.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) rig: Option<PathBuf>,
    /// What calibrations found of the rig, relative to its file.
    #[serde(default, skip_serializing_if = "RigCorrections::is_none")]
    pub(crate) corrections: RigCorrections,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) frames: Option<Frames>,
    #[serde(default)]
    pub(crate) find: Find,
    #[serde(default = "default_threshold")]
    pub(crate) threshold: Threshold,
    #[serde(default)]
    pub(crate) centre: Centre,
    #[serde(default)]
    pub(crate) noise: Noise,
    #[serde(default = "default_least_rows")]
    pub(crate) least_rows: u32,
    #[serde(default)]
    pub(crate) pieces: Pieces,
    #[serde(default)]
    pub(crate) rays: bool,
    #[serde(default)]
    pub(crate) exposure_delay_ms: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cell_directory: Option<PathBuf>,
}

/// Pictures from files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Frames {
    pub(crate) folder: PathBuf,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) raw_width_px: Option<usize>,
    #[serde(default)]
    pub(crate) again: bool,
}

/// What is looked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Find {
    #[default]
    Stripe,
    BrightSpot,
    DarkSpot,
}

fn default_threshold() -> Threshold {
    Settings::default().threshold
}

fn default_least_rows() -> u32 {
    Settings::default().least_rows
}

impl Config {
    pub(crate) fn read(value: &Value) -> Result<Self, PluginError> {
        let empty = Value::Object(serde_json::Map::new());
        let value = if value.is_null() { &empty } else { value };
        let config = Self::deserialize(value).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; light-stripe takes rig, corrections, frames, find, threshold, centre, noise, least_rows, pieces, rays and exposure_delay_ms"
            ))
        })?;
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<(), PluginError> {
        let wrong = |what: String| Err(PluginError::Refused(what));
        if self.least_rows < 2 {
            return wrong(format!("`least_rows` is {}; a stripe has at least 2", self.least_rows));
        }
        if !(-1000.0..=1000.0).contains(&self.exposure_delay_ms) {
            return wrong(format!("`exposure_delay_ms` is {}; it is -1000 to 1000", self.exposure_delay_ms));
        }
        if self.rig.is_none() && !self.corrections.is_none() {
            return wrong("`corrections` are of a rig: name its file as `rig`".to_owned());
        }
        if let Centre::GaussianDerivative { line_sigma_px } = self.centre
            && !(0.3..=50.0).contains(&line_sigma_px)
        {
            return wrong(format!("`line_sigma_px` is {line_sigma_px}; it is 0.3 to 50"));
        }
        let Noise { dark, per_level, speckle_px } = self.noise;
        if [dark, per_level, speckle_px].iter().any(|value| !(0.0..=1000.0).contains(value)) {
            return wrong("`noise` has a value below 0 or beyond belief".to_owned());
        }
        Ok(())
    }

    /// This configuration with some of its keys changed.
    pub(crate) fn with(&self, changes: &Value) -> Result<Self, PluginError> {
        let Value::Object(changes) = changes else {
            return Err(PluginError::Refused("settings are given as {key: value}".to_owned()));
        };
        let mut merged =
            serde_json::to_value(self).map_err(|error| PluginError::Failed(error.to_string()))?;
        if let Value::Object(keys) = &mut merged {
            keys.extend(changes.clone());
        }
        Self::read(&merged)
    }

    /// A path as the cell file means it.
    pub(crate) fn path(&self, path: &Path) -> PathBuf {
        self.cell_directory.as_ref().map_or_else(|| path.to_owned(), |directory| directory.join(path))
    }

    pub(crate) fn settings(&self) -> Settings {
        Settings {
            threshold: self.threshold,
            centre: self.centre,
            noise: self.noise,
            least_rows: self.least_rows,
            pieces: self.pieces,
        }
    }

    /// Nanoseconds to be added to a picture's time.
    pub(crate) fn delay_ns(&self) -> i64 {
        (self.exposure_delay_ms * 1e6) as i64
    }
}
