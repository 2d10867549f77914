//! `plumb report`: figures after ISO 230-2 and ISO 9283 as a user asks for them.

use serde_json::Value;

use crate::lab::Lab;

/// Targets, mm, and deviations in the positive and the negative direction, um. The figures below were worked out apart from this program.
const DEVIATIONS: [(f64, [f64; 5], [f64; 5]); 6] = [
    (3.0, [0.2, -1.0, 0.6, 0.0, 0.3], [-2.9, -3.8, -2.9, -3.5, -4.6]),
    (61.2, [5.6, 5.9, 5.5, 4.5, 4.6], [2.2, 2.3, 2.4, -0.5, 1.9]),
    (118.9, [2.9, 3.5, 2.5, 2.6, 3.4], [-0.2, -0.5, -0.6, 1.0, -0.1]),
    (181.4, [-0.6, 0.1, 1.1, 0.7, -0.4], [-2.7, -3.5, -4.2, -3.8, -2.2]),
    (240.7, [3.0, 2.4, 4.2, 3.1, 2.6], [0.7, -0.3, -0.5, -1.4, 1.3]),
    (299.0, [9.5, 8.3, 10.7, 9.9, 10.4], [7.4, 5.2, 5.5, 6.7, 6.9]),
];

const SLIDE: &str = "arm: slide
convention: distal
joints: [{name: x, slides: true}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0]}}
effects: [{effect: joint_zero, where: x, values: {zero_mm: 0}}, {effect: joint_backlash, where: x, values: {play_mm: 0}}]
";

fn axis(header: &str) -> String {
    let mut text = format!("{header}\n");
    for (at, positive, negative) in DEVIATIONS {
        for (side, deviations) in [(1, positive), (-1, negative)] {
            for deviation in deviations {
                text.push_str(&format!("{at},{side},t{at},{:.4}\n", at + deviation / 1000.0));
            }
        }
    }
    text
}

fn lab() -> Lab {
    let lab = Lab::of("ur5");
    lab.write("axis.csv", &axis("q1_mm,approach_q1,repeat,p1_x_mm"));
    lab.write("slide.yaml", SLIDE);
    lab
}

#[test]
fn an_axis_is_reported_as_text_json_and_page_with_its_uncertainty_budget() {
    let lab = lab();
    let output = lab.plumb(&["report", "iso230", "axis.csv", "--digits", "6"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let lines: Vec<String> =
        output.out().lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    for line in [
        "accuracy A 0.016592 0.012892 0.013188",
        "repeatability R 0.007264 0.003748 0.004888",
        "mean reversal error mean B 0.003360",
        "61.2 0.005220 0.000630 0.002520 0.001660 0.001222 0.004888 0.003440 0.003560 0.007264",
    ] {
        assert!(lines.iter().any(|one| one == line), "{}\nwanted: {line}", output.out());
    }
    let page = lab.path("axis.html");
    let written =
        lab.plumb(&["report", "iso230", "axis.csv", "--model", "slide.yaml", "--json", "-o", "axis.html"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    let json: Value = serde_json::from_str(&written.out()).unwrap();
    let figure = json["bidirectional"]["R"].as_f64().unwrap();
    assert!((figure - 0.007263926).abs() < 1e-8, "{figure}");
    let parts: Vec<&str> = json["budget"]["components"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["name"].as_str().unwrap())
        .collect();
    assert!(parts.contains(&"joint_backlash(x)"), "{parts:?}");
    let page = std::fs::read_to_string(page).unwrap();
    for part in ["<svg", "Uncertainty budget", "joint_backlash(x)", "expanded uncertainty (k = 2)", "0.0166"]
    {
        assert!(page.contains(part), "{part} is not on the page");
    }
}

#[test]
fn poses_are_reported_against_their_commanded_positions() {
    let lab = lab();
    let mut text = "q1_deg,repeat,commanded_x_mm,commanded_y_mm,p1_x_mm,p1_y_mm\n".to_owned();
    for (x, y) in [(10.1, 20.0), (10.3, 20.0), (10.2, 20.1), (10.2, 19.9)] {
        text.push_str(&format!("0,P1,10,20,{x},{y}\n"));
    }
    lab.write("poses.csv", &text);
    let output = lab.plumb(&["report", "iso9283", "poses.csv", "-o", "poses.html"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    // Four points on a circle of 0.1 mm about (10.2, 20): AP 0.2, every distance 0.1, so RP is 0.1.
    let line = output.out().lines().find(|line| line.trim_start().starts_with("P1")).unwrap().to_owned();
    let cells: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(cells, ["P1", "4", "0.2000", "0.2000", "0.0000", "0.0000", "0.1000", "0.1000", "0.0000"]);
    assert!(
        output.out().contains("note: 4 returns to some pose; the standard asks for 30 cycles"),
        "{}",
        output.out()
    );
    assert!(std::fs::read_to_string(lab.path("poses.html")).unwrap().contains("<svg"));
}

#[test]
fn orientations_of_poses_are_reported_beside_their_positions() {
    let lab = lab();
    let mut text = "q1_deg,repeat,commanded_x_mm,commanded_rx_deg,commanded_ry_deg,commanded_rz_deg,p1_x_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg\n".to_owned();
    for turn in [0.1, 0.3, 0.2, 0.2] {
        text.push_str(&format!("0,P1,10,0,0,90,10,0,0,{}\n", 90.0 + turn));
    }
    lab.write("poses.csv", &text);
    let output = lab.plumb(&["report", "iso9283", "poses.csv", "-o", "poses.html"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    // 0.2 deg aside in the mean; S is sqrt(0.02 / 3), three times that is 0.2449 deg.
    let line =
        output.out().lines().filter(|line| line.trim_start().starts_with("P1")).nth(1).unwrap().to_owned();
    let cells: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(cells, ["P1", "0.0000", "0.0000", "0.2000", "0.0000", "0.0000", "0.2449"], "{}", output.out());
    let json: Value =
        serde_json::from_str(&lab.plumb(&["report", "iso9283", "poses.csv", "--json"]).out()).unwrap();
    assert!((json["orientation"]["AP_abc_deg"][2].as_f64().unwrap() - 0.2).abs() < 1e-9, "{json}");
    assert!(std::fs::read_to_string(lab.path("poses.html")).unwrap().contains("Orientation at each pose"));
}

#[test]
fn what_cannot_be_reported_is_refused_with_what_would_be_right() {
    let lab = lab();
    lab.write("one-sided.csv", &axis("q1_mm,side,repeat,p1_x_mm"));
    lab.write("inches.csv", &axis("q1_mm,approach_q1,repeat,p1_x_in"));
    let two_positions = "q1_deg,repeat,commanded_x_mm,p1_x_mm\n0,P1,10,10.1\n0,P1,10.5,10.2\n";
    lab.write("two-places.csv", two_positions);
    let head = "q1_deg,repeat,commanded_x_mm,commanded_rx_deg,commanded_ry_deg,commanded_rz_deg,p1_x_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg";
    let turned = |degrees: u32| format!("0,P1,10,0,0,{degrees},10,0,0,90");
    lab.write("two-ways.csv", &format!("{head}\n{}\n{}\n", turned(90), turned(91)));
    for (arguments, needed) in [
        (&["iso230", "one-sided.csv"][..], "no column `approach_q1`"),
        (&["iso230", "inches.csv"], "p1_x changes by 25.4"),
        (&["iso230", "axis.csv", "--axis", "y"], "there is no axis `y`; there are q1"),
        (&["iso230", "axis.csv", "--reading", "p1_q"], "no reading `p1_q` in mm; there are p1_x"),
        (&["iso230", "none.csv"], "none.csv"),
        (&["iso230", "axis.csv", "-o", "nowhere/axis.html"], "nowhere/axis.html cannot be written"),
        (&["iso9283", "axis.csv", "--target", "p2"], "nothing was read of a target `p2`; there are p1"),
        (
            &["iso9283", "two-places.csv"],
            "line 3: pose P1 was commanded to another position than in line 2; returns to one pose have the same commanded place",
        ),
        (&["iso9283", "two-ways.csv"], "line 3: pose P1 was commanded to another orientation than in line 2"),
    ] {
        let mut words = vec!["report"];
        words.extend(arguments);
        let output = lab.plumb(&words);
        assert_eq!((output.code(), output.out().as_str()), (2, ""), "{}", output.all());
        assert!(
            output.err().starts_with("plumb: ") && output.err().contains(needed),
            "{}\nwanted: {needed}",
            output.err()
        );
    }
}
