//! Whether a procedure fits a cell, and every name in it is there when it is needed.

use super::Procedure;
use crate::cell_names::CellNames;
use crate::check_context::{CheckContext, RobotNames};
use crate::expression::{Expression, Names, Shape};
use crate::step::{Inside, Step, Turns};
use plumb_document::{FileProblems, Key, Problems, Span, did_you_mean};

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
    for (robot, span) in &procedure.finds_zeros {
        checker.context(&names).robot(robot, *span);
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
    ids: Vec<(String, Span)>,
}

impl Checker<'_> {
    fn context<'c>(&'c self, names: &'c Names) -> CheckContext<'c> {
        CheckContext {
            file: &self.procedure.text,
            problems: self.problems,
            names,
            robots: &self.cell.robots,
            sensors: &self.cell.sensors,
            streams: &self.cell.streams,
        }
    }

    fn parameters(&self) {
        for parameter in &self.procedure.parameters {
            let taken =
                parameter.name == "all" || self.cell.robots.iter().any(|robot| robot.name == parameter.name);
            if taken {
                self.problems.add(
                    parameter.span,
                    format!("`{}` is the name of something else", parameter.name),
                    "choose another",
                );
            }
        }
    }

    fn steps(&mut self, steps: &[Step], names: &mut Names) {
        // Lists of results over the turns of a repetition may be used anywhere: they are empty where nothing was found yet.
        for step in steps {
            self.all.push((step.id.clone(), Shape::List(Box::new(step.action.result_shape(self.cell)))));
        }
        names.set("all", Shape::Map(self.all.clone()));
        for step in steps {
            self.id(step, names);
            step.check(&self.context(names));
            match step.action.inside() {
                Inside::Repeated { turns, until, steps } => {
                    if let Turns::Times(times) = turns {
                        self.context(&self.plan_names).check_expression(times);
                    }
                    names.set(&step.id, step.action.result_shape(self.cell));
                    self.steps(steps, names);
                    if let Some(until) = until {
                        self.context(names).check_expression(until);
                    }
                }
                Inside::Called { file, with, .. } => {
                    let shape = self.call(file, with);
                    add_result(names, &mut self.all, &step.id, shape);
                    continue;
                }
                Inside::Nothing => {}
            }
            add_result(names, &mut self.all, &step.id, step.action.result_shape(self.cell));
        }
    }

    /// Checks a call of another procedure; gives what later expressions may name of it.
    fn call(&self, file: &str, with: &[(Key, Expression)]) -> Shape {
        let called = self.procedure.called(file);
        for (name, value) in with {
            self.context(&self.plan_names).check_expression(value);
            let Some(called) = called else { continue };
            if !called.parameters.iter().any(|parameter| parameter.name == name.name) {
                let help = did_you_mean(&name.name, called.parameters.iter().map(|p| p.name.as_str()));
                let message = format!("procedure `{}` has no parameter `{}`", called.name, name.name);
                self.problems.add(name.span, message, help);
            }
        }
        called.map_or(Shape::Anything, |called| called_shape(called, self.cell))
    }

    fn id(&mut self, step: &Step, names: &Names) {
        if let Some((_, first)) = self.ids.iter().find(|(id, _)| *id == step.id) {
            let message = format!("there is a step `{}` in line {} already", step.id, first.line);
            self.problems.add(step.span, message, "give each step an id of its own");
        } else if step.id == "all" || names.get(&step.id).is_some() {
            self.problems.add(
                step.span,
                format!("`{}` is the name of something else", step.id),
                "choose another id",
            );
        }
        self.ids.push((step.id.clone(), step.span));
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
        let shape = match step.action.inside() {
            Inside::Called { file, .. } => {
                procedure.called(file).map_or(Shape::Anything, |called| called_shape(called, cell))
            }
            _ => step.action.result_shape(cell),
        };
        entries.push((step.id.clone(), shape));
        if let Inside::Repeated { steps, .. } = step.action.inside() {
            collect_results(steps, procedure, cell, entries);
        }
    }
}

/// The names for the steps of a procedure: what they may use is added as checking goes through them.
fn add_result(names: &mut Names, all: &mut Vec<(String, Shape)>, id: &str, shape: Shape) {
    names.set(id, shape.clone());
    all.retain(|(known, _)| known != id);
    all.push((id.to_owned(), Shape::List(Box::new(shape))));
    names.set("all", Shape::Map(all.clone()));
}
