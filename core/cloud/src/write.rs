//! Clouds for other programs: PLY, PCD, E57 and MCAP, by the file's ending.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use crate::cloud::Cloud;
use crate::e57::e57;
use crate::errors::WriteError;
use crate::foxglove::{CloudCamera, mcap};

/// Writes the cloud into a file by its ending: `.ply` or `.pcd` (mm), `.e57` or `.mcap` (metres, as these formats have it). `time_ns` (since 1970) and the camera
/// go into an MCAP.
///
/// # Errors
/// [`WriteError`], also for another ending.
pub fn write(
    cloud: &Cloud,
    path: &Path,
    time_ns: u64,
    camera: Option<&CloudCamera>,
) -> Result<(), WriteError> {
    let failed = |cause: io::Error| WriteError { path: path.to_owned(), cause };
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let bytes = match ending.as_str() {
        "ply" => Ok(cloud.ply()),
        "pcd" => Ok(cloud.pcd()),
        "e57" => e57(cloud).map_err(io::Error::other),
        "mcap" => mcap(cloud, time_ns, camera).map_err(io::Error::other),
        _ => Err(io::Error::other(format!(
            "clouds are written as .ply, .pcd, .e57 and .mcap, not as `.{ending}`"
        ))),
    };
    let bytes = bytes.map_err(failed)?;
    // Half a cloud would be taken for a whole one.
    fs::File::create_new(path).map_err(failed)?.write_all(&bytes).map_err(|cause| {
        let _removed = fs::remove_file(path);
        failed(cause)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::CloudPoint;
    use crate::read::read;
    use nalgebra::Point3;
    use plumb_plugin::StripePoint;
    use serde_json::{Value, json};

    fn cloud() -> Cloud {
        let point = |number: u32| CloudPoint {
            position: Point3::new(f64::from(number), 530.5, -300.0 + 0.25 * f64::from(number)),
            stripe: number / 10,
            seen: StripePoint {
                v_px: (number % 10) as f32,
                width_px: 5.0,
                intensity: 200.0,
                sigma_mm: 0.045,
                ..StripePoint::default()
            },
        };
        Cloud { points: (0..95).map(point).collect(), ..Cloud::default() }
    }

    #[test]
    fn a_cloud_comes_back_from_ply_pcd_and_e57_as_it_went() {
        let folder = tempfile::tempdir().unwrap();
        for ending in ["ply", "pcd", "e57"] {
            let path = folder.path().join(format!("cloud.{ending}"));
            write(&cloud(), &path, 0, None).unwrap();
            let back = read(&path).unwrap();
            assert_eq!(back.points.len(), 95, "{ending}");
            for (back, went) in back.points.iter().zip(&cloud().points) {
                assert!((back.position - went.position).norm() < 1e-4, "{ending}: {back:?}");
                assert_eq!((back.stripe, back.seen.v_px), (went.stripe, went.seen.v_px), "{ending}");
                assert_eq!(back.seen.intensity, 200.0, "{ending}");
            }
        }
    }

    #[test]
    fn what_was_cut_short_anywhere_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        for (ending, bytes) in
            [("ply", cloud().ply()), ("pcd", cloud().pcd()), ("e57", e57(&cloud()).unwrap())]
        {
            let path = folder.path().join(format!("cloud.{ending}"));
            for length in (0..bytes.len() - 1).step_by(37) {
                fs::write(&path, &bytes[..length]).unwrap();
                let error = read(&path).unwrap_err().to_string();
                assert!(error.contains(&format!("cloud.{ending}: ")), "{error}");
            }
        }
    }

    #[test]
    fn clouds_of_other_programs_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let given = |name: &str, text: &str| {
            fs::write(folder.path().join(name), text).unwrap();
            read(&folder.path().join(name))
        };
        let ply = "ply\nformat ascii 1.0\ncomment units m\nelement vertex 2\nproperty double x\nproperty double y\n\
            property double z\nproperty float scalar_Intensity\nelement face 0\nproperty list uchar int vertex_indices\n\
            end_header\n0.1 0.2 0.3 7\n1 2 nan 9\n";
        let cloud = given("a.ply", ply).unwrap();
        assert_eq!(cloud.points.len(), 1, "a place that is no place is left out");
        assert_eq!(
            (cloud.points[0].position, cloud.points[0].seen.intensity),
            (Point3::new(100.0, 200.0, 300.0), 7.0)
        );
        let pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 3\nWIDTH 1\n\
            HEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 0 0 1\n";
        assert_eq!(given("a.pcd", pcd).unwrap().points[0].position, Point3::new(1.0, 2.0, 3.0));
        let message_for = |name: &str, text: &str| given(name, text).unwrap_err().to_string();
        assert!(
            message_for("b.pcd", &pcd.replace("ascii", "binary_compressed"))
                .contains("ascii and binary are read")
        );
        assert!(message_for("b.ply", &ply.replace("double z", "double w")).contains("no x, y and z"));
        assert!(
            message_for("c.ply", &ply.replace("vertex 2", "vertex 3")).contains("2 of 3 points are there")
        );
        assert!(message_for("d.ply", &ply.replace("vertex 2", "vertex 0")).contains("holds no point"));
        assert!(message_for("e.xyz", "1 2 3").contains("not from `.xyz`"));
    }

    #[test]
    fn an_mcap_holds_foxgloves_cloud_and_camera() {
        let camera = CloudCamera {
            size_px: [256, 256],
            focal_px: [694.4, 694.5],
            centre_px: [127.5, 127.0],
            distortion: [-0.1, 0.0, 0.0, 0.0, 0.0],
        };
        let bytes = crate::foxglove::mcap(&cloud(), 1_500_000_000, Some(&camera)).unwrap();
        let messages: Vec<_> =
            ::mcap::MessageStream::new(&bytes).unwrap().collect::<Result<Vec<_>, _>>().unwrap();
        let names: Vec<&str> =
            messages.iter().map(|message| message.channel.schema.as_ref().unwrap().name.as_str()).collect();
        assert_eq!(names, ["foxglove.CameraCalibration", "foxglove.PointCloud"]);
        let values: Vec<Value> =
            messages.iter().map(|message| serde_json::from_slice(&message.data).unwrap()).collect();
        assert_eq!(values[0]["K"][4], 694.5);
        assert_eq!(
            (&values[1]["timestamp"]["nsec"], &values[1]["point_stride"]),
            (&json!(500_000_000), &json!(32))
        );
        assert_eq!(values[1]["data"].as_str().unwrap().len(), (95 * 32_usize).div_ceil(3) * 4);
    }
}
