//! A run as it would go, without anything being started.

use serde::Serialize;
use serde_json::{Map, Value};

use super::estimate::{Estimator, ForeseenStep, Unknown};
use super::plan::make_plan;
use super::start::{check_unattended, model_values, parameters_of};
use super::{RobotFacts, RunRequest, StartError};
use crate::check_context::OwnLimits;
use crate::deg_or_mm::DegOrMm;
use crate::device::own_limits;
use crate::expression::Calculator;
use crate::step::{MotionContext, PlannedMotion, rounded};
use crate::workcell::{RobotSetting, Workcell};

/// What a run would do.
#[derive(Debug, Clone, Serialize)]
pub struct DryRun {
    /// The cell.
    pub cell: String,
    /// The procedure.
    pub procedure: String,
    /// Its title.
    pub title: String,
    /// The parameters it would run with.
    pub parameters: Map<String, Value>,
    /// Every step, repetitions unrolled.
    pub steps: Vec<DryStep>,
    /// About how long it would take, prompts left out, seconds. Robots are not started: the speeds of a simulated world are taken, or typical ones of the
    /// plugin.
    pub estimate_s: f64,
    /// The least it would take, seconds, where it has a repetition that ends when something is so, nobody knows in which turn: `estimate_s` counts all
    /// turns, this with the first alone and without the steps of which only the run will show whether they are needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_s: Option<f64>,
    /// The repetitions between these two times, with what a turn of each takes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub repetitions: Vec<OpenRepetition>,
    /// What watches over the robots' ways, in words.
    pub safety: Vec<String>,
    /// Why it would not start without somebody there; none when it would.
    pub needs_operator: Option<String>,
}

/// A repetition that ends when something is so, nobody knows in which turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpenRepetition {
    /// Its path.
    pub step: String,
    /// How many turns it has at most.
    pub turns: u32,
    /// About how long a turn takes, prompts left out, seconds.
    pub turn_s: f64,
}

/// One step of it.
#[derive(Debug, Clone, Serialize)]
pub struct DryStep {
    /// Its path.
    pub step: String,
    /// For people.
    pub title: String,
    /// What kind of step.
    pub kind: String,
    /// How deep in repetitions and calls.
    pub depth: u32,
    /// It asks somebody.
    pub asks: bool,
    /// Only when this holds.
    pub when: Option<String>,
    /// It is known already that this does not hold, here or around it: the step would be left out.
    pub is_left_out: bool,
    /// About how long it would take, seconds; none where a person sets the pace.
    pub estimate_s: Option<f64>,
    /// What it would move.
    pub moves: Vec<PlannedMotion>,
}

/// Works out what a run would do.
///
/// # Errors
/// [`StartError`] as for a run, but for one that would need an operator: that is reported in the plan.
pub fn dry_run(request: &RunRequest) -> Result<DryRun, StartError> {
    let calculator = Calculator::new();
    let parameters = parameters_of(request)?;
    let models = model_values(&request.cell);
    let plan = make_plan(&request.procedure, parameters.clone(), &models, &calculator)?;
    let estimator = Estimator {
        plan: &plan,
        calculator: &calculator,
        cell: &request.cell,
        models,
        facts: request.robots.clone(),
    };
    let own = own_limits_of(request);
    let mut steps = Vec::new();
    estimator.foresee(Unknown::Holds, |foreseen| {
        let planned = foreseen.planned();
        steps.push(DryStep {
            step: planned.step.0,
            title: planned.title,
            kind: planned.kind,
            depth: planned.depth,
            asks: planned.asks,
            when: foreseen.entry.step.when.as_ref().map(|when| when.text().to_owned()),
            is_left_out: foreseen.is_left_out,
            estimate_s: planned.estimate_s,
            moves: motions(foreseen, &request.cell, &own),
        });
    });
    let estimate_s = steps.iter().filter_map(|step| step.estimate_s).sum();
    let repetitions = open_repetitions(&estimator, &steps);
    let needs_operator = match check_unattended(request) {
        Err(StartError::NeedsOperator(reason)) if request.unattended => Some(reason),
        _ => None,
    };
    Ok(DryRun {
        cell: request.cell.name.clone(),
        procedure: request.procedure.name.clone(),
        title: request.procedure.title.clone(),
        parameters,
        steps,
        estimate_s,
        least_s: estimator.least_s(),
        repetitions,
        safety: safety(request),
        needs_operator,
    })
}

/// The repetitions whose last turn nobody knows, with the time of a turn as the steps inside have it.
fn open_repetitions(estimator: &Estimator<'_>, steps: &[DryStep]) -> Vec<OpenRepetition> {
    let timed = |(step, turns): (String, u32)| {
        let inside = format!("{step}[");
        let all_s: f64 = steps
            .iter()
            .filter(|known| known.step.starts_with(&inside))
            .filter_map(|known| known.estimate_s)
            .sum();
        OpenRepetition { turn_s: all_s / f64::from(turns.max(1)), step, turns }
    };
    estimator.open_repetitions().into_iter().map(timed).collect()
}

/// The limits of the robots' own, each with its robot.
fn own_limits_of(request: &RunRequest) -> Vec<(String, OwnLimits)> {
    let of_robot = |facts: &RobotFacts| {
        let limits = own_limits(&request.cell, &facts.robot, &facts.ranges).into_iter();
        limits.map(|limits| (facts.robot.clone(), limits)).collect::<Vec<_>>()
    };
    request.robots.iter().flat_map(of_robot).collect()
}

fn motions(foreseen: &ForeseenStep<'_>, cell: &Workcell, own: &[(String, OwnLimits)]) -> Vec<PlannedMotion> {
    let limits = |robot: &str, joint: &str| limits(cell, own, robot, joint);
    let range = |robot: &str, joint: &str| {
        let limits = cell.robot(robot)?.limits.iter().find(|(name, ..)| name == joint);
        limits.map(|(_, least, most)| (*least, *most))
    };
    let own_limits = |robot: &str, joint: &str| {
        own.iter()
            .find(|(known, limits)| known == robot && limits.joint == joint)
            .map(|(_, limits)| limits.clone())
    };
    let context =
        MotionContext { time: foreseen.context, limits: &limits, range: &range, own_limits: &own_limits };
    let mut moves = foreseen.entry.step.action.planned_motions(&context);
    if foreseen.is_left_out {
        moves.iter_mut().for_each(|motion| motion.beyond = None);
    }
    moves
}

fn limits(cell: &Workcell, own: &[(String, OwnLimits)], robot: &str, joint: &str) -> String {
    let setting = cell.robot(robot);
    let of_cell = setting.and_then(|setting| setting.limits.iter().find(|(name, ..)| name == joint));
    let own = own.iter().find(|(known, limits)| known == robot && limits.joint == joint);
    let unit = setting.and_then(|setting| setting.unit(joint)).unwrap_or(DegOrMm::Deg);
    let number = |internal: f64| rounded(unit.from_internal(internal));
    let in_words = |least, most| format!("{} to {} {}", number(least), number(most), unit.symbol());
    match (of_cell, own) {
        (Some((_, least, most)), _) => format!("{}, and the robot's own", in_words(*least, *most)),
        (None, Some((_, own))) => format!("the robot's own, {}", in_words(own.least, own.most)),
        (None, None) => "the robot's own".to_owned(),
    }
}

fn safety(request: &RunRequest) -> Vec<String> {
    let cell = &request.cell;
    let finds_zeros = request.procedure.finds_zeros_of();
    let watched = |robot: &RobotSetting| {
        let planes: Vec<&str> = cell
            .keep_out
            .iter()
            .filter(|plane| plane.robot == robot.device)
            .map(|plane| plane.name.as_str())
            .collect();
        let planes = planes.join(", ");
        let name = &robot.device;
        match (planes.is_empty(), finds_zeros.contains(name)) {
            (true, _) => {
                format!("{name} is kept within its joints' limits; the cell names no keep-out planes")
            }
            (false, true) => format!(
                "{name} is kept within its joints' limits; its keep-out planes ({planes}) are not watched while this finds its zeros"
            ),
            (false, false) => {
                format!(
                    "{name} is kept within its joints' limits and clear of {planes}, once its zeros are known"
                )
            }
        }
    };
    cell.robots.iter().map(watched).collect()
}
