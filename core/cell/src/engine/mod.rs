//! The engine: carries a procedure out in a cell, step by step, every transition written down before it is shown.

pub(crate) mod applied;
pub(crate) mod arm;
#[cfg(test)]
mod arm_tests;
mod attempts;
pub(crate) mod believed;
mod connect;
mod decide;
mod dry_run;
mod estimate;
mod event_sender;
mod execute;
mod finish;
pub(crate) mod flange;
mod found_before;
pub(crate) mod inbox;
pub(crate) mod joint_index;
pub(crate) mod journal;
mod manual_motion;
pub(crate) mod motion;
mod pause;
mod plan;
mod plan_geometry;
mod pose_cache;
pub(crate) mod prompting;
mod reach;
mod resume;
mod run_loop;
pub(crate) mod scan_state;
pub(crate) mod scope;
pub(crate) mod sensor_corrections;
mod sensor_reading;
mod settings;
mod start;
mod step_clock;
pub(crate) mod step_context;
pub(crate) mod step_error;
#[cfg(test)]
mod test_arm;
pub(crate) mod uncertainty;
mod ways_out;
mod zero_check;
mod zero_trust;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use plumb_plugin::{JointState, JointVector, Reading};
use serde_json::{Map, Value};

pub use sensor_corrections::sensor_corrections;

pub use crate::step::{JointFacts, PlannedMotion, RobotFacts};
pub use dry_run::{DryRun, DryStep, OpenRepetition, dry_run};
pub use event_sender::EventSender;
pub use plan::PlanError;
pub use start::{Connected, RunRequest, RunningRun, StartError, start_run};

use arm::Arm;
use believed::{RequestTimes, Source};
use inbox::{Inbox, Interrupt};
use journal::Journal;
use plan::Plan;
use pose_cache::PoseCache;
use scan_state::{Scan, ScanProgress};
use scope::joints_value;
use step_clock::StepClock;
use step_error::StepError;

use crate::answers::Answers;
use crate::device::{DeviceError, DeviceLinks, SensorLink};
use crate::event::{Event, LogLevel, StepPath};
use crate::expression::{Calculator, Expression};
use crate::prompt::PromptId;
use crate::run_handle::StopActions;
use crate::workcell::Workcell;

/// One sitting of one run.
pub(crate) struct Engine {
    pub(crate) cell: Arc<Workcell>,
    pub(crate) calculator: Arc<Calculator>,
    pub(crate) journal: Journal,
    pub(crate) inbox: Inbox,
    pub(crate) links: Box<dyn DeviceLinks>,
    pub(crate) stops: StopActions,
    pub(crate) arms: Vec<Arm>,
    pub(crate) sensors: Vec<Sensor>,
    /// What `configure` steps set on sensors in this run, by sensor.
    pub(crate) settings: BTreeMap<String, Map<String, Value>>,
    /// Devices whose process was lost.
    pub(crate) lost: Vec<String>,
    /// Robots whose zeros this run is to find.
    pub(crate) finds_zeros: Vec<String>,
    /// Robots that moved since their position was last written down, and where they came to rest.
    pub(crate) moved: BTreeMap<String, JointVector>,
    /// Where robots were last seen to be, as long as nothing but this run can have moved them.
    pub(crate) pose_cache: PoseCache,
    /// When the last motion ended, ns of the cell's clock: a reading of before does not belong to where the robots are. 0 before any.
    pub(crate) rest_ns: u64,
    /// The clock of the cell, as the step in hand has seen it go.
    pub(crate) clock: Arc<StepClock>,
    pub(crate) answers: Option<Answers>,
    pub(crate) unattended: bool,
    /// Who has left to the simulated world what it can do and read by itself, for the rest of the run.
    pub(crate) left_to_world_by: Option<String>,
    pub(crate) plan: Plan,
    /// The prompt and the number of an answer from elsewhere that is being looked at.
    pub(crate) offered: Option<(PromptId, i64)>,
    /// Where what a run makes, such as clouds of points, is put.
    pub(crate) outputs: PathBuf,
    /// The scan a pause has interrupted, with what it has made.
    pub(crate) paused_scan: Option<(StepPath, Scan, ScanProgress)>,
    /// A step failed, as a check that does not hold, and the run went on all the same: which entry of the plan, and what it said.
    pub(crate) failed_check: Option<(usize, String)>,
    /// What is known of the robots without asking them.
    pub(crate) facts: Vec<RobotFacts>,
    /// The entries of the plan whose results expressions see.
    pub(crate) with_results: BTreeSet<usize>,
}

/// A connected sensor.
pub(crate) struct Sensor {
    pub(crate) name: String,
    pub(crate) plugin: String,
    pub(crate) link: Box<dyn SensorLink>,
}

impl Engine {
    pub(crate) fn arm(&mut self, name: &str) -> Result<&mut Arm, StepError> {
        let lost = self.lost.iter().any(|lost| lost == name);
        let arm = self.arms.iter_mut().find(|arm| arm.name == name).filter(|_| !lost);
        arm.ok_or_else(|| StepError::Lost {
            device: name.to_owned(),
            message: format!("{name} is not connected"),
        })
    }

    pub(crate) fn sensor(&mut self, name: &str) -> Result<&mut Sensor, StepError> {
        let lost = self.lost.iter().any(|lost| lost == name);
        let sensor = self.sensors.iter_mut().find(|sensor| sensor.name == name).filter(|_| !lost);
        sensor.ok_or_else(|| StepError::Lost {
            device: name.to_owned(),
            message: format!("{name} is not connected"),
        })
    }

    /// Takes in commands; gives up where one interrupts.
    pub(crate) fn look_for_interrupt(&mut self) -> Result<(), StepError> {
        match self.inbox.interrupt() {
            Some(interrupt) => Err(interrupted(interrupt)),
            None => Ok(()),
        }
    }

    /// What a device's error means: a stop that was asked for is an interruption, and so is one at the pendant.
    pub(crate) fn device_error(&mut self, error: DeviceError) -> StepError {
        self.pose_cache.forget();
        if let Some(interrupt) = self.inbox.interrupt() {
            return interrupted(interrupt);
        }
        // A robot is stopped as soon as any device's process ends: then that is the reason.
        if error.is_stop()
            && let Some(lost) = self.links.lost().filter(|lost| !self.lost.contains(&lost.device))
        {
            return StepError::Lost { device: lost.device, message: lost.message };
        }
        if error.is_stop() {
            return StepError::Interrupted { interrupt: Interrupt::Stop, reason: error.to_string() };
        }
        StepError::from(error)
    }

    /// The values expressions see in a scope. Where the robots are is read only when an expression asks for it.
    pub(crate) fn values(
        &mut self,
        scope: usize,
        expressions: &[&str],
    ) -> Result<Map<String, Value>, StepError> {
        let mut robots = Map::new();
        for index in 0..self.arms.len() {
            let Some(name) = self.arms.get(index).map(|arm| arm.name.clone()) else { continue };
            let asked = format!("{name}.joints");
            let mut entries = Map::new();
            if let Some(Value::Object(model)) = self.model_values().remove(&name) {
                entries = model;
            }
            if expressions.iter().any(|text| text.contains(&asked)) {
                let state = self.read_pose(&name)?;
                let named = self.arm(&name)?.named(&state.joints);
                entries.insert("joints".to_owned(), joints_value(&named));
            }
            robots.insert(name, Value::Object(entries));
        }
        Ok(self.plan.scopes.get(scope).map(|scope| scope.values(robots)).unwrap_or_default())
    }

    /// What the robots' model files give to expressions.
    pub(crate) fn model_values(&self) -> Map<String, Value> {
        start::model_values(&self.cell)
    }

    pub(crate) fn number(&mut self, scope: usize, expression: &Expression) -> Result<f64, StepError> {
        let values = self.values(scope, &[expression.text()])?;
        Ok(expression.number(&self.calculator, &values)?)
    }

    /// Where a robot is, read now and shown; or as it was seen to be a moment ago, where nothing can have moved it since.
    ///
    /// # Errors
    /// Also when it says what cannot be, or that it is beyond its own limits.
    pub(crate) fn read_pose(&mut self, name: &str) -> Result<JointState, StepError> {
        let state = self.read_pose_anywhere(name)?;
        self.arm(name)?.check_own_limits(&state.joints).map_err(StepError::Error)?;
        Ok(state)
    }

    /// As [`Engine::read_pose`] of a robot that may be beyond its own limits, because it is about to be brought back.
    pub(crate) fn read_pose_anywhere(&mut self, name: &str) -> Result<JointState, StepError> {
        let known = self.pose_cache.fresh(name);
        let asked = self.links.clock_ns();
        let arm = self.arm(name)?;
        if let Some(state) = known {
            return Ok(state);
        }
        let read = arm.link.read_joints();
        let state = read.map_err(|error| self.device_error(error))?;
        self.believe_state(name, &state, asked)?;
        self.saw(name, &state)?;
        Ok(state)
    }

    /// Takes a state for true once it was looked at. `asked_ns` is when it was asked for, where the cell's clock can be read.
    pub(crate) fn believe_state(
        &mut self,
        name: &str,
        state: &JointState,
        asked_ns: Option<u64>,
    ) -> Result<(), StepError> {
        let between_ns = asked_ns.zip(self.links.clock_ns());
        self.arm(name)?.believe_state(state, between_ns).map_err(StepError::Error)
    }

    /// What a sensor has seen up to `after_ns`, once it was looked at: nothing that is dated before `not_before_ns`.
    pub(crate) fn read_sensor(
        &mut self,
        name: &str,
        after_ns: u64,
        not_before_ns: u64,
    ) -> Result<Reading, StepError> {
        let asked_ns = self.links.clock_ns();
        let read = self.sensor(name)?.link.read(after_ns);
        let reading = read.map_err(|error| self.device_error(error))?;
        let between_ns = asked_ns.zip(self.links.clock_ns());
        let sensor = self.sensor(name)?;
        let source = Source { device: name, plugin: &sensor.plugin };
        let asked = RequestTimes { reported_before_ns: 0, between_ns };
        believed::check_reading(source, sensor.link.description(), &reading, not_before_ns, asked)
            .map_err(StepError::Error)?;
        Ok(reading)
    }

    /// Takes in and shows where a robot says it is.
    pub(crate) fn saw(&mut self, name: &str, state: &JointState) -> Result<(), StepError> {
        self.clock.saw(state.time_ns);
        self.pose_cache.saw(name, state);
        self.show_pose(name, state)
    }

    pub(crate) fn show_pose(&mut self, name: &str, state: &JointState) -> Result<(), StepError> {
        let arm = self.arm(name)?;
        let joints = arm.named(&state.joints);
        let event = Event::Joints {
            device: name.to_owned(),
            time_ns: state.time_ns,
            moving: state.is_moving(),
            joints,
        };
        let planes = arm.clearances(&state.joints);
        self.journal.show(event);
        if !planes.is_empty() {
            self.journal.show(Event::Clearance { device: name.to_owned(), planes });
        }
        Ok(())
    }

    /// Writes down where the robots that moved came to rest, for a resume.
    pub(crate) fn note_poses(&mut self) -> Result<(), plumb_record::RecordError> {
        for (name, joints) in std::mem::take(&mut self.moved) {
            if let Some(arm) = self.arms.iter().find(|arm| arm.name == name) {
                let recorded = arm.recorded(&joints);
                self.journal.pose(&name, &recorded)?;
            }
        }
        Ok(())
    }

    /// Reads where every robot is and writes it down.
    pub(crate) fn read_and_note_poses(&mut self) -> Result<(), StepError> {
        for index in 0..self.arms.len() {
            let Some(name) = self.arms.get(index).map(|arm| arm.name.clone()) else { continue };
            let state = self.read_pose_anywhere(&name)?;
            if let Err(beyond) = self.arm(&name)?.check_own_limits(&state.joints) {
                self.journal.log(LogLevel::Warning, &name, None, &beyond)?;
            }
            self.moved.insert(name, state.joints);
        }
        Ok(self.note_poses()?)
    }
}

pub(crate) fn interrupted(interrupt: Interrupt) -> StepError {
    let reason = match interrupt {
        Interrupt::Pause => "paused by the operator",
        Interrupt::Stop => "stopped by the operator",
        Interrupt::Abort => "aborted by the operator",
        Interrupt::Finish => "finished early by the operator",
        // The operator left, or the arm was stopped with nobody there to go on.
        Interrupt::Keep => "kept for later",
        Interrupt::FromOutside { by, .. } => {
            return StepError::Interrupted { interrupt, reason: format!("ended by {by}") };
        }
    };
    StepError::Interrupted { interrupt, reason: reason.to_owned() }
}
