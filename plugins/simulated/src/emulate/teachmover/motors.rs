//! The motors behind the controller, and what hangs on them.

mod bare;
mod in_world;

pub use bare::BareMotors;
pub use in_world::MotorsInWorld;

use super::event::Key;

/// The motors failed: the world they are in has gone.
#[derive(Debug, thiserror::Error)]
#[error("the arm is gone: {0}")]
pub struct MotorsError(
    /// Why.
    pub String,
);

/// How a motion ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// As ordered.
    Made,
    /// Before its time, by a STOP key that is not the controller's own.
    CutShort,
    /// It never began: something else moves the arm.
    Refused,
}

/// The end of a motion: when the last half-step was made, ns of the controller's clock, and how it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct End {
    /// When the last half-step was made.
    pub at: u64,
    /// How it ended.
    pub ending: Ending,
}

/// A pendant that belongs to the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pendant {
    /// The key pressed last, 0 for none.
    pub key: u8,
    /// Whether it has the arm.
    pub drives: bool,
}

/// Six stepper motors, the grip switch and the lines. Times are ns of the controller's clock.
pub trait Motors: Send {
    /// Starts turning all motors by these half-steps, the one that makes the most of them at `rate` half-steps a second.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn start(&mut self, half_steps: [i32; 6], rate: f64, now: u64) -> Result<(), MotorsError>;

    /// The end of the motion begun last; `None` while it goes on.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn end(&mut self, now: u64) -> Result<Option<End>, MotorsError>;

    /// When to ask for the end next.
    fn look_again(&self, now: u64) -> u64;

    /// Ends the motion where it is, and reports when the last half-step was made.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn halt(&mut self, now: u64) -> Result<u64, MotorsError>;

    /// Half-steps sent to each motor since the last reset, as far as they are known without asking.
    fn position(&self, now: u64) -> [i32; 6];

    /// Counts from here.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn reset(&mut self) -> Result<(), MotorsError>;

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

    /// A key is pressed on the controller's pendant, where the world has one of its own.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn press(&mut self, _key: Key) -> Result<(), MotorsError> {
        Ok(())
    }

    /// The operator is given the arm, where the world has an operator.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn hand_over(&mut self) -> Result<(), MotorsError> {
        Ok(())
    }

    /// The pendant of the world, where it has one.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn pendant(&mut self) -> Result<Option<Pendant>, MotorsError> {
        Ok(None)
    }

    /// Whether the arm is still there.
    ///
    /// # Errors
    /// [`MotorsError`] when it is gone.
    fn check(&mut self) -> Result<(), MotorsError> {
        Ok(())
    }

    /// An input line takes a level; `false` where the world sets its own.
    fn set_input(&mut self, _bit: u32, _level: bool) -> bool {
        false
    }

    /// Something of this width (mm) is put between the fingers; `false` where it does not fit.
    ///
    /// # Errors
    /// [`MotorsError`] when the arm is gone.
    fn put_between_fingers(&mut self, width_mm: f64) -> Result<bool, MotorsError>;
}
