//! A laser line sensor on the hand: the shipped cell from the run to the model that is written back, a fault of the arm seen by profiles alone, and tables that are
//! refused.

use serde_json::Value;

use crate::lab::Lab;

/// Of the world file: where the sensor sits on the flange, and the ball, mm.
const SENSOR: [f64; 3] = [25.0, -55.0, 60.0];
const BALL: [f64; 3] = [-430.0, -190.0, 30.0];

/// How the sensor is turned there: roll, pitch, yaw, deg.
const TURNED: [f64; 3] = [3.0, -4.0, 93.0];

fn measured(lab: &Lab) -> String {
    let run = lab.plumb(&["run", "cell-profile.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let table = lab.plumb(&["show", "--table"]);
    assert_eq!(table.code(), 0, "{}", table.all());
    table.out()
}

fn json(lab: &Lab, arguments: &[&str]) -> Value {
    let output = lab.plumb(arguments);
    assert_eq!(output.code(), 0, "{}", output.all());
    serde_json::from_str(&output.out()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// A rotation of roll, pitch and yaw by its columns, written out.
fn columns([roll, pitch, yaw]: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(|angle| angle.to_radians().sin_cos());
    [
        [cy * cp, sy * cp, -sp],
        [cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr],
        [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr],
    ]
}

/// The angle between two rotations, deg, by their traces.
fn apart(one: [f64; 3], other: [f64; 3]) -> f64 {
    let (one, other) = (columns(one), columns(other));
    let trace: f64 = one.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| a * b).sum();
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

#[test]
fn the_shipped_cell_finds_sensor_plate_ball_and_rim_from_no_start_and_writes_them_back() {
    let lab = Lab::of("ur5");
    let table = measured(&lab);
    assert!(table.contains("profile1_x_mm") && table.contains("profile5_z_mm"), "{table}");
    lab.write("profiles.csv", &table);
    let pair = ["profile.model.yaml", "--data", "profiles.csv", "--holdout", "none"];
    let output = lab.plumb(&[&["model", "compare"], &pair[..]].concat());
    for part in [
        "p1 on the flange: x ",
        "plate (plane) in the frame",
        "ball (ball) in the frame",
        "rim (edge) in the frame",
    ] {
        assert!(output.out().contains(part), "{part}\n{}", output.all());
    }
    let found = json(&lab, &[&["model", "accept", "--json"], &pair[..]].concat());
    let sensor = &found["placed"][0];
    for (axis, truth) in SENSOR.iter().enumerate() {
        let (at, se) = (number(&sensor["xyz_mm"][axis]), number(&sensor["se_mm"][axis]));
        assert!((at - truth).abs() < 4.0 * se && se < 0.1, "axis {axis}: {at} +- {se}, is {truth}");
    }
    let turned = [0, 1, 2].map(|axis| number(&sensor["rpy_deg"][axis]));
    let se: f64 = (0..3).map(|axis| number(&sensor["se_deg"][axis]).powi(2)).sum::<f64>().sqrt();
    assert!(apart(turned, TURNED) < 4.0 * se && se < 0.1, "{turned:?} +- {se}");
    let surface = |name: &str| {
        let all = found["surfaces"].as_array().unwrap();
        all.iter().find(|one| one["name"] == name).unwrap_or_else(|| panic!("{name}: {found}")).clone()
    };
    for (axis, truth) in BALL.iter().enumerate() {
        let one = &surface("ball")["numbers"][axis];
        let (at, se) = (number(&one["value"]), number(&one["se"]));
        assert!((at - truth).abs() < 4.0 * se && se < 0.1, "ball, axis {axis}: {at} +- {se}, is {truth}");
    }
    let normal = [0.02, -0.01, 1.0].map(|part: f64| part / (1.0 + 0.0005_f64).sqrt());
    let offset = normal[0] * -480.0 + normal[1] * -110.0 + normal[2] * 5.0;
    let plate = surface("plate");
    let (at, se) = (number(&plate["numbers"][0]["value"]), number(&plate["numbers"][0]["se"]));
    assert!((at - offset).abs() < 4.0 * se, "plate: {at} +- {se}, is {offset}");
    // The line of the rim passes the world's by no more than it is sure of.
    let (point, along) =
        (&surface("rim")["xyz_mm"], [1.0, 0.1, 0.05].map(|part: f64| part / 1.0125_f64.sqrt()));
    let away = [-520.0, -40.0, 40.0]
        .iter()
        .enumerate()
        .map(|(axis, truth)| number(&point[axis]) - truth)
        .collect::<Vec<_>>();
    let on_line: f64 = away.iter().zip(along).map(|(a, b)| a * b).sum();
    let beside = away.iter().zip(along).map(|(a, b)| (a - on_line * b).powi(2)).sum::<f64>().sqrt();
    assert!(beside < 0.1, "the rim is {beside} mm aside");
    // The revision is a model by which the next fit begins, and from which poses are proposed.
    let revision = std::fs::read_to_string(lab.path("profile.model.rev1.yaml")).unwrap();
    assert!(
        revision.contains("profile: {seen_by: p1}") && revision.contains("profile_mm: 0.02"),
        "{revision}"
    );
    assert_eq!(lab.plumb(&["check", "profile.model.rev1.yaml"]).code(), 0);
    let verdict =
        json(&lab, &["model", "diagnose", "profile.model.yaml", "--data", "profiles.csv", "--json"]);
    assert_eq!(verdict["verdict"], "at_floor", "{verdict}");
    let hidden = ["--effect", "joint_backlash(elbow)", "-o", "hidden"];
    let refused = lab
        .plumb(&[&["trial", "inject", "profile.model.yaml", "--data", "profiles.csv"], &hidden[..]].concat());
    assert!(
        refused.code() == 2
            && refused.err().contains("line profiles (profile1_x_mm ...)")
            && refused.err().contains("plumb trial new --cell"),
        "{}",
        refused.all()
    );
    let next =
        lab.plumb(&["model", "next", "profile.model.yaml", "--data", "profiles.csv", "-n", "3", "--csv"]);
    assert!(next.code() == 0 && next.out().lines().count() >= 4, "{}", next.all());
}

#[test]
fn a_wrong_zero_of_the_arm_is_named_by_profiles_alone_and_added() {
    let lab = Lab::of("ur5");
    lab.edit(
        "world-profile.yaml",
        "    by: ur5.arm.yaml",
        "    by: ur5.arm.yaml\n    zero_error: {elbow_deg: 0.2}",
    );
    lab.write("profiles.csv", &measured(&lab));
    let pair = ["profile.model.yaml", "--data", "profiles.csv"];
    let verdict = json(&lab, &[&["model", "diagnose", "--json"], &pair[..]].concat());
    assert_eq!(verdict["verdict"], "named", "{verdict}");
    let named = verdict["candidates"][0]["label"].as_str().unwrap_or_default().to_owned();
    assert_eq!(named, "joint_zero(elbow)", "{verdict}");
    let added = json(
        &lab,
        &[&["model", "add", "profile.model.yaml", "joint_zero(elbow)", "--json"], &pair[1..]].concat(),
    );
    let effect = &added["added"][0];
    assert!((number(&effect["size"]).abs() - 0.2).abs() < 4.0 * number(&effect["se"]), "{effect}");
    let rms = number(&added["rms_mm"]["fit"]);
    // Five points of 0.02 mm each in a row.
    assert!(rms < 0.02 * 5.0_f64.sqrt(), "{added}");
}

#[test]
fn profiles_that_cannot_be_meant_are_refused_with_what_would_be_right() {
    let lab = Lab::of("ur5");
    let table: String = measured(&lab)
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect();
    let compare = |name: &str, model: &str, text: &str, part: &str| {
        lab.write(name, text);
        let printed = lab.plumb(&["model", "compare", model, "--data", name]);
        assert!(printed.code() == 2 && printed.err().contains(part), "{part}: {}", printed.all());
    };
    // Metres under headers of mm.
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let in_metres = |line: &str| {
        let cells = line.split(',').zip(&header).map(|(cell, name)| match cell.parse::<f64>() {
            Ok(value) if name.starts_with("profile") => format!("{}", value / 1000.0),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",")
    };
    let metres: Vec<String> = std::iter::once(header.join(",")).chain(lines.map(in_metres)).collect();
    compare(
        "metres.csv",
        "profile.model.yaml",
        &(metres.join("\n") + "\n"),
        "if they are in m, say so in the headers",
    );
    // The diameter of the ball in place of its radius is the other way; half of it is reported.
    let model = std::fs::read_to_string(lab.path("profile.model.yaml")).unwrap();
    lab.write("half.model.yaml", &model.replace("radius_mm: 20", "radius_mm: 10"));
    compare(
        "table.csv",
        "half.model.yaml",
        &table,
        "shows none larger than itself: check the unit of the profiles and its `radius_mm`",
    );
    lab.write("none.model.yaml", &model.replace(", radius_mm: 20", ""));
    compare("table.csv", "none.model.yaml", &table, "radius_mm");
    lab.write("blind.model.yaml", &model.replace("profile: {seen_by: p1}\n", ""));
    compare("table.csv", "blind.model.yaml", &table, "`profile: {seen_by: p1}`");
    // Three points of the rim are six numbers, and sensor and rim are ten.
    let last = table.lines().count() - 3;
    let few: Vec<&str> = table.lines().take(1).chain(table.lines().skip(last)).collect();
    compare("few.csv", "profile.model.yaml", &(few.join("\n") + "\n"), "measured numbers cannot settle");
}

#[test]
fn a_sensor_that_looks_away_fails_the_run_and_says_so() {
    let lab = Lab::of("ur5");
    lab.edit("world-profile.yaml", "rpy_deg: [3, -4, 93]", "rpy_deg: [63, -4, 93]");
    let run = lab.plumb(&["run", "cell-profile.yaml", "--headless"]);
    assert_ne!(run.code(), 0);
    assert!(run.all().contains("the laser line sensor does not see `plate` from here"), "{}", run.all());
    lab.plumb(&["doctor", "--clean", "cell-profile.yaml"]);
}

#[test]
fn profiles_as_a_sensor_exports_them_become_five_points_a_row() {
    let lab = Lab::new();
    lab.write("poses.csv", "q1_deg,q2_deg,profile,on\n10,20,a,plate\n30,40,b,plate\n");
    let points: String =
        (0..640).map(|n| format!("a,{},{}\nb,{},{}\n", n - 320, 150 + n / 10, n - 320, 200)).collect();
    lab.write("points.csv", &format!("profile,x_mm,z_mm\n{points}"));
    let made = lab.plumb(&["model", "profile", "poses.csv", "--points", "points.csv"]);
    assert_eq!(made.code(), 0, "{}", made.all());
    assert!(
        made.out().starts_with("q1_deg,q2_deg,profile,on,profile1_x_mm,profile1_z_mm,"),
        "{}",
        made.out()
    );
    assert_eq!(made.out().lines().last().unwrap().matches(",200.00000").count(), 5, "{}", made.out());
    lab.write("points.csv", "profile,x_mm,z_mm\nc,1,2\n");
    let refused = lab.plumb(&["model", "profile", "poses.csv", "--points", "points.csv"]);
    assert!(
        refused.code() == 2 && refused.err().contains("profile `c` has points and no pose"),
        "{}",
        refused.all()
    );
}
