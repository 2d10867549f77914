//! What every robot must do, on an emulated controller that keeps the motors' time.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::cell::RefCell;

use plumb_plugin::{Robot, conformance};
use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, LineOptions};
use plumb_teachmover::TeachMover;
use serde_json::json;

#[test]
fn the_teachmover_does_what_every_robot_must() {
    // Each check gets a controller of its own; all of them work on until the last has been checked.
    let emulators = RefCell::new(Vec::new());
    let report = conformance::check_robot(include_str!("../plugin.yaml"), |host| {
        let emulator =
            Emulator::start(LineOptions::default(), Box::new(BareMotors::new(false, 20.0))).unwrap();
        let config = json!({
            "port": emulator.status().port,
            "registers_zero": {"shoulder_deg": 41, "elbow_deg": -78, "wrist_pitch_deg": -90, "gripper_mm": 20},
        });
        emulators.borrow_mut().push(emulator);
        TeachMover::create(&config, host)
    });
    assert!(report.is_good(), "{report}");
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == conformance::CheckOutcome::Passed), "{report}");
}
