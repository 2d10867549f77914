//! Tables with headers of their own, as people bring them to the model lab.

use std::fs;

use crate::lab::Lab;

/// A cell with a model of two joints, a table measured on that arm, and the table's text with other headers.
struct Brought {
    lab: Lab,
}

/// Two links in a plane.
const MODEL: &str = "arm: planar
convention: distal
joints:
  - {name: shoulder, a_mm: 300, alpha_deg: 0, d_mm: 0, limits_deg: [-170, 170]}
  - {name: elbow, a_mm: 200, alpha_deg: 0, d_mm: 0, limits_deg: [-170, 170]}
targets: {p1: {xyz_mm: [0, 0, 0]}}
noise: {p1_mm: 0.05}
free: [joint_zero(elbow)]
effects: []
";

impl Brought {
    fn new(header: &str) -> Self {
        let lab = Lab::new();
        lab.write("planar.yaml", MODEL);
        let brought = Self { lab };
        brought.write(header);
        brought
    }

    /// Thirty poses of an elbow that is off by a fifth of a degree.
    fn write(&self, header: &str) {
        let mut text = format!("{header}\n");
        let extra = header.matches(',').count() - 4;
        for row in 0..30_u32 {
            let (q1, q2) = (f64::from(row * 37 % 120) - 60.0, f64::from(row * 53 % 140) - 70.0);
            let (first, both) = (q1.to_radians(), (q1 + q2 + 0.2).to_radians());
            let noise = |seed: u32| f64::from((row * seed) % 7) * 0.01 - 0.03;
            let x = 300.0 * first.cos() + 200.0 * both.cos() + noise(3);
            let y = 300.0 * first.sin() + 200.0 * both.sin() + noise(5);
            text.push_str(&format!("{q1},{q2},{x:.4},{y:.4},0.0{}\n", ",1".repeat(extra)));
        }
        self.lab.write("table.csv", &text);
    }

    /// What `compare` says, with more options.
    fn compare(&self, more: &[&str]) -> crate::lab::CommandOutput {
        let mut arguments = vec!["model", "compare", "planar.yaml", "--data", "table.csv"];
        arguments.extend(more);
        self.lab.plumb(&arguments)
    }
}

#[test]
fn the_models_own_names_and_named_columns_read_as_the_usual_headers_do() {
    let brought = Brought::new("q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm");
    let usual = brought.compare(&[]);
    assert_eq!(usual.code(), 0, "{}", usual.all());
    brought.write("shoulder_deg,elbow_deg,p1_x_mm,p1_y_mm,p1_z_mm");
    assert_eq!(brought.compare(&[]).out(), usual.out(), "joints by the model's names");
    brought.write("J1,J2,X,Y [mm],z,p1_qw");
    let named = brought.compare(&[
        "--columns",
        "J1=q1_deg,J2=elbow_deg,X=p1_x_mm,Y [mm]=p1_y_mm",
        "--columns",
        "z=p1_z_mm,p1_qw=",
    ]);
    assert_eq!(named.out(), usual.out(), "{}", named.err());
}

#[test]
fn the_option_that_an_error_prints_reads_the_table() {
    let brought = Brought::new("J1,J2,X [mm],Y [mm],Z [mm]");
    let refused = brought.compare(&[]);
    assert_eq!(refused.code(), 2);
    let (_, option) =
        refused.err().split_once("--columns '").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    let option = option.split('\'').next().unwrap();
    assert_eq!(
        option,
        "J1=q1_deg,J2=q2_deg,X [mm]=p1_x_mm,Y [mm]=p1_y_mm,Z [mm]=p1_z_mm",
        "{}",
        refused.err()
    );
    let read = brought.compare(&["--columns", option]);
    assert_eq!(read.code(), 0, "{}", read.all());
    brought.write("q1_deg,q2_deg,x_mm,y_mm,z_mm");
    let nothing = brought.compare(&[]);
    assert!(
        nothing.err().contains("nothing was measured")
            && nothing.err().contains("--columns x_mm=p1_x_mm,y_mm=p1_y_mm,z_mm=p1_z_mm"),
        "{}",
        nothing.err()
    );
}

#[test]
fn every_missing_unit_and_every_orientation_is_reported_at_once() {
    let brought = Brought::new("shoulder,q2,p1_x,p1_y_mm,p1_z_mm,p1_quat_w,yaw_deg");
    let output = brought.compare(&[]);
    assert_eq!(output.code(), 2);
    let stderr = output.err();
    assert!(stderr.starts_with("plumb: table.csv: 5 columns of line 1 cannot be read\n"), "{stderr}");
    for line in [
        "column 1 (`shoulder`): the unit is missing: write q1_deg, q1_rad",
        "column 2 (`q2`): the unit is missing",
        "column 3 (`p1_x`): the unit is missing: write p1_x_mm",
        "column 6 (`p1_quat_w`): orientations are called p1_qw, p1_qx",
        "--columns p1_quat_w=p1_qw;",
        "angles about axes do not say in which order they turn",
        "--columns yaw_deg= leaves the column out",
    ] {
        assert!(stderr.contains(line), "{line}\n{stderr}");
    }
}

#[test]
fn a_column_that_is_not_there_and_one_that_is_said_twice_are_refused() {
    let brought = Brought::new("shoulder_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm");
    let lost = brought.compare(&["--columns", "shuolder_deg=q1_deg"]).err();
    assert_eq!(
        lost,
        "plumb: table.csv: there is no column `shuolder_deg` to read as `q1_deg`; did you mean `shoulder_deg`?\n"
    );
    let twice = brought.compare(&["--columns", "p1_z_mm=q1_rad"]).err();
    assert!(
        twice.contains("column 5 (`p1_z_mm`): it says the same as `shoulder_deg`, in another unit; keep one"),
        "{twice}"
    );
    let form = brought.compare(&["--columns", "J1"]);
    assert_eq!(form.code(), 2);
    assert!(form.err().contains("write OLD=NEW, as in J1=q1_deg"), "{}", form.err());
    assert!(fs::metadata(brought.lab.path("planar.rev1.yaml")).is_err(), "nothing was written");
}
