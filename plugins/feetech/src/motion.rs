//! From angles to steps and back, and how several servos arrive together.

use crate::servo::{MIDDLE, STEP_DEG};

/// The unit of the servos' acceleration, steps/s2.
const ACCELERATION_UNIT: f64 = 100.0;
/// The most that its register holds.
const MOST_ACCELERATION: f64 = 254.0;
/// The most steps a second that a goal's speed holds.
const MOST_SPEED: f64 = 32_767.0;

/// Which way a servo counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// Up where the joint's angle grows.
    Same,
    /// Down.
    Reversed,
}

impl Direction {
    pub(crate) fn of(reversed: bool) -> Self {
        if reversed { Self::Reversed } else { Self::Same }
    }

    pub(crate) fn other(self) -> Self {
        Self::of(self == Self::Same)
    }

    fn sign(self) -> f64 {
        if self == Self::Same { 1.0 } else { -1.0 }
    }

    /// The angle at a step, deg.
    pub(crate) fn degrees(self, step: i32) -> f64 {
        self.sign() * f64::from(step - MIDDLE) * STEP_DEG
    }

    /// The step nearest to an angle, deg.
    pub(crate) fn step(self, degrees: f64) -> i32 {
        MIDDLE + (self.sign() * degrees / STEP_DEG).round() as i32
    }
}

/// A servo's goal and how it goes there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Goal {
    pub(crate) servo: u8,
    pub(crate) step: i32,
    /// Steps a second; 0 for as fast as it can.
    pub(crate) speed: u16,
}

impl Goal {
    /// Its block of registers: acceleration, position, time (none), speed.
    pub(crate) fn block(self, acceleration: u8, steps_a_unit: u16) -> Vec<u8> {
        let [low, high] = u16::try_from(self.step).unwrap_or_default().to_le_bytes();
        let [slow, fast] = self.speed.div_ceil(steps_a_unit.max(1)).to_le_bytes();
        vec![acceleration, low, high, 0, 0, slow, fast]
    }
}

/// How long the longest of these ways takes, s: up to speed, along, and down again.
pub(crate) fn duration_s(steps: i32, speed: f64, acceleration: f64) -> f64 {
    let way = f64::from(steps.abs());
    match speed * speed / acceleration < way {
        true => way / speed + speed / acceleration,
        false => 2.0 * (way / acceleration).sqrt(),
    }
}

/// The speed at which a servo needs as long for its way as the slowest one for its own, steps/s.
pub(crate) fn speed_to_arrive_with(steps: i32, longest: i32, speed: f64) -> u16 {
    let fraction = f64::from(steps.abs()) / f64::from(longest.abs().max(1));
    (speed * fraction).clamp(1.0, MOST_SPEED).round() as u16
}

/// What the register of accelerations holds for so many deg/s2.
pub(crate) fn acceleration_in_units(degrees: f64) -> u8 {
    (degrees / STEP_DEG / ACCELERATION_UNIT).clamp(1.0, MOST_ACCELERATION).round() as u8
}

/// The acceleration that a register's value means, steps/s2.
pub(crate) fn acceleration_in_steps(units: u8) -> f64 {
    f64::from(units) * ACCELERATION_UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_steps_convert_both_ways() {
        for direction in [Direction::Same, Direction::Reversed] {
            assert_eq!(direction.step(0.0), MIDDLE);
            for step in [0, 1000, 2048, 3000, 4095] {
                assert_eq!(direction.step(direction.degrees(step)), step);
            }
        }
        assert_eq!(Direction::Same.step(90.0), 3072);
        assert_eq!(Direction::Reversed.step(90.0), 1024);
    }

    #[test]
    fn a_goal_is_written_as_its_registers_lie() {
        let goal = Goal { servo: 1, step: 0x0801, speed: 0x0102 };
        assert_eq!(goal.block(20, 1), [20, 0x01, 0x08, 0, 0, 0x02, 0x01]);
        assert_eq!(goal.block(20, 50)[5..], [6, 0]);
    }

    #[test]
    fn servos_arrive_together_and_in_the_time_that_is_expected() {
        assert_eq!(speed_to_arrive_with(50, 100, 600.0), 300);
        assert_eq!(speed_to_arrive_with(0, 100, 600.0), 1);
        assert!((duration_s(1000, 500.0, 2000.0) - 2.25).abs() < 1e-9);
        assert!((duration_s(10, 500.0, 1000.0) - 0.2).abs() < 1e-9);
    }
}
