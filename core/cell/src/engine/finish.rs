//! The end of a sitting.

use plumb_record::{RecordError, record_option};

use super::Engine;
use super::run_loop::{RunEnd, describe};
use crate::event::{DeviceState, Event, LogLevel, RunOutcome};

impl Engine {
    /// Brings the robots to rest, writes the end down and shuts the devices down. A run that needs something before it can go on leaves its
    /// simulated world alive, so that it can be resumed there.
    pub(crate) fn finish(mut self, end: RunEnd) -> Result<RunOutcome, RecordError> {
        if end.outcome != RunOutcome::Passed {
            self.note_where_robots_came_to_rest()?;
        }
        self.stops.clear();
        for arm in &mut self.arms {
            if self.lost.contains(&arm.name) {
                continue;
            }
            if let Err(error) = arm.link.deactivate() {
                self.journal.log(LogLevel::Warning, &arm.name, None, &error.to_string())?;
            }
            self.journal.device(&arm.name, &arm.plugin, DeviceState::Finalized, None);
        }
        for sensor in self.sensors.iter().filter(|sensor| !self.lost.contains(&sensor.name)) {
            self.journal.device(&sensor.name, &sensor.plugin, DeviceState::Finalized, None);
        }
        let resumable = matches!(end.outcome, RunOutcome::Error | RunOutcome::NeedsOperator);
        let message = match resumable {
            true => format!(
                "{} (go on with: plumb run --resume {}{})",
                end.message,
                self.journal.run,
                record_option(self.journal.record.directory())
            ),
            false => end.message,
        };
        // Written down before the world goes: a program killed here has nothing left to resume.
        self.journal.run_ended(end.outcome, &message)?;
        self.arms.clear();
        self.sensors.clear();
        self.links.shut_down(resumable);
        self.take_in_log(None)?;
        if !resumable {
            self.journal.record.set_world(self.journal.run, None)?;
        }
        self.journal.show(Event::RunEnded { run: self.journal.run.0, outcome: end.outcome, message });
        Ok(end.outcome)
    }

    /// A run that ends in the middle of a motion leaves a robot elsewhere than its steps do. The next run compares that with what the drive reads.
    fn note_where_robots_came_to_rest(&mut self) -> Result<(), RecordError> {
        for index in 0..self.arms.len() {
            let Some(name) = self.arms.get(index).map(|arm| arm.name.clone()) else { continue };
            if self.lost.contains(&name) {
                continue;
            }
            self.pose_cache.forget();
            match self.read_pose_anywhere(&name) {
                Ok(state) => {
                    self.moved.insert(name, state.joints);
                }
                Err(error) => self.journal.log(LogLevel::Warning, &name, None, &describe(&error))?,
            }
        }
        self.note_poses()
    }
}
