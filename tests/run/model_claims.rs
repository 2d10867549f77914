//! What `plumb model grow` claims of what it adds, on the command line: the residual map comes last, is marked, and can be left out.

use std::fmt::Write as _;
use std::process::{Command, Stdio};

const ARM: &str = "arm: column
convention: distal
joints:
  - {name: waist, d_mm: 300, alpha_deg: 90}
  - {name: shoulder, a_mm: 200}
  - {name: elbow, a_mm: 150}
targets: {p1: {}}
free: [joint_zero(*)]
noise: {p1_mm: 0.02}
";

/// Positions of the arm, whose shoulder is off by a function of the pose that no effect knows.
fn table(rows: u32) -> String {
    table_with(rows, |_| [0.0; 3])
}

/// The same, where each joint is off besides by so much, rad, at a pose, rad.
fn table_with(rows: u32, off: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for row in 0..rows {
        // Kronecker's sequence: evenly spread, like no grid.
        let spread = |step: f64, low: f64, high: f64| low + (high - low) * (step * f64::from(row)).fract();
        let q = [
            spread(0.819_172_5, -150.0, 150.0),
            spread(0.671_043_6, -20.0, 100.0),
            spread(0.549_700_5, -120.0, -10.0),
        ];
        let off = off(q.map(f64::to_radians));
        let [waist, shoulder, elbow] = [0, 1, 2].map(|joint| q[joint].to_radians() + off[joint]);
        let lifted = shoulder + 0.001 * (2.0 * waist + 1.0).sin() * (2.0 * elbow).cos();
        let radius = 200.0 * lifted.cos() + 150.0 * (lifted + elbow).cos();
        let height = 300.0 + 200.0 * lifted.sin() + 150.0 * (lifted + elbow).sin();
        let noise = 0.02 * (f64::from(row) * 12.9898).sin();
        let point = [radius * waist.cos() + noise, radius * waist.sin() - noise, height + noise];
        let _ = writeln!(text, "{},{},{},{},{},{}", q[0], q[1], q[2], point[0], point[1], point[2]);
    }
    text
}

fn plumb(folder: &std::path::Path, asked: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.arg("model").args(asked).current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), [text(&output.stdout), text(&output.stderr)].concat())
}

#[test]
fn a_residual_map_is_added_last_marked_and_left_out_on_demand() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.yaml"), ARM).unwrap();
    std::fs::write(at.join("poses.csv"), table(300)).unwrap();
    let pair = ["arm.yaml", "--data", "poses.csv", "--holdout", "random:0.3:1"];
    let asked = |command: &str, more: &[&str]| {
        let (code, printed) = plumb(at, &[&[command], &pair[..], more].concat());
        assert_eq!(code, Some(0), "{printed}");
        printed
    };
    let without = asked("grow", &["--no-map", "--dry"]);
    assert!(!without.contains("residual"), "{without}");
    let grown = asked("grow", &[]);
    assert!(grown.contains("+ residual_map") && grown.contains("not understood"), "{grown}");
    let history = plumb(at, &["history", "arm.yaml"]).1;
    assert!(history.contains("add residual_map (not understood)"), "{history}");
    let compared = asked("compare", &[]);
    assert!(compared.contains("a residual map takes") && compared.contains("not understood"), "{compared}");
    let json = asked("compare", &["--json"]);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(report["residual_map"]["not_understood"].as_f64().unwrap() > 0.3, "{json}");
    let diagnosed = asked("diagnose", &[]);
    assert!(diagnosed.contains("residual map is left out here"), "{diagnosed}");
    let removed = plumb(at, &["remove", "arm.yaml", "residual_map", "--data", "poses.csv"]);
    assert_eq!(removed.0, Some(0), "{}", removed.1);
    let again = plumb(at, &["remove", "arm.yaml", "residual_map", "--data", "poses.csv"]);
    assert!(again.0 == Some(2) && again.1.contains("has no residual map to take out"), "{}", again.1);
}

/// Waves of three gears, and an elbow whose gain is wrong.
fn gears([waist, shoulder, elbow]: [f64; 3]) -> [f64; 3] {
    let waist = 5e-4 * (9.0 * waist).sin() + 3e-4 * (20.0 * waist).cos();
    [waist, 4e-4 * (12.0 * shoulder).sin(), 7e-4 * (7.0 * elbow).sin() + 0.015 * elbow]
}

#[test]
fn a_batch_adds_corrections_and_knows_how_large_waves_are_so_that_it_does_no_harm_where_nothing_was_measured()
{
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("arm.yaml"), ARM).unwrap();
    std::fs::write(at.join("poses.csv"), table_with(640, gears)).unwrap();
    let pair = ["arm.yaml", "--data", "poses.csv", "--holdout", "random:0.3:1"];
    let (code, grown) = plumb(at, &[&["grow"], &pair[..]].concat());
    assert_eq!(code, Some(0), "{grown}");
    let gain = grown
        .lines()
        .find(|line| line.starts_with("+ joint_gain(elbow)"))
        .unwrap_or_else(|| panic!("{grown}"));
    assert!(
        gain.contains("correction: may be joint_gain(elbow), or a mechanism that is not listed"),
        "{gain}"
    );
    assert!(grown.contains("by mechanisms alone: fit"), "{grown}");
    assert!(
        grown.contains("left out upper third of elbow") && !grown.contains("does not extrapolate"),
        "{grown}"
    );
    let files: Vec<_> = std::fs::read_dir(at).unwrap().map(|entry| entry.unwrap().path()).collect();
    let written = |path: &std::path::PathBuf| std::fs::read_to_string(path).unwrap_or_default();
    let found = files.iter().find(|path| written(path).contains("prior_sd"));
    let text = written(found.unwrap_or_else(|| panic!("{files:?}")));
    assert!(
        text.contains("claim: correction, may_be: [\"joint_gain(elbow)\"")
            && text.contains("measured_region:")
    );
    let compared = plumb(at, &[&["compare"], &pair[..]].concat());
    assert_eq!(compared.0, Some(0), "{}", compared.1);
    // A wave's prior that cannot be: said with its position, and nothing is done.
    let sine = text.find("prior_sd: {sine_deg: ").unwrap() + "prior_sd: {sine_deg: ".len();
    let end = sine + text[sine..].find(',').unwrap();
    let line = text[..sine].lines().count();
    std::fs::write(at.join("wrong.yaml"), format!("{}0{}", &text[..sine], &text[end..])).unwrap();
    let (code, printed) = plumb(at, &["compare", "wrong.yaml", "--data", "poses.csv"]);
    assert_eq!(code, Some(2), "{printed}");
    assert!(printed.contains(&format!("wrong.yaml:{line}:")), "{printed}");
    assert!(printed.contains("the standard deviation of `sine_deg` must be greater than zero"), "{printed}");
}

#[test]
fn of_three_targets_of_which_one_has_a_declared_noise_the_others_noise_is_estimated_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let three = ARM.replace(
        "targets: {p1: {}}",
        "targets: {p1: {}, p2: {xyz_mm: [0, 30, 0]}, p3: {xyz_mm: [0, 0, 40]}}",
    );
    std::fs::write(at.join("arm.yaml"), three).unwrap();
    let mut text =
        "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,p2_x_mm,p2_y_mm,p2_z_mm,p3_x_mm,p3_y_mm,p3_z_mm\n"
            .to_owned();
    for (index, line) in table(60).lines().skip(1).enumerate() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [waist, lifted] = [cells[0].to_radians(), (cells[1] + cells[2]).to_radians()];
        // The frame of the last row: y up its link, z along the axis of the elbow.
        let up = [-lifted.sin() * waist.cos(), -lifted.sin() * waist.sin(), lifted.cos()];
        let across = [waist.sin(), -waist.cos(), 0.0];
        let noise = 0.1 * (index as f64 * 3.7).sin();
        let point = |along: [f64; 3], by: f64| {
            (0..3)
                .map(|axis| format!("{}", cells[3 + axis] + by * along[axis] + noise))
                .collect::<Vec<_>>()
                .join(",")
        };
        let _ = writeln!(text, "{line},{},{}", point(up, 30.0), point(across, 40.0));
    }
    std::fs::write(at.join("poses.csv"), text).unwrap();
    let (code, printed) = plumb(at, &["compare", "arm.yaml", "--data", "poses.csv"]);
    assert_eq!(code, Some(0), "{printed}");
    let of = |target: &str| {
        let noise = format!("noise of {target}_mm:");
        printed.lines().any(|line| line.contains(&noise) && line.contains("estimated"))
    };
    assert!(of("p2") && of("p3") && !of("p1"), "{printed}");
}
