//! A measuring probe in the hand, a datum cube and balls: the shipped cell from the run to the arm's fault by its name, and what is refused.

use serde_json::Value;

use crate::lab::Lab;

fn json(lab: &Lab, arguments: &[&str]) -> Value {
    let output = lab.plumb(arguments);
    assert_eq!(output.code(), 0, "{}", output.all());
    serde_json::from_str(&output.out()).unwrap()
}

#[test]
fn the_shipped_cell_names_the_elbow_by_touch_and_finds_cube_balls_and_stylus() {
    let lab = Lab::of("ur5");
    let run = lab.plumb(&["run", "cell-probe.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    lab.write("touches.csv", &lab.plumb(&["show", "--table"]).out());
    let pair = ["probe.model.yaml", "--data", "touches.csv"];
    let verdict = json(&lab, &[&["model", "diagnose", "--json"], &pair[..]].concat());
    assert_eq!(
        (&verdict["verdict"], &verdict["candidates"][0]["label"]),
        (&"named".into(), &"joint_zero(elbow)".into()),
        "{verdict}"
    );
    let added = json(
        &lab,
        &[
            "model",
            "add",
            "probe.model.yaml",
            "joint_zero(elbow)",
            "--data",
            "touches.csv",
            "--holdout",
            "none",
            "--json",
        ],
    );
    let effect = &added["added"][0];
    let (size, se) = (effect["size"].as_f64().unwrap().abs(), effect["se"].as_f64().unwrap());
    assert!((size - 0.08).abs() < 4.0 * se && se < 0.01, "{effect}");
    // The cube of the world file is square to 0.001 deg; so it is measured, where the elbow is right.
    let surfaces = added["surfaces"].as_array().unwrap();
    let angles: Vec<&Value> =
        surfaces.iter().flat_map(|one| one["angles"].as_array().into_iter().flatten()).collect();
    assert_eq!(angles.len(), 3, "{added}");
    for angle in &angles {
        let (at, se) = (angle["deg"].as_f64().unwrap(), angle["se_deg"].as_f64().unwrap());
        assert!((at - 90.0).abs() < 4.0 * se + 0.001 && se < 0.05, "{angle}");
    }
    let compared =
        lab.plumb(&["model", "compare", "probe.model.yaml", "--data", "touches.csv", "--holdout", "none"]);
    assert!(
        compared.out().contains("  top to front: ") && compared.out().contains("  front to side: "),
        "{}",
        compared.all()
    );
    // Of the world file: the second ball; its position is as sure as is declared.
    let ball = added["surfaces"].as_array().unwrap().iter().find(|one| one["name"] == "ball_b").unwrap();
    for (number, truth) in ball["numbers"].as_array().unwrap().iter().zip([-619.8, 160.2, 39.9]) {
        let (at, se) = (number["value"].as_f64().unwrap(), number["se"].as_f64().unwrap());
        assert!((at - truth).abs() < 4.0 * se && se < 0.5, "{number} is {truth}");
    }
}

#[test]
fn a_probe_that_is_nowhere_near_or_has_nothing_to_feel_fails_the_run_and_says_so() {
    let lab = Lab::of("ur5");
    lab.edit("world-probe.yaml", "point_mm: [-450, -200, 60]", "point_mm: [-450, -200, 40]");
    let run = lab.plumb(&["run", "cell-probe.yaml", "--headless"]);
    assert_ne!(run.code(), 0);
    assert!(run.all().contains("the probe does not feel `top` from here: its ball is "), "{}", run.all());
    lab.plumb(&["doctor", "--clean", "cell-probe.yaml"]);
    lab.edit("procedures/feel.yaml", "{read_probe: {at: top}}", "{read_probe: {at: tip}}");
    let run = lab.plumb(&["run", "cell-probe.yaml", "--headless", "--record", "other"]);
    assert!(run.all().contains("nothing to feel called `tip`; there is front"), "{}", run.all());
    lab.plumb(&["doctor", "--clean", "cell-probe.yaml"]);
}
