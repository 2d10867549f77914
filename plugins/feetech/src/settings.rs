//! What the servos are set to: looked at when the arm is connected, and changed when its zeros are set.

use crate::bus::{Bus, BusError};
use crate::registers::{
    GOAL, HIGHEST_GOAL, HOMING_OFFSET, LOCK, LOWEST_GOAL, MODEL, OPERATING_MODE, PHASE, Register,
    SPEED_IN_SINGLE_STEPS, STATE, TORQUE, offset_of_register, offset_to_register, position_of_register,
};
use crate::servo::{STEPS_A_TURN, nearest_to_middle};

/// Steps of a servo's speed register where one unit is fifty steps a second.
const COARSE_SPEED: u16 = 50;
/// The models of the SCS series, which have 1024 steps and the high byte first; the hundreds of their numbers.
const SCS_MODELS: std::ops::Range<u16> = 1280..1536;

/// How a servo is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Settings {
    pub(crate) model: u16,
    pub(crate) homing_offset: i32,
    pub(crate) lowest_goal: u16,
    pub(crate) highest_goal: u16,
    pub(crate) operating_mode: u16,
    /// Steps a second of one unit of its speeds.
    pub(crate) steps_a_unit: u16,
}

impl Settings {
    pub(crate) fn read(bus: &mut Bus, servo: u8) -> Result<Self, BusError> {
        let phase = bus.read(servo, PHASE)?;
        let fine = phase & u16::from(SPEED_IN_SINGLE_STEPS) != 0;
        Ok(Self {
            model: bus.read(servo, MODEL)?,
            homing_offset: offset_of_register(bus.read(servo, HOMING_OFFSET)?),
            lowest_goal: bus.read(servo, LOWEST_GOAL)?,
            highest_goal: bus.read(servo, HIGHEST_GOAL)?,
            operating_mode: bus.read(servo, OPERATING_MODE)?,
            steps_a_unit: if fine { 1 } else { COARSE_SPEED },
        })
    }

    /// Why an arm cannot be driven with it.
    pub(crate) fn objection(&self) -> Option<String> {
        if SCS_MODELS.contains(&self.model) {
            return Some(format!(
                "its model number is {}, of the SCS series, which counts otherwise; this driver knows the STS and SMS series",
                self.model
            ));
        }
        (self.operating_mode != 0).then(|| {
            format!(
                "its operating mode is {}; only in mode 0 does it go to positions: set register 33 to 0 with the maker's program",
                self.operating_mode
            )
        })
    }
}

/// Has the servo call the position where it is `step` from now on. Its torque is off for these few milliseconds, so that it does not run to where its
/// old goal would lie by the new count.
pub(crate) fn take_for(bus: &mut Bus, servo: u8, step: i32) -> Result<Option<i32>, BusError> {
    let held = bus.read(servo, TORQUE)? == 1;
    let old = offset_of_register(bus.read(servo, HOMING_OFFSET)?);
    let here = nearest_to_middle(position_of_register(bus.read(servo, STATE)?));
    let offset = within_half_a_turn(old + here - step);
    let Some(register) = offset_to_register(offset) else { return Ok(None) };
    bus.write(servo, TORQUE, 0)?;
    let written = write_for_good(bus, servo, HOMING_OFFSET, register);
    // Whatever came of it, the servo holds where it is and not where its old goal is.
    let now = nearest_to_middle(position_of_register(bus.read(servo, STATE)?));
    bus.write(servo, GOAL, u16::try_from(now).unwrap_or_default())?;
    if held {
        bus.write(servo, TORQUE, 1)?;
    }
    written.map(|()| Some(offset))
}

/// An offset and one that is a whole turn more are the same position.
fn within_half_a_turn(offset: i32) -> i32 {
    (offset + STEPS_A_TURN / 2).rem_euclid(STEPS_A_TURN) - STEPS_A_TURN / 2
}

/// Writes a register that is kept without power.
fn write_for_good(bus: &mut Bus, servo: u8, register: Register, value: u16) -> Result<(), BusError> {
    bus.write(servo, LOCK, 0)?;
    let written = bus.write(servo, register, value);
    bus.write(servo, LOCK, 1)?;
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_taken_within_half_a_turn() {
        for (offset, taken) in [(0, 0), (100, 100), (-2047, -2047), (2050, -2046), (-2050, 2046), (4096, 0)] {
            assert_eq!(within_half_a_turn(offset), taken, "{offset}");
        }
    }

    #[test]
    fn servos_that_cannot_be_driven_are_named() {
        let good = Settings {
            model: 777,
            homing_offset: 0,
            lowest_goal: 0,
            highest_goal: 4095,
            operating_mode: 0,
            steps_a_unit: 1,
        };
        assert_eq!(good.objection(), None);
        assert!(Settings { model: 1284, ..good }.objection().unwrap().contains("SCS series"));
        assert!(Settings { operating_mode: 1, ..good }.objection().unwrap().contains("operating mode is 1"));
    }
}
