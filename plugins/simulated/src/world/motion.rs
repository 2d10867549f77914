//! One motion of the arm: all motors start together, run evenly, and arrive together.

use std::ops::Range;

use super::drive::{AXES, HalfSteps};

/// How finely the motors' positions can be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// Any position; no machine is built so, but what the method itself costs is seen best with it.
    Continuous,
    /// Whole half-steps.
    HalfStep,
}

/// How finely a continuous motion is looked at: a part moves the hand no further than this, mm.
const PART_TRAVEL: f64 = 0.25;

/// No part of a continuous motion lasts longer, so that a stop takes effect soon, ns.
const PART_TIME_NS: u64 = 2_000_000;

/// A motion so slow that this many such parts would not last it has longer ones.
const MOST_TIMED_PARTS: u64 = 100_000;

/// A motion under way, divided into parts small enough to watch what happens in each.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    from: HalfSteps,
    to: HalfSteps,
    resolution: Resolution,
    started_ns: u64,
    duration_ns: u64,
    parts: u64,
    done: u64,
}

impl Motion {
    /// Plans a motion of the registers from `from` to `to`.
    ///
    /// `rates` are the motors' speeds (half-steps/s) none of which is exceeded; `reach` is the arm's length (mm), and no part
    /// shall last longer than `watch_ns`, if anything is given.
    pub(super) fn plan(
        from: HalfSteps,
        to: HalfSteps,
        resolution: Resolution,
        rates: &HalfSteps,
        started_ns: u64,
        reach: f64,
        watch_ns: Option<u64>,
    ) -> Motion {
        let travel = to.minus(&from);
        let seconds =
            (0..AXES).fold(0.0, |longest: f64, axis| longest.max(travel.0[axis].abs() / rates.0[axis]));
        let duration_ns = (seconds * 1e9).ceil() as u64;
        let most_steps = travel.0.iter().fold(0.0, |most: f64, steps| most.max(steps.abs()));
        let parts = match resolution {
            Resolution::HalfStep => most_steps.round() as u64,
            Resolution::Continuous if most_steps == 0.0 => 0,
            Resolution::Continuous => {
                let turned = travel.to_joints();
                let angle: f64 = turned.0.iter().take(AXES - 1).map(|joint| joint.abs()).sum();
                let by_travel = (angle * reach / PART_TRAVEL).ceil() as u64;
                let by_time = duration_ns.div_ceil(PART_TIME_NS).min(MOST_TIMED_PARTS);
                let by_watch = watch_ns.map_or(1, |watch| duration_ns.div_ceil(watch.max(1)));
                by_travel.max(by_time).max(by_watch).max(1)
            }
        };
        Motion { from, to, resolution, started_ns, duration_ns, parts, done: 0 }
    }

    /// When the motion ends, world time, ns.
    pub(super) fn end_ns(&self) -> u64 {
        self.started_ns + self.duration_ns
    }

    /// Whether every part is done.
    pub(super) fn is_done(&self) -> bool {
        self.done >= self.parts
    }

    /// When the next part begins and ends and where the registers are then, unless all are done.
    pub(super) fn next_part(&self) -> Option<(Range<u64>, HalfSteps)> {
        let next = self.done + 1;
        (!self.is_done())
            .then(|| (self.time_after(self.done)..self.time_after(next), self.registers_after(next)))
    }

    /// Marks the next part as done.
    pub(super) fn complete_part(&mut self) {
        self.done += 1;
    }

    /// Speed of each motor, half-steps/s.
    pub(super) fn rates(&self) -> HalfSteps {
        let seconds = (self.duration_ns as f64 / 1e9).max(f64::MIN_POSITIVE);
        HalfSteps(self.to.minus(&self.from).0.map(|travel| travel.abs() / seconds))
    }

    fn time_after(&self, part: u64) -> u64 {
        let fraction = part as f64 / self.parts as f64;
        self.started_ns + (self.duration_ns as f64 * fraction) as u64
    }

    fn registers_after(&self, part: u64) -> HalfSteps {
        if part >= self.parts {
            return self.to;
        }
        let fraction = part as f64 / self.parts as f64;
        let travelled = self.to.minus(&self.from).times(fraction);
        self.from.plus(&match self.resolution {
            Resolution::Continuous => travelled,
            Resolution::HalfStep => HalfSteps(travelled.0.map(f64::round)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RATES: HalfSteps = HalfSteps([400.0; AXES]);

    fn plan(from: [i32; 6], to: [i32; 6], resolution: Resolution) -> Motion {
        let from = HalfSteps(from.map(f64::from));
        let to = HalfSteps(to.map(f64::from));
        Motion::plan(from, to, resolution, &RATES, 1_000, 460.0, None)
    }

    proptest! {
        #[test]
        fn each_part_of_a_half_step_motion_moves_no_motor_more_than_one(
            from in prop::array::uniform6(-300..300_i32), to in prop::array::uniform6(-300..300_i32),
        ) {
            let mut motion = plan(from, to, Resolution::HalfStep);
            let mut registers = HalfSteps(from.map(f64::from));
            let mut time = 1_000;
            while let Some((part, next)) = motion.next_part() {
                prop_assert!(next.minus(&registers).0.iter().all(|steps| steps.abs() <= 1.0 && steps.fract() == 0.0));
                prop_assert!(part.start == time && part.end >= time);
                (time, registers) = (part.end, next);
                motion.complete_part();
            }
            prop_assert_eq!(registers, HalfSteps(to.map(f64::from)));
            prop_assert!(time <= motion.end_ns());
        }

        #[test]
        fn a_continuous_motion_arrives_exactly(to in prop::array::uniform6(-300.0..300.0_f64)) {
            let to = HalfSteps(to);
            let mut motion =
                Motion::plan(HalfSteps([0.1; AXES]), to, Resolution::Continuous, &RATES, 0, 460.0, None);
            let mut last = HalfSteps::default();
            while let Some((_, next)) = motion.next_part() {
                last = next;
                motion.complete_part();
            }
            prop_assert_eq!(last, to);
        }
    }

    #[test]
    fn the_slowest_motor_sets_the_duration() {
        let motion = plan([0; 6], [400, 800, 0, 0, 0, 0], Resolution::HalfStep);
        assert_eq!(motion.end_ns(), 1_000 + 2_000_000_000);
        assert_eq!(motion.rates().0[1], 400.0);
        assert_eq!(motion.rates().0[0], 200.0);
    }

    #[test]
    fn a_motion_to_where_the_arm_is_is_done_at_once() {
        for resolution in [Resolution::Continuous, Resolution::HalfStep] {
            let motion = plan([5; 6], [5; 6], resolution);
            assert!(motion.is_done());
            assert_eq!(motion.end_ns(), 1_000);
        }
    }
}
