//! Stops on the way, over a line of 9600 baud.

use std::time::{Duration, Instant};

use plumb_plugin::{JointVector, Motion, PluginError, Robot};
use plumb_simulated::emulate::val2::{Dialect, EmulatorOptions};
use plumb_simulated::protocol::{Pace, WorldCommand};
use serde_json::json;

use super::{Cell, LEFTY, at_9600, connect};

/// One stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop {
    /// Share of full speed.
    pub(crate) speed: f64,
    /// From the wish to the control C at the far end of the wire.
    pub(crate) after: Duration,
    /// How far the waist still went, deg.
    pub(crate) went_deg: f64,
}

/// Speeds that are stopped from.
pub(crate) const SPEEDS: [f64; 3] = [1.0, 0.5, 0.2];

/// Makes them, in three dialects and at three speeds.
pub(crate) fn made(count: usize) -> Vec<Stop> {
    (0..count).map(|round| stop(Dialect::ALL[round % 3].1, SPEEDS[round / 3 % 3])).collect()
}

fn stop(dialect: Dialect, speed: f64) -> Stop {
    let options = EmulatorOptions { dialect, line: at_9600(), ..EmulatorOptions::default() };
    let mut cell = Cell::of(options, Pace::Real, &json!({"full_speed_percent": 100}));
    let target = JointVector::from_slice(&LEFTY.map(f64::to_radians)).unwrap();
    let stopper = cell.recording.clone();
    let mut watcher = connect(&cell.world.socket);
    let asked = std::thread::spawn(move || {
        // Well under way, so that there is something to brake.
        let before = loop {
            let waist = watcher.read(WorldCommand::Read {}).unwrap().joints[0].to_degrees();
            if waist > 1.0 {
                break waist;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        stopper.set_stop(true);
        (Instant::now(), before)
    });
    let error = cell.arm.move_joints(&Motion::absolute(target, speed)).unwrap_err();
    assert!(matches!(error, PluginError::Stopped(_)), "{error:?}");
    let (asked, before) = asked.join().unwrap();
    let heard = cell.emulator.status().last_cancel.unwrap();
    assert!(!cell.world.client.read(WorldCommand::Read {}).unwrap().moving);
    Stop { speed, after: heard.saturating_duration_since(asked), went_deg: cell.world.joints()[0] - before }
}
