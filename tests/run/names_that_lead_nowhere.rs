//! Names in cells and procedures that no device answers to: `plumb check` and `--dry-run` find them, with nothing started.

use crate::lab::Lab;

/// `plumb check` of these files, a dry run and a run all end with 2 and say each of these; nothing was started.
fn assert_found(lab: &Lab, files: &[&str], procedure: &str, words: &[&str]) {
    let mut commands: Vec<Vec<&str>> = files.iter().map(|file| vec!["check", file]).collect();
    commands.push(vec!["run", files[0], procedure, "--dry-run"]);
    commands.push(vec!["run", files[0], procedure, "--headless"]);
    for command in commands {
        let output = lab.plumb(&command);
        assert_eq!(output.code(), 2, "{command:?}: {}", output.all());
        for word in words {
            assert!(output.err().contains(word), "{word} in {command:?}: {}", output.all());
        }
    }
    assert!(lab.plumb(&["history"]).out().contains("no runs"), "nothing was started");
}

#[test]
fn a_misspelled_value_of_a_reading_is_found_in_the_procedure_with_what_was_meant() {
    let lab = Lab::of("light-stripe");
    lab.edit("procedures/camera-aim.yaml", "first.lens_x_mm", "first.lens_xx_mm");
    let words =
        ["procedures/camera-aim.yaml:46:", "`first` has no `lens_xx_mm`", "did you mean `lens_x_mm`?"];
    assert_found(&lab, &["cell.yaml", "procedures/camera-aim.yaml"], "camera-aim", &words);
    // Of a camera too, and the unit belongs to the name.
    let lab = Lab::of("light-stripe");
    lab.write(
        "procedures/extra.yaml",
        "procedure: extra\nsteps:\n  - {id: look, do: {measure: {sensor: camera}}}\n  - {id: lit, do: {check: {that: look.brightness > 3, otherwise: too dark}}}\n",
    );
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
    assert_found(&lab, &["cell.yaml"], "extra", &["`look` has no `brightness`", "did you mean `brightest`?"]);
}

#[test]
fn a_line_that_the_arm_has_not_is_found_in_a_simulated_cell_and_in_one_with_a_driver() {
    for cell in ["cell.yaml", "cell-serial.yaml", "cell-hardware.yaml"] {
        let lab = Lab::new();
        lab.edit(cell, "bit: 0", "bit: 9");
        let words = ["device `eye`: `config.bit` is 9", "`arm` has 7 input lines: 0 to 6"];
        assert_found(&lab, &[cell], "initialize", &words);
    }
    let lab = Lab::new();
    lab.edit("cell.yaml", "bit: 0", "bit: 6");
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(output.code(), 0, "the last line is one: {}", output.all());
}

#[test]
fn a_sensor_without_the_input_its_settings_need_is_found() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "inputs: {line: arm/inputs}, ", "");
    let words = [
        "device `eye` has `bit`, which needs its input `line` wired",
        "write `inputs: {line: DEVICE/STREAM}` with a stream of digital-inputs/1",
    ];
    assert_found(&lab, &["cell.yaml"], "initialize", &words);
}

#[test]
fn an_arm_that_is_not_placed_in_the_world_is_found() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "arm: teachmover", "arm: techmover");
    let words =
        ["device `arm`: there is no arm `techmover` in the cell's world", "did you mean `teachmover`?"];
    assert_found(&lab, &["cell.yaml"], "initialize", &words);
}

#[test]
fn a_dry_run_finds_what_is_wrong_with_the_world_file() {
    let lab = Lab::new();
    lab.edit("world-ideal.yaml", "arm:", "amr:");
    assert_found(&lab, &["cell.yaml"], "initialize", &["world-ideal.yaml", "did you mean `arm`?"]);
}

/// A cell of an arm and a gauge as `plumb plugins new` makes them. Nothing of them is started, so that Python need not be there.
fn own_devices() -> Lab {
    let lab = Lab::new();
    for arguments in [["robot", "quill"], ["sensor", "gauge"]] {
        let made = lab.plumb(&[&["plugins", "new"], &arguments[..], &["--lang", "python"]].concat());
        assert_eq!(made.code(), 0, "{}", made.all());
    }
    lab.write(
        "cell-own.yaml",
        "cell: own\ntitle: own\ndevices:\n  arm: {plugin: quill}\n  gauge: {plugin: gauge}\nrobots:\n  arm: {joints: {waist: deg, slide: mm}}\nprocedures: [quill/procedure.yaml]\n",
    );
    let good = lab.plumb(&["check", "cell-own.yaml"]);
    assert_eq!(good.code(), 0, "{}", good.all());
    lab
}

#[test]
fn a_robot_that_is_none_and_joints_that_its_manifest_has_not_are_found() {
    // The same slip in cell and procedure: they agree with each other, and not with the plugin.
    let waist =
        "procedure: there-and-back\nsteps:\n  - {id: out, do: {move: {robot: arm, to_mm: {waist: 3}}}}\n";
    let slide =
        "procedure: there-and-back\nsteps:\n  - {id: out, do: {move: {robot: arm, to_deg: {slide: 3}}}}\n";
    let slid =
        "procedure: there-and-back\nsteps:\n  - {id: out, do: {move: {robot: arm, to_mm: {slid: 3}}}}\n";
    for (from, to, procedure, words) in [
        (
            "arm: {plugin: quill}",
            "arm: {plugin: gauge}",
            None,
            ["cell-own.yaml:4:", "device `arm` is under `robots:`, and plugin `gauge` is a sensor"],
        ),
        (
            "gauge: {plugin: gauge}",
            "gauge: {plugin: quill}",
            None,
            ["device `gauge` is a robot, and the cell file says nothing about it", "name it under `robots:`"],
        ),
        (
            "{waist: deg, slide: mm}",
            "{waist: deg, slid: mm}",
            Some(slid),
            ["robot `arm`: its plugin has no joint `slid`", "did you mean `slide`?"],
        ),
        (
            "{waist: deg, slide: mm}",
            "{waist: mm, slide: mm}",
            Some(waist),
            ["robot `arm`: joint `waist` is given in mm", "it turns: write `deg`"],
        ),
        (
            "{waist: deg, slide: mm}",
            "{waist: deg, slide: deg}",
            Some(slide),
            ["robot `arm`: joint `slide` is given in deg", "it slides: write `mm`"],
        ),
    ] {
        let lab = own_devices();
        lab.edit("cell-own.yaml", from, to);
        if let Some(procedure) = procedure {
            lab.write("quill/procedure.yaml", procedure);
        }
        assert_found(&lab, &["cell-own.yaml"], "there-and-back", &words);
    }
}

/// The template lists its joints with their ends.
#[test]
fn a_position_beyond_the_joints_of_a_new_robot_is_found() {
    let lab = own_devices();
    lab.edit("quill/procedure.yaml", "to_mm: {slide: 40}", "to_mm: {slide: 240}");
    assert_found(&lab, &["cell-own.yaml"], "there-and-back", &["slide", "240", "200"]);
}
