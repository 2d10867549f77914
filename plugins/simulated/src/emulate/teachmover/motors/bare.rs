//! Motors on a bench: no arm, no world; lines and grip as they are set.

use super::{End, Ending, Motors, MotorsError};
use crate::world::GRIPPER_HALF_STEPS_PER_MM;

/// Motors on a bench: no arm, no world; lines and grip as they are set.
#[derive(Debug, Clone)]
pub struct BareMotors {
    /// Whether a motion takes no time.
    at_once: bool,
    turned: [i32; 6],
    /// What `turned` was at the last reset.
    zero: [i32; 6],
    motion: Option<Motion>,
    lines: u8,
    outputs: u8,
    opening_mm: f64,
    between_mm: f64,
}

#[derive(Debug, Clone, Copy)]
struct Motion {
    half_steps: [i32; 6],
    began: u64,
    period: u64,
    steps: u32,
}

impl BareMotors {
    /// Motors at rest with the fingers open by `opening_mm`; with `at_once`, motions take no time.
    pub fn new(at_once: bool, opening_mm: f64) -> Self {
        Self {
            at_once,
            turned: [0; 6],
            zero: [0; 6],
            motion: None,
            lines: 0,
            outputs: 0,
            opening_mm,
            between_mm: 0.0,
        }
    }

    /// The output lines.
    pub fn outputs(&self) -> u8 {
        self.outputs
    }

    fn opening_mm(&self) -> f64 {
        let [_, _, elbow, _, _, gripper] = self.turned;
        self.opening_mm + f64::from(gripper - elbow) / GRIPPER_HALF_STEPS_PER_MM
    }

    /// Ends the motion with this many of its steps made, and reports when the last was.
    fn settle(&mut self, motion: Motion, steps: u32) -> u64 {
        self.turned = motion.from(self.turned, steps);
        self.motion = None;
        motion.time_of(steps)
    }
}

impl Motion {
    /// The half-steps of each motor from `start` on, once the one with the most has made `steps`.
    fn from(&self, start: [i32; 6], steps: u32) -> [i32; 6] {
        let part = f64::from(steps) / f64::from(self.steps.max(1));
        let mut turned = start;
        for (turned, count) in turned.iter_mut().zip(self.half_steps) {
            *turned += (f64::from(count) * part).round() as i32;
        }
        turned
    }

    fn steps_at(&self, now: u64) -> u32 {
        if self.period == 0 {
            return self.steps;
        }
        let elapsed = now.saturating_sub(self.began) / self.period;
        u32::try_from(elapsed).unwrap_or(u32::MAX).min(self.steps)
    }

    /// When the given step is made.
    fn time_of(&self, step: u32) -> u64 {
        self.began + u64::from(step) * self.period
    }
}

impl Motors for BareMotors {
    fn start(&mut self, half_steps: [i32; 6], rate: f64, now: u64) -> Result<(), MotorsError> {
        let steps = half_steps.iter().map(|count| count.unsigned_abs()).fold(0, u32::max);
        let period = if self.at_once { 0 } else { (1e9 / rate) as u64 };
        self.motion = Some(Motion { half_steps, began: now, period, steps });
        Ok(())
    }

    fn end(&mut self, now: u64) -> Result<Option<End>, MotorsError> {
        let at = match self.motion {
            None => now,
            Some(motion) if motion.steps_at(now) < motion.steps => return Ok(None),
            Some(motion) => self.settle(motion, motion.steps),
        };
        Ok(Some(End { at, ending: Ending::Made }))
    }

    fn look_again(&self, now: u64) -> u64 {
        self.motion.map_or(now, |motion| motion.time_of(motion.steps))
    }

    fn halt(&mut self, now: u64) -> Result<u64, MotorsError> {
        Ok(self.motion.map_or(now, |motion| self.settle(motion, motion.steps_at(now))))
    }

    fn position(&self, now: u64) -> [i32; 6] {
        let mut position =
            self.motion.map_or(self.turned, |motion| motion.from(self.turned, motion.steps_at(now)));
        for (position, zero) in position.iter_mut().zip(self.zero) {
            *position -= zero;
        }
        position
    }

    fn reset(&mut self) -> Result<(), MotorsError> {
        self.zero = self.turned;
        Ok(())
    }

    fn inputs(&mut self) -> Result<u8, MotorsError> {
        let touches = self.opening_mm() <= self.between_mm;
        Ok(self.lines & 0x7f | u8::from(touches) << 7)
    }

    fn set_outputs(&mut self, levels: u8) -> Result<(), MotorsError> {
        self.outputs = levels;
        Ok(())
    }

    fn set_input(&mut self, bit: u32, level: bool) -> bool {
        let mask = 1_u8.checked_shl(bit).unwrap_or(0) & 0x7f;
        self.lines = if level { self.lines | mask } else { self.lines & !mask };
        true
    }

    fn put_between_fingers(&mut self, width_mm: f64) -> Result<bool, MotorsError> {
        let fits = width_mm <= self.opening_mm();
        if fits {
            self.between_mm = width_mm;
        }
        Ok(fits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_motion_takes_its_half_steps_times_their_period() {
        let mut motors = BareMotors::new(false, 20.0);
        motors.start([10, -5, 0, 0, 0, 0], 100.0, 0).unwrap();
        assert_eq!(motors.end(35 * MS).unwrap(), None);
        assert_eq!(motors.position(35 * MS), [3, -2, 0, 0, 0, 0]);
        assert_eq!(motors.look_again(0), 100 * MS);
        assert_eq!(motors.end(120 * MS).unwrap(), Some(End { at: 100 * MS, ending: Ending::Made }));
        assert_eq!(motors.position(120 * MS), [10, -5, 0, 0, 0, 0]);
    }

    #[test]
    fn a_halt_keeps_what_was_made() {
        let mut motors = BareMotors::new(false, 20.0);
        motors.start([10, 0, 0, 0, 0, 0], 100.0, 0).unwrap();
        assert_eq!(motors.halt(47 * MS).unwrap(), 40 * MS);
        assert_eq!(motors.halt(50 * MS).unwrap(), 50 * MS);
        assert_eq!(motors.position(90 * MS), [4, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn the_grip_switch_trips_at_what_lies_between_the_fingers() {
        let mut motors = BareMotors::new(true, 20.0);
        assert!(!motors.put_between_fingers(21.0).unwrap());
        assert!(motors.put_between_fingers(18.0).unwrap());
        assert_eq!(motors.inputs().unwrap(), 0);
        motors.start([0, 0, 0, 0, 0, -30], 100.0, 0).unwrap();
        motors.end(0).unwrap();
        assert_eq!(motors.inputs().unwrap(), 0x80);
        // The elbow's motor turns 50 half-steps, and the gripper's 30 more than it must to follow.
        motors.start([0, 0, 50, 0, 0, 80], 100.0, 0).unwrap();
        motors.end(0).unwrap();
        assert_eq!(motors.inputs().unwrap(), 0);
    }
}
