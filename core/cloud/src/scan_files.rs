//! What a scan leaves: its cloud as PLY and PCD, and the two tables the calibration reads.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::cloud::Cloud;
use crate::errors::WriteError;

impl Cloud {
    /// Writes `name.ply`, `name.pcd`, and for the calibration `name.poses.csv` and `name.stripes.csv`, in which the surface is called `on`. `joints` are
    /// the names of the robot's. Where the folder holds a cloud of that name, this is `name-2`, and so on. Gives the name it took.
    ///
    /// # Errors
    /// [`WriteError`]
    pub fn save(&self, folder: &Path, name: &str, joints: &[String], on: &str) -> Result<String, WriteError> {
        let taken = |name: &String| folder.join(format!("{name}.ply")).exists();
        let name = std::iter::once(name.to_owned())
            .chain((2..).map(|number| format!("{name}-{number}")))
            .find(|name| !taken(name))
            .unwrap_or_default();
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |cause| WriteError { path, cause }
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

    /// The joints at each stripe: a measurement table of the lab.
    fn poses_table(&self, joints: &[String]) -> String {
        let numbers = 1..=joints.len();
        let dated = self.times.len() == self.poses.len();
        let time = dated.then(|| "time_s".to_owned()).into_iter();
        let columns = numbers.clone().map(|joint| format!("q{joint}_deg"));
        let sides = numbers.clone().map(|joint| format!("approach_q{joint}"));
        let flown = self.speeds.iter().flatten().any(|speed| *speed != 0.0);
        let speeds = numbers.filter(|_| flown).map(|joint| format!("speed_q{joint}_deg_s"));
        let mut text =
            format!("{}\n", columns.chain(sides).chain(speeds).chain(time).collect::<Vec<_>>().join(","));
        for (row, pose) in self.poses.iter().enumerate() {
            let values = pose.iter().map(|joint| format!("{:.9}", joint.to_degrees()));
            let time = self.times.get(row).filter(|_| dated).map(|time| format!("{time:.4}")).into_iter();
            let sides = self.approaches.get(row).map(Vec::as_slice).unwrap_or_default();
            let sides = (0..pose.len()).map(|joint| sides.get(joint).copied().unwrap_or(0).to_string());
            let speeds = self.speeds.get(row).filter(|_| flown).map(Vec::as_slice).unwrap_or_default();
            let speeds = speeds.iter().map(|speed| format!("{:.6}", speed.to_degrees()));
            let _ = writeln!(
                text,
                "{}",
                values.chain(sides).chain(speeds).chain(time).collect::<Vec<_>>().join(",")
            );
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_fast_the_joints_went_is_in_the_table_of_a_scan_in_motion_alone() {
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
        cloud.times = vec![12.5];
        let table = cloud.poses_table(&["a".to_owned(), "b".to_owned()]);
        assert!(table.lines().next().unwrap().ends_with(",speed_q2_deg_s,time_s"), "{table}");
        assert!(table.lines().nth(1).unwrap().ends_with(",0.000000,12.5000"), "{table}");
    }
}
