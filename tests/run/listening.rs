//! The step `listen`: a stream of a device is taken in for a time or until something holds, and numbers of it are kept.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::lab::{Lab, kill, skipped};
use crate::python_drivers;

/// The example `scale`, and a procedure of these steps, or its own; none without Python, which is said.
fn scale(steps: &str) -> Option<Lab> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("there is no `python3` here");
        return None;
    }
    let lab = Lab::new();
    let made = lab.plumb(&["plugins", "new", "sensor", "scale", "--lang", "python"]);
    assert_eq!(made.code(), 0, "{}", made.all());
    // The shipped example: 100 g and 102 g in turn, settled from the 20th message on.
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/bridge/examples/scale");
    for (file, path) in [
        ("driver.py", "scale/driver.py"),
        ("plugin.yaml", "scale/plugin.yaml"),
        ("cell.yaml", "weighing.yaml"),
        ("weigh.yaml", "weigh.yaml"),
    ] {
        fs::copy(example.join(file), lab.path(path)).unwrap();
    }
    if !steps.is_empty() {
        with_steps(&lab, steps);
    }
    Some(lab)
}

fn with_steps(lab: &Lab, steps: &str) {
    lab.write("weigh.yaml", &format!("procedure: weigh\ntitle: Weigh\nsteps:\n{steps}"));
}

/// `plumb check` finds this, and nothing else.
fn assert_found(lab: &Lab, steps: &str, words: &[&str]) {
    with_steps(lab, steps);
    let checked = lab.plumb(&["check", "weighing.yaml"]);
    assert_eq!(checked.code(), 2, "{steps}: {}", checked.all());
    for word in words {
        assert!(checked.err().contains(word), "{word}: {}", checked.err());
    }
    assert!(checked.err().contains("weigh.yaml:4:"), "{}", checked.err());
}

#[test]
fn numbers_of_a_stream_are_kept_with_their_units_and_later_steps_use_them() {
    let Some(lab) = scale("") else { return };
    let right = "
  - id: right
    do:
      check:
        that: >-
          abs(heard.weight_g - 101) < 1e-9 && abs(heard.spread_g - sqrt(40.0 / 39.0)) < 1e-9 && heard.lowest_g == 100
          && heard.highest_g == 102 && heard.weighings == 40 && heard.messages == 40 && heard.seconds > 0.5 && heard.at_last == 1
        otherwise: '{heard.weight_g:.9} {heard.spread_g:.9} {heard.lowest_g} {heard.highest_g} {heard.weighings} {heard.seconds}'
";
    let text = fs::read_to_string(lab.path("weigh.yaml")).unwrap();
    lab.write("weigh.yaml", &(text.trim_end().to_owned() + right));
    for arguments in [&["check", "weighing.yaml"][..], &["run", "weighing.yaml", "--dry-run"]] {
        let printed = lab.plumb(arguments);
        assert_eq!(printed.code(), 0, "{}", printed.all());
    }
    let run = lab.plumb(&["run", "weighing.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(
        run.out().contains("40 messages of scale/weights, weight 101 g, spread 1.0127 g"),
        "{}",
        run.out()
    );
    // The record has the values, with their units and where they come from.
    let readings = lab.shown("1")["readings"].to_string();
    assert!(readings.contains(r#""source":"scale""#) && readings.contains(r#""unit":"g""#), "{readings}");
}

#[test]
fn it_listens_until_a_condition_holds_or_says_what_the_last_message_held() {
    let until = |condition: &str, within: &str| {
        format!(
            "  - {{id: heard, do: {{listen: {{stream: scale/weights, until: {condition}, within_s: {within}, values: {{weight_g: {{last: weight_g}}}}}}}}}}\n"
        )
    };
    let Some(lab) = scale(&until("message.settled == 1", "60")) else { return };
    let run = lab.plumb(&["run", "weighing.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());

    with_steps(&lab, &until("message.weight_g > 500", "1"));
    let run = lab.plumb(&["run", "weighing.yaml", "--headless"]);
    assert_eq!(run.code(), 1, "{}", run.all());
    assert!(run.all().contains("`message.weight_g > 500` did not come about in 1 s: "), "{}", run.all());
    assert!(run.all().contains(" of scale/weights came, the last with weight_g 10"), "{}", run.all());
}

#[test]
fn a_device_a_stream_a_field_and_a_unit_that_are_not_there_are_found_before_a_run() {
    let listen = |keys: &str| format!("  - {{id: heard, do: {{listen: {{{keys}}}}}}}\n");
    let Some(lab) = scale(&listen("stream: scale/weights, for_s: 1")) else { return };
    let good = lab.plumb(&["check", "weighing.yaml"]);
    assert_eq!(good.code(), 0, "{}", good.all());
    for (keys, words) in [
        ("stream: scales/weights, for_s: 1", ["no device `scales`", "did you mean `scale`?"]),
        (
            "stream: scale/weight, for_s: 1",
            ["device `scale` has no stream `weight`", "did you mean `weights`?"],
        ),
        ("stream: weights, for_s: 1", ["`weights` names no stream of a device", "DEVICE/STREAM"]),
        (
            "stream: scale/weights, for_s: 1, values: {m_g: {mean: weigt_g}}",
            ["has no field `weigt_g`", "did you mean `weight_g`?"],
        ),
        (
            "stream: scale/weights, for_s: 1, values: {m_mm: {mean: weight_g}}",
            ["`weight_g` is in g, and `m_mm` does not say so", "ends in `_g`"],
        ),
        (
            "stream: scale/weights, for_s: 1, values: {still_mm: {last: settled}}",
            ["`still_mm` is said to be in mm", "without a unit"],
        ),
        (
            "stream: scale/weights, for_s: 1, values: {m_g: {average: weight_g}}",
            ["there is no `average` of a field", "mean"],
        ),
        (
            "stream: scale/weights, until: message.setled == 1, within_s: 1",
            ["setled", "did you mean `settled`?"],
        ),
        ("stream: scale/weights, until: message.settled == 1", ["how long to wait", "`within_s: 10`"]),
        ("stream: scale/weights, for_s: 1, messages: 3", ["ends in one way", "give one of"]),
        ("stream: scale/weights", ["nothing says when listening ends", "`for_s: 2`"]),
        ("stream: scale/weights, for_s: -1", ["`for_s` is -1", "above 0"]),
        (
            "stream: scale/weights, for_s: 1, within_s: 2",
            ["`for_s` is the time itself", "leave `within_s` out"],
        ),
    ] {
        assert_found(&lab, &listen(keys), &words);
    }
}

#[test]
fn a_stream_that_is_silent_from_the_beginning_or_falls_silent_gives_no_values() {
    let steps = "  - {id: heard, do: {listen: {stream: scale/weights, for_s: 1, values: {weight_g: {mean: weight_g}}}}}\n";
    let Some(lab) = scale(steps) else { return };
    lab.edit("scale/driver.py", "time.sleep(0.02)", "time.sleep(0.02 if number != 2 else 1000)");
    lab.edit(
        "weigh.yaml",
        "steps:",
        "steps:\n  - {id: first, do: {listen: {stream: scale/weights, for_s: 5}}, on_error: skip}",
    );
    let run = lab.plumb(&["run", "weighing.yaml", "--headless"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    let output = "scale/weights was silent: no message came in 1 s; `plumb streams CELL scale/weights` shows when its device sends";
    assert!(run.all().contains(output), "{}", run.all());

    with_steps(&lab, &steps.replace("for_s: 1", "for_s: 30, longest_gap_s: 0.5"));
    lab.edit("scale/driver.py", "number != 2 ", "number != 100 ");
    let begun = Instant::now();
    let run = lab.plumb(&["run", "weighing.yaml", "--headless", "--accept-plugins"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("scale/weights was silent for 0.5"), "{}", run.all());
    assert!(begun.elapsed() < Duration::from_secs(25), "it did not wait to the end: {:?}", begun.elapsed());
}

/// A driver that dates its messages wrongly: what was weighed before the step is no value of the step.
#[test]
fn messages_dated_before_the_step_began_are_no_values() {
    let steps = "  - {id: heard, do: {listen: {stream: scale/weights, for_s: 1, values: {weight_g: {mean: weight_g}}}}}\n";
    let Some(lab) = scale(steps) else { return };
    lab.edit(
        "scale/driver.py",
        "weight=self.weight",
        "time_ns=self.host.now_ns() - 5 * 10**9, weight=self.weight",
    );
    let run = lab.plumb(&["run", "weighing.yaml", "--headless"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    // Five seconds before it was sent, which was after the step began: how long after is the machine's affair.
    let text = run.all();
    let dated = text.split_once("messages came late: the last is dated ").map(|(_, rest)| rest);
    let before_s = dated.and_then(|rest| rest.split_once(" s before the step began")?.0.parse::<f64>().ok());
    assert!(before_s.is_some_and(|before_s| before_s > 0.0 && before_s <= 5.0), "{text}");
}

#[test]
fn a_publisher_that_is_killed_ends_the_step_at_once_and_is_named() {
    let steps = "  - {id: heard, do: {listen: {stream: scale/weights, for_s: 60, values: {weight_g: {mean: weight_g}}}}}\n";
    let Some(lab) = scale(steps) else { return };
    let mut running = lab.start(&["run", "weighing.yaml"]);
    running.until(|event| event["event"] == "step_progress");
    let begun = Instant::now();
    kill(running.host_of("libplumb_bridge"));
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    assert!(last.to_string().contains("the host of scale was ended by SIGKILL"), "{last}");
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
}

/// Angles of a stream are those of every procedure: what the drive says plus the zeros in force.
#[test]
fn the_joints_of_a_stream_are_named_by_the_cell_and_counted_from_the_zeros_in_force() {
    let Some(lab) = python_drivers::cell(&[
        (
            "self.joints = [0.0, 0.0]   # rad, mm",
            "self.joints = [0.0, 0.0]\n        import threading\n        threading.Thread(target=self.send_states, daemon=True).start()",
        ),
        (
            "    def describe(self):",
            "    def send_states(self):\n        import time\n        while True:\n            self.host.emit('joints', joints=[0.5, 12.5], moving=0)\n            time.sleep(0.02)\n\n    def describe(self):",
        ),
    ]) else {
        return;
    };
    let listen = "listen: {stream: arm/joints, messages: 10, within_s: 30, values: {waist_deg: {mean: joints.waist_deg}, slide_mm: {last: joints.slide_mm}}}";
    let procedure = format!(
        "procedure: hear\ntitle: Hear\nsteps:\n  - {{id: zero, do: {{apply: {{robot: arm, joint_zero: {{waist: {{shift_deg: 2, uncertainty_deg: 0.1}}}}}}}}}}\n  - {{id: heard, do: {{{listen}}}}}\n"
    );
    lab.write("pyarm/procedure.yaml", &procedure);
    lab.write("accept.yaml", "answers: {zero: accept}\n");
    let run = lab.plumb(&["run", "cell-py.yaml", "--answers", "accept.yaml", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert!(
        run.out().contains("10 messages of arm/joints, waist 30.6479 deg, slide 12.5 mm"),
        "{}",
        run.out()
    );

    lab.write("pyarm/procedure.yaml", &procedure.replace("joints.waist_deg", "joints.waist_rad"));
    let wrong = lab.plumb(&["check", "cell-py.yaml"]);
    assert_eq!(wrong.code(), 2, "{}", wrong.all());
    assert!(wrong.err().contains("did you mean `joints.waist_deg`?"), "{}", wrong.err());
}

/// The stream of the host itself, which every device has.
#[test]
fn the_health_of_a_simulated_arm_can_be_listened_to() {
    let lab = Lab::new();
    let steps = "  - {id: heard, do: {listen: {stream: arm/health, messages: 2, within_s: 30, values: {served: {last: requests}}}}}\n";
    lab.write("hear.yaml", &format!("procedure: hear\ntitle: Hear\nsteps:\n{steps}"));
    lab.edit("cell.yaml", "procedures: [", "procedures: [hear.yaml, ");
    let run = lab.plumb(&["run", "cell.yaml", "hear", "--headless"]);
    assert_eq!(run.code(), 0, "{}", run.all());
}
