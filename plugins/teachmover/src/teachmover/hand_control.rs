//! What only the pendant stops: driving the arm by hand from it, and the program taught to the controller.

use plumb_plugin::{JogState, LogLevel, PluginError};

use super::{Mode, TeachMover};
use crate::configuration::PendantMode;
use crate::controller::OnlyThePendantStopsIt;
use crate::protocol::Status;

impl TeachMover {
    /// Hands the arm over, or looks whether that has ended.
    pub(super) fn drive_by_hand(&mut self) -> Result<JogState, PluginError> {
        let mode = match self.mode {
            Mode::AtThePendant(mode) => mode,
            Mode::GivenBack => {
                self.observe(None)?;
                return Ok(self.finished());
            }
            Mode::Ready | Mode::Doubtful(_) => {
                self.begin()?;
                return Ok(self.under_way());
            }
        };
        match self.controller.reply_at_hand(&mode.command()) {
            Ok(None) => Ok(self.under_way()),
            Ok(Some(status)) => self.ended(mode, status),
            Err(error) => {
                let error = PluginError::from(error);
                self.mode = Mode::Ready;
                self.doubt_after(&error);
                Err(error)
            }
        }
    }

    /// Takes the arm back, which only the pendant can do, or the end of the program.
    pub(super) fn end_driving_by_hand(&mut self) -> Result<JogState, PluginError> {
        if matches!(self.mode, Mode::AtThePendant(_)) {
            let state = self.drive_by_hand()?;
            if state.finished == 0 {
                self.refuse_at_the_pendant()?;
            }
            self.mode = Mode::Ready;
            return Ok(state);
        }
        if matches!(self.mode, Mode::GivenBack) {
            self.mode = Mode::Ready;
        }
        self.observe(None)?;
        Ok(self.finished())
    }

    /// Refuses everything while only the pendant stops the arm.
    pub(super) fn refuse_at_the_pendant(&mut self) -> Result<(), PluginError> {
        let Mode::AtThePendant(mode) = self.mode else { return Ok(()) };
        if self.drive_by_hand()?.finished != 0 {
            return Ok(());
        }
        Err(PluginError::NotReady(
            match mode {
                PendantMode::HandControl => {
                    "the arm is under hand control, which nothing but its pendant ends: press STOP on the pendant"
                }
                PendantMode::TaughtProgram => {
                    "the taught program runs, and nothing but the pendant stops it before its end: press STOP on the pendant"
                }
            }
            .to_owned(),
        ))
    }

    fn begin(&mut self) -> Result<(), PluginError> {
        let Some(mode) = self.configuration.pendant else {
            return Err(PluginError::Refused(
                "under hand control nothing but the pendant stops the arm; if an operator stands at it, confirm that in the cell file with `only_the_pendant_stops: [hand_control]`"
                    .to_owned(),
            ));
        };
        if let Mode::Doubtful(reason) = &self.mode {
            return Err(PluginError::NotReady(format!(
                "the arm is not handed over after a failed conversation ({reason}): look where it is, then activate it again"
            )));
        }
        self.observe(None)?;
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        self.controller.begin(mode, OnlyThePendantStopsIt::confirmed_by_the_operator())?;
        self.mode = Mode::AtThePendant(mode);
        let name = mode.name();
        let text = format!("{name}: from here on only the STOP key on the pendant stops the arm");
        self.host.log(LogLevel::Warn, &text);
        Ok(())
    }

    fn ended(&mut self, mode: PendantMode, status: Status) -> Result<JogState, PluginError> {
        if (mode, status) == (PendantMode::TaughtProgram, Status::Refused) {
            self.mode = Mode::Ready;
            return Err(PluginError::Refused(
                "the controller refused @RUN: no program is taught to it; name one in the cell file with `taught_program: {write_from: FILE}`"
                    .to_owned(),
            ));
        }
        self.mode = Mode::GivenBack;
        self.observe(None)?;
        // The operator ends it with the STOP key.
        self.stop_key = false;
        let state = JogState { state: self.report_rest()?, ..self.finished() };
        let how = match (mode, status) {
            (PendantMode::TaughtProgram, Status::StopKey) => "was ended by the STOP key on the pendant",
            _ => "has ended",
        };
        self.host.log(LogLevel::Info, &format!("{} {how}: {}", mode.name(), self.pose_in_words()));
        Ok(state)
    }

    /// Meanwhile the controller answers nothing: the joints are those from before.
    fn under_way(&self) -> JogState {
        JogState { state: self.joint_state(true), key: u32::from(self.last.key.0), finished: 0 }
    }

    fn finished(&self) -> JogState {
        JogState { state: self.joint_state(false), key: u32::from(self.last.key.0), finished: 1 }
    }
}
