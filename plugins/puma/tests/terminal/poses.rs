//! How long poses take over a line of 9600 baud, and where the time goes.

use std::fmt;

use plumb_puma::Profile;
use plumb_simulated::emulate::val2::EmulatorOptions;
use plumb_simulated::protocol::Pace;
use serde_json::json;

use super::{Cell, at_9600};

/// Poses with five of six joints changed, typed so, at a controller that keeps up or does not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    typing: &'static str,
    keeps_up: bool,
    profile: Profile,
    poses: f64,
    pub(crate) commands_a_pose: f64,
}

/// Times so many poses each way.
pub(crate) fn timed(poses: u32) -> Vec<Row> {
    let ways = [("careful", false), ("careful", true), ("fast", true), ("fast", false)];
    ways.into_iter().map(|(typing, keeps_up)| time(typing, keeps_up, poses)).collect()
}

fn time(typing: &'static str, keeps_up: bool, poses: u32) -> Row {
    let options = EmulatorOptions { line: at_9600(), keeps_up, ..EmulatorOptions::default() };
    let mut cell = Cell::of(options, Pace::Fast, &json!({"typing": typing}));
    cell.go([1.0, -89.0, 91.0, 1.0, 1.0, 1.0]).unwrap();
    cell.arm.take_time_profile();
    for turn in 0..poses {
        let by = f64::from(turn % 8);
        cell.go([10.0 + by, -80.0 + by, 80.0 + f64::from(turn / 8), 12.5, 20.0 - by, 33.0 + by]).unwrap();
    }
    let profile = cell.arm.take_time_profile();
    let poses = f64::from(poses);
    Row { typing, keeps_up, profile, poses, commands_a_pose: f64::from(profile.commands) / poses }
}

impl Row {
    /// Seconds a pose, motion excluded.
    fn spent(&self) -> f64 {
        (self.profile.total - self.profile.motion).as_secs_f64() / self.poses
    }

    /// What the line itself needs for a pose, s. Careful: a character and its echo take turns. Fast: they overlap.
    fn limit(&self) -> f64 {
        let Profile { sent, received, .. } = self.profile;
        let characters = if self.typing == "fast" { sent.max(received) } else { sent + received };
        f64::from(characters) * 10.0 / 9600.0 / self.poses
    }

    pub(crate) fn times(&self) -> f64 {
        self.spent() / self.limit()
    }
}

impl fmt::Display for Row {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { typing, keeps_up, profile, poses, commands_a_pose } = self;
        let total = profile.total.as_secs_f64().max(1e-9);
        let fraction = |part: std::time::Duration| 100.0 * part.as_secs_f64() / total;
        write!(
            formatter,
            "| {typing}, {} | {commands_a_pose:.0} | {:.0}, {:.0} | {:.0} % | {:.0} % | {:.0} % | {:.0} % | {:.2} s | {:.2} s | {:.2} |",
            if *keeps_up { "keeps up" } else { "holds one character" },
            f64::from(profile.sent) / poses,
            f64::from(profile.received) / poses,
            fraction(profile.line),
            fraction(profile.controller),
            fraction(profile.motion),
            fraction(profile.ours()),
            self.spent(),
            self.limit(),
            self.times()
        )
    }
}
