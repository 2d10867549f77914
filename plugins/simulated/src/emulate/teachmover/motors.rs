//! The motors behind the controller, and what hangs on them.

/// Half-steps of the gripper's motor for one millimetre of opening: 371 for an inch.
const GRIPPER_HALF_STEPS_PER_MM: f64 = 371.0 / 25.4;

/// The motors failed: the world they are in has gone.
#[derive(Debug, thiserror::Error)]
#[error("the arm is gone: {0}")]
pub struct MotorsError(
    /// Why.
    pub String,
);

/// How far a motion has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Half-steps issued since it began.
    pub made: [i32; 6],
    /// When it ended, ns of the controller's clock; `None` while it goes on.
    pub ended: Option<u64>,
}

/// Six stepper motors, the grip switch and the lines. Times are ns of the controller's clock.
pub trait Motors: Send {
    /// Starts turning all motors by these half-steps, the one that makes the most of them at `rate` half-steps a second.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn start(&mut self, half_steps: [i32; 6], rate: f64, now: u64) -> Result<(), MotorsError>;

    /// How far the motion has come.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn progress(&mut self, now: u64) -> Result<Progress, MotorsError>;

    /// When to ask for progress next.
    fn look_again(&self, now: u64) -> u64;

    /// Ends the motion where it is.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn halt(&mut self, now: u64) -> Result<Progress, MotorsError>;

    /// The user input lines, bits 0 to 6, and the grip switch, bit 7 (assumed: no source says where it is found).
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn inputs(&mut self) -> Result<u8, MotorsError>;

    /// Sets the user output lines.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn set_outputs(&mut self, levels: u8) -> Result<(), MotorsError>;

    /// An input line of an arm that stands in no world: its level; `false` when the world has its own.
    fn set_input(&mut self, _bit: u32, _level: bool) -> bool {
        false
    }

    /// What lies between the fingers of an arm that stands in no world: its width, mm; `false` when the world has its own.
    fn put_between_fingers(&mut self, _width_mm: f64) -> bool {
        false
    }
}

/// Motors on a bench: no arm, no world; lines and grip as they are told.
#[derive(Debug, Clone)]
pub struct BareMotors {
    /// Whether a motion takes no time.
    at_once: bool,
    turned: [i64; 6],
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
        Self { at_once, turned: [0; 6], motion: None, lines: 0, outputs: 0, opening_mm, between_mm: 0.0 }
    }

    /// The output lines.
    pub fn outputs(&self) -> u8 {
        self.outputs
    }

    fn touches(&self) -> bool {
        let [_, _, elbow, _, _, gripper] = self.turned;
        let opened = (gripper - elbow) as f64 / GRIPPER_HALF_STEPS_PER_MM;
        self.opening_mm + opened <= self.between_mm
    }

    /// Ends the motion with this many of its steps made.
    fn settle(&mut self, motion: Motion, steps: u32) -> [i32; 6] {
        let made = motion.after(steps);
        for (turned, made) in self.turned.iter_mut().zip(made) {
            *turned += i64::from(made);
        }
        self.motion = None;
        made
    }
}

impl Motion {
    /// The half-steps of each motor once the one with the most has made `steps`.
    fn after(&self, steps: u32) -> [i32; 6] {
        let part = f64::from(steps) / f64::from(self.steps.max(1));
        self.half_steps.map(|count| (f64::from(count) * part).round() as i32)
    }

    fn steps_at(&self, now: u64) -> u32 {
        let elapsed = now.saturating_sub(self.began) / self.period.max(1);
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

    fn progress(&mut self, now: u64) -> Result<Progress, MotorsError> {
        let Some(motion) = self.motion else { return Ok(Progress { made: [0; 6], ended: Some(now) }) };
        let steps = if self.at_once { motion.steps } else { motion.steps_at(now) };
        if steps < motion.steps {
            return Ok(Progress { made: motion.after(steps), ended: None });
        }
        Ok(Progress { made: self.settle(motion, steps), ended: Some(motion.time_of(steps)) })
    }

    fn look_again(&self, now: u64) -> u64 {
        self.motion.map_or(now, |motion| motion.time_of(motion.steps))
    }

    fn halt(&mut self, now: u64) -> Result<Progress, MotorsError> {
        let Some(motion) = self.motion else { return Ok(Progress { made: [0; 6], ended: Some(now) }) };
        let steps = motion.steps_at(now);
        Ok(Progress { made: self.settle(motion, steps), ended: Some(motion.time_of(steps)) })
    }

    fn inputs(&mut self) -> Result<u8, MotorsError> {
        Ok(self.lines & 0x7f | u8::from(self.touches()) << 7)
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

    fn put_between_fingers(&mut self, width_mm: f64) -> bool {
        self.between_mm = width_mm;
        true
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
        assert_eq!(motors.progress(35 * MS).unwrap(), Progress { made: [3, -2, 0, 0, 0, 0], ended: None });
        assert_eq!(motors.look_again(0), 100 * MS);
        let end = Progress { made: [10, -5, 0, 0, 0, 0], ended: Some(100 * MS) };
        assert_eq!(motors.progress(120 * MS).unwrap(), end);
    }

    #[test]
    fn a_halt_keeps_what_was_made() {
        let mut motors = BareMotors::new(false, 20.0);
        motors.start([10, 0, 0, 0, 0, 0], 100.0, 0).unwrap();
        let end = Progress { made: [4, 0, 0, 0, 0, 0], ended: Some(40 * MS) };
        assert_eq!(motors.halt(47 * MS).unwrap(), end);
        assert_eq!(motors.halt(50 * MS).unwrap().made, [0; 6]);
    }

    #[test]
    fn the_grip_switch_trips_at_what_lies_between_the_fingers() {
        let mut motors = BareMotors::new(true, 20.0);
        motors.put_between_fingers(18.0);
        assert_eq!(motors.inputs().unwrap(), 0);
        motors.start([0, 0, 0, 0, 0, -30], 100.0, 0).unwrap();
        motors.progress(0).unwrap();
        assert_eq!(motors.inputs().unwrap(), 0x80);
        // The elbow going up slackens nothing: its motor and the gripper's went together.
        motors.start([0, 0, 50, 0, 0, 80], 100.0, 0).unwrap();
        motors.progress(0).unwrap();
        assert_eq!(motors.inputs().unwrap(), 0);
    }
}
