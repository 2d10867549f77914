//! How the controller leads its joints: along a straight line in joint space, its speed a trapezoid, all joints together.

use super::states::AXES;

/// As near as a way counts as none, rad.
const NO_WAY: f64 = 1e-9;

/// One way of all joints. Speeds and accelerations are those of the joint that goes furthest, as `movej` has them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Way {
    from: [f64; AXES],
    to: [f64; AXES],
    /// Of the joint that goes furthest, rad.
    length: f64,
    /// The speed in the middle, rad/s.
    top: f64,
    /// rad/s2.
    acceleration: f64,
    /// Since it began, s.
    elapsed: f64,
    stop: Option<Stop>,
}

/// A way that is left before its end.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    /// How far it had come, rad.
    gone: f64,
    /// How fast it was, rad/s.
    speed: f64,
    /// rad/s2.
    deceleration: f64,
    /// Since the stop began, s.
    elapsed: f64,
}

/// Where a way has come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionState {
    /// rad.
    pub(super) joints: [f64; AXES],
    /// rad/s.
    pub(super) speeds: [f64; AXES],
    /// Whether it goes no further.
    pub(super) ended: bool,
}

impl Way {
    /// A way from where the joints are (rad).
    pub(super) fn new(from: [f64; AXES], to: [f64; AXES], speed: f64, acceleration: f64) -> Self {
        let length = from.iter().zip(&to).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
        // A short way is over before the speed is reached: a triangle.
        let top = speed.min((acceleration * length).sqrt());
        Self { from, to, length, top, acceleration, elapsed: 0.0, stop: None }
    }

    /// Brings the joints to rest on their way. One that stops already goes on stopping, harder if this is harder.
    pub(super) fn stop(&mut self, deceleration: f64) {
        let (gone, speed) = self.gone();
        let deceleration = self.stop.map_or(deceleration, |stop| stop.deceleration.max(deceleration));
        self.stop = Some(Stop { gone, speed, deceleration, elapsed: 0.0 });
    }

    /// Goes on for a time, s.
    pub(super) fn advance(&mut self, seconds: f64) -> MotionState {
        match &mut self.stop {
            Some(stop) => stop.elapsed += seconds,
            None => self.elapsed += seconds,
        }
        let (gone, speed) = self.gone();
        let fraction = if self.length > NO_WAY { (gone / self.length).min(1.0) } else { 1.0 };
        let rate = if self.length > NO_WAY { speed / self.length } else { 0.0 };
        let mut state = MotionState { joints: self.to, speeds: [0.0; AXES], ended: speed <= 0.0 };
        if fraction < 1.0 {
            for (joint, (from, to)) in state.joints.iter_mut().zip(self.from.iter().zip(&self.to)) {
                *joint = from + fraction * (to - from);
            }
        }
        for (joint, (from, to)) in state.speeds.iter_mut().zip(self.from.iter().zip(&self.to)) {
            *joint = rate * (to - from);
        }
        state
    }

    /// How far the joint that goes furthest has come, rad, and its speed, rad/s; no speed at the end.
    fn gone(&self) -> (f64, f64) {
        if let Some(Stop { gone, speed, deceleration, elapsed }) = self.stop {
            let still = (speed / deceleration).min(elapsed);
            let here = gone + speed * still - deceleration * still * still / 2.0;
            return (here.min(self.length), (speed - deceleration * still).max(0.0));
        }
        if self.length <= NO_WAY {
            return (0.0, 0.0);
        }
        let ramp = self.top / self.acceleration;
        let total = self.length / self.top + ramp;
        let (past, left) = (self.elapsed, total - self.elapsed);
        if left <= 0.0 {
            (self.length, 0.0)
        } else if past < ramp && past <= left {
            // The first moment is a speed already: it has not ended.
            (self.acceleration * past * past / 2.0, (self.acceleration * past).max(f64::MIN_POSITIVE))
        } else if left < ramp {
            (self.length - self.acceleration * left * left / 2.0, self.acceleration * left)
        } else {
            (self.top * (past - ramp / 2.0), self.top)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: f64 = 0.008;

    /// Every state of a way, and how long it took, s.
    fn gone(mut way: Way) -> (Vec<MotionState>, f64) {
        let mut states = Vec::new();
        while states.last().is_none_or(|state: &MotionState| !state.ended) && states.len() < 10_000 {
            states.push(way.advance(CYCLE));
        }
        let seconds = states.len() as f64 * CYCLE;
        (states, seconds)
    }

    #[test]
    fn neither_speed_nor_acceleration_is_exceeded_and_all_joints_arrive_together() {
        let to = [1.0, -0.5, 0.0, 0.2, 0.0, 0.0];
        let (states, seconds) = gone(Way::new([0.0; AXES], to, 0.8, 2.0));
        // 1 rad at 0.8 rad/s, and once the ramp: 1.25 + 0.4 s.
        assert!((seconds - 1.65).abs() < 2.0 * CYCLE, "{seconds}");
        assert_eq!(states.last().map(|state| state.joints), Some(to));
        for pair in states.windows(2) {
            let [before, after] = pair else { continue };
            assert!((after.joints[0] - before.joints[0]) / CYCLE < 0.8 + 1e-9);
            assert!((after.speeds[0] - before.speeds[0]).abs() / CYCLE < 2.0 + 1e-6);
            assert!((after.joints[1] + 0.5 * after.joints[0]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_short_way_never_reaches_the_speed() {
        let (states, seconds) = gone(Way::new([0.0; AXES], [0.01, 0.0, 0.0, 0.0, 0.0, 0.0], 3.0, 1.0));
        assert!((seconds - 0.2).abs() < 2.0 * CYCLE, "{seconds}");
        assert!(states.iter().all(|state| state.speeds[0] <= 0.1 + 1e-9));
    }

    #[test]
    fn a_stop_takes_its_deceleration_and_no_joint_goes_on_after_it() {
        let mut way = Way::new([0.0; AXES], [3.0; AXES], 1.0, 4.0);
        for _ in 0..100 {
            let _on_the_way = way.advance(CYCLE);
        }
        let before = way.advance(CYCLE).joints[0];
        way.stop(2.0);
        let (states, seconds) = gone(way);
        assert!((seconds - 0.5).abs() < 2.0 * CYCLE, "{seconds}");
        let end = states.last().map_or(0.0, |state| state.joints[0]);
        assert!((end - before - 0.25).abs() < 1e-6, "{}", end - before);
    }

    #[test]
    fn no_way_is_over_at_once() {
        let state = Way::new([0.3; AXES], [0.3; AXES], 1.0, 1.0).advance(CYCLE);
        assert!(state.ended && state.joints == [0.3; AXES]);
    }
}
