//! The registers of an STS servo that this driver uses: address and length. Two bytes go low byte first.

/// An address in a servo's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Register {
    /// Its first byte.
    pub(crate) address: u8,
    /// Its bytes, 1 or 2.
    pub(crate) length: u8,
}

const fn byte(address: u8) -> Register {
    Register { address, length: 1 }
}

const fn word(address: u8) -> Register {
    Register { address, length: 2 }
}

/// The servo's model; its entry is two bytes, of which STS3215 has 777.
pub(crate) const MODEL: Register = word(3);
/// The lowest goal it takes.
pub(crate) const LOWEST_GOAL: Register = word(9);
/// The highest goal it takes.
pub(crate) const HIGHEST_GOAL: Register = word(11);
/// Bits of how it was built; [`SPEED_IN_SINGLE_STEPS`] is one.
pub(crate) const PHASE: Register = byte(18);
/// Subtracted from what the encoder shows: a size of 11 bits and a sign.
pub(crate) const HOMING_OFFSET: Register = word(31);
/// 0: it goes to positions. Others turn without end.
pub(crate) const OPERATING_MODE: Register = byte(33);
/// 1: it holds and moves; 0: it can be turned by hand.
pub(crate) const TORQUE: Register = byte(40);
/// Where a goal's block begins: acceleration, goal, time, speed.
pub(crate) const ACCELERATION: Register = byte(41);
/// Where it goes, or holds.
pub(crate) const GOAL: Register = word(42);
/// 1: what is written to its permanent registers is lost with its power.
pub(crate) const LOCK: Register = byte(55);
/// Where a state's block begins.
pub(crate) const STATE: Register = word(56);
/// Length of a state's block: position, speed, load, voltage, temperature, a flag, status, moving.
pub(crate) const STATE_LENGTH: u8 = 11;

/// Bit of [`PHASE`]: speeds are steps a second. Without it one unit is fifty of them.
pub(crate) const SPEED_IN_SINGLE_STEPS: u8 = 4;

/// Sign bit of a homing offset.
const OFFSET_SIGN: u16 = 1 << 11;
/// Sign bit of a position.
const POSITION_SIGN: u16 = 1 << 15;
/// The furthest homing offset either way, steps.
pub(crate) const FURTHEST_OFFSET: i32 = 2047;

/// A homing offset as its register holds it; `None` for one that it cannot hold.
pub(crate) fn offset_to_register(steps: i32) -> Option<u16> {
    let size = u16::try_from(steps.unsigned_abs()).ok().filter(|_| steps.abs() <= FURTHEST_OFFSET)?;
    Some(if steps < 0 { size | OFFSET_SIGN } else { size })
}

/// The homing offset that a register holds.
pub(crate) fn offset_of_register(register: u16) -> i32 {
    signed(register & 0xfff, OFFSET_SIGN)
}

/// The position that a register holds.
pub(crate) fn position_of_register(register: u16) -> i32 {
    signed(register, POSITION_SIGN)
}

fn signed(register: u16, sign: u16) -> i32 {
    let size = i32::from(register & !sign);
    if register & sign == 0 { size } else { -size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_a_bit_of_their_own() {
        assert_eq!(offset_to_register(-5), Some(0x805));
        assert_eq!(offset_of_register(0x805), -5);
        assert_eq!((offset_to_register(2047), offset_to_register(2048)), (Some(2047), None));
        assert_eq!((position_of_register(0x8003), position_of_register(4095)), (-3, 4095));
        for steps in -2047..=2047 {
            assert_eq!(offset_to_register(steps).map(offset_of_register), Some(steps));
        }
    }
}
