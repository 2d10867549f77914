//! Whether a procedure fits a cell, and every name in it is there when it is needed.

use super::Procedure;
use crate::expression::{Names, Shape};
use crate::read_context::{CheckContext, RobotNames};
use crate::step::{Action, Step, Turns, add_result};
use crate::workcell::{DeviceSetting, RobotSetting};
use crate::yaml::{FileProblems, Place, Problems, did_you_mean};

/// What a cell offers to the names in a procedure.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellNames {
    pub(crate) robots: Vec<RobotNames>,
    pub(crate) sensors: Vec<String>,
    /// For each sensor whose quantities are known, the names of its readings' values: `tip.x_mm`.
    pub(crate) quantities: Vec<(String, Vec<String>)>,
    /// For each robot, what its model file gives: `arm.model.shoulder.a_mm`.
    pub(crate) models: Vec<(String, Shape)>,
}

impl CellNames {
    /// What these devices offer, as far as it is known before they are started.
    pub(crate) fn of(devices: &[DeviceSetting], robots: &[RobotSetting]) -> Self {
        let is_sensor = |name: &String| robots.iter().all(|robot| robot.device != *name);
        let model = |robot: &RobotSetting| Some((robot.device.clone(), robot.model.as_ref()?.shape()));
        Self {
            robots: robots.iter().map(RobotSetting::names).collect(),
            sensors: devices.iter().map(|device| device.name.clone()).filter(is_sensor).collect(),
            quantities: Vec::new(),
            models: robots.iter().filter_map(model).collect(),
        }
    }
}

/// Checks a procedure and those it calls against a cell.
///
/// # Errors
/// Every mistake of every file.
pub(crate) fn check_procedure(procedure: &Procedure, cell: &CellNames) -> Result<(), Vec<FileProblems>> {
    let problems = Problems::default();
    let plan_names = names_before_the_run(procedure, cell);
    let mut names = plan_names.clone();
    for robot in &cell.robots {
        names.set(&robot.name, robot_shape(robot, cell, true));
    }
    names.set("all", Shape::Map(Vec::new()));
    let mut checker =
        Checker { procedure, cell, plan_names, problems: &problems, all: Vec::new(), ids: Vec::new() };
    checker.parameters();
    for (robot, place) in &procedure.finds_zeros {
        checker.context(&names).robot(robot, *place);
    }
    checker.steps(&procedure.steps, &mut names);
    let mut wrong: Vec<FileProblems> =
        problems.into_result(&procedure.file, &procedure.text).err().into_iter().collect();
    for (_, called) in &procedure.called {
        wrong.extend(check_procedure(called, cell).err().into_iter().flatten());
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong) }
}

/// What is known before the run: parameters and models.
fn names_before_the_run(procedure: &Procedure, cell: &CellNames) -> Names {
    let mut names = Names::default();
    for parameter in &procedure.parameters {
        names.set(&parameter.name, Shape::Single);
    }
    for robot in &cell.robots {
        names.set(&robot.name, robot_shape(robot, cell, false));
    }
    names
}

fn robot_shape(robot: &RobotNames, cell: &CellNames, with_joints: bool) -> Shape {
    let mut entries = Vec::new();
    if with_joints {
        let joints =
            robot.joints.iter().map(|(name, unit)| (format!("{name}_{}", unit.symbol()), Shape::Single));
        entries.push(("joints".to_owned(), Shape::Map(joints.collect())));
    }
    if let Some((_, model)) = cell.models.iter().find(|(name, _)| *name == robot.name) {
        entries.push(("model".to_owned(), model.clone()));
    }
    Shape::Map(entries)
}

struct Checker<'a> {
    procedure: &'a Procedure,
    cell: &'a CellNames,
    plan_names: Names,
    problems: &'a Problems,
    all: Vec<(String, Shape)>,
    ids: Vec<(String, Place)>,
}

impl Checker<'_> {
    fn context<'c>(&'c self, names: &'c Names) -> CheckContext<'c> {
        CheckContext {
            file: &self.procedure.text,
            problems: self.problems,
            names,
            robots: &self.cell.robots,
            sensors: &self.cell.sensors,
        }
    }

    fn parameters(&self) {
        for parameter in &self.procedure.parameters {
            let taken =
                parameter.name == "all" || self.cell.robots.iter().any(|robot| robot.name == parameter.name);
            if taken {
                self.problems.add(
                    parameter.place,
                    format!("`{}` is the name of something else", parameter.name),
                    "choose another",
                );
            }
        }
    }

    fn steps(&mut self, steps: &[Step], names: &mut Names) {
        // Lists of results over the turns of a repetition may be used anywhere: they are empty where nothing was found yet.
        for step in steps {
            self.all.push((step.id.clone(), Shape::List(Box::new(step.result_shape(self.cell)))));
        }
        names.set("all", Shape::Map(self.all.clone()));
        for step in steps {
            self.id(step, names);
            step.check(&self.context(names));
            match &step.action {
                Action::Repeat(repeat) => {
                    if let Turns::Times(times) = &repeat.turns {
                        self.context(&self.plan_names).check_expression(times);
                    }
                    names.set(&step.id, step.result_shape(self.cell));
                    self.steps(&repeat.steps, names);
                    if let Some(until) = &repeat.until {
                        self.context(names).check_expression(until);
                    }
                }
                Action::Call(call) => {
                    let called = self.procedure.called(&call.file);
                    for (name, value) in &call.with {
                        self.context(&self.plan_names).check_expression(value);
                        let Some(called) = called else { continue };
                        if !called.parameters.iter().any(|parameter| parameter.name == name.name) {
                            let help =
                                did_you_mean(&name.name, called.parameters.iter().map(|p| p.name.as_str()));
                            let message =
                                format!("procedure `{}` has no parameter `{}`", called.name, name.name);
                            self.problems.add(name.place, message, help);
                        }
                    }
                    let shape = called.map_or(Shape::Anything, |called| called_shape(called, self.cell));
                    add_result(names, &mut self.all, &step.id, shape);
                    continue;
                }
                _ => {}
            }
            add_result(names, &mut self.all, &step.id, step.result_shape(self.cell));
        }
    }

    fn id(&mut self, step: &Step, names: &Names) {
        if let Some((_, first)) = self.ids.iter().find(|(id, _)| *id == step.id) {
            let message = format!("a step `{}` stands in line {} already", step.id, first.line);
            self.problems.add(step.place, message, "give each step an id of its own");
        } else if step.id == "all" || names.get(&step.id).is_some() {
            self.problems.add(
                step.place,
                format!("`{}` is the name of something else", step.id),
                "choose another id",
            );
        }
        self.ids.push((step.id.clone(), step.place));
    }
}

/// What a caller may name of a called procedure: the results of its steps.
fn called_shape(called: &Procedure, cell: &CellNames) -> Shape {
    let mut entries = Vec::new();
    collect_results(&called.steps, called, cell, &mut entries);
    Shape::Map(entries)
}

fn collect_results(
    steps: &[Step],
    procedure: &Procedure,
    cell: &CellNames,
    entries: &mut Vec<(String, Shape)>,
) {
    for step in steps {
        let shape = match &step.action {
            Action::Call(call) => {
                procedure.called(&call.file).map_or(Shape::Anything, |called| called_shape(called, cell))
            }
            _ => step.result_shape(cell),
        };
        entries.push((step.id.clone(), shape));
        if let Action::Repeat(repeat) = &step.action {
            collect_results(&repeat.steps, procedure, cell, entries);
        }
    }
}
