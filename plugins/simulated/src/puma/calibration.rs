//! The controller's calibration file: by how much the zero of each joint was moved since the arm came, so that a calibration outlives the day.

use std::io;
use std::path::Path;

use super::joints::{AXES, JOINTS};

/// The first line of the file.
const HEADING: &str = "# Zero references of a simulated PUMA's controller, moved by POTCAL by so many degrees. Without this file they are as they came.";

/// The shifts it holds, rad; none when there is no such file, or none that can be read.
pub(super) fn read(file: &Path) -> Option<[f64; AXES]> {
    let text = plumb_document::read_text(file, plumb_document::FileKind::CALIBRATION).ok()?;
    let mut shifts = [0.0; AXES];
    for (shift, joint) in shifts.iter_mut().zip(&JOINTS) {
        let line = text.lines().find_map(|line| line.strip_prefix(joint.name)?.strip_prefix(':'))?;
        *shift = line.trim().parse::<f64>().ok().filter(|shift| shift.is_finite())?.to_radians();
    }
    Some(shifts)
}

/// Writes it whole.
pub(super) fn write(file: &Path, shifts: &[f64; AXES]) -> io::Result<()> {
    let mut text = format!("{HEADING}\n");
    for (shift, joint) in shifts.iter().zip(&JOINTS) {
        text.push_str(&format!("{}: {}\n", joint.name, shift.to_degrees()));
    }
    std::fs::write(file, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_again_and_what_is_none_is_not_taken() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("potcal.txt");
        assert_eq!(read(&file), None);
        let shifts = [0.0, 0.01, -0.02, 0.03, -0.04, 0.05];
        write(&file, &shifts).expect("written");
        let read_again = read(&file).expect("a calibration");
        for (shift, again) in shifts.iter().zip(read_again) {
            assert!((shift - again).abs() < 1e-15);
        }
        std::fs::write(&file, "waist: much").expect("written");
        assert_eq!(read(&file), None);
    }
}
