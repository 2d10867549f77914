//! Exported arms read by a program of their own, in Python with nothing but its own library: the tip is where the calibrated model has it.

use std::fmt::Write as _;
use std::process::Command;

use crate::lab::{CommandOutput, Lab, skipped};

/// Rows of a UR5 after its maker: a, alpha, d; mm and deg.
const ROWS: [(f64, f64, f64); 6] = [
    (0.0, 90.0, 89.159),
    (-425.0, 0.0, 0.0),
    (-392.25, 0.0, 0.0),
    (0.0, 90.0, 109.15),
    (0.0, -90.0, 94.65),
    (0.0, 0.0, 82.3),
];

const JOINTS: [&str; 6] = ["pan", "lift", "elbow", "wrist1", "wrist2", "wrist3"];

/// Errors of a, alpha, d and zero of each row, as an engineer may find them.
const ERRORS: [(f64, f64, f64, f64); 6] = [
    (-0.7, 0.129, -1.04, 0.3),
    (-0.1, 0.023, 0.0, -0.385),
    (-1.42, 0.052, 0.0, 0.111),
    (1.4, 0.183, -1.89, 0.001),
    (1.25, 0.134, 0.03, -0.327),
    (0.0, 0.0, -1.65, -0.317),
];

/// Where the frame of the last row is, mm: products of the matrices of Denavit and Hartenberg, written out.
fn flange(q: [f64; 6], errors: &[(f64, f64, f64, f64); 6]) -> [f64; 3] {
    let mut at = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    for (((a, alpha, d), (more_a, more_alpha, more_d, zero)), q) in ROWS.iter().zip(errors).zip(q) {
        let (s, c) = (q + zero.to_radians()).sin_cos();
        let (sa, ca) = (alpha + more_alpha).to_radians().sin_cos();
        let (a, d) = (a + more_a, d + more_d);
        let row = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ];
        at = at.map(|line| [0, 1, 2, 3].map(|column| (0..4).map(|k| line[k] * row[k][column]).sum()));
    }
    at.map(|line| line[3])
}

/// A thousand poses with where the flange is.
fn poses(errors: &[(f64, f64, f64, f64); 6]) -> String {
    let mut text = String::new();
    for pose in 0..1000_usize {
        let q = [0, 1, 2, 3, 4, 5].map(|joint| ((pose * 17 + joint * 241) % 601) as f64 / 100.0 - 3.0);
        let cells: Vec<String> =
            q.iter().chain(&flange(q, errors)).map(|value| format!("{value:.17e}")).collect();
        writeln!(text, "{}", cells.join(" ")).unwrap();
    }
    text
}

fn lab(errors: &[(f64, f64, f64, f64); 6]) -> Lab {
    let lab = Lab::of("ur5");
    let text = std::fs::read_to_string(lab.path("../arms/ur5.yaml")).unwrap();
    let mut effects = "effects:\n".to_owned();
    for (joint, (a, alpha, d, zero)) in JOINTS.iter().zip(errors) {
        for (effect, key, value) in [
            ("link_length", "length_mm", a),
            ("link_twist", "twist_deg", alpha),
            ("link_offset", "offset_mm", d),
            ("joint_zero", "zero_deg", zero),
        ] {
            if *value != 0.0 {
                writeln!(effects, "  - {{effect: {effect}, where: {joint}, values: {{{key}: {value}}}}}")
                    .unwrap();
            }
        }
    }
    assert!(text.contains("effects: []"));
    lab.write("arm.yaml", &text.replace("effects: []", effects.trim_end()));
    lab.write("poses.txt", &poses(errors));
    lab.write("reader.py", include_str!("exported_arms.py"));
    lab
}

fn export(lab: &Lab, form: &str, more: &[&str]) -> CommandOutput {
    lab.plumb(&[&["model", "export", "arm.yaml", "--as", form], more].concat())
}

/// The greatest distance that the reader in Python finds, mm; nothing where there is no Python.
fn distance(lab: &Lab, arguments: &[&str]) -> Option<f64> {
    let output = Command::new("python3").arg("reader.py").args(arguments).current_dir(lab.path(".")).output();
    let Ok(output) = output else {
        skipped("there is no `python3` here");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let (poses, worst) = printed.trim().split_once(' ').unwrap();
    assert_eq!(poses, "1000");
    Some(worst.parse().unwrap())
}

#[test]
fn a_reader_in_python_finds_the_tip_of_urdf_and_ur_calibration_where_the_model_has_it() {
    let lab = lab(&ERRORS);
    for (form, file, arguments) in [
        ("urdf", "arm.urdf", &["urdf", "arm.urdf", "flange", "poses.txt"][..]),
        ("ros-calibration", "arm.calibration.yaml", &["ur", "arm.calibration.yaml", "poses.txt"]),
    ] {
        let written = export(&lab, form, &[]);
        assert_eq!(written.code(), 0, "{}", written.all());
        lab.write(file, &written.out());
        let Some(worst) = distance(&lab, arguments) else { return };
        assert!(worst < 1e-6, "{form}: {worst} mm");
    }
}

#[test]
fn what_lies_behind_the_last_joint_has_no_entry_in_a_ur_calibration_and_is_reported() {
    let mut errors = ERRORS;
    errors[5] = (-0.714, 0.111, -1.65, -0.317);
    let lab = lab(&errors);
    let refused = export(&lab, "ros-calibration", &[]);
    assert_eq!((refused.code(), refused.out().as_str()), (2, ""), "{}", refused.all());
    for part in ["0.714 mm", "0.111 deg", "behind the last joint", "--leave-out"] {
        assert!(refused.err().contains(part), "{part}: {}", refused.err());
    }
    let written = export(&lab, "ros-calibration", &["--leave-out"]);
    assert!(written.code() == 0 && written.err().contains("0.714 mm"), "{}", written.all());
    lab.write("arm.calibration.yaml", &written.out());
    lab.write("arm.urdf", &export(&lab, "urdf", &[]).out());
    if let Some(worst) = distance(&lab, &["ur", "arm.calibration.yaml", "poses.txt"]) {
        assert!((worst - 0.714).abs() < 1e-6, "{worst} mm");
        assert!(distance(&lab, &["urdf", "arm.urdf", "flange", "poses.txt"]).unwrap() < 1e-6);
    }
}
