//! How each kind of step is carried out, one a file.

mod apply;
mod check;
mod compute;
mod configure;
mod correct;
mod declare;
mod flight;
mod jog;
mod measure;
mod move_joints;
mod pendant;
mod prompt;
mod row;
mod scan;
mod search;
mod unusual;

pub(crate) use correct::SENSOR_PARAMETER;
pub use correct::sensor_corrections;
pub(super) use measure::result_name;
pub(super) use move_joints::joint_vector;
pub(super) use scan::{Made, Scan, attitude_of, flange_at};
pub(crate) use search::CIRCUMSTANCES;

use super::Engine;
use super::step_context::{Done, StepContext};
use super::step_error::StepError;
use crate::step::{Action, Step};

impl Engine {
    /// Carries out a step that has no steps inside.
    pub(super) fn execute(&mut self, step: &Step, at: &StepContext) -> Result<Done, StepError> {
        match &step.action {
            Action::Prompt(prompt) => self.execute_prompt(prompt, at),
            Action::Move(motion) => self.execute_move(motion, at),
            Action::Search(search) => self.execute_search(search, at),
            Action::Compute(compute) => self.execute_compute(compute, at),
            Action::Check(check) => self.execute_check(check, at),
            Action::Apply(apply) => self.execute_apply(apply, at),
            Action::Correct(correct) => self.execute_correct(correct, at),
            Action::Configure(configure) => self.execute_configure(configure),
            Action::Measure(measure) => self.execute_measure(measure, at),
            Action::Row(row) => self.execute_row(row, at),
            Action::Scan(scan) => self.execute_scan(scan, at),
            Action::Declare(declare) => self.execute_declare(declare, at),
            Action::Repeat(_) | Action::Call(_) => Ok(Done::default()),
        }
    }
}
