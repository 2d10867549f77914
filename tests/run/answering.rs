//! Prompts answered from a second terminal: two programs, one record.

use serde_json::Value;

use crate::lab::{Lab, Running};

fn until_asked(running: &mut Running, step: &str) {
    running.until(|event| event["event"] == "prompt_asked" && event["prompt"]["step"] == step);
}

#[test]
fn a_run_is_led_through_its_prompts_from_another_terminal() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--operator", "ada", "--pace", "fast"]);
    until_asked(&mut running, "target");
    let shown = lab.plumb(&["answer"]);
    assert_eq!(shown.code(), 0, "{}", shown.all());
    assert!(shown.out().contains("run 1 asks at target (prompt 1): Lay the target"), "{}", shown.out());
    assert!(shown.out().contains("answer with: plumb answer --prompt 1 done"), "{}", shown.out());

    let wrong = lab.plumb(&["answer", "yes"]);
    assert_eq!(wrong.code(), 2);
    assert!(wrong.err().contains("`yes` is no answer to `Lay the target`: write done"), "{}", wrong.err());
    assert_eq!(lab.plumb(&["answer", "done", "--operator", "bob"]).code(), 0);
    until_asked(&mut running, "hand");
    assert_eq!(lab.plumb(&["answer", "1", "done", "--operator", "bob"]).code(), 0);
    until_asked(&mut running, "level");
    let far = lab.plumb(&["answer", "60"]);
    assert_eq!(far.code(), 2, "{}", far.all());
    assert!(far.err().contains("60 deg is out of range: it lies between -45 and 45 deg"), "{}", far.err());
    assert_eq!(lab.plumb(&["answer", "0.2", "--operator", "bob"]).code(), 0);

    until_asked(&mut running, "place");
    let far = lab.plumb(&["answer", "waist=500"]);
    assert_eq!(far.code(), 2, "{}", far.all());
    assert!(far.err().contains("the answer was not taken: waist would go to 500.000 deg"), "{}", far.err());
    let unknown = lab.plumb(&["answer", "wasit=5"]);
    assert!(unknown.err().contains("there is no joint wasit in deg"), "{}", unknown.err());
    assert_eq!(lab.plumb(&["answer", "done"]).code(), 0);
    for step in ["waist.apply_waist", "shoulder_elbow.apply_zeros"] {
        until_asked(&mut running, step);
        let answered = lab.plumb(&["answer", "accept"]);
        assert_eq!(answered.code(), 0, "{}", answered.all());
    }
    let (last, code) = running.end();
    assert_eq!((code, &last["outcome"]), (Some(0), &Value::from("passed")));
    lab.assert_zeros_found("1");
    let shown = lab.shown("1");
    let by: Vec<&Value> =
        shown["prompts"].as_array().unwrap().iter().map(|prompt| &prompt["answer"]["by"]).collect();
    assert_eq!(by[..2], ["bob", "bob"]);
    let over = lab.plumb(&["answer", "1", "done"]);
    assert_eq!(over.code(), 2);
    assert!(over.err().contains("run 1 has ended; nothing waits for an answer"), "{}", over.err());
}

#[test]
fn in_a_simulated_cell_one_answer_leaves_readings_and_acts_to_the_program_and_nothing_else() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--operator", "ada", "--pace", "fast"]);
    until_asked(&mut running, "target");
    let shown = lab.plumb(&["answer"]);
    assert!(
        shown.out().contains("\n         or: plumb answer --prompt 1 simulate   (leaves"),
        "{}",
        shown.out()
    );
    let left = lab.plumb(&["answer", "simulate", "--operator", "bob"]);
    assert_eq!(left.code(), 0, "{}", left.all());
    // What has no simulated operator is asked still: where to begin, and whether corrections are applied.
    until_asked(&mut running, "place");
    assert_eq!(lab.plumb(&["answer", "done"]).code(), 0);
    until_asked(&mut running, "waist.apply_waist");
    let refused = lab.plumb(&["answer", "simulate"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert_eq!(lab.plumb(&["answer", "accept"]).code(), 0);
    until_asked(&mut running, "shoulder_elbow.apply_zeros");
    assert_eq!(lab.plumb(&["answer", "accept"]).code(), 0);
    let (last, code) = running.end();
    assert_eq!((code, &last["outcome"]), (Some(0), &Value::from("passed")));
    lab.assert_zeros_found("1");
    let shown = lab.shown("1");
    let by: Vec<&Value> =
        shown["prompts"].as_array().unwrap().iter().map(|prompt| &prompt["answer"]["by"]).collect();
    assert_eq!(by[..3], ["simulated operator, for bob"; 3]);
}

/// Two people, one prompt: the answer that comes second is not taken for the next prompt, which it would fit.
#[test]
fn an_answer_to_a_prompt_that_is_over_is_refused_where_it_names_its_prompt() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--pace", "fast"]);
    until_asked(&mut running, "target");
    assert_eq!(lab.plumb(&["answer", "--prompt", "1", "done"]).code(), 0);
    until_asked(&mut running, "hand");
    for late in ["1", "target"] {
        let refused = lab.plumb(&["answer", "--prompt", late, "done"]);
        assert_eq!(refused.code(), 2, "{}", refused.all());
        let expected = format!("prompt `{late}` is not open: run 1 asks at hand now (prompt 2)");
        assert!(refused.err().contains(&expected), "{}", refused.err());
    }
    assert_eq!(lab.shown("1")["prompts"][1]["answer"], Value::Null, "the next prompt still waits");
    assert_eq!(lab.plumb(&["answer", "1", "done", "--prompt", "hand"]).code(), 0);
    until_asked(&mut running, "level");
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

#[test]
fn an_answer_to_nothing_says_so() {
    let lab = Lab::new();
    let nothing = lab.plumb(&["answer", "done"]);
    assert_eq!(nothing.code(), 2);
    assert!(nothing.err().contains("no run goes on in"), "{}", nothing.err());
    let mut running = lab.start(&["run", "cell.yaml", "--attended"]);
    until_asked(&mut running, "target");
    running.signal(nix::sys::signal::Signal::SIGKILL);
    running.end();
    let killed = lab.plumb(&["answer", "1", "done"]);
    assert_eq!(killed.code(), 2);
    assert!(killed.err().contains("has gone: `plumb run --resume 1` goes on with it"), "{}", killed.err());
    let no_run = lab.plumb(&["answer", "seven", "done"]);
    assert!(no_run.err().contains("`seven` is no number of a run"), "{}", no_run.err());
}

#[test]
fn an_operator_who_goes_back_past_a_correction_finds_it_undone_in_the_record_and_on_the_certificate() {
    let lab = Lab::new();
    lab.write(
        "procedures/extra.yaml",
        "procedure: extra\nfinds_zeros: [arm]\nsteps:\n  \
         - {id: place, title: Over the white, do: {prompt: {text: There, jog_to: {robot: arm}}}}\n  \
         - {id: shift, do: {apply: {robot: arm, joint_zero: {waist: {shift_deg: 1.5, uncertainty_deg: 0.1}}}}}\n  \
         - {id: near, do: {check: {that: arm.joints.waist_deg < 15, otherwise: Too far to the left}}}\n",
    );
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
    let mut running = lab.start(&["run", "cell.yaml", "extra", "--attended", "--pace", "fast"]);
    let answers = [
        ("place", "waist=20"),
        ("shift", "accept"),
        ("near", "back"),
        ("place", "waist=10"),
        ("shift", "reject"),
    ];
    for (step, answer) in answers {
        until_asked(&mut running, step);
        if (step, answer) == ("near", "back") {
            let asked = lab.plumb(&["answer"]);
            let expected = "Going back undoes the correction of joint zero of arm waist.";
            assert!(asked.out().contains(expected), "{}", asked.all());
        }
        let answered = lab.plumb(&["answer", answer]);
        assert_eq!(answered.code(), 0, "{step} {answer}: {}", answered.all());
    }
    let (last, _) = running.end();
    assert_eq!(last["outcome"], "passed", "{last}");
    let zeros = lab.plumb(&["record", "zeros", "teachmover"]).out();
    assert!(zeros.contains("run 1: the operator went back to `place`"), "{zeros}");
    let shown = lab.plumb(&["show", "1"]).out();
    assert!(shown.contains("in force from revision 1 until undone by revision 2"), "{shown}");
    assert_eq!(lab.plumb(&["certificate", "1", "-o", "c.html"]).code(), 0);
    let certificate = std::fs::read_to_string(lab.path("c.html")).unwrap();
    assert!(certificate.contains("no: ") && !certificate.contains("since revision 1"), "{certificate}");
}
