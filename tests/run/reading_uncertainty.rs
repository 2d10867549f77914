//! A reading's own uncertainty goes from the sensor through `measure` and `row` into the measurement table, and there into the fit.

use std::process::Command;

use crate::lab::Lab;

/// A sensor that says where the tip is, made up, and how sure it is; of z it does not know.
const DRIVER: &str = r#"import plumb_driver

class Tracker(plumb_driver.Sensor):
    model, quantities = "a tracker, made up", {"x": "mm", "y": "mm", "z": "mm"}

    def read(self, after_ns):
        return {"x": (700.5, 0.02), "y": (1.25, 0.04), "z": 300.0}

plumb_driver.run(Tracker)
"#;

fn procedure(row: &str) -> String {
    format!(
        "procedure: sure
title: How sure
steps:
  - {{id: tip, do: {{measure: {{sensor: tracker}}}}}}
  - {{id: row, do: {{row: {{robot: arm, p1_x_mm: tip.x_mm, p1_y_mm: tip.y_mm, p1_z_mm: tip.z_mm, {row}}}}}}}
"
    )
}

/// The SCARA with that sensor; none without Python, which is said.
fn cell(row: &str) -> Option<Lab> {
    if Command::new("python3").arg("--version").output().is_err() {
        println!("skipped: there is no `python3` here");
        return None;
    }
    let lab = Lab::of("scara");
    let made = lab.plumb(&["plugins", "new", "sensor", "pytracker", "--lang", "python"]);
    assert_eq!(made.code(), 0, "{}", made.all());
    lab.write("pytracker/driver.py", DRIVER);
    let quantities =
        "quantities:\n  - {name: x, unit: mm}\n  - {name: y, unit: mm}\n  - {name: z, unit: mm}\n";
    lab.edit("pytracker/plugin.yaml", "quantities:\n  - {name: height, unit: mm}\n", quantities);
    lab.edit("cell.yaml", "devices:\n", "devices:\n  tracker: {plugin: pytracker}\n");
    lab.edit("cell.yaml", "procedures: [", "procedures: [sure.yaml, ");
    lab.write("sure.yaml", &procedure(row));
    Some(lab)
}

#[test]
fn what_a_sensor_says_of_its_own_uncertainty_reaches_the_table_and_the_fit() {
    let Some(lab) = cell("std_x_mm: tip.std_x_mm, std_y_mm: 2 * tip.std_y_mm") else {
        return;
    };
    for arguments in [&["check", "cell.yaml"][..], &["run", "cell.yaml", "sure", "--headless"]] {
        let output = lab.plumb(arguments);
        assert_eq!(output.code(), 0, "{arguments:?}: {}", output.all());
    }
    let table = lab.plumb(&["show", "--table"]).out();
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let cells: Vec<&str> = lines.next().unwrap().split(',').collect();
    let cell = |name: &str| header.iter().position(|known| *known == name).map(|index| cells[index]);
    assert_eq!((cell("std_x_mm"), cell("std_y_mm")), (Some("0.02"), Some("0.08")), "{table}");
}

#[test]
fn an_uncertainty_that_is_none_is_refused_where_it_is_written() {
    let Some(lab) = cell("std_x_mm: tip.std_q_mm") else { return };
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert!(
        output.code() != 0 && output.all().contains("std_q_mm") && output.all().contains("std_x_mm"),
        "{}",
        output.all()
    );
    lab.write("sure.yaml", &procedure("std_z_mm: tip.std_z_mm"));
    let output = lab.plumb(&["run", "cell.yaml", "sure", "--headless"]);
    assert_ne!(output.code(), 0, "what the sensor does not know is no number");
    assert!(output.all().contains("std_z_mm"), "{}", output.all());
    lab.plumb(&["doctor", "--clean", "cell.yaml"]);
    lab.write("sure.yaml", &procedure("std_x_mm: -tip.std_x_mm"));
    let output = lab.plumb(&["run", "cell.yaml", "sure", "--headless"]);
    assert_ne!(output.code(), 0);
    assert!(
        output.all().contains("`std_x_mm` is -0.02: a standard uncertainty is above 0"),
        "{}",
        output.all()
    );
    lab.plumb(&["doctor", "--clean", "cell.yaml"]);
    lab.write("sure.yaml", &procedure("std_x_mn: tip.std_x_mm"));
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert!(
        output.code() != 0
            && output.all().contains("a row has no column `std_x_mn`")
            && output.all().contains("units are mm, m"),
        "{}",
        output.all()
    );
}
