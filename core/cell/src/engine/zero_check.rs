//! Whether the zeros found before still hold, looked at when a robot is connected. The decision itself is in `zero_trust`.

use std::time::Instant;

use plumb_plugin::JointVector;
use plumb_record::{AppliedCorrection, JOINT_ZERO, LastPose, RecordError};
use serde_json::Value;

use super::Engine;
use super::arm::{Arm, zero_in_force};
use super::joint_index::JointIndex;
use super::journal::{Attempt, Question};
use super::motion::joint_vector;
use super::plan::Entry;
use super::prompting::Received;
use super::step_context::StepContext;
use super::step_error::StepError;
use super::zero_trust::{
    Consequence, Evidence, JointThen, MayBe, Situation, Stage, Verdict, consequence, judge,
};
use crate::event::{Event, LogLevel, StepPath};
use crate::prompt::{Answer, ChoiceOption, PromptKind};

impl Engine {
    /// The corrections of a robot in force, without zeros that it has lost since they were found.
    pub(crate) fn zeros_in_force(&self, robot: &str) -> Result<Vec<AppliedCorrection>, RecordError> {
        let record = &self.journal.record;
        let cell = &self.cell.name;
        let mut corrections = record.corrections_in_force(cell, robot)?;
        let Some(loss) = record.zero_loss(cell, robot)? else { return Ok(corrections) };
        let mut lost = Vec::new();
        for correction in corrections.iter().filter(|known| known.key.quantity == JOINT_ZERO) {
            if !record.was_found_since(cell, correction, &loss)? {
                lost.push(correction.key.clone());
            }
        }
        corrections.retain(|known| !lost.contains(&known.key));
        Ok(corrections)
    }

    /// Reads the zeros in force from the record.
    pub(crate) fn take_over_zeros(&mut self, robot: &str) -> Result<(), StepError> {
        let corrections = self.zeros_in_force(robot)?;
        let trusted = self.trusts_zeros(robot);
        if let Some(arm) = self.arms.iter_mut().find(|arm| arm.name == robot) {
            arm.set_zeros(&corrections, trusted);
        }
        Ok(())
    }

    /// Looks at the zeros of every robot before anything moves.
    ///
    /// # Errors
    /// [`StepError::NeedsOperator`] where they do not hold and this run needs them.
    pub(crate) fn check_zeros(&mut self, first_time: bool) -> Result<(), StepError> {
        let stage = if first_time { Stage::AtTheStart } else { Stage::InMidRun };
        for index in 0..self.arms.len() {
            let Some(name) = self.arms.get(index).map(|arm| arm.name.clone()) else { continue };
            self.check_zeros_of(&name, stage)?;
            self.require_zeros(&name)?;
        }
        Ok(())
    }

    /// Looks at the zeros of one robot that was just connected.
    ///
    /// # Errors
    /// As [`Engine::check_zeros`].
    pub(crate) fn check_zeros_of(&mut self, robot: &str, stage: Stage) -> Result<(), StepError> {
        let last = self.journal.record.last_pose(&self.cell.name, robot)?;
        let verdict = judge(self.evidence(robot, last.as_ref())?);
        if verdict == Verdict::OnItsWay {
            let message =
                "it reads a place on the way of the move in which the last run was cut off: its zeros hold";
            self.journal.log(LogLevel::Info, robot, None, message)?;
        }
        if verdict.holds() {
            return Ok(());
        }
        let reason = self.what_was_noticed(robot, &verdict, last.as_ref())?;
        let situation = Situation {
            stage,
            finds_zeros: self.finds_zeros.iter().any(|name| name == robot),
            moves: self.is_moved(robot),
            attended: !self.unattended,
        };
        match consequence(&verdict, situation) {
            Consequence::Hold => Ok(()),
            Consequence::LoseAndGoOn => self.lose_zeros(robot, &reason),
            Consequence::Ask if self.ask_whether_zeros_hold(robot, &reason)? => {
                let message = format!("{reason}. The operator says that its power stayed on: its zeros hold");
                Ok(self.journal.log(LogLevel::Warning, robot, None, &message)?)
            }
            Consequence::Ask | Consequence::LoseAndEnd => {
                self.lose_zeros(robot, &reason)?;
                Err(StepError::NeedsOperator(format!(
                    "{robot} has lost its zeros: {reason}. {}",
                    self.how_to_find_zeros(robot)
                )))
            }
        }
    }

    /// A run that needs zeros which an earlier run saw lost does not begin.
    fn require_zeros(&mut self, robot: &str) -> Result<(), StepError> {
        if self.finds_zeros.iter().any(|name| name == robot) {
            return Ok(());
        }
        let all = self.journal.record.corrections_in_force(&self.cell.name, robot)?;
        let held = self.zeros_in_force(robot)?;
        let initialize = self.cell.robot(robot).map(|setting| setting.initialize.clone()).unwrap_or_default();
        let lost = initialize
            .iter()
            .find(|joint| zero_in_force(&all, joint).is_some() && zero_in_force(&held, joint).is_none());
        match lost.filter(|_| self.is_moved(robot)) {
            None => Ok(()),
            Some(joint) => Err(StepError::NeedsOperator(format!(
                "{robot} has lost the zero of its {joint}, and no run has found it since. {}",
                self.how_to_find_zeros(robot)
            ))),
        }
    }

    /// Whether a step of this run may move a robot.
    fn is_moved(&self, robot: &str) -> bool {
        let moves = |entry: &Entry| {
            entry.is_shown() && entry.step.action.moved_robots().iter().any(|name| name == robot)
        };
        self.plan.entries.iter().any(moves)
    }

    fn how_to_find_zeros(&self, robot: &str) -> String {
        let finds = |name: &String| name == robot;
        match self.cell.procedures.iter().find(|known| known.finds_zeros_of().iter().any(finds)) {
            Some(procedure) => format!("Find them with procedure `{}` first", procedure.name),
            None => "Find them with a procedure that says `finds_zeros` first".to_owned(),
        }
    }

    fn evidence(&mut self, robot: &str, last: Option<&LastPose>) -> Result<Evidence, StepError> {
        let held = self.zeros_in_force(robot)?;
        let initialize = self.cell.robot(robot).map(|setting| setting.initialize.clone()).unwrap_or_default();
        let has_zeros = initialize.iter().any(|joint| zero_in_force(&held, joint).is_some());
        let is_new_world = self.links.is_new_world();
        if !has_zeros || is_new_world {
            return Ok(Evidence { has_zeros, is_new_world, joints: None });
        }
        let reads = self.read_pose_anywhere(robot)?.joints;
        let arm = self.arm(robot)?;
        let joints = last.and_then(|last| joints_then(arm, last, &reads));
        Ok(Evidence { has_zeros, is_new_world, joints })
    }

    /// A sentence without its stop.
    fn what_was_noticed(
        &mut self,
        robot: &str,
        verdict: &Verdict,
        last: Option<&LastPose>,
    ) -> Result<String, StepError> {
        Ok(match verdict {
            Verdict::Elsewhere(joint) => {
                let arm = self.arm(robot)?;
                let unit = arm.unit(arm.joint(&joint.joint)?);
                let run = last.map_or(0, |last| last.run.0);
                format!(
                    "its drive reads {:.3} {unit} at the {}, and run {run} left it at {:.3} {unit}: it was switched off, or moved by somebody else",
                    unit.from_internal(joint.reads),
                    joint.joint,
                    unit.from_internal(joint.recorded),
                    unit = unit.symbol()
                )
            }
            _ => "the record does not know where its drive was left".to_owned(),
        })
    }

    /// Writes the loss down, and says it.
    fn lose_zeros(&mut self, robot: &str, reason: &str) -> Result<(), StepError> {
        let cell = self.cell.name.clone();
        self.journal.record.note_zero_loss(&cell, robot, self.journal.run, reason)?;
        let joints = self.cell.robot(robot).map(|setting| setting.initialize.clone()).unwrap_or_default();
        let message = format!(
            "{reason}. Until a run has found its zeros again it is elsewhere than its numbers say, and its keep-out planes are not watched"
        );
        self.journal.record.note_log(self.journal.run, "warning", robot, None, &message)?;
        self.journal.show(Event::ZerosLost { device: robot.to_owned(), joints, reason: message });
        self.take_over_zeros(robot)
    }

    fn ask_whether_zeros_hold(&mut self, robot: &str, reason: &str) -> Result<bool, StepError> {
        let path = StepPath("zeros".to_owned());
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Question {
            step: &path,
            title: "Do the zeros still hold?",
            text: format!(
                "{robot}: {reason}.\nIf its power was off, its zeros no longer hold and it would go elsewhere than it is sent."
            ),
            help: Some(
                "A drive that was only moved with its pendant has kept its count. One that was switched off counts anew from wherever it was."
                    .to_owned(),
            ),
            kind: PromptKind::Choice {
                options: vec![
                    option("lost", "Its power was off, or I do not know: find the zeros first"),
                    option("hold", "Its power stayed on, it was only moved: the zeros hold"),
                ],
                default: Some("lost".to_owned()),
            },
            simulated: false,
        };
        let prompt = self.journal.ask(question)?;
        let at = StepContext {
            path: path.clone(),
            title: String::new(),
            answer_name: "zeros".to_owned(),
            scope: 0,
            attempt: Attempt { row: 0, number: 1, started: Instant::now() },
            intent: None,
            limit: None,
        };
        loop {
            match self.receive(&prompt, &at)? {
                Received::Answer(answer, by) => {
                    self.journal.answered(&prompt, &answer, &by)?;
                    return Ok(answer == Answer::Choice { key: "hold".to_owned() });
                }
                Received::Jog { .. } | Received::HandOver => {
                    self.refuse(&prompt, "nothing is jogged in this prompt")
                }
                Received::Silence => {}
            }
        }
    }
}

/// Each joint as it was left and as it reads now; none where the record names other joints.
fn joints_then(arm: &Arm, last: &LastPose, reads: &JointVector) -> Option<Vec<JointThen>> {
    let intent = last
        .intent
        .as_ref()
        .filter(|intent| intent.get("robot").and_then(Value::as_str) == Some(arm.name.as_str()));
    let target = intent.and_then(|intent| joint_vector(intent.get("target")?));
    let searched = intent.and_then(|intent| intent.get("joint")?.as_str());
    let rows = last.joints.as_array()?;
    let then = |index: JointIndex| {
        let joint = arm.joint_name(index);
        let row = rows.iter().find(|row| row.get("name").and_then(Value::as_str) == Some(joint))?;
        let recorded = arm.unit(index).to_internal(row.get("drive").and_then(Value::as_f64)?);
        let may_be = match (&target, searched) {
            (Some(target), _) => MayBe::Towards(index.value(target).ok()?),
            (None, Some(searched)) if searched == joint => MayBe::Anywhere,
            _ => MayBe::There,
        };
        Some(JointThen {
            joint: joint.to_owned(),
            recorded,
            reads: index.value(reads).ok()?,
            resolution: arm.resolution(index),
            may_be,
        })
    };
    arm.joints().map(then).collect()
}
