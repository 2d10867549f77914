//! The plugin does what every robot must.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::Served;
use plumb_plugin::Robot;
use plumb_plugin::conformance::{CheckOutcome, check_robot};
use plumb_simulated::SimulatedRobot;
use plumb_simulated::protocol::Pace;
use serde_json::json;

fn report_of(file: &str, pace: Pace) -> plumb_plugin::conformance::CheckReport {
    let served = Served::start(file, pace);
    let config = json!({"arm": "teachmover", "world": served.socket});
    check_robot(include_str!("../plugin.yaml"), |host| SimulatedRobot::create(&config, host))
}

#[test]
fn it_conforms_in_real_time() {
    let report = report_of("world-ideal.yaml", Pace::Real);
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn it_conforms_where_motors_make_half_steps_and_moves_take_no_time() {
    let report = report_of("world-worn.yaml", Pace::Fast);
    assert!(report.is_good(), "{report}");
}
