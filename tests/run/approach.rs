//! `approach_...` means one thing everywhere: 1 arrived so that the joint's coordinate grew, -1 so that it fell. Worlds, cells, the lab, the list of next poses,
//! reports and exported files are held to it, and to each other.

use serde_json::Value;

use crate::lab::Lab;

fn json(lab: &Lab, arguments: &[&str]) -> Value {
    let output = lab.plumb(arguments);
    assert_eq!(output.code(), 0, "{}", output.all());
    serde_json::from_str(&output.out()).unwrap()
}

/// The cells of a column, by its header.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let index = lines.next().unwrap().split(',').position(|header| header == name);
    let index = index.unwrap_or_else(|| panic!("no column {name}: {table}"));
    lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect()
}

#[test]
fn a_cell_writes_1_where_a_joint_went_up_and_play_comes_out_positive() {
    let lab = Lab::of("scara");
    let run = lab.plumb(&["run", "cell.yaml", "measure-tip", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let table = lab.plumb(&["show", "--table"]).out();
    let (q, way) = (column(&table, "q3_mm"), column(&table, "approach_q3"));
    let moved: Vec<usize> = (1..q.len()).filter(|row| (q[*row] - q[row - 1]).abs() > 0.5).collect();
    assert!(moved.len() > 30, "{table}");
    for row in moved {
        assert_eq!(way[row], (q[row] - q[row - 1]).signum(), "row {row}: {} after {}", q[row], q[row - 1]);
    }
    lab.write("table.csv", &table);
    let found = json(&lab, &["model", "diagnose", "scara.model.yaml", "--data", "table.csv", "--json"]);
    assert_eq!(found["named"]["effect"], "joint_backlash", "{found}");
    // 0.4 mm in the world file.
    let (size, se) = (found["named"]["size"].as_f64().unwrap(), found["named"]["se"].as_f64().unwrap());
    assert!((size - 0.4).abs() < 4.0 * se, "{size} +- {se}");
}

#[test]
fn a_trial_writes_1_where_a_joint_went_up_and_play_comes_out_positive() {
    let lab = Lab::new();
    let made = lab.plumb(&[
        "trial",
        "new",
        "--seed",
        "5",
        "--arm",
        "puma560",
        "--effect",
        "joint_backlash(elbow)=0.1deg",
        "-o",
        "t",
    ]);
    assert_eq!(made.code(), 0, "{}", made.all());
    let found = json(&lab, &["model", "diagnose", "t/model.yaml", "--data", "t/table.csv", "--json"]);
    assert_eq!(found["named"]["effect"], "joint_backlash", "{found}");
    let (size, se) = (found["named"]["size"].as_f64().unwrap(), found["named"]["se"].as_f64().unwrap());
    assert!((size - 0.1).abs() < 4.0 * se, "{size} +- {se}");
    lab.write("found.json", &found.to_string());
    assert!(
        lab.plumb(&["trial", "reveal", "t", "--diagnosis", "found.json"])
            .out()
            .contains("The diagnosis is right")
    );
}

/// A slide with 24 um of play: moving up it stays 12 um behind. `up` is what the table calls that.
fn axis(up: i32) -> String {
    let mut text = "q1_mm,approach_q1,repeat,p1_x_mm\n".to_owned();
    for cycle in 0..5 {
        for (index, way) in (0..6).map(|index| (index, 1)).chain((0..6).rev().map(|index| (index, -1))) {
            let (at, wobble) = (31.0 * f64::from(index), f64::from((7 * index + 3 * cycle) % 5 - 2));
            let read = at - 0.012 * f64::from(way) + 0.0005 * wobble;
            text.push_str(&format!("{at},{},t{index},{read:.4}\n", up * way));
        }
    }
    text
}

const SLIDE: &str = "arm: slide
convention: distal
joints: [{name: x, slides: true, limits_mm: [0, 200]}]
base: {xyz_mm: [0, 0, 0], rpy_deg: [0, 90, 0], free: false}
targets: {p1: {xyz_mm: [0, 0, 0], free: false}}
free: [joint_zero(x)]
";

#[test]
fn an_axis_s_report_play_and_compensation_agree_on_what_is_forward() {
    let lab = Lab::new();
    lab.write("slide.yaml", SLIDE);
    lab.write("axis.csv", &axis(1));
    let report = json(&lab, &["report", "iso230", "axis.csv", "--json"]);
    let mean = |way: &str| report["at"][0][way]["mean"].as_f64().unwrap_or_else(|| panic!("{way}: {report}"));
    assert!(
        (mean("positive") - mean("negative") + 0.024).abs() < 0.001,
        "moving up it stays behind: {report}"
    );
    let added = lab.plumb(&[
        "model",
        "add",
        "slide.yaml",
        "joint_backlash(x)",
        "--data",
        "axis.csv",
        "--holdout",
        "none",
    ]);
    assert_eq!(added.code(), 0, "{}", added.all());
    let file = lab.plumb(&["model", "export", "slide.yaml", "--as", "linuxcnc"]).out();
    let line: Vec<f64> = file.lines().next().unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
    assert!(
        line[1] < line[2] && (line[2] - line[1] - 0.024).abs() < 0.002,
        "nominal, forward, reverse: {file}"
    );
}

#[test]
fn a_table_that_counts_the_other_way_is_recognised_by_its_negative_play() {
    let lab = Lab::new();
    lab.write("slide.yaml", SLIDE);
    for (up, is_reported) in [(1, false), (-1, true)] {
        lab.write("axis.csv", &axis(up));
        let output = lab.plumb(&["model", "diagnose", "slide.yaml", "--data", "axis.csv"]);
        assert!(output.code() == 0 && output.out().contains("joint_backlash(x)"), "{}", output.all());
        assert_eq!(
            output.all().contains("the play of x is negative")
                && output.all().contains("`approach_x` is not 1"),
            is_reported,
            "{}",
            output.all()
        );
    }
    lab.edit("axis.csv", "0,-1,", "0,up,");
    let refused = lab.plumb(&["model", "diagnose", "slide.yaml", "--data", "axis.csv"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
}
