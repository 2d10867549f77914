//! The calibration file: which way each servo counts, and the homing offset it had then. It is laid out as LeRobot lays out its own, so that either
//! program reads what the other has written: a JSON object of joints, each with `id`, `drive_mode` (1: reversed), `homing_offset`, `range_min` and `range_max`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plumb_document::{FileKind, ReadError, read_text};
use serde::{Deserialize, Serialize};

/// What the file keeps of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Kept {
    /// The servo's number.
    pub(crate) id: u8,
    /// 1: the servo counts down where the angle grows.
    pub(crate) drive_mode: u8,
    /// Of its register, steps.
    pub(crate) homing_offset: i32,
    /// The lowest it goes, steps.
    pub(crate) range_min: i32,
    /// The highest, steps.
    pub(crate) range_max: i32,
}

/// What the file keeps, joint by joint.
pub(crate) type Calibration = BTreeMap<String, Kept>;

/// What is wrong with the file.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CalibrationError {
    #[error("the calibration file {} cannot be read: {error}", file.display())]
    Read { file: PathBuf, error: ReadError },
    #[error("the calibration file {} is not laid out as one: {error}; put it away, and calibrate the arm anew", file.display())]
    Layout { file: PathBuf, error: serde_json::Error },
    #[error("the servos were calibrated, but the calibration file {} cannot be written: {error}", file.display())]
    Write { file: PathBuf, error: std::io::Error },
}

/// Reads the file; nothing where there is none yet.
pub(crate) fn read(file: &Path) -> Result<Calibration, CalibrationError> {
    if !file.exists() {
        return Ok(Calibration::new());
    }
    let text = read_text(file, FileKind::CALIBRATION)
        .map_err(|error| CalibrationError::Read { file: file.to_owned(), error })?;
    serde_json::from_str(&text).map_err(|error| CalibrationError::Layout { file: file.to_owned(), error })
}

/// Writes the file: as a whole, or not at all.
pub(crate) fn write(file: &Path, calibration: &Calibration) -> Result<(), CalibrationError> {
    let failed = |error| CalibrationError::Write { file: file.to_owned(), error };
    let text =
        serde_json::to_string_pretty(calibration).map_err(|error| failed(std::io::Error::from(error)))?;
    let unfinished = file.with_extension("unfinished");
    std::fs::write(&unfinished, text + "\n").map_err(failed)?;
    std::fs::rename(&unfinished, file).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ELBOW: Kept = Kept { id: 3, drive_mode: 1, homing_offset: -70, range_min: 900, range_max: 3100 };

    #[test]
    fn it_comes_back_as_it_was_written_and_none_is_empty() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("arm.json");
        assert_eq!(read(&file).unwrap(), Calibration::new());
        let calibration = Calibration::from([("elbow_flex".to_owned(), ELBOW)]);
        write(&file, &calibration).unwrap();
        assert_eq!(read(&file).unwrap(), calibration);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing unfinished is left");
    }

    #[test]
    fn a_file_that_is_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("arm.json");
        std::fs::write(&file, "{\"elbow\": 3}").unwrap();
        assert!(read(&file).unwrap_err().to_string().contains("is not laid out as one"));
        assert!(read(folder.path()).unwrap_err().to_string().contains("cannot be read"));
        let nowhere = folder.path().join("no").join("arm.json");
        assert!(write(&nowhere, &Calibration::new()).unwrap_err().to_string().contains("cannot be written"));
    }
}
