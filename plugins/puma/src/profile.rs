//! Where the time goes: on the line, in the controller, in motion, and here.

use std::fmt;
use std::time::Duration;

/// Time spent since the profile was begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Profile {
    /// Commands typed.
    pub commands: u32,
    /// Characters sent.
    pub sent: u32,
    /// Characters received.
    pub received: u32,
    /// What those characters take on the line at its rate.
    pub line: Duration,
    /// Waiting for the controller while nothing moved, beyond that.
    pub controller: Duration,
    /// Waiting for the arm to arrive.
    pub motion: Duration,
    /// All of it, from the beginning of each command to its end.
    pub total: Duration,
}

impl Profile {
    /// What the driver itself took.
    pub fn ours(&self) -> Duration {
        self.total.saturating_sub(self.line + self.controller + self.motion)
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fraction = |part: Duration| 100.0 * part.as_secs_f64() / self.total.as_secs_f64().max(1e-9);
        write!(
            formatter,
            "{} commands, {} characters sent and {} received in {:.2} s: line {:.0} %, controller {:.0} %, motion {:.0} %, driver {:.0} %",
            self.commands,
            self.sent,
            self.received,
            self.total.as_secs_f64(),
            fraction(self.line),
            fraction(self.controller),
            fraction(self.motion),
            fraction(self.ours())
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_neither_line_nor_controller_nor_motion_took_is_the_drivers_own() {
        let profile = Profile {
            commands: 3,
            sent: 40,
            received: 90,
            line: Duration::from_millis(500),
            controller: Duration::from_millis(300),
            motion: Duration::from_secs(1),
            total: Duration::from_secs(2),
        };
        assert_eq!(profile.ours(), Duration::from_millis(200));
        assert_eq!(
            profile.to_string(),
            "3 commands, 40 characters sent and 90 received in 2.00 s: line 25 %, controller 15 %, motion 50 %, driver 10 %"
        );
    }
}
