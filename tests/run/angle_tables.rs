//! Tables of angles alone: every error of such a table is in degrees, in text, JSON, drawings, pages and files.

use std::fs;

use serde_json::Value;

use crate::lab::Lab;

/// An arm that turns about a column, with a level on its last link.
const ARM: &str = "arm: column
convention: distal
joints:
  - {name: waist, d_mm: 300, alpha_deg: 90}
  - {name: shoulder, a_mm: 200}
  - {name: elbow, a_mm: 150}
targets: {p1: {free: false}}
effects: []
";

/// What an instrument beside the arm knows: tilts need no base, directions need one.
const TILTS: &str = "measured_from: world
base: {free: false}
level: {after: elbow, rpy_deg: [-90, 0, 0]}
noise: {tilt_deg: 0.02}
free: [joint_zero(elbow)]
";
const DIRECTIONS: &str = "base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0], free: true}
noise: {azimuth_deg: 0.003, elevation_deg: 0.003}
free: [joint_zero(shoulder), joint_zero(elbow)]
";

/// Poses of the arm, deg: waist, shoulder, elbow, well mixed.
fn poses() -> impl Iterator<Item = [f64; 3]> {
    let mixed =
        |row: u32, step: u32, low: f64, high: f64| low + (high - low) * f64::from(row * step % 97) / 96.0;
    (1..91).map(move |row| {
        [mixed(row, 37, -150.0, 150.0), mixed(row, 53, -20.0, 60.0), mixed(row, 29, -60.0, -10.0)]
    })
}

/// Noise between -1 and 1 that depends on the row alone.
fn scatter(row: usize, seed: usize) -> f64 {
    ((row * 7919 + seed * 104_729) % 2003) as f64 / 1001.0 - 1.0
}

/// What a level on the last link reads where the elbow turns by 2 % more than commanded.
fn tilts() -> String {
    let rows = poses().enumerate().map(|(row, [waist, shoulder, elbow])| {
        let tilt = -(shoulder + 1.02 * elbow) + 0.03 * scatter(row, 1);
        format!("{waist:.4},{shoulder:.4},{elbow:.4},{:.4},{tilt:.4}\n", 0.03 * scatter(row, 2))
    });
    format!("q1_deg,q2_deg,q3_deg,tilt_x_deg,tilt_y_deg\n{}", rows.collect::<String>())
}

/// What a theodolite reads of the tip of the same arm.
fn directions() -> String {
    let rows = poses().enumerate().map(|(row, [waist, shoulder, elbow])| {
        let [first, second] = [shoulder, shoulder + 1.02 * elbow].map(f64::to_radians);
        let radius = 200.0 * first.cos() + 150.0 * second.cos();
        let (sine, cosine) = waist.to_radians().sin_cos();
        let [x, y] = [900.0 + radius * cosine, -1400.0 + radius * sine];
        let z = 50.0 + 200.0 * first.sin() + 150.0 * second.sin();
        let azimuth = y.atan2(x).to_degrees() + 0.005 * scatter(row, 3);
        let elevation = z.atan2(x.hypot(y)).to_degrees() + 0.005 * scatter(row, 4);
        format!("{waist:.4},{shoulder:.4},{elbow:.4},{azimuth:.5},{elevation:.5}\n")
    });
    format!("q1_deg,q2_deg,q3_deg,p1_azimuth_deg,p1_elevation_deg\n{}", rows.collect::<String>())
}

fn lab(rest: &str, table: &str) -> Lab {
    let lab = Lab::new();
    lab.write("angles.yaml", &format!("{ARM}{rest}"));
    lab.write("angles.csv", table);
    lab
}

/// What a command of the model lab prints.
fn printed(lab: &Lab, command: &str, more: &[&str]) -> String {
    let mut arguments = vec!["model", command, "angles.yaml", "--data", "angles.csv"];
    arguments.extend(more);
    let printed = lab.plumb(&arguments);
    assert_eq!(printed.code(), 0, "{}", printed.all());
    printed.out()
}

/// The lines of a text that give a number in mm, without the sizes of candidates and where things were found: those may be lengths.
fn lengths_in(text: &str) -> Vec<&str> {
    let is_length = |line: &&str| {
        let found = ["link_", "_offset(", "base_"].iter().any(|effect| line.contains(effect));
        let words = line.split(|letter: char| !letter.is_alphanumeric());
        words.filter(|word| *word == "mm" || *word == "mm2").count() > usize::from(found)
    };
    text.lines().filter(is_length).collect()
}

/// The keys of errors of readings that end in `_mm`, with all keys above.
fn keys_in_mm(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            for (key, field) in fields {
                let path = format!("{path}/{key}");
                if key.ends_with("_mm") || key.ends_with("_mm2") {
                    found.push(path.clone());
                }
                keys_in_mm(field, &path, found);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| keys_in_mm(item, path, found)),
        _ => {}
    }
}

fn json(lab: &Lab, command: &str, more: &[&str]) -> Value {
    let mut arguments = vec!["--json"];
    arguments.extend(more);
    serde_json::from_str(&printed(lab, command, &arguments)).unwrap()
}

#[test]
fn of_a_level_every_error_is_said_in_degrees() {
    let lab = lab(TILTS, &tilts());
    let compared = printed(&lab, "compare", &[]);
    assert_eq!(lengths_in(&compared), [""; 0], "{compared}");
    assert!(compared.contains("error of a point, deg"), "{compared}");
    assert!(compared.contains("noise: 0.0200 deg a reading, as declared"), "{compared}");
    let diagnosed = printed(&lab, "diagnose", &[]);
    assert_eq!(lengths_in(&diagnosed), [""; 0], "{diagnosed}");
    assert!(diagnosed.contains("joint_gain(elbow)                explains  0.2"), "{diagnosed}");
    let grown = printed(&lab, "grow", &["--dry"]);
    assert_eq!(lengths_in(&grown), [""; 0], "{grown}");
    let drawn = printed(
        &lab,
        "compare",
        &["--plot", "svg", "--output", &lab.path("angles.svg").display().to_string()],
    );
    assert_eq!(lengths_in(&drawn), [""; 0], "{drawn}");
    let picture = fs::read_to_string(lab.path("angles.svg")).unwrap();
    assert_eq!(lengths_in(&picture), [""; 0], "{picture}");
    assert!(picture.contains("residuals, deg") && picture.contains("error of a row, deg"), "{picture}");
}

#[test]
fn in_json_the_keys_of_angles_end_in_deg_and_a_unit_is_given() {
    let lab = lab(TILTS, &tilts());
    for command in ["compare", "diagnose", "grow"] {
        let output = json(&lab, command, if command == "grow" { &["--dry"] } else { &[] });
        let mut lengths = Vec::new();
        keys_in_mm(&output, "", &mut lengths);
        assert_eq!(lengths, [""; 0], "{command}: {output:#}");
        assert_eq!(output["unit"], "deg", "{command}");
        let fit = output["rms_deg"]["fit"].as_f64().unwrap();
        assert!((0.001..2.0).contains(&fit), "{command}: {fit}");
        assert!(output["floor"]["sigma_deg"].is_f64(), "{command}");
    }
}

#[test]
fn of_directions_from_a_theodolite_the_page_and_the_story_are_in_degrees() {
    let lab = lab(DIRECTIONS, &directions());
    let diagnosed = printed(&lab, "diagnose", &[]);
    assert_eq!(lengths_in(&diagnosed), [""; 0], "{diagnosed}");
    assert!(diagnosed.contains("NAMED. The error of 0.024 deg is joint_gain(elbow)"), "{diagnosed}");
    let added = printed(&lab, "add", &["joint_gain(elbow)"]);
    assert!(added.contains("the error falls from ") && added.contains(" deg; revision 1"), "{added}");
    let written = fs::read_to_string(lab.path("angles.rev1.yaml")).unwrap();
    assert!(written.contains("rms_deg: ") && !written.contains("rms_mm"), "{written}");
    let listed = lab.plumb(&["model", "history", "angles.yaml"]);
    assert!(listed.out().contains(" deg  ") && lengths_in(&listed.out()).is_empty(), "{}", listed.all());
    let page = lab.path("angles.html").display().to_string();
    printed(&lab, "report", &["--output", &page]);
    let page = fs::read_to_string(page).unwrap();
    // Where the model believes the target to be is a length.
    let of_positions = page.replace("<th>at x, mm</th>", "");
    assert_eq!(lengths_in(&of_positions), [""; 0], "{page}");
    assert!(page.contains("RMS error of one measured point, deg"), "{page}");
}

#[test]
fn beside_lengths_angles_keep_their_own_unit_and_add_nothing_to_the_error_in_mm() {
    // Heights of the tip, and in every third row a tilt alone: the root mean square of both together would be of neither.
    let rows = poses().enumerate().map(|(row, [waist, shoulder, elbow])| {
        let [first, second] = [shoulder, shoulder + elbow].map(f64::to_radians);
        let height = 300.0 + 200.0 * first.sin() + 150.0 * second.sin() + 0.05 * scatter(row, 5);
        let read = match row % 3 {
            0 => format!(",{:.4}", 5.0 - shoulder - elbow),
            _ => format!("{height:.4},"),
        };
        format!("{waist:.4},{shoulder:.4},{elbow:.4},{read}\n")
    });
    let table = format!("q1_deg,q2_deg,q3_deg,height_mm,tilt_y_deg\n{}", rows.collect::<String>());
    let lab = lab(&TILTS.replace("noise: {tilt_deg: 0.02}", "noise: {tilt_deg: 5, height_mm: 0.05}\nsurfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}}}"), &table);
    let compared = json(&lab, "compare", &[]);
    assert_eq!(compared["unit"], "mm");
    let error = &compared["error_mm"]["fit"];
    assert!(error["max"].as_f64().unwrap() < 0.2, "the tilts are off by 5 deg: {error}");
    // Sixty rows of heights, some of them held out.
    assert!(error["points"].as_u64().unwrap() <= 60, "{error}");
}
