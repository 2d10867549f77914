//! Hosts that die in the middle of a run.

use crate::lab::{Lab, kill};

#[test]
fn a_host_killed_in_mid_move_ends_an_unattended_run_which_goes_on_where_the_arm_is() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let arm = running.host_of("libplumb_simulated");
    running.until_moving_in("waist.lower");
    kill(arm);
    let lost = running.until(|event| event["event"] == "device" && event["state"] == "lost");
    assert!(lost["message"].as_str().unwrap().contains("SIGKILL"), "{lost}");
    let (last, code) = running.end();
    assert_eq!(code, Some(2));
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("arm is lost") && message.contains("plumb run --resume 1"), "{message}");

    let resumed = lab.plumb(&["run", "--resume"]);
    assert_eq!(resumed.code(), 0, "{}", resumed.all());
    assert!(resumed.out().contains("resumed at waist.lower"), "{}", resumed.out());
    lab.assert_zeros_found("1");
    let shown = lab.shown("1");
    let kinds: Vec<&str> =
        shown["interruptions"].as_array().unwrap().iter().map(|one| one["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["sitting_began", "device_lost", "sitting_began"]);
    let asked = shown["prompts"].as_array().unwrap().iter().filter(|prompt| prompt["step"] == "hand").count();
    assert_eq!(asked, 1, "what was answered is not asked again");
}

#[test]
fn a_retry_decided_beforehand_starts_the_lost_host_again_and_goes_on() {
    let lab = Lab::new();
    lab.edit("answers.yaml", "answers:\n", "on_error: {waist.find_a: retry}\nanswers:\n");
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let arm = running.host_of("libplumb_simulated");
    running.until_moving_in("waist.find_a");
    kill(arm);
    running.until(|event| event["event"] == "device" && event["state"] == "lost");
    let again = running.until(|event| event["event"] == "step_started");
    assert_eq!((&again["step"], &again["attempt"]), (&"waist.find_a".into(), &2.into()));
    running.until(|event| event["event"] == "step_finished" && event["step"] == "waist.apply_waist");
    running.signal(nix::sys::signal::Signal::SIGINT);
    assert_eq!(running.end().1, Some(3));
    let zeros = lab.zeros("1");
    assert!((zeros[0].1 - 1.7).abs() < 1e-6, "{zeros:?}");
}

#[test]
fn a_lost_sensor_stops_the_arm_too() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let eye = running.host_of("libplumb_ir_proximity");
    running.until_moving_in("waist.lower");
    kill(eye);
    let lost = running.until(|event| event["event"] == "device" && event["state"] == "lost");
    assert_eq!(lost["device"], "eye");
    let (last, code) = running.end();
    assert_eq!(code, Some(2));
    assert!(last["message"].as_str().unwrap().contains("eye is lost"), "{last}");
    let resumed = lab.plumb(&["run", "--resume"]);
    assert_eq!(resumed.code(), 0, "{}", resumed.all());
    lab.assert_zeros_found("1");
}
