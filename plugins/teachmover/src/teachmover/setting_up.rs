//! What the controller is given when the arm is connected, before anything moves: the character it answers to, the pause in its replies, the
//! program it holds.

use std::fs;
use std::path::Path;

use plumb_document::{FileKind, read_bytes};
use plumb_plugin::{LogLevel, PluginError};

use super::TeachMover;
use crate::controller::ControllerError;
use crate::drive::HalfSteps;
use crate::protocol::{ControllerState, ProgramLine, parse_program};
use crate::reply_line::{ReplyFailure, SerialError};
use crate::speed_code::SpeedCode;

/// Whether nobody answered.
fn is_silence(error: &ControllerError) -> bool {
    matches!(
        error,
        ControllerError::Line(SerialError::ReadReply { failure: ReplyFailure::Silent { .. }, .. })
    )
}

/// What to set for a controller that does not know `@READ`.
const WITHOUT_READ: &str = "where a controller carries moves out and does not know @READ, as owners of a TeachMover II have reported, `dead_reckoning: true` in the cell file has its half-steps counted here; what that cannot see is in the driver's manual";

impl TeachMover {
    /// Where the arm is when it is connected, or how it can be connected where the controller does not say it.
    pub(super) fn first_reading(&mut self) -> Result<ControllerState, PluginError> {
        if self.configuration.dead_reckoning {
            self.require_somebody_without_read()?;
            let text = "dead reckoning: the arm is taken to be in the pose of `registers_zero` now. Nothing confirms where it is: steps that stall or get lost are not seen, nor are inputs and the pendant's keys, and a move that its STOP key ends loses the place";
            self.host.log(LogLevel::Warn, text);
            return self.read_twice_alike(None);
        }
        self.read_twice_alike(None).map_err(|error| match &error {
            PluginError::Disconnected(text) if text.contains("@READ") => {
                PluginError::Disconnected(format!("{text}; {WITHOUT_READ}"))
            }
            PluginError::Failed(text) if text.starts_with("the controller refused @READ") => {
                PluginError::Failed(format!("{text}; {WITHOUT_READ}"))
            }
            _ => error,
        })
    }

    /// Makes sure that a controller is there, and one that does not know `@READ`. It is asked that first all the same: a firmware that takes the numbers of
    /// `@STEP` for positions answers it in its own way, and would go somewhere by a move of no half-steps.
    fn require_somebody_without_read(&mut self) -> Result<(), PluginError> {
        match self.controller.can_read_registers() {
            Ok(true) => Err(PluginError::Refused(
                "config: dead_reckoning is true, and this controller answers @READ: take `dead_reckoning` out of the cell file, so that what it says is used".to_owned(),
            )),
            Ok(false) => Ok(()),
            Err(error) if is_silence(&error) => {
                self.controller.resynchronise()?;
                // A move of no half-steps shows that somebody answers.
                self.controller.step(SpeedCode::SLOWEST, HalfSteps::default(), None)?;
                Ok(())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Does what the cell file says of the controller.
    pub(super) fn set_up(&mut self) -> Result<(), PluginError> {
        self.rename()?;
        if let Some(amount) = self.configuration.reply_delay {
            self.controller.delay_replies(amount)?;
        }
        if let Some(file) = self.configuration.program.keep_in.clone() {
            self.keep_program(&file)?;
        }
        if let Some(file) = self.configuration.program.write_from.clone() {
            self.write_program(&file)?;
        }
        Ok(())
    }

    /// Makes an arm that answers to its former character answer to its own.
    fn rename(&mut self) -> Result<(), PluginError> {
        let Some(former) = self.configuration.renamed_from else { return Ok(()) };
        match self.controller.read() {
            Err(error) if is_silence(&error) => {}
            other => return other.map(drop).map_err(PluginError::from),
        }
        self.controller.resynchronise()?;
        let own = self.configuration.recognition;
        self.controller.call_it(former);
        let renamed = self.controller.change_recognition(own);
        self.controller.call_it(own);
        renamed?;
        let (former, own) = (char::from(former), char::from(own));
        self.host.log(LogLevel::Info, &format!("the arm answered to '{former}' and answers to '{own}' now"));
        Ok(())
    }

    /// Keeps the program that the controller holds in a file; none leaves the file as it is.
    fn keep_program(&mut self, file: &Path) -> Result<(), PluginError> {
        let program = self.controller.dump_program()?;
        if program.is_empty() {
            self.host.log(LogLevel::Info, "no program is taught to the controller: nothing to keep");
            return Ok(());
        }
        let lines = program.iter().map(|line| line.0.map(|word| word.to_string()).join(",") + "\n");
        fs::write(file, lines.collect::<String>()).map_err(|error| {
            let file = file.display();
            PluginError::Refused(format!("config: taught_program: keep_in {file} cannot be written: {error}"))
        })?;
        let text = format!(
            "the program taught to the controller is kept in {}: {} lines",
            file.display(),
            program.len()
        );
        self.host.log(LogLevel::Info, &text);
        Ok(())
    }

    /// Writes the program of a file into the controller and reads it back.
    fn write_program(&mut self, file: &Path) -> Result<(), PluginError> {
        let refused = |why: String| {
            let file = file.display();
            PluginError::Refused(format!("config: taught_program: write_from {file}: {why}"))
        };
        let bytes = read_bytes(file, FileKind::TAUGHT_PROGRAM).map_err(|error| refused(error.to_string()))?;
        let program: Vec<ProgramLine> = parse_program(&bytes).map_err(|fault| refused(fault.to_string()))?;
        if program.is_empty() {
            return Err(refused(
                "it holds no program: a line of eight numbers for each of its lines".to_owned(),
            ));
        }
        self.controller.write_program(&program)?;
        let held = self.controller.dump_program()?;
        if let Some(missing) = program.iter().find(|line| !held.contains(line)) {
            return Err(PluginError::Failed(format!(
                "the controller did not take the line {} of {} over: a byte was damaged on the line, or its memory is full",
                missing.0.map(|word| word.to_string()).join(","),
                file.display()
            )));
        }
        let text = format!("{} lines of {} are taught to the controller", program.len(), file.display());
        self.host.log(LogLevel::Info, &text);
        Ok(())
    }
}
