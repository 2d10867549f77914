//! A cloud as files: PLY, PCD, and the two tables the model lab reads.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{Cloud, CloudPoint};

/// Why a cloud was not written.
#[derive(Debug, thiserror::Error)]
#[error("{} cannot be written: {cause}", path.display())]
pub struct SaveError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system said.
    pub cause: io::Error,
}

/// What a point has beside its place, in single precision.
const SCALARS: [&str; 5] = ["intensity", "width", "sigma", "stripe", "row"];

fn scalars(point: &CloudPoint) -> [f32; 5] {
    let seen = &point.seen;
    [seen.intensity, seen.width_px, seen.sigma_mm, point.stripe as f32, seen.v_px]
}

impl Cloud {
    /// Writes `name.ply`, `name.pcd`, and for the model lab `name.poses.csv` and `name.stripes.csv`, in which the surface is called `on`. `joints` are
    /// the names of the robot's. Where the folder holds a cloud of that name, this is `name-2`, and so on. Gives the name it took.
    ///
    /// # Errors
    /// [`SaveError`]
    pub fn save(&self, folder: &Path, name: &str, joints: &[String], on: &str) -> Result<String, SaveError> {
        let taken = |name: &String| folder.join(format!("{name}.ply")).exists();
        let name = std::iter::once(name.to_owned())
            .chain((2..).map(|number| format!("{name}-{number}")))
            .find(|name| !taken(name))
            .unwrap_or_default();
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |cause| SaveError { path, cause }
        };
        fs::create_dir_all(folder).map_err(failed(folder))?;
        let write = |ending: &str, bytes: &[u8]| {
            let path = folder.join(format!("{name}.{ending}"));
            fs::write(&path, bytes).map_err(failed(&path))
        };
        write("ply", &self.ply())?;
        write("pcd", &self.pcd())?;
        write("poses.csv", self.poses_table(joints).as_bytes())?;
        write("stripes.csv", self.stripes_table(on).as_bytes())?;
        Ok(name)
    }

    /// Binary PLY in single precision, which every reader takes; grey as colour beside the scalars, so that every viewer shows something.
    pub fn ply(&self) -> Vec<u8> {
        let mut head = format!(
            "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\n",
            self.points.len()
        );
        for scalar in SCALARS {
            let _ = writeln!(head, "property float {scalar}");
        }
        head.push_str("property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
        let mut bytes = head.into_bytes();
        for point in &self.points {
            push_floats(&mut bytes, point);
            bytes.extend([point.seen.intensity.clamp(0.0, 255.0) as u8; 3]);
        }
        bytes
    }

    /// Binary PCD of version 0.7.
    pub fn pcd(&self) -> Vec<u8> {
        let count = self.points.len();
        let fields = SCALARS.join(" ");
        let eight = |word: &str| [word; 8].join(" ");
        let head = format!(
            "# units mm\nVERSION 0.7\nFIELDS x y z {fields}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {count}\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
            eight("4"),
            eight("F"),
            eight("1")
        );
        let mut bytes = head.into_bytes();
        self.points.iter().for_each(|point| push_floats(&mut bytes, point));
        bytes
    }

    /// The joints at each stripe: a measurement table of the lab.
    fn poses_table(&self, joints: &[String]) -> String {
        let numbers = 1..=joints.len();
        let columns = numbers.clone().map(|joint| format!("q{joint}_deg"));
        let sides = numbers.clone().map(|joint| format!("approach_q{joint}"));
        let flown = self.speeds.iter().flatten().any(|speed| *speed != 0.0);
        let speeds = numbers.filter(|_| flown).map(|joint| format!("speed_q{joint}_deg_s"));
        let mut text = format!("{}\n", columns.chain(sides).chain(speeds).collect::<Vec<_>>().join(","));
        for (row, pose) in self.poses.iter().enumerate() {
            let values = pose.iter().map(|joint| format!("{:.9}", joint.to_degrees()));
            let sides = self.approaches.get(row).map(Vec::as_slice).unwrap_or_default();
            let sides = (0..pose.len()).map(|joint| sides.get(joint).copied().unwrap_or(0).to_string());
            let speeds = self.speeds.get(row).filter(|_| flown).map(Vec::as_slice).unwrap_or_default();
            let speeds = speeds.iter().map(|speed| format!("{:.6}", speed.to_degrees()));
            let _ = writeln!(text, "{}", values.chain(sides).chain(speeds).collect::<Vec<_>>().join(","));
        }
        text
    }

    /// The stripes' points in their pictures; `row` counts the rows of the first table from 1.
    fn stripes_table(&self, on: &str) -> String {
        let mut text = "row,u_px,v_px,sigma_px,on\n".to_owned();
        for point in &self.points {
            let seen = &point.seen;
            let _ = writeln!(
                text,
                "{},{:.5},{:.1},{:.5},{on}",
                point.stripe + 1,
                seen.u_px,
                seen.v_px,
                seen.sigma_px
            );
        }
        text
    }
}

fn push_floats(bytes: &mut Vec<u8>, point: &CloudPoint) {
    let place = point.place.coords.map(|axis| axis as f32);
    for value in place.iter().copied().chain(scalars(point)) {
        bytes.extend(value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn how_fast_the_joints_went_stands_in_the_table_of_a_scan_in_motion_alone() {
        let mut cloud =
            Cloud { poses: vec![vec![0.5; 2]], approaches: vec![vec![1, -1]], ..Cloud::default() };
        cloud.speeds = vec![vec![0.0; 2]];
        assert!(
            cloud
                .poses_table(&["a".to_owned(), "b".to_owned()])
                .starts_with("q1_deg,q2_deg,approach_q1,approach_q2\n")
        );
        cloud.speeds = vec![vec![1_f64.to_radians(), 0.0]];
        let table = cloud.poses_table(&["a".to_owned(), "b".to_owned()]);
        assert!(table.lines().next().unwrap().ends_with(",speed_q1_deg_s,speed_q2_deg_s"), "{table}");
        assert!(table.lines().nth(1).unwrap().ends_with(",1,-1,1.000000,0.000000"), "{table}");
    }

    #[test]
    fn both_formats_hold_as_many_bytes_as_their_headers_say() {
        let point = CloudPoint { place: Point3::new(1.0, 2.0, 3.0), stripe: 4, seen: Default::default() };
        let cloud = Cloud { points: vec![point; 7], poses: vec![vec![0.5; 6]], ..Cloud::default() };
        let after = |bytes: &[u8], mark: &[u8]| {
            let at = bytes.windows(mark.len()).position(|window| window == mark).unwrap();
            bytes.len() - at - mark.len()
        };
        assert_eq!(after(&cloud.ply(), b"end_header\n"), 7 * (8 * 4 + 3));
        assert_eq!(after(&cloud.pcd(), b"DATA binary\n"), 7 * 8 * 4);
        assert!(String::from_utf8_lossy(&cloud.ply()).contains("comment units mm"));
    }
}
