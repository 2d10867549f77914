//! Procedures: declared steps, so that the whole plan is known before anything moves.

mod check;
mod count;
mod load;

use std::path::PathBuf;
use std::sync::Arc;

pub(crate) use check::check_procedure;
pub(crate) use count::MOST_ENTRIES;
pub use load::load_procedure;
pub(crate) use load::{LoadedFiles, load};

use crate::step::{Inside, Step};
use plumb_document::Span;

/// A procedure that was read: its own file is in order; whether it fits a cell is checked with the cell.
#[derive(Debug, Clone)]
pub struct Procedure {
    /// Its file.
    pub file: PathBuf,
    /// The file's text.
    pub text: String,
    /// Its name, unique in a cell.
    pub name: String,
    /// For people.
    pub title: String,
    /// What it is for, in some sentences.
    pub about: Option<String>,
    /// What can be set when it is run.
    pub parameters: Vec<Parameter>,
    /// Robots whose zeros it is to find: until it has, what their drives say is not trusted, and their keep-out planes are not watched.
    pub finds_zeros: Vec<(String, Span)>,
    /// What it does.
    pub steps: Vec<Step>,
    /// The procedures its steps call, by the file name used in the call.
    pub called: Vec<(String, Arc<Procedure>)>,
    /// How many steps it unrolls to with its parameters at their defaults, the beginnings and ends of turns among them.
    pub entries: u64,
}

/// Something that can be set when a procedure is run.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name; the end is its unit: `K_mm`.
    pub name: String,
    /// Where the name is written.
    pub span: Span,
    /// Value when nobody sets another.
    pub default: f64,
    /// Smallest allowed.
    pub minimum: f64,
    /// Greatest allowed.
    pub maximum: f64,
    /// What it is.
    pub about: Option<String>,
}

impl Procedure {
    /// The procedure a call of this one names.
    pub fn called(&self, file: &str) -> Option<&Arc<Procedure>> {
        self.called.iter().find(|(name, _)| name == file).map(|(_, procedure)| procedure)
    }

    /// Robots whose zeros this procedure, or one it calls, is to find.
    pub fn finds_zeros_of(&self) -> Vec<String> {
        let own = self.finds_zeros.iter().map(|(robot, _)| robot.clone());
        own.chain(self.called.iter().flat_map(|(_, called)| called.finds_zeros_of())).collect()
    }

    /// How far at most this procedure, or one it calls, corrects the zero of a robot's joint, rad or mm; 0 where none does.
    pub(crate) fn zero_shift(&self, robot: &str, joint: &str) -> f64 {
        let called = self.called.iter().map(|(_, called)| called.zero_shift(robot, joint));
        called.fold(greatest_zero_shift(&self.steps, robot, joint), f64::max)
    }

    /// The parameters of a sensor that this procedure, or one it calls, corrects.
    pub(crate) fn corrections_of(&self, sensor: &str) -> Vec<&str> {
        let mut keys = Vec::new();
        collect_corrections(&self.steps, sensor, &mut keys);
        keys.extend(self.called.iter().flat_map(|(_, called)| called.corrections_of(sensor)));
        keys
    }

    /// This procedure and all it calls, each file once.
    pub fn all_files(&self) -> Vec<(&PathBuf, &str)> {
        let mut files = vec![(&self.file, self.text.as_str())];
        for (_, called) in &self.called {
            for file in called.all_files() {
                if !files.contains(&file) {
                    files.push(file);
                }
            }
        }
        files
    }
}

fn greatest_zero_shift(steps: &[Step], robot: &str, joint: &str) -> f64 {
    let of_step = |step: &Step| match step.action.inside() {
        Inside::Repeated { steps, .. } => greatest_zero_shift(steps, robot, joint),
        Inside::Called { .. } | Inside::Nothing => step.action.zero_shift(robot, joint),
    };
    steps.iter().map(of_step).fold(0.0, f64::max)
}

fn collect_corrections<'a>(steps: &'a [Step], sensor: &str, keys: &mut Vec<&'a str>) {
    for step in steps {
        keys.extend(step.action.corrected_parameters(sensor));
        if let Inside::Repeated { steps, .. } = step.action.inside() {
            collect_corrections(steps, sensor, keys);
        }
    }
}
