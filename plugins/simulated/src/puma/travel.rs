//! One motion: all joints start together, run evenly and arrive together.

use super::joints::{AXES, JOINTS};

/// From full speed the brakes bring the arm to rest in this time, s; from a share of it, in that share.
const BRAKING_S: f64 = 0.25;

/// A motion under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Travel {
    from: [f64; AXES],
    to: [f64; AXES],
    /// Share of full speed.
    speed: f64,
    began_ns: u64,
    duration_ns: u64,
    braking: bool,
}

impl Travel {
    /// From one place to another (rad) at a share of full speed.
    pub(super) fn plan(from: [f64; AXES], to: [f64; AXES], speed: f64, now_ns: u64) -> Self {
        let slowest =
            JOINTS.iter().zip(from.iter().zip(&to)).fold(0.0, |longest: f64, (joint, (from, to))| {
                longest.max((to - from).abs() / (joint.top_speed_deg.to_radians() * speed))
            });
        let duration_ns = (slowest * 1e9).ceil() as u64;
        Self { from, to, speed, began_ns: now_ns, duration_ns, braking: false }
    }

    pub(super) fn end_ns(&self) -> u64 {
        self.began_ns + self.duration_ns
    }

    /// How far it is at a moment, but not past its end: when, and the joints, rad.
    pub(super) fn at(&self, now_ns: u64) -> (u64, [f64; AXES]) {
        if now_ns >= self.end_ns() {
            return (self.end_ns(), self.to);
        }
        let share = now_ns.saturating_sub(self.began_ns) as f64 / self.duration_ns as f64;
        let mut joints = self.from;
        for (joint, to) in joints.iter_mut().zip(&self.to) {
            *joint += (to - *joint) * share;
        }
        (now_ns, joints)
    }

    /// The motion from now on with the brakes on: half of what it would have gone in the time it brakes. One that brakes already goes on.
    pub(super) fn braked(self, now_ns: u64) -> Self {
        let left_ns = self.end_ns().saturating_sub(now_ns);
        let braking_ns = (BRAKING_S * self.speed * 1e9) as u64;
        if self.braking || left_ns == 0 {
            return self;
        }
        let (_, from) = self.at(now_ns);
        let share = (braking_ns as f64 / 2.0 / left_ns as f64).min(1.0);
        let mut to = from;
        for (joint, end) in to.iter_mut().zip(&self.to) {
            *joint += (end - *joint) * share;
        }
        let duration_ns = braking_ns.min(left_ns * 2);
        Self { from, to, began_ns: now_ns, duration_ns, braking: true, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(degrees: f64, speed: f64) -> Travel {
        let mut to = [0.0; AXES];
        to[0] = degrees.to_radians();
        Travel::plan([0.0; AXES], to, speed, 0)
    }

    #[test]
    fn a_motion_takes_as_long_as_its_slowest_joint() {
        assert_eq!(turn(82.0, 1.0).end_ns(), 1_000_000_000);
        let (_, half_way) = turn(82.0, 0.5).at(1_000_000_000);
        assert!((half_way[0].to_degrees() - 41.0).abs() < 1e-9);
    }

    #[test]
    fn brakes_take_longer_and_further_at_speed_and_never_past_the_end() {
        let way = |speed: f64| {
            let braked = turn(80.0, speed).braked(100_000_000);
            let (_, from) = turn(80.0, speed).at(100_000_000);
            let (_, rest) = braked.at(u64::MAX);
            (rest[0] - from[0]).to_degrees()
        };
        assert!((way(1.0) - 82.0 * 0.125).abs() < 1e-6);
        assert!((way(0.2) - 16.4 * 0.025).abs() < 1e-6);
        let short = turn(1.0, 1.0).braked(1_000_000);
        assert!(short.at(u64::MAX).1[0] <= 1.0_f64.to_radians() + 1e-15);
    }
}
