//! The steps a procedure is made of, as they are declared: one kind a file. How they are carried out is the engine's.

mod apply;
mod call;
mod check;
mod compute;
mod configure;
mod correct;
mod declare;
mod error_terms;
mod joint_targets;
mod measure;
mod move_joints;
mod prompt;
mod repeat;
mod row;
mod scan;
mod search;

use std::time::Duration;

pub use apply::{ApplyStep, ShiftUncertainty, ZeroShift};
pub use call::CallStep;
pub use check::CheckStep;
pub(crate) use compute::BUDGET;
pub use compute::ComputeStep;
pub use configure::ConfigureStep;
pub use correct::{Change, CorrectStep, ParameterCorrection};
pub(crate) use correct::{key_of, name_and_unit};
pub use declare::DeclareStep;
pub use error_terms::{ErrorSize, ErrorTerm};
pub(crate) use error_terms::{INSTRUMENTS, TOLERANCES};
pub use joint_targets::{JointTarget, JointTargets};
pub use measure::MeasureStep;
pub use move_joints::{HandTarget, MoveStep, PointTarget};
pub use prompt::{Arrival, ArrivalSide, PromptStep, Question, SimulatedAct};
pub use repeat::{RepeatStep, Rows, Turns};
pub use row::RowStep;
pub use scan::{Fitted, ScanStep};
pub use search::{Approach, Finds, SearchStep};

use crate::expression::{Expression, Names, Shape};
use crate::procedure::CellNames;
use crate::prompt::Decision;
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, NodeValue, Place, did_you_mean};

/// One step of a procedure.
#[derive(Debug, Clone)]
pub struct Step {
    /// Unique in the procedure; results are called by it.
    pub id: String,
    /// Where the id stands.
    pub place: Place,
    /// For people.
    pub title: String,
    /// What it does.
    pub action: Action,
    /// Only when this holds; otherwise it is not needed.
    pub when: Option<Expression>,
    /// It fails when it takes longer.
    pub time_limit: Option<Duration>,
    /// What to do when it fails; left open, a person is asked, and an unattended run ends.
    pub on_error: Option<OnError>,
    /// How many times `retry` tries before the run ends.
    pub retries: u32,
}

/// What to do when a step fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnError {
    /// Ask a person.
    Ask,
    /// Do this without asking.
    Decide(Decision),
}

/// What a step does.
#[derive(Debug, Clone)]
pub enum Action {
    /// Ask a person.
    Prompt(PromptStep),
    /// Move a robot's joints.
    Move(MoveStep),
    /// Move until a sensor changes.
    Search(SearchStep),
    /// Change a sensor's settings.
    Configure(ConfigureStep),
    /// Read a sensor's values.
    Measure(MeasureStep),
    /// Write a row of the measurement table for the model lab.
    Row(RowStep),
    /// Carry a light stripe sensor over something and gather points.
    Scan(Box<ScanStep>),
    /// Do steps several times.
    Repeat(RepeatStep),
    /// Work something out.
    Compute(ComputeStep),
    /// Put corrections in force.
    Apply(ApplyStep),
    /// Correct parameters of a sensor.
    Correct(CorrectStep),
    /// Have a controller set its own zeros.
    Declare(DeclareStep),
    /// Go on only if something holds.
    Check(CheckStep),
    /// Do another procedure.
    Call(CallStep),
}

/// The kinds there are, as files name them, with what each does in a sentence. The manual and messages are made from it.
pub const KINDS: &[(&str, &str)] = &[
    (
        "prompt",
        "asks a person: to do something and confirm, to choose, for a number, or to bring the arm somewhere",
    ),
    ("move", "moves joints of a robot, to angles or by angles"),
    (
        "search",
        "moves one joint until a sensor changes: fast, back off, slow from the same side, and back to where it changed",
    ),
    ("configure", "changes settings of a sensor"),
    ("measure", "reads the values of a sensor"),
    (
        "scan",
        "carries a light stripe sensor along a line, a stripe at each place, and makes a cloud of points of them",
    ),
    ("row", "writes a row of the run's measurement table, which the model lab reads"),
    ("repeat", "does its steps several times, or once for each row of a table"),
    ("compute", "works out values from parameters and earlier results"),
    ("check", "ends the run as failed unless something holds"),
    ("apply", "puts what was found in force as a new revision of the arm's joint zeros"),
    ("correct", "applies what was found of a sensor, as a new revision of the corrections of its parameters"),
    (
        "declare",
        "has a robot's controller take where the arm stands for a stated pose from now on: its own zeros are set",
    ),
    ("call", "does the steps of another procedure"),
];

impl Action {
    /// As files name it.
    pub fn kind(&self) -> &'static str {
        match self {
            Action::Prompt(_) => "prompt",
            Action::Move(_) => "move",
            Action::Search(_) => "search",
            Action::Configure(_) => "configure",
            Action::Measure(_) => "measure",
            Action::Row(_) => "row",
            Action::Scan(_) => "scan",
            Action::Repeat(_) => "repeat",
            Action::Compute(_) => "compute",
            Action::Apply(_) => "apply",
            Action::Correct(_) => "correct",
            Action::Declare(_) => "declare",
            Action::Check(_) => "check",
            Action::Call(_) => "call",
        }
    }
}

/// Reads the `steps:` of a procedure or repetition; none when one of them cannot be read.
pub(crate) fn read_steps(node: &Node, context: &ReadContext<'_>) -> Option<Vec<Step>> {
    let items = node.list("`steps`", context.problems)?;
    if items.is_empty() {
        context.problems.add(node.place, "`steps` is empty", "a procedure has at least one step");
    }
    let steps: Vec<Option<Step>> = items.iter().map(|item| read_step(item, context)).collect();
    steps.into_iter().collect()
}

fn read_step(node: &Node, context: &ReadContext<'_>) -> Option<Step> {
    let mut map = MapReader::new(node, "a step", context.problems)?;
    let id = context.required_text(&mut map, "id");
    let title =
        map.optional("title").and_then(|node| node.text("`title`", context.problems)).map(str::to_owned);
    let action = map.required("do").and_then(|node| read_action(node, context));
    let when = map.optional("when").and_then(|node| context.expression(node, "`when`"));
    let time_limit = map
        .optional("time_limit_s")
        .and_then(|node| node.number_between("`time_limit_s`", 0.001, 1e6, context.problems))
        .map(Duration::from_secs_f64);
    let on_error = map.optional("on_error").and_then(|node| read_on_error(node, context));
    let retries = map
        .optional("retries")
        .and_then(|node| node.count_between("`retries`", 1, 100, context.problems))
        .unwrap_or(3);
    map.finish();
    let (id, place) = id?;
    check_name(&id, place, "a step's id", context);
    let title = title.unwrap_or_else(|| id.replace('_', " "));
    Some(Step { id, place, title, action: action?, when, time_limit, on_error, retries })
}

fn read_on_error(node: &Node, context: &ReadContext<'_>) -> Option<OnError> {
    let index = node.word("way to go on", &["ask", "retry", "skip", "abort"], context.problems)?;
    Some(match index {
        0 => OnError::Ask,
        1 => OnError::Decide(Decision::Retry),
        2 => OnError::Decide(Decision::Skip),
        _ => OnError::Decide(Decision::Abort),
    })
}

fn read_action(node: &Node, context: &ReadContext<'_>) -> Option<Action> {
    let entries = match &node.value {
        NodeValue::Map(entries) => entries.as_slice(),
        other => {
            let message = format!("`do` is a map with the kind of step as its key; this is {}", other.kind());
            context.problems.add(
                node.place,
                message,
                "write, for example, `do: {move: {robot: arm, by_deg: {waist: 5}}}`",
            );
            return None;
        }
    };
    let [(kind, body)] = entries else {
        context.problems.add(
            node.place,
            format!("a step does one thing; this `do` has {} keys", entries.len()),
            "",
        );
        return None;
    };
    match kind.name.as_str() {
        "prompt" => prompt::read(body, context).map(Action::Prompt),
        "move" => move_joints::read(body, context).map(Action::Move),
        "search" => search::read(body, context).map(Action::Search),
        "configure" => configure::read(body, context).map(Action::Configure),
        "measure" => measure::read(body, context).map(Action::Measure),
        "row" => row::read(body, context).map(Action::Row),
        "scan" => scan::read(body, context).map(|step| Action::Scan(Box::new(step))),
        "repeat" => repeat::read(body, context).map(Action::Repeat),
        "compute" => compute::read(body, context).map(Action::Compute),
        "apply" => apply::read(body, context).map(Action::Apply),
        "correct" => correct::read(body, context).map(Action::Correct),
        "declare" => declare::read(body, context).map(Action::Declare),
        "check" => check::read(body, context).map(Action::Check),
        "call" => call::read(body, context).map(Action::Call),
        other => {
            let help = did_you_mean(other, KINDS.iter().map(|(name, _)| *name));
            context.problems.add(kind.place, format!("there is no kind of step `{other}`"), help);
            None
        }
    }
}

/// Characters of a name: it stands in a column of a screen of 80, and in the names of files in shared memory.
pub(crate) const LONGEST_NAME: usize = 64;

/// Names that expressions use are words of letters, digits and underscores.
pub(crate) fn check_name(name: &str, place: Place, what: &str, context: &ReadContext<'_>) {
    let mut letters = name.chars();
    let good_start = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
    let good = good_start && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
    if name.len() > LONGEST_NAME {
        let message = format!("{what} has {} characters", name.len());
        context.problems.add(place, message, format!("at most {LONGEST_NAME}"));
    } else if !good || context.calculator.compile_expression(name).is_err() {
        let message = format!("`{name}` cannot be {what}");
        context.problems.add(
            place,
            message,
            "use letters, digits and `_`, beginning with a letter, and no word of the expression language",
        );
    }
}

impl Step {
    /// Checks everything the step refers to. `after` are the names for what comes after it: the step adds its own results to them.
    pub(crate) fn check(&self, context: &CheckContext<'_>) {
        if let Some(when) = &self.when {
            context.check_expression(when);
        }
        match &self.action {
            Action::Prompt(step) => step.check(context),
            Action::Move(step) => step.check(context),
            Action::Search(step) => step.check(context),
            Action::Compute(step) => step.check(context),
            Action::Apply(step) => step.check(context),
            Action::Correct(step) => step.check(context),
            Action::Declare(step) => step.check(context),
            Action::Check(step) => step.check(context),
            Action::Configure(step) => step.check(context),
            Action::Measure(step) => step.check(context),
            Action::Row(step) => step.check(context),
            Action::Scan(step) => step.check(context),
            Action::Repeat(_) | Action::Call(_) => {}
        }
    }

    /// What later expressions may name of this step's result.
    pub(crate) fn result_shape(&self, cell: &CellNames) -> Shape {
        let joints_of = |robot: &str| {
            let joints = cell
                .robots
                .iter()
                .find(|known| known.name == robot)
                .map(|known| known.joints.as_slice())
                .unwrap_or_default();
            let entries =
                joints.iter().map(|(name, unit)| (format!("{name}_{}", unit.symbol()), Shape::Single));
            Shape::Map(entries.collect())
        };
        let single = |name: &str| (name.to_owned(), Shape::Single);
        match &self.action {
            Action::Prompt(step) => step.result_shape(joints_of),
            Action::Move(step) => Shape::Map(vec![("joints".to_owned(), joints_of(&step.robot))]),
            Action::Search(step) => Shape::Map(vec![
                single("found"),
                ("joints".to_owned(), joints_of(&step.robot)),
                single("half_width_deg"),
                single("half_width_mm"),
                ("fast_joints".to_owned(), joints_of(&step.robot)),
            ]),
            Action::Configure(_) => Shape::Map(vec![single("configured")]),
            Action::Measure(step) => {
                let known = cell.quantities.iter().find(|(sensor, _)| *sensor == step.sensor);
                known.map_or(Shape::Anything, |(_, names)| {
                    Shape::Map(names.iter().map(|name| single(name)).collect())
                })
            }
            Action::Scan(step) => step.result_shape(),
            Action::Row(_) => Shape::Map(Vec::new()),
            Action::Repeat(step) => {
                let mut names = vec![single("turn"), single("turns")];
                if let Turns::Over(table) = &step.turns {
                    names.extend(table.columns.iter().map(|column| single(column)));
                }
                Shape::Map(names)
            }
            Action::Compute(step) => step.result_shape(),
            Action::Apply(_) | Action::Correct(_) => Shape::Map(vec![single("revision"), single("applied")]),
            Action::Declare(step) => {
                Shape::Map(vec![single("declared"), ("joints".to_owned(), joints_of(&step.robot))])
            }
            Action::Check(_) => Shape::Map(vec![single("holds")]),
            Action::Call(_) => Shape::Anything,
        }
    }
}

/// The names for the steps of a procedure: what they may use is added as checking goes through them.
pub(crate) fn add_result(names: &mut Names, all: &mut Vec<(String, Shape)>, id: &str, shape: Shape) {
    names.set(id, shape.clone());
    all.retain(|(known, _)| known != id);
    all.push((id.to_owned(), Shape::List(Box::new(shape))));
    names.set("all", Shape::Map(all.clone()));
}
