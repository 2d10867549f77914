//! `declare`: a robot's controller takes where the arm is for a stated pose from now on.

use plumb_document::{MapReader, Node, Span};
use plumb_plugin::JointVector;
use plumb_record::{Budget, CONTROLLER_ZERO, CorrectionKey, NewCorrection};
use serde_json::json;

use super::declaration::{Action, StepQuestion};
use super::joint_targets::{JointTargets, read_pair};
use super::kind::{Kind, StepKind};
use super::time::{EXCHANGE_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::journal::Question;
use crate::engine::scope::joints_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Shape;
use crate::in_words::give_or_take;
use crate::prompt::{Answer, ChoiceOption, PromptKind};
use crate::read_context::ReadContext;

/// A declared calibration of a controller's own zeros.
#[derive(Debug, Clone)]
pub(crate) struct DeclareStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// What the joints shall read from now on; joints not named read what they read.
    pub(crate) joints: JointTargets,
    /// One standard uncertainty of that, or its budget, for the record; what is left out was not determined.
    pub(crate) uncertainties: JointTargets,
    /// A greater shift is a mistake, not a correction: degrees or mm.
    pub(crate) plausible: f64,
    /// A person (or the answers file) accepts it first.
    pub(crate) ask: bool,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<DeclareStep> {
    let mut map = MapReader::new(node, "`declare`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let joints = read_pair(&mut map, "as_deg", "as_mm", context);
    let uncertainties = read_pair(&mut map, "uncertainty_deg", "uncertainty_mm", context);
    let plausible = context.number_or(&mut map, "plausible", (1e-6, 1e4), 10.0);
    let ask = map.optional("ask").and_then(|node| node.boolean("`ask`", context.problems)).unwrap_or(true);
    let span = map.span();
    map.finish();
    if joints.is_empty() {
        let help = "give what the joints shall read, as in `as_deg: {shoulder: -90, elbow: 90}`";
        context.problems.add(span, "this declares no joint", help);
        return None;
    }
    let (robot, robot_span) = robot?;
    Some(DeclareStep { robot, robot_span, joints, uncertainties, plausible, ask })
}

impl Action for DeclareStep {
    fn check(&self, context: &CheckContext<'_>) {
        let robot = context.robot(&self.robot, self.robot_span);
        for joint in self.joints.iter().chain(&self.uncertainties) {
            joint.check(robot, context);
        }
    }

    fn result_shape(&self, cell: &CellNames) -> Shape {
        Shape::Map(vec![
            ("declared".to_owned(), Shape::Single),
            ("joints".to_owned(), cell.joints_shape(&self.robot)),
        ])
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(EXCHANGE_S)
    }

    fn question(&self) -> Option<StepQuestion<'_>> {
        self.ask.then_some(StepQuestion::Acceptance)
    }
}

pub(super) const KIND: Kind = Kind::entry::<DeclareStep>();

impl StepKind for DeclareStep {
    const NAME: &'static str = "declare";
    const SENTENCE: &'static str = "has a robot's controller take the arm's position for a stated pose from now on: its own zeros are set";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["robot"],
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "as_deg": {"description": "What the joints shall read where they stand.", "$ref": "#/definitions/joint_numbers"},
    "as_mm": {"description": "What the joints shall read where they stand.", "$ref": "#/definitions/joint_numbers"},
    "uncertainty_deg": {"$ref": "#/definitions/joint_numbers"},
    "uncertainty_mm": {"$ref": "#/definitions/joint_numbers"},
    "plausible": {"description": "A greater shift is a mistake, not a correction.", "type": "number", "minimum": 0.000001, "maximum": 10000},
    "ask": {"description": "A person (or the answers) accepts it first; true if left out.", "type": "boolean"}
  },
  "anyOf": [{"required": ["as_deg"]}, {"required": ["as_mm"]}]
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_declare(self, at)
    }
}

/// How far a joint may read from what was declared, in steps of its drive.
const STEPS_APART: f64 = 2.0;

impl Engine {
    fn execute_declare(&mut self, step: &DeclareStep, at: &StepContext) -> Result<Done, StepError> {
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
        self.pose_cache.forget();
        let set = self.arm(&step.robot)?.link.set_zero(&declared);
        set.map_err(|error| self.device_error(error))?;
        let now = self.read_pose(&step.robot)?.joints;
        self.require_declared(step, &declared, &now)?;
        let reason = format!("run {}, step {}", self.journal.run, at.path);
        self.journal.applied(&cell, &step.robot, &numbers, &corrections, &reason)?;
        let joints = self.arm(&step.robot)?.named(&now);
        let shifts = corrections
            .iter()
            .map(|one| format!("{} {:.3} -> {:.3} {}", one.key.site, one.old, one.new, one.unit));
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
            let index = arm.joint(&joint.joint)?;
            let zero = arm.zero(index);
            let old = joint.unit.from_internal(index.value(here)? + zero);
            let unit = joint.unit.symbol();
            let shift = (value - old).abs();
            if shift.is_nan() || shift > step.plausible {
                return Err(StepError::error(format!(
                    "{} reads {old:.3} {unit} and would have to read {value:.3} {unit}: a shift of more than the {} {unit} that are plausible. \
                     Nothing was changed; bring the arm to the pose first",
                    joint.joint, step.plausible
                )));
            }
            index.set(&mut declared, joint.unit.to_internal(value) - zero)?;
            let key = CorrectionKey {
                device: step.robot.clone(),
                quantity: CONTROLLER_ZERO.to_owned(),
                site: joint.joint.clone(),
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
            let (site, unit) = (&one.key.site, &one.unit);
            let around = give_or_take(one.uncertainty, unit);
            format!("{site}: reads {:.3}, shall read {:.3} {unit} ({around})", one.old, one.new)
        });
        let option = |key: &str, label: &str| ChoiceOption { key: key.to_owned(), label: label.to_owned() };
        let question = Question {
            step: &at.path,
            title: &at.title,
            text: format!(
                "Have the controller take the arm's present position for this pose?\n{}",
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
            simulated: false,
        };
        Ok(self.ask(question, at)? == Answer::Choice { key: "accept".to_owned() })
    }

    /// A controller that does not read what it was given has not taken it over.
    fn require_declared(
        &mut self,
        step: &DeclareStep,
        declared: &JointVector,
        now: &JointVector,
    ) -> Result<(), StepError> {
        let arm = self.arm(&step.robot)?;
        for joint in arm.joints() {
            let (requested, reads) = (joint.value(declared)?, joint.value(now)?);
            let apart = (requested - reads).abs();
            if apart > STEPS_APART * arm.resolution(joint) + 1e-6 {
                let unit = arm.unit(joint);
                return Err(StepError::error(format!(
                    "{} was to read {:.3} {unit} and reads {:.3} {unit}: the controller did not take the pose over",
                    arm.joint_name(joint),
                    unit.from_internal(requested),
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
        name: format!("{} shifted", correction.key.site),
        value: correction.new - correction.old,
        unit: correction.unit.clone(),
        uncertainty: correction.uncertainty,
    }
}
