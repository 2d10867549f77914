//! What the stages of a rig's calibration find are corrections: accepted or discarded, recorded, used by later runs, certified, rolled back.

use std::fs;

use nix::sys::signal::Signal;
use plumb_record::{Record, StoredCorrection};
use serde_json::Value;

use crate::agin_steps::{APEX_MM, apex_error, out_of_true, values_of};
use crate::lab::{Lab, wait_gone};

/// The corrections of a run, by their names.
fn corrections(lab: &Lab, run: i64) -> Vec<StoredCorrection> {
    let record = Record::open(&lab.path("record")).unwrap();
    record.corrections_of_run(plumb_record::RunId(run)).unwrap()
}

fn found<'c>(corrections: &'c [StoredCorrection], site: &str) -> Vec<&'c StoredCorrection> {
    corrections.iter().filter(|one| one.key.site == site).collect()
}

#[test]
fn four_stages_in_a_sequence_correct_a_rig_that_was_never_calibrated() {
    let lab = Lab::of("light-stripe");
    assert_eq!(lab.plumb(&["check", "new-rig.yaml"]).code(), 0);
    assert!(apex_error(&lab, "new-rig.yaml", APEX_MM) > 2.0);
    let output = lab.plumb(&["run", "new-rig.yaml", "calibrate-rig", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let all = corrections(&lab, 2);
    let sites: Vec<&str> = all.iter().map(|one| one.key.site.as_str()).collect();
    assert_eq!(
        sites,
        [
            "flange",
            "camera_aim_x",
            "camera_aim_y",
            "camera_scale_u",
            "camera_scale_v",
            "camera_roll",
            "sheet_tilt",
            "sheet_turn",
            "sheet_offset"
        ]
    );
    let revisions: Vec<i64> = all.iter().map(|one| one.revision.expect("accepted")).collect();
    assert!(
        revisions.is_sorted() && revisions.first() < revisions.last(),
        "a revision a stage: {revisions:?}"
    );
    // Later runs use the corrected rig: nobody wrote a rig file.
    let left = apex_error(&lab, "new-rig.yaml", APEX_MM);
    assert!(left < 0.5, "{left} mm");
    // Done again, the stages find nothing more than their uncertainties.
    let output = lab.plumb(&["run", "new-rig.yaml", "calibrate-rig", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    for (first, again) in all.iter().zip(corrections(&lab, 4)) {
        assert!((again.old - first.new).abs() < 1e-12, "{again:?} goes on from {first:?}");
        let change = (again.new - again.old).abs();
        assert!(change < 2.0 * first.uncertainty.unwrap(), "{} changes by {change}", first.key.site);
    }
}

#[test]
fn a_correction_of_the_rig_has_a_trend_a_certificate_and_a_way_back() {
    let lab = out_of_true();
    let plumb = |arguments: &[&str]| {
        let output = lab.plumb(&[arguments, &["--record", "record"]].concat());
        assert_eq!(output.code(), 0, "{arguments:?}: {}", output.all());
        output.out()
    };
    values_of(&lab, "cell.yaml", "camera-aim", "correction");
    values_of(&lab, "cell.yaml", "camera-scale", "correction");
    values_of(&lab, "cell.yaml", "projector", "correction");
    let trend = plumb(&["history", "--trend", "stripe.camera_aim_x"]);
    assert!(trend.contains("camera aim x of stripe, deg") && trend.contains(" now "), "{trend}");
    let certificate = lab.path("certificate.html");
    plumb(&["certificate", "3", "-o", certificate.to_str().unwrap()]);
    let page = fs::read_to_string(certificate).unwrap();
    assert!(page.contains("sheet tilt of stripe") && page.contains("sheet offset of stripe"), "{page}");
    let shown = plumb(&["show", "2"]);
    assert!(shown.contains("camera scale u"), "{shown}");

    // Written as a rig file, the numbers contain the corrections of the record: they are not made twice.
    let written = plumb(&["stripe", "correct", "cell.yaml", "-o", "calibrated.yaml"]);
    assert!(written.contains("camera aim x") && written.contains("calibrated.rig.yaml"), "{written}");
    for cell in ["cell.yaml", "calibrated.yaml"] {
        let left = apex_error(&lab, cell, APEX_MM);
        assert!(left < 0.5, "{cell}: {left} mm");
    }
    let again = lab.plumb(&["stripe", "correct", "cell.yaml", "--record", "record", "-o", "calibrated.yaml"]);
    assert!(again.code() == 2 && again.err().contains("calibrated.rig.yaml"), "{}", again.all());
    let none = lab.plumb(&["stripe", "correct", "cell.yaml", "--record", "other", "-o", "none.yaml"]);
    assert!(
        none.code() == 2 && none.err().contains("no correction of `stripe` is in force"),
        "{}",
        none.all()
    );
    assert!(!lab.path("other").exists(), "looking for corrections makes no record");

    // Rolled back to the camera's aim alone, the pyramid is off again.
    let aim = corrections(&lab, 1).first().unwrap().revision.unwrap().to_string();
    let zeros = plumb(&["record", "zeros", "light-stripe"]);
    assert!(
        zeros.contains("stripe of cell light-stripe: in force now") && zeros.contains("  camera aim x "),
        "{zeros}"
    );
    let back = plumb(&["record", "rollback", "light-stripe", &aim]);
    assert!(back.contains("  sheet tilt ") && back.contains("  camera scale u "), "{back}");
    let back = apex_error(&lab, "cell.yaml", APEX_MM);
    assert!(back > 1.0, "{back} mm");
}

#[test]
fn what_is_discarded_is_recorded_and_changes_nothing() {
    let lab = Lab::of("light-stripe");
    lab.edit("answers.yaml", "  aim.take_over: accept", "  aim.take_over: reject");
    let output = lab.plumb(&["run", "new-rig.yaml", "calibrate-rig", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(output.out().contains("discarded: stripe works with the values it had"), "{}", output.out());
    let all = corrections(&lab, 1);
    assert!(found(&all, "camera_aim_x").iter().all(|one| one.revision.is_none()), "{all:?}");
    assert!(found(&all, "camera_scale_u").iter().all(|one| one.revision.is_some()), "{all:?}");
}

/// The cell with one procedure more, of these steps.
fn with_steps(steps: &str) -> Lab {
    let lab = Lab::of("light-stripe");
    lab.write("procedures/extra.yaml", &format!("procedure: extra\nsteps:\n{steps}"));
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
    lab
}

#[test]
fn implausible_corrections_and_too_few_stripes_are_refused_before_anything_changes() {
    let lab = with_steps(
        "  - {id: turn, on_error: abort, do: {correct: {sensor: stripe, ask: false, parameters: {camera_roll_deg: {shift: 40, uncertainty: 0.1, plausible: 5}}}}}\n",
    );
    let output = lab.plumb(&["run", "cell.yaml", "extra", "--headless", "--record", "record"]);
    assert!(
        output.code() == 2
            && output.all().contains(
                "camera_roll would shift by 40.000 deg, more than the plausible 5 deg: nothing was changed"
            ),
        "{}",
        output.all()
    );
    assert!(corrections(&lab, 1).is_empty());
    // What the procedure allows and no rig can be, the sensor refuses, and the record has no such value in force.
    lab.edit(
        "procedures/extra.yaml",
        "shift: 40, uncertainty: 0.1, plausible: 5",
        "shift: 40, uncertainty: 0.1, plausible: 90",
    );
    let output = lab.plumb(&["run", "cell.yaml", "extra", "--headless", "--record", "record"]);
    assert!(output.code() == 2 && output.all().contains("it lies between -30 and 30"), "{}", output.all());
    assert!(corrections(&lab, 2).iter().all(|one| one.revision.is_none()));

    let few = lab.plumb(&["run", "cell.yaml", "projector", "--headless", "--set", "heights=2"]);
    assert!(few.code() == 2 && few.all().contains("`heights` is 2"), "{}", few.all());
    // Too near for the light to be in the picture, and over the pyramid in place of the bare table.
    let near = lab.plumb(&["run", "cell.yaml", "projector", "--headless", "--set", "lowest_mm=190"]);
    assert!(near.code() == 1 && near.all().contains("no stripe is seen on the table"), "{}", near.all());
    let over = ["--set", "place_x_mm=60", "--set", "place_y_mm=530", "--record", "record"];
    let uneven = lab.plumb(&[&["run", "cell.yaml", "projector", "--headless"][..], &over].concat());
    assert!(uneven.code() == 1 && uneven.all().contains("mm from one sheet"), "{}", uneven.all());
    assert!(corrections(&lab, 3).is_empty());
}

#[test]
fn a_parameter_that_the_plugin_does_not_have_is_refused_when_the_cell_is_checked() {
    let lab = with_steps(
        "  - {id: turn, do: {correct: {sensor: stripe, parameters: {camera_rol_deg: {shift: 1, uncertainty: 0.1, plausible: 5}}}}}\n",
    );
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert!(
        output.code() == 2
            && output.all().contains("corrects its `camera_rol_deg`")
            && output.all().contains("did you mean `camera_roll_deg`?"),
        "{}",
        output.all()
    );
    lab.write(
        "procedures/extra.yaml",
        "procedure: extra\nsteps:\n  - {id: turn, do: {correct: {sensor: stripe, parameters: {}}}}\n",
    );
    let empty = lab.plumb(&["check", "cell.yaml"]);
    assert!(empty.code() == 2 && empty.all().contains("this corrects nothing"), "{}", empty.all());
}

#[test]
fn killed_between_two_stages_a_run_keeps_what_was_accepted_and_does_not_find_it_twice() {
    let lab = Lab::of("light-stripe");
    // In the middle of the stage after, too: the sensor's settings are those of a procedure that has begun.
    for (run, step) in [(1, "scale.spot"), (2, "scale.side[2].aside")] {
        let arguments =
            ["run", "new-rig.yaml", "calibrate-rig", "--headless", "--pace", "real", "--record", "record"];
        let mut running = lab.start(&arguments);
        running.until(|event| event["event"] == "step_started" && event["step"] == step);
        let hosts = running.hosts();
        running.signal(Signal::SIGKILL);
        assert_eq!(running.end().1, None);
        hosts.into_iter().for_each(wait_gone);
        let before = corrections(&lab, run);
        assert_eq!(found(&before, "camera_aim_x").len(), 1, "{before:?}");
        let number = run.to_string();
        let resumed = lab.plumb(&["run", "--resume", &number, "--headless", "--record", "record"]);
        assert_eq!(resumed.code(), 0, "killed in {step}: {}", resumed.all());
        let after = corrections(&lab, run);
        for one in &before {
            let now = found(&after, &one.key.site);
            assert_eq!(now.len(), 1, "{} is found once", one.key.site);
            assert_eq!(now.first().map(|now| (now.new, now.revision)), Some((one.new, one.revision)));
        }
        assert_eq!(after.len(), 9, "{after:?}");
    }
    let left = apex_error(&lab, "new-rig.yaml", APEX_MM);
    assert!(left < 0.5, "{left} mm");
    let log = lab.plumb(&["show", "2", "--json", "--record", "record"]).out();
    let _: Value = serde_json::from_str(&log).unwrap();
}
