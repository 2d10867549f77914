//! Driving the arm by hand, from its pendant.

use plumb_plugin::{JogState, LogLevel, PluginError};

use super::{Mode, TeachMover};
use crate::controller::OnlyThePendantStopsIt;
use crate::protocol::Command;

impl TeachMover {
    /// Hands the arm to the pendant, or looks whether the operator has ended it.
    pub(super) fn drive_by_hand(&mut self) -> Result<JogState, PluginError> {
        match self.mode {
            Mode::HandControl => {}
            Mode::HandControlEnded => {
                self.observe(None)?;
                return Ok(self.finished());
            }
            Mode::Ready | Mode::Doubtful(_) => {
                self.begin()?;
                return Ok(self.under_way());
            }
        }
        match self.controller.reply_at_hand(&Command::HandControl) {
            Ok(None) => Ok(self.under_way()),
            Ok(Some(_)) => self.ended(),
            Err(error) => {
                let error = PluginError::from(error);
                self.mode = Mode::Ready;
                self.doubt_after(&error);
                Err(error)
            }
        }
    }

    /// Takes the arm back, which only the operator can do.
    pub(super) fn end_driving_by_hand(&mut self) -> Result<JogState, PluginError> {
        if matches!(self.mode, Mode::HandControl) {
            let state = self.drive_by_hand()?;
            if state.finished == 0 {
                self.refuse_under_hand_control()?;
            }
            self.mode = Mode::Ready;
            return Ok(state);
        }
        if matches!(self.mode, Mode::HandControlEnded) {
            self.mode = Mode::Ready;
        }
        self.observe(None)?;
        Ok(self.finished())
    }

    /// Refuses everything while the operator has the arm.
    pub(super) fn refuse_under_hand_control(&mut self) -> Result<(), PluginError> {
        if matches!(self.mode, Mode::HandControl) && self.drive_by_hand()?.finished == 0 {
            return Err(PluginError::NotReady(
                "the arm is under hand control, which nothing but its pendant ends: press STOP on the pendant".to_owned(),
            ));
        }
        Ok(())
    }

    fn begin(&mut self) -> Result<(), PluginError> {
        if !self.configuration.hand_control {
            return Err(PluginError::Refused(
                "under hand control nothing but the pendant stops the arm; if an operator stands at it, confirm that in the cell file with `only_the_pendant_stops: [hand_control]`"
                    .to_owned(),
            ));
        }
        if let Mode::Doubtful(reason) = &self.mode {
            return Err(PluginError::NotReady(format!(
                "the arm is not handed over after a failed conversation ({reason}): look where it stands, then activate it again"
            )));
        }
        self.observe(None)?;
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        self.controller.begin_hand_control(OnlyThePendantStopsIt::confirmed_by_the_operator())?;
        self.mode = Mode::HandControl;
        self.host
            .log(LogLevel::Warn, "hand control: from here on only the STOP key on the pendant stops the arm");
        Ok(())
    }

    fn ended(&mut self) -> Result<JogState, PluginError> {
        self.mode = Mode::HandControlEnded;
        self.observe(None)?;
        // The operator ends it with the STOP key.
        self.stop_key = false;
        let state = JogState { state: self.tell_rest()?, ..self.finished() };
        self.host.log(LogLevel::Info, &format!("hand control has ended: {}", self.pose_in_words()));
        Ok(state)
    }

    /// While the operator drives, the controller answers nothing: the joints are those from before.
    fn under_way(&self) -> JogState {
        JogState { state: self.joint_state(true), key: u32::from(self.last.key.0), finished: 0 }
    }

    fn finished(&self) -> JogState {
        JogState { state: self.joint_state(false), key: u32::from(self.last.key.0), finished: 1 }
    }
}
