//! One motion: all joints start together, run evenly and arrive together.

use super::drive::Drive;

/// A motion under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Travel {
    from: Vec<f64>,
    to: Vec<f64>,
    /// Share of full speed.
    speed: f64,
    /// From full speed to rest, s.
    braking_s: f64,
    began_ns: u64,
    duration_ns: u64,
    braking: bool,
    /// Whether a controller leads the servos, cycle by cycle.
    led: bool,
}

impl Travel {
    /// From one position to another (rad or mm) at a fraction of full speed.
    pub(super) fn plan(drive: &Drive, from: Vec<f64>, to: Vec<f64>, speed: f64, now_ns: u64) -> Self {
        let ways = from.iter().zip(&to).map(|(from, to)| (to - from).abs());
        let durations = drive.joints.iter().zip(ways).map(|(joint, way)| way / (joint.top_speed * speed));
        let slowest = durations.fold(0.0, f64::max);
        let duration_ns = (slowest * 1e9).ceil() as u64;
        Self {
            from,
            to,
            speed,
            braking_s: drive.braking_s,
            began_ns: now_ns,
            duration_ns,
            braking: false,
            led: false,
        }
    }

    /// One cycle of a controller that leads the servos; where it ends they stop, without brakes.
    pub(super) fn led(from: Vec<f64>, to: Vec<f64>, now_ns: u64, duration_ns: u64) -> Self {
        Self {
            from,
            to,
            speed: 1.0,
            braking_s: 0.0,
            began_ns: now_ns,
            duration_ns,
            braking: false,
            led: true,
        }
    }

    /// Whether a controller leads the servos, cycle by cycle.
    pub(super) fn is_led(&self) -> bool {
        self.led
    }

    pub(super) fn end_ns(&self) -> u64 {
        self.began_ns.saturating_add(self.duration_ns)
    }

    /// How far it is at a moment, but not past its end: when, and the joints, rad or mm.
    pub(super) fn at(&self, now_ns: u64) -> (u64, Vec<f64>) {
        if now_ns >= self.end_ns() {
            return (self.end_ns(), self.to.clone());
        }
        let fraction = now_ns.saturating_sub(self.began_ns) as f64 / self.duration_ns as f64;
        (now_ns, self.on_the_way(&self.from, fraction))
    }

    /// The motion from now on with the brakes on: half of what it would have gone in the time it brakes. One that brakes already goes on.
    pub(super) fn braked(self, now_ns: u64) -> Self {
        let left_ns = self.end_ns().saturating_sub(now_ns);
        let braking_ns = (self.braking_s * self.speed * 1e9) as u64;
        if self.braking || left_ns == 0 {
            return self;
        }
        let (_, from) = self.at(now_ns);
        let fraction = (braking_ns as f64 / 2.0 / left_ns as f64).min(1.0);
        let to = self.on_the_way(&from, fraction);
        let duration_ns = braking_ns.min(left_ns.saturating_mul(2));
        Self { from, to, began_ns: now_ns, duration_ns, braking: true, ..self }
    }

    /// The joints after a fraction of the way from somewhere to the end.
    fn on_the_way(&self, from: &[f64], fraction: f64) -> Vec<f64> {
        from.iter().zip(&self.to).map(|(joint, to)| joint + (to - joint) * fraction).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::puma560;

    fn turn(degrees: f64, speed: f64) -> Travel {
        let mut to = vec![0.0; 6];
        to[0] = degrees.to_radians();
        Travel::plan(&puma560::drive(), vec![0.0; 6], to, speed, 0)
    }

    #[test]
    fn a_motion_takes_as_long_as_its_slowest_joint() {
        assert!(turn(82.0, 1.0).end_ns().abs_diff(1_000_000_000) <= 1);
        let (_, half_way) = turn(82.0, 0.5).at(1_000_000_000);
        assert!((half_way[0].to_degrees() - 41.0).abs() < 1e-6);
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

    #[test]
    fn an_arm_without_brakes_stops_at_once() {
        let mut drive = puma560::drive();
        drive.braking_s = 0.0;
        let travel = Travel::plan(&drive, vec![0.0; 6], vec![1.0; 6], 1.0, 0);
        let (_, here) = travel.at(10_000_000);
        let (_, rest) = travel.braked(10_000_000).at(u64::MAX);
        assert_eq!(rest, here);
    }
}
