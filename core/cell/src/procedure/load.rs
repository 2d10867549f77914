//! From a procedure's file to what it says.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::count::{self, MOST_ENTRIES};
use super::{Parameter, Procedure};
use crate::expression::Calculator;
use crate::file::read_text;
use crate::read_context::ReadContext;
use crate::step::{Action, Step, check_name, read_steps};
use crate::yaml::{FileProblems, Key, MapReader, Node, NodeValue, Problems, parse};

/// A procedure with the mistakes found while it was read. It is there, mistakes or not, when all its steps could be read.
pub(crate) struct LoadedProcedure {
    pub(crate) procedure: Option<Procedure>,
    pub(crate) wrong: Vec<FileProblems>,
}

/// Reads a procedure and those it calls. Its own form is checked here; whether it fits a cell, with the cell.
///
/// # Errors
/// Every mistake of every file, a [`FileProblems`] a file.
pub fn load_procedure(file: &Path, calculator: &Calculator) -> Result<Procedure, Vec<FileProblems>> {
    match load(file, calculator, &mut LoadedFiles::default()) {
        LoadedProcedure { procedure: Some(procedure), wrong } if wrong.is_empty() => Ok(procedure),
        LoadedProcedure { wrong, .. } => Err(wrong),
    }
}

/// Procedures that call each other; deeper nobody can follow.
const DEEPEST_CALL: usize = 9;

/// What is read of the files that call each other: each once, however often and on whatever ways it is called.
#[derive(Default)]
pub(crate) struct LoadedFiles {
    /// Those that are being read, each called by the one before it.
    callers: Vec<PathBuf>,
    /// Those that were read; none where one holds mistakes.
    read: HashMap<PathBuf, Option<Arc<Procedure>>>,
}

pub(crate) fn load(file: &Path, calculator: &Calculator, files: &mut LoadedFiles) -> LoadedProcedure {
    let problems = Problems::default();
    let read = read_text(file).and_then(|text| Ok((parse(file, &text, &problems)?, text)));
    let (root, text) = match read {
        Ok(read) => read,
        Err(problem) => return LoadedProcedure { procedure: None, wrong: vec![problem] },
    };
    let folder = file.parent().unwrap_or(Path::new("."));
    let context = ReadContext { calculator, file: &text, folder, problems: &problems };
    let mut read = read_procedure(&root, file, &context);
    let mut wrong = Vec::new();
    if let Some(procedure) = &mut read {
        let mut called = Vec::new();
        files.callers.push(file.to_owned());
        load_called(&procedure.steps, file, calculator, files, &problems, &mut called, &mut wrong);
        files.callers.pop();
        procedure.called = called;
        procedure.entries = count::entries(procedure, calculator);
        if procedure.entries > MOST_ENTRIES as u64 {
            let message = format!("the procedure unrolls to {} steps", procedure.entries);
            let help = format!(
                "at most {MOST_ENTRIES} are run, the beginnings and ends of turns among them: repeat less often, or in several runs"
            );
            problems.add(root.place, message, help);
            read = None;
        }
    }
    if let Err(own) = problems.into_result(file, &text) {
        wrong.insert(0, own);
    }
    LoadedProcedure { procedure: read.map(|procedure| Procedure { text, ..procedure }), wrong }
}

fn load_called(
    steps: &[Step],
    file: &Path,
    calculator: &Calculator,
    files: &mut LoadedFiles,
    problems: &Problems,
    called: &mut Vec<(String, Arc<Procedure>)>,
    wrong: &mut Vec<FileProblems>,
) {
    for step in steps {
        match &step.action {
            Action::Repeat(repeat) => {
                load_called(&repeat.steps, file, calculator, files, problems, called, wrong)
            }
            Action::Call(call) if !called.iter().any(|(name, _)| *name == call.file) => {
                let path = file.parent().unwrap_or(Path::new(".")).join(&call.file);
                if let Some(known) = files.read.get(&path) {
                    called.extend(known.iter().map(|procedure| (call.file.clone(), Arc::clone(procedure))));
                } else if files.callers.contains(&path) {
                    problems.add(call.place, "this procedure is being called by itself", "");
                } else if files.callers.len() >= DEEPEST_CALL {
                    let help = "do it in one of them";
                    problems.add(
                        call.place,
                        format!("more than {DEEPEST_CALL} procedures call each other"),
                        help,
                    );
                } else if !path.exists() {
                    let message = format!("there is no file {}", path.display());
                    problems.add(call.place, message, "the name is relative to this file");
                } else {
                    let loaded = load(&path, calculator, files);
                    wrong.extend(loaded.wrong);
                    let procedure = loaded.procedure.map(Arc::new);
                    called.extend(procedure.iter().map(|read| (call.file.clone(), Arc::clone(read))));
                    files.read.insert(path, procedure);
                }
            }
            _ => {}
        }
    }
}

fn read_procedure(root: &Node, file: &Path, context: &ReadContext<'_>) -> Option<Procedure> {
    let mut map = MapReader::new(root, "a procedure", context.problems)?;
    let name = context.required_text(&mut map, "procedure");
    let title =
        map.optional("title").and_then(|node| node.text("`title`", context.problems)).map(str::to_owned);
    let about =
        map.optional("about").and_then(|node| node.text("`about`", context.problems)).map(str::to_owned);
    let parameters =
        map.optional("parameters").and_then(|node| node.entries("`parameters`", context.problems));
    let finds_zeros =
        map.optional("finds_zeros").and_then(|node| node.list("`finds_zeros`", context.problems));
    let steps = map.required("steps").and_then(|node| read_steps(node, context));
    map.finish();
    let parameters =
        parameters.unwrap_or_default().iter().filter_map(|(key, node)| read_parameter(key, node, context));
    let parameters = parameters.collect();
    let robot = |node: &Node| Some((node.text("a robot", context.problems)?.to_owned(), node.place));
    let finds_zeros = finds_zeros.unwrap_or_default().iter().filter_map(robot).collect();
    let (name, _) = name?;
    let title = title.unwrap_or_else(|| name.clone());
    Some(Procedure {
        file: file.to_owned(),
        text: String::new(),
        name,
        title,
        about,
        parameters,
        finds_zeros,
        steps: steps?,
        called: Vec::new(),
        entries: 0,
    })
}

fn read_parameter(key: &Key, node: &Node, context: &ReadContext<'_>) -> Option<Parameter> {
    check_name(&key.name, key.place, "the name of a parameter", context);
    let what = format!("`{}`", key.name);
    let mut parameter = Parameter {
        name: key.name.clone(),
        place: key.place,
        default: 0.0,
        minimum: f64::NEG_INFINITY,
        maximum: f64::INFINITY,
        about: None,
    };
    if !matches!(node.value, NodeValue::Map(_)) {
        parameter.default = node.number(&what, context.problems)?;
        return Some(parameter);
    }
    let mut map = MapReader::new(node, "a parameter", context.problems)?;
    let number = |node: Option<&Node>| node.and_then(|node| node.number(&what, context.problems));
    let default = number(map.required("default"));
    let minimum = number(map.optional("minimum"));
    let maximum = number(map.optional("maximum"));
    parameter.about =
        map.optional("about").and_then(|node| node.text("`about`", context.problems)).map(str::to_owned);
    map.finish();
    parameter.default = default?;
    parameter.minimum = minimum.unwrap_or(f64::NEG_INFINITY);
    parameter.maximum = maximum.unwrap_or(f64::INFINITY);
    if let Err(reason) = parameter.accept(parameter.default) {
        context.problems.add(node.place, reason, "");
    }
    Some(parameter)
}

impl Parameter {
    /// Whether it may have this value.
    ///
    /// # Errors
    /// A sentence that says what it may have.
    pub fn accept(&self, value: f64) -> Result<(), String> {
        if value >= self.minimum && value <= self.maximum {
            return Ok(());
        }
        let range = match (self.minimum.is_finite(), self.maximum.is_finite()) {
            (true, true) => format!("lies between {} and {}", self.minimum, self.maximum),
            (true, false) => format!("is at least {}", self.minimum),
            _ => format!("is at most {}", self.maximum),
        };
        Err(format!("`{}` is {value}; it {range}", self.name))
    }
}
