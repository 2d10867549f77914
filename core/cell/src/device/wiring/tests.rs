//! What the manifests of plugins know of a cell before anything is started.

use super::super::test_cell::{CELL, cell_in, plugins};
use super::*;
use crate::device::{joint_ranges, own_limits};
use crate::joint_range::JointRange;

/// What is said of a cell in which one piece of the good one is another.
fn errors(old: &str, new: &str) -> Vec<String> {
    assert!(CELL.contains(old), "{old}");
    errors_of(&CELL.replace(old, new), &[])
}

fn errors_of(text: &str, lines: &[InputLines]) -> Vec<String> {
    let (directory, catalogue) = plugins();
    let cell = cell_in(&directory, text);
    match check_plugins(&cell, &catalogue, lines) {
        Ok(()) => Vec::new(),
        Err(problems) => sentences(&problems),
    }
}

/// Each mistake, with what would be right.
fn sentences(problems: &FileProblems) -> Vec<String> {
    let in_words = |one: &plumb_document::Problem| {
        format!("{}: {}", one.message, one.help.as_deref().unwrap_or_default())
    };
    problems.problems.iter().map(in_words).collect()
}

/// Exactly one thing is said, with these words.
fn assert_said(old: &str, new: &str, words: &[&str]) {
    let errors = errors(old, new);
    assert_eq!(errors.len(), 1, "{errors:?}");
    for word in words {
        assert!(errors[0].contains(word), "{word}: {}", errors[0]);
    }
}

#[test]
fn a_cell_that_fits_its_plugins_is_in_order() {
    assert!(errors("", "").is_empty(), "{:?}", errors("", ""));
}

#[test]
fn a_plugin_that_is_not_there_is_reported_with_those_that_are() {
    let errors = errors("plugin: test-sensor", "plugin: test-sensr");
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].contains("test-sensr") && errors[0].contains("test-sensor"), "{errors:?}");
}

#[test]
fn a_device_under_robots_has_to_be_one_and_a_robot_has_to_be_there() {
    let both = "arm: {joints: {waist: deg, lift: mm}}\n  eye: {joints: {waist: deg}}";
    let errors = errors("arm: {joints: {waist: deg, lift: mm}}", both);
    assert!(errors.iter().any(|one| one.contains("device `eye` is under `robots:`")), "{errors:?}");
    let none = CELL.replace("robots:\n  arm: {joints: {waist: deg, lift: mm}}\n", "");
    let errors = errors_of(&none, &[]);
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(
        errors[0].contains("device `arm` is a robot, and the cell file says nothing about it"),
        "{errors:?}"
    );
}

#[test]
fn a_joint_is_one_of_the_plugins_in_its_own_unit() {
    assert_said("waist: deg", "waste: deg", &["its plugin has no joint `waste`", "waist"]);
    assert_said("waist: deg", "waist: mm", &["joint `waist` is given in mm", "it turns: write `deg`"]);
    assert_said("lift: mm", "lift: deg", &["joint `lift` is given in deg", "it slides: write `mm`"]);
}

#[test]
fn an_input_is_wired_to_a_stream_that_is_there_and_fits() {
    let wired = "inputs: {line: arm/inputs}";
    let added = |wire: &str| format!("inputs: {{line: arm/inputs, {wire}}}");
    assert_said(wired, &added("lime: arm/inputs"), &["plugin `test-sensor` has no input `lime`", "line"]);
    assert_said(wired, "inputs: {line: arm/input}", &["device `arm` has no stream `input`", "inputs"]);
    let message = "input `line` takes digital-inputs/1, but this stream carries joint-state/1";
    assert_said(wired, "inputs: {line: arm/joints}", &[message, "wire a stream of the same kind"]);
    assert!(errors(wired, &added("joints: arm/joints")).is_empty());
}

#[test]
fn an_input_that_is_needed_has_to_be_wired_and_an_optional_one_has_not() {
    assert_said(
        "config: {bit: 1}, inputs: {line: arm/inputs}",
        "config: {}",
        &[
            "device `eye` needs its input `line` wired",
            "write `inputs: {line: DEVICE/STREAM}` with a stream of digital-inputs/1",
        ],
    );
}

#[test]
fn a_setting_that_means_an_input_needs_it_wired() {
    assert_said(
        "bit: 1}",
        "bit: 1, chip: /dev/gpiochip0}",
        &["device `eye` has `chip`, which needs its input `joints` wired", "with a stream of joint-state/1"],
    );
}

#[test]
fn a_line_is_one_of_those_the_robot_has() {
    assert!(errors("bit: 1", "bit: 0").is_empty());
    assert_said("bit: 1", "bit: 2", &["`config.bit` is 2", "`arm` has 2 input lines: 0 to 1"]);
    assert_eq!(lines_in_words(0), "`arm` has no input lines");
    assert_eq!(lines_in_words(1), "`arm` has one input line: 0");
}

fn lines_in_words(count: u32) -> String {
    super::super::input_lines::lines_there_are("arm", count)
}

#[test]
fn how_many_lines_there_are_is_known_from_the_manifest_or_else_from_the_device() {
    let (folder, mut catalogue) = plugins();
    let cell = cell_in(&folder, CELL);
    let reported = |count| [InputLines { device: "arm".to_owned(), count }];
    assert_eq!(lines_of(&cell, &catalogue, &reported(7), "arm"), Some(2), "the manifest comes first");
    let manifest = folder.path().join("robot/plugin.yaml");
    let text = std::fs::read_to_string(&manifest).unwrap().replace("input_lines: 2\n", "");
    std::fs::write(&manifest, text).unwrap();
    catalogue = Catalogue::search(&[folder.path().to_owned()]);
    assert_eq!(lines_of(&cell, &catalogue, &reported(7), "arm"), Some(7));
    assert_eq!(lines_of(&cell, &catalogue, &reported(7), "eye"), None);
    assert_eq!(lines_of(&cell, &catalogue, &reported(7), "leg"), None, "there is no such device");
}

#[test]
fn settings_are_held_against_the_plugins_schema() {
    assert_said("bit: 1", "bit: -1", &["device `eye`: `config.bit` is -1", "it lies at 0 or above"]);
    assert_said("bit: 1", "bite: 1", &["`config` has no key `bite`", "bit"]);
}

#[test]
fn wired_inputs_are_reported_with_the_stream_they_come_from() {
    let (directory, catalogue) = plugins();
    let cell = cell_in(&directory, CELL);
    let wired = wired_inputs(&cell, &cell.devices[1], &catalogue).unwrap();
    let [wire] = wired.as_slice() else { panic!("{wired:?}") };
    assert_eq!((wire.input.as_str(), wire.device.as_str()), ("line", "arm"));
    assert_eq!((wire.stream.name.as_str(), wire.stream.message.as_str()), ("inputs", "digital-inputs/1"));
    let cell = cell_in(&directory, &CELL.replace("arm/inputs", "arm/input"));
    let error = wired_inputs(&cell, &cell.devices[1], &catalogue).unwrap_err();
    assert!(error.starts_with("device `arm` has no stream `input`: "), "{error}");
}

#[test]
fn joints_go_as_far_as_the_manifest_or_the_robot_itself_says() {
    let (directory, catalogue) = plugins();
    let cell = cell_in(&directory, CELL);
    let ranges = joint_ranges(&cell, &catalogue, &[]);
    let [waist, lift] = ranges.as_slice() else { panic!("{ranges:?}") };
    assert_eq!((waist.device.as_str(), waist.joint.as_str()), ("arm", "waist"));
    assert!((waist.least.to_degrees() + 90.0).abs() < 1e-9 && (waist.most.to_degrees() - 120.0).abs() < 1e-9);
    assert_eq!((lift.joint.as_str(), lift.least, lift.most), ("lift", 0.0, 50.0));
    let reported = JointRange { device: "arm".into(), joint: "waist".into(), least: -1.0, most: 1.0 };
    let ranges = joint_ranges(&cell, &catalogue, std::slice::from_ref(&reported));
    assert_eq!(
        ranges,
        std::slice::from_ref(&reported),
        "what the robot said counts, and nothing of its manifest"
    );
    let other = JointRange { device: "leg".into(), ..reported };
    assert_eq!(joint_ranges(&cell, &catalogue, &[other]).len(), 3, "another's joints say nothing of these");
    let limits = own_limits(&cell, "arm", &ranges);
    let [limit] = limits.as_slice() else { panic!("one of the arm's joints is known: {}", limits.len()) };
    assert_eq!((limit.joint.as_str(), limit.least, limit.most, limit.zero_shift), ("waist", -1.0, 1.0, 0.0));
    assert!(own_limits(&cell, "leg", &ranges).is_empty());
}

/// Numbers of a procedure are a drive's: they go as far beyond a joint's own limits as its zero may be put elsewhere.
#[test]
fn limits_reach_as_far_as_a_procedure_may_shift_the_zero() {
    let (folder, catalogue) = plugins();
    let procedure = "procedure: find\nsteps:\n  - {id: near, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 1, uncertainty_deg: 1, plausible_deg: 4}}}}}\n  - {id: far, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 1, uncertainty_deg: 1, plausible_deg: 6}, lift: {shift_mm: 1, uncertainty_mm: 1, plausible_mm: 3}}}}}\n";
    std::fs::write(folder.path().join("find.yaml"), procedure).unwrap();
    let cell = cell_in(&folder, &CELL.replace("procedures: []", "procedures: [find.yaml]"));
    let limits = own_limits(&cell, "arm", &joint_ranges(&cell, &catalogue, &[]));
    let shifts: Vec<_> = limits.iter().map(|limit| (limit.joint.as_str(), limit.zero_shift)).collect();
    assert_eq!(shifts, [("waist", 6.0_f64.to_radians()), ("lift", 3.0)], "the furthest of its steps");
}

#[test]
fn what_a_procedure_corrects_is_something_the_sensor_takes() {
    let (folder, catalogue) = plugins();
    let errors = |key: &str| {
        let procedure = format!(
            "procedure: level\nsteps:\n  - {{id: set, do: {{correct: {{sensor: eye, parameters: {{{key}: {{shift: 0.1, uncertainty: 0.1, plausible: 5}}}}}}}}}}\n"
        );
        std::fs::write(folder.path().join("level.yaml"), procedure).unwrap();
        let cell = cell_in(&folder, &CELL.replace("procedures: []", "procedures: [level.yaml]"));
        check_plugins(&cell, &catalogue, &[]).err().map(|problems| sentences(&problems).concat())
    };
    assert_eq!(errors("tilt_deg"), None);
    let message = errors("tilt_mm").unwrap();
    assert!(
        message.contains(
            "procedure `level` corrects its `tilt_mm`, and plugin `test-sensor` takes no such correction"
        ) && message.contains("tilt_deg"),
        "{message}"
    );
}

#[test]
fn joints_that_a_setting_lists_count_where_its_schema_marks_them() {
    let (folder, _) = plugins();
    let manifest = folder.path().join("robot/plugin.yaml");
    let text = std::fs::read_to_string(&manifest).unwrap();
    let (head, _) = text.split_once("joints:\n  - {name: waist").unwrap();
    let marked = "config:\n  type: object\n  properties:\n    axes: {type: array, are_joints: true}\n    spare: {type: array}\n";
    std::fs::write(&manifest, format!("{head}{marked}")).unwrap();
    let catalogue = Catalogue::search(&[folder.path().to_owned()]);
    let axes = "arm: {plugin: test-robot, config: {axes: [{name: waist, from_deg: -10, to_deg: 20}], spare: [{name: tail, from_mm: 0, to_mm: 1}]}}";
    let cell = cell_in(&folder, &CELL.replace("arm: {plugin: test-robot}", axes));
    let ranges = joint_ranges(&cell, &catalogue, &[]);
    let [waist] = ranges.as_slice() else { panic!("{ranges:?}") };
    assert!((waist.most.to_degrees() - 20.0).abs() < 1e-9, "{waist:?}");
    let problems = check_plugins(&cell, &catalogue, &[]).expect_err("it has no lift");
    let errors = sentences(&problems);
    assert!(errors.len() == 1 && errors[0].contains("its plugin has no joint `lift`"), "{errors:?}");
}
