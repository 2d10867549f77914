//! Runs in which all goes well.

use crate::lab::Lab;

#[test]
fn without_a_terminal_the_cell_initializes_itself_and_finds_the_true_zeros() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(run.out().contains("run 1 passed: all steps passed"), "{}", run.out());
    lab.assert_zeros_found("1");
    let again = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(again.code(), 0, "{}", again.all());
    lab.assert_zeros_found("2");
    let history = lab.plumb(&["history"]).out();
    assert!(history.lines().count() == 3 && history.contains("initialize"), "{history}");
    let show = lab.plumb(&["show", "2"]).out();
    for part in [
        "run 2 of teachmover",
        "shoulder_elbow.cycle[4].edge",
        "trigger poses",
        "joint zero of arm elbow",
        "cell.yaml",
    ] {
        assert!(show.contains(part), "{part} is missing in\n{show}");
    }
}

#[test]
fn table_2_1_comes_out_of_the_procedure_to_the_papers_digits() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-paper.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let shown = lab.shown("1");
    let readings = shown["readings"].as_array().unwrap().iter().filter(|reading| reading["name"] == "error");
    let errors: Vec<f64> = readings.map(|reading| reading["value"].as_f64().unwrap()).collect();
    let printed = [(-10138.0, 1.0), (178.2, 0.1), (-5.635, 0.001), (0.1766, 0.0001)];
    assert_eq!(errors.len(), 7, "{errors:?}");
    for (found, (printed, digit)) in errors.iter().zip(printed) {
        assert!((found - printed).abs() < digit, "found {found}, printed {printed}");
    }
    let table = lab.plumb(&["show", "1"]).out();
    assert!(table.contains("error micron") && table.contains("178.24"), "{table}");
}

#[test]
fn with_backlash_the_zeros_found_are_those_of_the_side_of_approach() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-backlash.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    // All three joints are searched towards smaller angles, where the drive leads the arm by half the play (0.4, 0.3 and 0.5 degrees).
    for ((joint, found), side) in lab.zeros("1").into_iter().zip([1.7 + 0.2, -2.4 + 0.15, 1.3 + 0.25]) {
        assert!((found - side).abs() < 0.1, "{joint}: found {found}, expected about {side}");
    }
}

#[test]
fn a_parameter_can_be_set_and_is_kept_with_the_run() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml", "initialize", "--set", "cycles=1", "--set", "Br_deg=8"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let shown = lab.shown("1");
    assert_eq!(shown["run"]["parameters"]["cycles"], 1);
    assert_eq!(shown["run"]["parameters"]["Br_deg"], 8);
    assert!(!lab.plumb(&["show", "1"]).out().contains("cycle[3]"));
}

#[test]
fn events_are_lines_of_json_in_an_unbroken_sequence() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell-paper.yaml", "--set", "cycles=1"]);
    let mut sequence = 0;
    let mut last = serde_json::Value::Null;
    while let Some(event) = running.event() {
        sequence += 1;
        assert_eq!(event["sequence"], sequence);
        last = event;
    }
    assert_eq!((&last["event"], &last["outcome"]), (&"run_ended".into(), &"passed".into()));
}

#[test]
fn nothing_of_a_run_is_left_behind() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell-paper.yaml", "--set", "cycles=1"]);
    let arm = running.host_of("libplumb_simulated");
    let eye = running.host_of("libplumb_ir_proximity");
    while running.event().is_some() {}
    for process in [arm, eye] {
        crate::lab::wait_gone(process);
    }
    let cell = lab.path("cell-paper.yaml").display().to_string();
    let worlds = std::fs::read_dir("/proc").unwrap().flatten().filter(|entry| {
        let command = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&command).contains(&cell.replace("cell-paper", "world-no-table"))
    });
    assert_eq!(worlds.count(), 0, "the world has ended");
}
