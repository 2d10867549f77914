//! The controller's calibration file: by how much the zero of each joint was moved since the arm came, so that a calibration outlives the day.

use std::io;
use std::path::Path;

use super::drive::JointDrive;

/// The first line of the file.
const HEADING: &str = "# Zero references of a simulated arm's controller, moved by its calibration by so many degrees or millimetres. Without this file they are as they came.";

/// The shifts it holds, rad or mm; none when there is no such file, or none that can be read.
pub(super) fn read(file: &Path, joints: &[JointDrive]) -> Option<Vec<f64>> {
    let text = plumb_document::read_text(file, plumb_document::FileKind::CALIBRATION).ok()?;
    let shift = |joint: &JointDrive| {
        let line = text.lines().find_map(|line| line.strip_prefix(&joint.name)?.strip_prefix(':'))?;
        let written = line.trim().parse::<f64>().ok().filter(|shift| shift.is_finite())?;
        Some(joint.read(written))
    };
    joints.iter().map(shift).collect()
}

/// Writes it whole.
pub(super) fn write(file: &Path, joints: &[JointDrive], shifts: &[f64]) -> io::Result<()> {
    let mut text = format!("{HEADING}\n");
    for (shift, joint) in shifts.iter().zip(joints) {
        text.push_str(&format!("{}: {}\n", joint.name, joint.written(*shift)));
    }
    std::fs::write(file, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::puma560;

    #[test]
    fn what_was_written_is_read_again_and_what_is_none_is_not_taken() {
        let joints = puma560::drive().joints;
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("potcal.txt");
        assert_eq!(read(&file, &joints), None);
        let shifts = [0.0, 0.01, -0.02, 0.03, -0.04, 0.05];
        write(&file, &joints, &shifts).expect("written");
        let read_again = read(&file, &joints).expect("a calibration");
        for (shift, again) in shifts.iter().zip(read_again) {
            assert!((shift - again).abs() < 1e-15);
        }
        std::fs::write(&file, "waist: much").expect("written");
        assert_eq!(read(&file, &joints), None);
    }
}
