//! One servo's state, and what is wrong with it.

use plumb_plugin::MotorState;

use crate::registers::position_of_register;

/// Steps of a whole turn.
pub(crate) const STEPS_A_TURN: i32 = 4096;
/// The step that means a joint's zero: the middle of what a servo counts.
pub(crate) const MIDDLE: i32 = STEPS_A_TURN / 2;
/// One step, degrees.
pub(crate) const STEP_DEG: f64 = 360.0 / STEPS_A_TURN as f64;

/// Steps of the load register from no torque to full torque.
const LOAD_STEPS: f64 = 1000.0;
/// Steps of the voltage register in a volt.
const VOLT_STEPS: f64 = 10.0;
/// Steps of the temperature register in a degree Celsius.
const CELSIUS_STEPS: f64 = 1.0;

/// Bits of a status that are faults, and what to do about each. Bit 4 says that torque is on, which is none.
const FAULTS: [(u8, &str); 5] = [
    (1, "its supply voltage is out of range: check the power supply and its plug"),
    (2, "its position encoder does not work: switch the arm off and on; if it stays so, change the servo"),
    (4, "it is too hot and has let go: let it cool down, and take load off"),
    (8, "it draws too much current and has let go: look for what blocks the joint"),
    (32, "it was overloaded and has let go: free the joint, then activate the arm again"),
];

/// What a servo reports of itself at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ServoState {
    /// Where it is, steps, the middle being [`MIDDLE`].
    pub(crate) position: i32,
    /// How much of its torque it uses, per mille.
    pub(crate) load: u16,
    /// Tenths of a volt.
    pub(crate) decivolts: u8,
    /// Degrees Celsius.
    pub(crate) celsius: u8,
    /// Its faults.
    pub(crate) status: u8,
    /// Whether it is on its way to a goal.
    pub(crate) moving: bool,
}

impl ServoState {
    /// From the block of registers that holds it, and the status of the answer.
    pub(crate) fn of_block(status: u8, block: &[u8]) -> Option<Self> {
        let [low, high, _, _, load_low, load_high, decivolts, celsius, _, own_status, moving] = *block else {
            return None;
        };
        Some(Self {
            position: nearest_to_middle(position_of_register(u16::from_le_bytes([low, high]))),
            // Bit 10 is the direction of the load.
            load: u16::from_le_bytes([load_low, load_high]) & 0x3ff,
            decivolts,
            celsius,
            status: status | own_status,
            moving: moving != 0,
        })
    }

    /// What is wrong with it.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        FAULTS.iter().find(|(bit, _)| self.status & bit != 0).map(|(_, text)| *text)
    }

    /// Load and temperature in words, for a message.
    pub(crate) fn in_words(&self) -> String {
        format!(
            "load {:.0} %, {} degrees Celsius, {:.1} V",
            f64::from(self.load) / 10.0,
            self.celsius,
            f64::from(self.decivolts) / VOLT_STEPS
        )
    }
}

/// What the servos report of their motors, in the units of the contract. Known of its uncertainty is what the steps of the registers make of it.
pub(crate) fn motor_state(time_ns: u64, states: &[ServoState]) -> MotorState {
    let mut motors = MotorState::unreported(time_ns, states.len());
    for (index, state) in states.iter().enumerate() {
        motors.temperature.set(index, f64::from(state.celsius) / CELSIUS_STEPS);
        motors.load.set(index, f64::from(state.load) / LOAD_STEPS);
        motors.voltage.set(index, f64::from(state.decivolts) / VOLT_STEPS);
    }
    motors.temperature_uncertainty = uncertainty_of_step(1.0 / CELSIUS_STEPS);
    motors.load_uncertainty = uncertainty_of_step(1.0 / LOAD_STEPS);
    motors.voltage_uncertainty = uncertainty_of_step(1.0 / VOLT_STEPS);
    motors
}

/// The standard uncertainty of a value that lies anywhere within a step: of a uniform distribution (JCGM 100:2008, 4.3.7).
fn uncertainty_of_step(step: f64) -> f64 {
    step / 12.0_f64.sqrt()
}

/// Some firmware goes on counting beyond a turn, or below 0, where the homing offset carries it there: the same position within half a turn of the middle.
pub(crate) fn nearest_to_middle(position: i32) -> i32 {
    position.rem_euclid(STEPS_A_TURN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_reported_within_half_a_turn_of_the_middle() {
        for (reported, expected) in [(2048, 2048), (0, 0), (4095, 4095), (4096, 0), (-1, 4095), (8191, 4095)]
        {
            assert_eq!(nearest_to_middle(reported), expected, "{reported}");
        }
    }

    #[test]
    fn faults_are_named_and_torque_is_none() {
        let block = [0, 8, 0, 0, 100, 4, 74, 31, 0, 0, 0];
        let state = ServoState::of_block(0x10, &block).unwrap();
        assert_eq!((state.position, state.load, state.fault()), (2048, 100, None));
        let hot = ServoState::of_block(4, &block).unwrap();
        assert!(hot.fault().unwrap().starts_with("it is too hot"));
        assert_eq!(ServoState::of_block(0, &[0; 4]), None);
    }
}
