//! What the controller can be commanded.

use std::fmt;

use super::ProgramLine;
use super::words::{self, Word};
use crate::drive::HalfSteps;
use crate::speed_code::SpeedCode;

/// A command to the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Moves all six motors together by signed half-steps, and sets the output lines if given (bits 0 to 4).
    Step {
        /// How fast.
        speed: SpeedCode,
        /// By how much.
        counts: HalfSteps,
        /// The levels of the output lines.
        outputs: Option<u8>,
    },
    /// Reports registers, inputs and the last pendant key.
    Read,
    /// Closes the gripper, lightly and slowly, until its switch trips.
    Close,
    /// Hands the arm to the pendant.
    HandControl,
    /// Sets the registers to zero and switches the motor current off.
    Reset,
    /// Runs the taught program.
    RunProgram,
    /// Reports the taught program.
    DumpProgram,
    /// Writes one line of a taught program.
    WriteProgram(ProgramLine),
    /// Changes the recognition character, for several arms on one line.
    Recognition(u8),
    /// Makes the controller wait between the characters of its replies.
    Delay(u8),
}

impl Command {
    /// The command as the manual writes it, such as `@STEP`, whatever the recognition character in use.
    pub fn name(&self) -> String {
        format!("@{}", self.word().text)
    }

    /// Whether a program that drives a real arm shows this form; otherwise it is from memory, and an arm may want another.
    pub fn is_seen_on_an_arm(&self) -> bool {
        self.word().seen_on_an_arm
    }

    /// The bytes on the line, with the arm's recognition character in front and the carriage return at the end.
    pub fn bytes(&self, recognition: u8) -> Vec<u8> {
        let mut bytes = vec![recognition];
        bytes.extend_from_slice(self.word().text.as_bytes());
        match self {
            Self::Step { speed, counts, outputs } => {
                let counts = counts.0.into_iter();
                let numbers = std::iter::once(i32::from(speed.number())).chain(counts);
                push_numbers(&mut bytes, numbers.chain(outputs.map(i32::from)));
            }
            Self::WriteProgram(line) => push_numbers(&mut bytes, line.0.into_iter().map(i32::from)),
            Self::Recognition(character) => bytes.extend_from_slice(&[b' ', *character]),
            Self::Delay(amount) => push_numbers(&mut bytes, std::iter::once(i32::from(*amount))),
            Self::Read
            | Self::Close
            | Self::HandControl
            | Self::Reset
            | Self::RunProgram
            | Self::DumpProgram => {}
        }
        bytes.push(b'\r');
        bytes
    }

    fn word(&self) -> &'static Word {
        match self {
            Self::Step { .. } => &words::STEP,
            Self::Read => &words::READ,
            Self::Close => &words::CLOSE,
            Self::HandControl => &words::SET,
            Self::Reset => &words::RESET,
            Self::RunProgram => &words::RUN,
            Self::DumpProgram => &words::QDUMP,
            Self::WriteProgram(_) => &words::QWRITE,
            Self::Recognition(_) => &words::ARM,
            Self::Delay(_) => &words::DELAY,
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(String::from_utf8_lossy(&self.bytes(b'@')).trim_end())
    }
}

fn push_numbers(bytes: &mut Vec<u8>, numbers: impl Iterator<Item = i32>) {
    for (index, number) in numbers.enumerate() {
        bytes.push(if index == 0 { b' ' } else { b',' });
        bytes.extend_from_slice(number.to_string().as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_reads_as_the_controller_takes_it() {
        let step = |outputs| Command::Step {
            speed: SpeedCode::new(220).unwrap(),
            counts: HalfSteps([1, -20, 0, 7, 7, 0]),
            outputs,
        };
        for (command, bytes) in [
            (step(None), "@STEP 220,1,-20,0,7,7,0\r"),
            (step(Some(5)), "@STEP 220,1,-20,0,7,7,0,5\r"),
            (Command::Read, "@READ\r"),
            (Command::Close, "@CLOSE\r"),
            (Command::HandControl, "@SET\r"),
            (Command::Reset, "@RESET\r"),
            (Command::RunProgram, "@RUN\r"),
            (Command::DumpProgram, "@QDUMP\r"),
            (
                Command::WriteProgram(ProgramLine([1, 2, 3, 4, 5, 6, 7, 65535])),
                "@QWRITE 1,2,3,4,5,6,7,65535\r",
            ),
            (Command::Recognition(b'#'), "@ARM #\r"),
            (Command::Delay(3), "@DELAY 3\r"),
        ] {
            assert_eq!(String::from_utf8(command.bytes(b'@')).unwrap(), bytes);
        }
    }

    #[test]
    fn another_recognition_character_is_in_front_on_the_line_but_not_in_messages() {
        assert_eq!(Command::Read.bytes(b'#'), b"#READ\r");
        assert_eq!(Command::Read.to_string(), "@READ");
    }
}
