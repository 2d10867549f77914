//! What a cell file gives under `config:`.

use std::path::{Path, PathBuf};

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

use crate::grey::{FORMATS, GreyFormat};

/// Which camera, and how it is set. What is left out stays as the camera is set.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    pub(crate) device: PathBuf,
    #[serde(default)]
    pub(crate) width_px: Option<u32>,
    #[serde(default)]
    pub(crate) height_px: Option<u32>,
    /// The name of a [`GreyFormat`].
    #[serde(default)]
    format: Option<String>,
    #[serde(default)]
    pub(crate) frames_per_second: Option<f64>,
    #[serde(default)]
    pub(crate) exposure_us: Option<f64>,
    #[serde(default)]
    pub(crate) gain: Option<i64>,
    #[serde(default)]
    pub(crate) every_ms: f64,
}

/// What can be changed while it runs.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    every_ms: f64,
}

impl Config {
    pub(crate) fn read(value: &Value) -> Result<Self, PluginError> {
        let config = Self::deserialize(value).map_err(|error| {
            let takes = "a camera takes {device: /dev/video0, width_px, height_px, format, frames_per_second, exposure_us, gain, every_ms}";
            PluginError::Refused(format!("{error}; {takes}"))
        })?;
        let positive = |value: Option<f64>, most: f64| value.is_none_or(|value| value > 0.0 && value <= most);
        if !positive(config.frames_per_second, 1e4) {
            return Err(PluginError::Refused("`frames_per_second` is above 0, up to 10000".to_owned()));
        }
        if !positive(config.exposure_us, 1e6) {
            return Err(PluginError::Refused("`exposure_us` is above 0, up to 1000000".to_owned()));
        }
        config.formats()?;
        every_ns(config.every_ms)?;
        Ok(config)
    }

    /// The formats that may be chosen, the best first.
    pub(crate) fn formats(&self) -> Result<Vec<GreyFormat>, PluginError> {
        let Some(name) = &self.format else { return Ok(FORMATS.to_vec()) };
        GreyFormat::named(name).map(|format| vec![format]).ok_or_else(|| {
            let known = FORMATS.map(|format| format.name()).join(", ");
            let compressed = ["MJPG", "MJPEG", "JPEG", "H264", "HEVC"].contains(&name.as_str());
            let why = if compressed { " is compressed, which moves the edges of a line" } else { " is none" };
            PluginError::Refused(format!("`format: {name}`{why}: write one of {known}"))
        })
    }

    pub(crate) fn device(&self) -> &Path {
        &self.device
    }

    /// How long the shutter is open, ns, where that is known.
    pub(crate) fn exposure_ns(&self) -> Option<u64> {
        self.exposure_us.map(|exposure_us| (exposure_us * 1e3) as u64)
    }
}

impl Settings {
    pub(crate) fn read(value: &Value) -> Result<Self, PluginError> {
        Self::deserialize(value).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; while it runs a camera takes {{every_ms: ms}}, and the rest when it is started"
            ))
        })
    }

    /// From picture to picture, ns; none for pictures when asked.
    pub(crate) fn every_ns(self) -> Result<Option<u64>, PluginError> {
        every_ns(self.every_ms)
    }
}

/// Milliseconds as nanoseconds; none for 0.
pub(crate) fn every_ns(every_ms: f64) -> Result<Option<u64>, PluginError> {
    if !(0.0..=60_000.0).contains(&every_ms) {
        return Err(PluginError::Refused(format!("`every_ms` is {every_ms}; it is 0 to 60000")));
    }
    Ok((every_ms > 0.0).then_some((every_ms * 1e6) as u64))
}
