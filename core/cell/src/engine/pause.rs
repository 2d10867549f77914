//! Pausing: nothing moves until an explicit resume.

use std::time::Duration;

use plumb_record::Interruption;

use super::Engine;
use super::inbox::Interrupt;
use super::step_error::StepError;
use crate::command::Command;
use crate::event::{DeviceState, Event, StepPath};

impl Engine {
    /// Waits until someone resumes. Then robots may move again.
    ///
    /// # Errors
    /// When someone ends the run instead, or a robot cannot be made ready again.
    pub(crate) fn pause(
        &mut self,
        interrupt: Interrupt,
        step: Option<&StepPath>,
        reason: &str,
    ) -> Result<(), StepError> {
        if interrupt == Interrupt::Stop {
            self.journal.interruption(Interruption::Stopped, step, reason)?;
            self.journal.show(Event::Stopped { reason: reason.to_owned() });
        }
        self.journal.interruption(Interruption::Paused, step, reason)?;
        let mut reason = reason.to_owned();
        for arm in self.arms.iter_mut().filter(|arm| !self.lost.contains(&arm.name)) {
            if let Err(error) = arm.link.deactivate() {
                reason = format!("{reason}; {error}");
            }
        }
        self.show_robots(DeviceState::Inactive);
        self.take_in_log(step)?;
        self.journal.show(Event::Paused { step: step.cloned(), reason });
        loop {
            match self.inbox.next(Duration::from_millis(200)) {
                Some(Command::Resume) => break,
                Some(command) => match self.inbox.as_interrupt(&command) {
                    Some(Interrupt::Stop) => {
                        self.journal.interruption(Interruption::Stopped, step, "stopped by the operator")?;
                        self.journal.show(Event::Stopped { reason: "stopped by the operator".to_owned() });
                    }
                    Some(
                        end @ (Interrupt::Abort
                        | Interrupt::Finish
                        | Interrupt::Keep
                        | Interrupt::FromOutside { .. }),
                    ) => {
                        return Err(super::interrupted(end));
                    }
                    Some(Interrupt::Pause) | None => {}
                },
                None => {}
            }
        }
        self.inbox.pause_before_next = false;
        self.journal.interruption(Interruption::Resumed, step, "resumed by the operator")?;
        self.journal.show(Event::Resumed);
        self.activate_robots()
    }

    /// Lets every robot that is there move (again).
    pub(crate) fn activate_robots(&mut self) -> Result<(), StepError> {
        for index in 0..self.arms.len() {
            let Some(arm) = self.arms.get_mut(index) else { continue };
            if self.lost.contains(&arm.name) {
                continue;
            }
            self.pose_cache.forget();
            let activated = arm.link.activate();
            let (name, plugin) = (arm.name.clone(), arm.plugin.clone());
            activated.map_err(|error| self.device_error(error))?;
            self.journal.device(&name, &plugin, DeviceState::Active, None);
        }
        Ok(())
    }

    pub(crate) fn show_robots(&self, state: DeviceState) {
        for arm in self.arms.iter().filter(|arm| !self.lost.contains(&arm.name)) {
            self.journal.device(&arm.name, &arm.plugin, state, None);
        }
    }
}
