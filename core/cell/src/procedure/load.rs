//! From a procedure's file to what it says.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::count::{self, MOST_ENTRIES};
use super::{Parameter, Procedure};
use crate::expression::Calculator;
use crate::read_context::ReadContext;
use crate::step::{Inside, Step, check_name, read_action, read_steps};
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Key, MapReader, Node, NodeValue, Problems, parse_as, read_document,
};

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
    let read = read_document(file, FileKind::CELL)
        .and_then(|text| Ok((parse_as(DocumentKind::Procedure, file, &text, &problems)?, text)));
    let (root, text) = match read {
        Ok(read) => read,
        Err(problem) => return LoadedProcedure { procedure: None, wrong: vec![problem] },
    };
    let folder = file.parent().unwrap_or(Path::new("."));
    let context = ReadContext { calculator, file: &text, folder, problems: &problems, read_action };
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
            problems.add(root.span, message, help);
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
        match step.action.inside() {
            Inside::Repeated { steps, .. } => {
                load_called(steps, file, calculator, files, problems, called, wrong);
            }
            Inside::Called { file: name, span, .. } if !called.iter().any(|(known, _)| known == name) => {
                let path = file.parent().unwrap_or(Path::new(".")).join(name);
                if let Some(known) = files.read.get(&path) {
                    called.extend(known.iter().map(|procedure| (name.to_owned(), Arc::clone(procedure))));
                } else if let Some((message, help)) = files.refuses(&path) {
                    problems.add(span, message, help);
                } else {
                    let loaded = load(&path, calculator, files);
                    wrong.extend(loaded.wrong);
                    let procedure = loaded.procedure.map(Arc::new);
                    called.extend(procedure.iter().map(|read| (name.to_owned(), Arc::clone(read))));
                    files.read.insert(path, procedure);
                }
            }
            Inside::Called { .. } | Inside::Nothing => {}
        }
    }
}

impl LoadedFiles {
    /// Why the procedure in a file cannot be called from the one that is being read, and what would be right.
    fn refuses(&self, path: &PathBuf) -> Option<(String, &'static str)> {
        if self.callers.contains(path) {
            Some(("this procedure is being called by itself".to_owned(), ""))
        } else if self.callers.len() >= DEEPEST_CALL {
            Some((format!("more than {DEEPEST_CALL} procedures call each other"), "do it in one of them"))
        } else if !path.exists() {
            Some((format!("there is no file {}", path.display()), "the name is relative to this file"))
        } else {
            None
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
        parameters.unwrap_or_default().iter().map(|(key, node)| read_parameter(key, node, context));
    let parameters = parameters.collect();
    let robot = |node: &Node| Some((node.text("a robot", context.problems)?.to_owned(), node.span));
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

/// One that could not be read has no number, and is known by its name: what uses it is not accused.
fn read_parameter(key: &Key, node: &Node, context: &ReadContext<'_>) -> Parameter {
    check_name(&key.name, key.span, "the name of a parameter", context);
    let what = format!("`{}`", key.name);
    let mut parameter = Parameter {
        name: key.name.clone(),
        span: key.span,
        default: 0.0,
        minimum: f64::NEG_INFINITY,
        maximum: f64::INFINITY,
        about: None,
    };
    if !matches!(node.value, NodeValue::Map(_)) {
        parameter.default = node.number(&what, context.problems).unwrap_or(f64::NAN);
        return parameter;
    }
    let Some(mut map) = MapReader::new(node, "a parameter", context.problems) else { return parameter };
    let number = |node: Option<&Node>| node.and_then(|node| node.number(&what, context.problems));
    let default = number(map.required("default"));
    let minimum = number(map.optional("minimum"));
    let maximum = number(map.optional("maximum"));
    parameter.about =
        map.optional("about").and_then(|node| node.text("`about`", context.problems)).map(str::to_owned);
    map.finish();
    parameter.default = default.unwrap_or(f64::NAN);
    parameter.minimum = minimum.unwrap_or(f64::NEG_INFINITY);
    parameter.maximum = maximum.unwrap_or(f64::INFINITY);
    match parameter.accept(parameter.default) {
        Err(reason) if default.is_some() => context.problems.add(node.span, reason, ""),
        _ => {}
    }
    parameter
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
