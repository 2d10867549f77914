//! `declare`

use plumb_plugin::JointVector;
use plumb_record::{Budget, CONTROLLER_ZERO, CorrectionKey, NewCorrection};
use serde_json::json;

use crate::engine::Engine;
use crate::engine::journal::Question;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::in_words::give_or_take;
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::step::DeclareStep;

/// How far a joint may read from what was declared, in steps of its drive.
const STEPS_APART: f64 = 2.0;

impl Engine {
    pub(super) fn execute_declare(
        &mut self,
        step: &DeclareStep,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        let here = self.read_pose(&step.robot)?.joints;
        let (declared, corrections) = self.declaration(step, at, &here)?;
        let cell = self.cell.name.clone();
        let numbers = self.journal.proposed(&at.path, &cell, &corrections)?;
        if step.ask && !self.is_declaration_accepted(&corrections, at)? {
            let message = "the zeros were left as they are".to_owned();
            let joints = joints_value(&self.arm(&step.robot)?.named(&here));
            return Ok(Done {
                result: json!({"declared": false, "joints": joints}),
                values: Vec::new(),
                message,
            });
        }
        self.standing.forget();
        let set = self.arm(&step.robot)?.link.set_zero(&declared);
        set.map_err(|error| self.device_error(error))?;
        let now = self.read_pose(&step.robot)?.joints;
        self.require_declared(step, &declared, &now)?;
        let reason = format!("run {}, step {}", self.journal.run, at.path);
        self.journal.applied(&cell, &step.robot, &numbers, &corrections, &reason)?;
        let joints = self.arm(&step.robot)?.named(&now);
        let shifts = corrections
            .iter()
            .map(|one| format!("{} {:.3} -> {:.3} {}", one.key.place, one.old, one.new, one.unit));
        let message = format!("reads from now on: {}", shifts.collect::<Vec<_>>().join(", "));
        Ok(Done {
            result: json!({"declared": true, "joints": joints_value(&joints)}),
            values: corrections.iter().map(shown).collect(),
            message,
        })
    }

    /// What the joints shall read (the drive's numbers), and for each that is named what it read and shall read.
    fn declaration(
        &mut self,
        step: &DeclareStep,
        at: &StepContext,
        here: &JointVector,
    ) -> Result<(JointVector, Vec<NewCorrection>), StepError> {
        let mut declared = *here;
        let mut corrections = Vec::new();
        for joint in &step.joints {
            let value = self.number(at.scope, &joint.value)?;
            let budget = self.stated_uncertainty(step, at, &joint.joint)?;
            let arm = self.arm(&step.robot)?;
            let Some(column) = arm.column(&joint.joint) else { continue };
            let zero = arm.zero(column);
            let old = joint.unit.from_internal(here.get(column).unwrap_or(0.0) + zero);
            let unit = joint.unit.symbol();
            if (value - old).abs() > step.plausible {
                return Err(StepError::error(format!(
                    "{} reads {old:.3} {unit} and would have to read {value:.3} {unit}: a shift of more than the {} {unit} that are plausible. \
                     Nothing was changed; bring the arm to the pose first",
                    joint.joint, step.plausible
                )));
            }
            declared.set(column, joint.unit.to_internal(value) - zero);
            let key = CorrectionKey {
                device: step.robot.clone(),
                quantity: CONTROLLER_ZERO.to_owned(),
                place: joint.joint.clone(),
            };
            let uncertainty = budget.as_ref().and_then(Budget::standard);
            corrections.push(NewCorrection {
                key,
                old,
                new: value,
                uncertainty,
                budget,
                unit: unit.to_owned(),
            });
        }
        Ok((declared, corrections))
    }

    /// What the procedure says of the uncertainty of a joint's zero; none where it says nothing: that was not determined.
    fn stated_uncertainty(
        &mut self,
        step: &DeclareStep,
        at: &StepContext,
        joint: &str,
    ) -> Result<Option<Budget>, StepError> {
        let Some(known) = step.uncertainties.iter().find(|known| known.joint == joint) else {
            return Ok(None);
        };
        self.stated(&known.value, known.unit.symbol(), at)
    }

    fn is_declaration_accepted(
        &mut self,
        corrections: &[NewCorrection],
        at: &StepContext,
    ) -> Result<bool, StepError> {
        let lines = corrections.iter().map(|one| {
            let (place, unit) = (&one.key.place, &one.unit);
            let around = give_or_take(one.uncertainty, unit);
            format!("{place}: reads {:.3}, shall read {:.3} {unit} ({around})", one.old, one.new)
        });
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Question {
            step: &at.path,
            title: &at.title,
            text: format!(
                "Have the controller take where the arm stands now for this pose?\n{}",
                lines.collect::<Vec<_>>().join("\n")
            ),
            help: Some(
                "The controller keeps this and uses it in every later move. What it read before is kept in the record; only bringing the arm to a pose and declaring that anew changes it again.".to_owned(),
            ),
            kind: PromptKind::Choice {
                options: vec![
                    option("accept", "Have the controller take it so"),
                    option("reject", "Leave its zeros as they are"),
                ],
                default: Some("accept".to_owned()),
            },
        };
        Ok(self.ask(question, at)? == Answer::Choice { key: "accept".to_owned() })
    }

    /// A controller that does not read what it was told has not taken it over.
    fn require_declared(
        &mut self,
        step: &DeclareStep,
        declared: &JointVector,
        now: &JointVector,
    ) -> Result<(), StepError> {
        let arm = self.arm(&step.robot)?;
        for column in 0..arm.description.joints.len() {
            let (Some(wanted), Some(reads)) = (declared.get(column), now.get(column)) else { continue };
            let apart = (wanted - reads).abs();
            if apart > STEPS_APART * arm.resolution(column) + 1e-6 {
                let unit = arm.unit(column);
                return Err(StepError::error(format!(
                    "{} was to read {:.3} {unit} and reads {:.3} {unit}: the controller did not take the pose over",
                    arm.joint_name(column),
                    unit.from_internal(wanted),
                    unit.from_internal(reads),
                    unit = unit.symbol()
                )));
            }
        }
        Ok(())
    }
}

fn shown(correction: &NewCorrection) -> NamedValue {
    NamedValue {
        name: format!("{} shifted", correction.key.place),
        value: correction.new - correction.old,
        unit: correction.unit.clone(),
        uncertainty: correction.uncertainty,
    }
}
