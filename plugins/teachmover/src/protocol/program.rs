//! A line of a program taught to the controller, as eight numbers.

use crate::drive::HalfSteps;
use crate::speed_code::SpeedCode;

/// A line of a taught program: a point, or any other line as the controller keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramLine(pub [u16; 8]);

/// Why a point cannot be written as a line of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProgramLineError {
    /// A register is larger than a line can hold.
    #[error("a taught point holds registers from -32768 to 32767, not {0}")]
    Register(i32),
}

/// The kind of a line that moves the arm to a point: the low half of its second number.
const POINT: u16 = 1;

impl ProgramLine {
    /// The line that moves to absolute registers.
    ///
    /// The positions are 16-bit two's complement; their low halves come first (third to fifth number), then their high halves (sixth to
    /// eighth), two motors to a number. The second number holds `255 - speed` in its high half.
    ///
    /// # Errors
    /// [`ProgramLineError`] for a register that does not fit.
    pub fn point(line: u8, speed: SpeedCode, registers: HalfSteps) -> Result<Self, ProgramLineError> {
        let mut bytes = [[0_u16; 2]; 6];
        for (bytes, register) in bytes.iter_mut().zip(registers.0) {
            let register = i16::try_from(register).map_err(|_| ProgramLineError::Register(register))?;
            *bytes = register.to_le_bytes().map(u16::from);
        }
        let [base, shoulder, elbow, right, left, gripper] = bytes;
        let pair = |first: [u16; 2], second: [u16; 2]| {
            let (([low, high], [second_low, second_high]), byte) = ((first, second), 256);
            (second_low * byte + low, second_high * byte + high)
        };
        let (low_1, high_1) = pair(base, shoulder);
        let (low_2, high_2) = pair(elbow, right);
        let (low_3, high_3) = pair(left, gripper);
        let speed = (255 - u16::from(speed.number())) * 256 + POINT;
        Ok(Self([u16::from(line), speed, low_1, low_2, low_3, high_1, high_2, high_3]))
    }

    /// The absolute registers a point leads to, and its speed; `None` for a line that is no point.
    pub fn as_point(&self) -> Option<(SpeedCode, HalfSteps)> {
        let [_, kind, low_1, low_2, low_3, high_1, high_2, high_3] = self.0;
        let (low_kind, inverse_speed) = (kind % 256, kind / 256);
        if low_kind != POINT {
            return None;
        }
        let speed = SpeedCode::new(u8::try_from(255 - inverse_speed).ok()?)?;
        let first = |low: u16, high: u16| i32::from(i16::from_le_bytes([low as u8, high as u8]));
        let second = |low: u16, high: u16| first(low / 256, high / 256);
        Some((
            speed,
            HalfSteps([
                first(low_1, high_1),
                second(low_1, high_1),
                first(low_2, high_2),
                second(low_2, high_2),
                first(low_3, high_3),
                second(low_3, high_3),
            ]),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_point_is_written_as_programs_for_real_arms_write_it() {
        let line =
            ProgramLine::point(3, SpeedCode::new(200).unwrap(), HalfSteps([1, -2, 300, 0, 0, -300])).unwrap();
        // base 0x0001, shoulder 0xFFFE, elbow 0x012C, gripper 0xFED4
        assert_eq!(line.0, [3, 55 * 256 + 1, 0xFE01, 0x002C, 0xD400, 0xFF00, 0x0001, 0xFE00]);
    }

    #[test]
    fn a_register_beyond_sixteen_bits_is_refused() {
        let error =
            ProgramLine::point(0, SpeedCode::SLOWEST, HalfSteps([0, 40_000, 0, 0, 0, 0])).unwrap_err();
        assert_eq!(error.to_string(), "a taught point holds registers from -32768 to 32767, not 40000");
    }

    proptest! {
        #[test]
        fn a_point_survives_its_eight_numbers(speed in 0..=245_u8, registers in prop::array::uniform6(-32768..32768_i32)) {
            let (speed, registers) = (SpeedCode::new(speed).unwrap(), HalfSteps(registers));
            prop_assert_eq!(ProgramLine::point(7, speed, registers).unwrap().as_point(), Some((speed, registers)));
        }

        #[test]
        fn any_eight_numbers_are_a_point_or_not(words in prop::array::uniform8(any::<u16>())) {
            let _ = ProgramLine(words).as_point();
        }
    }
}
