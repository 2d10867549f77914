//! `plumb model profile`: profiles of a laser line sensor, point by point, become a few points a row of a measurement table.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use plumb_calibration::board_table::NamedText;
use plumb_calibration::profile_table::with_profiles;
use plumb_document::{FileKind, read_text};

/// Options of `profile`.
#[derive(Debug, Args)]
pub(crate) struct ProfileArguments {
    /// The poses: a table with the joints of each profile, `on` (what it lies on) and a column `profile`, its name in the table of points.
    poses: PathBuf,
    /// The points, as the sensor exports them: a table with the columns profile, `x_mm` (along its line), `z_mm` (away from it).
    #[arg(long, value_name = "CSV")]
    points: PathBuf,
    /// How many points are kept of each profile: each is on the parabola through its part of the profile.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=60))]
    keep: u16,
}

/// The table of poses with the points of each profile.
pub(super) fn run(arguments: &ProfileArguments) -> Result<String, Box<dyn Error>> {
    let read = |path: &PathBuf| {
        let name = path.display().to_string();
        match read_text(path, FileKind::TABLE) {
            Ok(text) => Ok((name, text)),
            Err(error) => Err(format!("{name}: {error}")),
        }
    };
    let (poses_name, poses) = read(&arguments.poses)?;
    let (points_name, points) = read(&arguments.points)?;
    let poses = NamedText { name: &poses_name, text: &poses };
    let points = NamedText { name: &points_name, text: &points };
    Ok(with_profiles(poses, points, usize::from(arguments.keep))?)
}
