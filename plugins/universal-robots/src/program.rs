//! The programs that are sent.

use std::fmt::Write as _;
use std::time::Duration;

use crate::rtde::AXES;

/// A move of all joints (rad) with the speed (rad/s) and the acceleration (rad/s2) of the joint that goes furthest. It writes `number` to the first register when it begins and to the
/// next when it has ended, and the controller ends it when the first input register is not written for `watchdog`.
pub fn move_joints(
    number: i32,
    joints: &[f64; AXES],
    speed: f64,
    acceleration: f64,
    first_register: u8,
    watchdog: Duration,
) -> String {
    let joints: Vec<String> = joints.iter().map(|joint| format!("{joint:.7}")).collect();
    let hz = 1.0 / watchdog.as_secs_f64();
    let mut text = "def plumb_move():\n".to_owned();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "  rtde_set_watchdog(\"input_int_register_{first_register}\", {hz:.3}, \"stop\")");
    let _ = writeln!(text, "  write_output_integer_register({first_register}, {number})");
    let _ = writeln!(text, "  movej([{}], a={acceleration:.5}, v={speed:.5})", joints.join(", "));
    let _ = writeln!(text, "  write_output_integer_register({}, {number})", first_register + 1);
    text + "end\n"
}

/// Brings the joints to rest with a deceleration (rad/s2); a new program takes the place of the one that runs. It writes its number as a move does.
pub fn stop(number: i32, deceleration: f64, first_register: u8) -> String {
    let ended = first_register + 1;
    format!(
        "def plumb_stop():\n  write_output_integer_register({first_register}, {number})\n  stopj({deceleration:.5})\n  write_output_integer_register({ended}, {number})\nend\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_is_the_program_that_the_manual_describes() {
        let text = move_joints(
            7,
            &[0.0, -1.570_796_4, 1.0, 0.0, 0.0, 0.5],
            0.5,
            1.4,
            24,
            Duration::from_millis(250),
        );
        assert_eq!(
            text,
            "def plumb_move():\n  rtde_set_watchdog(\"input_int_register_24\", 4.000, \"stop\")\n  write_output_integer_register(24, 7)\n  movej([0.0000000, -1.5707964, 1.0000000, 0.0000000, 0.0000000, 0.5000000], a=1.40000, v=0.50000)\n  write_output_integer_register(25, 7)\nend\n"
        );
    }
}
