//! `plumb stripe export`: a stored cloud for another program.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::UNIX_EPOCH;

use plumb_cloud::CloudCamera;
use plumb_light_stripe::geometry::read_rig;

use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Write a stored cloud for another program: PLY, PCD, E57, or MCAP with Foxglove's PointCloud and the camera's calibration.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The cloud: a PLY, PCD or E57 file.
    cloud: PathBuf,
    /// Where to; what it becomes is given by the ending: .ply, .pcd (mm), .e57 or .mcap (metres).
    to: PathBuf,
    /// The rig whose camera saw it; goes into an MCAP as its CameraCalibration.
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

/// Only what is new is written.
#[derive(Debug, thiserror::Error)]
#[error("{} is there already; name another file", .0.display())]
struct Exists(PathBuf);

/// Writes it.
///
/// # Errors
/// The file holds no cloud, the rig cannot be read, the new file is there already or cannot be written.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let cloud = plumb_cloud::read(&arguments.cloud)?;
    let camera = match &arguments.rig {
        None => None,
        Some(path) => {
            let camera = read_rig(path)?.camera;
            let lens = camera.distortion;
            Some(CloudCamera {
                size_px: [camera.width_px, camera.height_px],
                focal_px: [camera.fx_px, camera.fy_px],
                centre_px: [camera.cx_px, camera.cy_px],
                distortion: [lens.k1, lens.k2, lens.p1, lens.p2, lens.k3],
            })
        }
    };
    // Only new files: a device or a pipe, /dev/full among them, is there already.
    if arguments.to.symlink_metadata().is_ok() {
        return Err(Exists(arguments.to.clone()).into());
    }
    // A scan is as old as its file.
    let taken = fs::metadata(&arguments.cloud).and_then(|file| file.modified()).ok();
    let time_ns =
        taken.and_then(|time| time.duration_since(UNIX_EPOCH).ok()).map_or(0, |time| time.as_nanos() as u64);
    plumb_cloud::write(&cloud, &arguments.to, time_ns, camera.as_ref())?;
    print_line!("{} points in {}", cloud.points.len(), arguments.to.display())?;
    Ok(ExitCode::SUCCESS)
}
