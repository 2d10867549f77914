//! `plumb check`: everything that can be known about a file before anything is connected.

use std::path::{Path, PathBuf};

use crate::answers::load_answers;
use crate::expression::Calculator;
use crate::file::read_text;
use crate::procedure::load_procedure;
use crate::workcell::{Workcell, check_model, load_workcell};
use crate::yaml::{FileProblems, Node, NodeValue, Problems, did_you_mean, parse};

/// A file that is in order, as far as can be known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckedFile {
    /// What kind of file it is, with its name: "cell `teachmover`".
    pub what: String,
    /// What could not be checked, and how it could be; and other things worth knowing.
    pub notes: Vec<String>,
}

/// What a file is, by the key it begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// `cell:`
    Workcell,
    /// `procedure:`
    Procedure,
    /// `answers:`
    Answers,
    /// `world:`, and no cell
    World,
    /// `arm:`
    Model,
    /// `study:`; it names a cell and lays numbers over its world.
    Study,
}

const KINDS: [(&str, FileKind); 6] = [
    ("study", FileKind::Study),
    ("cell", FileKind::Workcell),
    ("procedure", FileKind::Procedure),
    ("answers", FileKind::Answers),
    ("world", FileKind::World),
    ("arm", FileKind::Model),
];

/// What kind of file this is.
///
/// # Errors
/// When it cannot be read, or has none of the keys by which kinds are told.
pub fn kind_of_file(file: &Path) -> Result<FileKind, FileProblems> {
    let text = read_text(file)?;
    let root = parse(file, &text, &Problems::default())?;
    let keys: Vec<&str> = match &root.value {
        NodeValue::Map(entries) => entries.iter().map(|(key, _)| key.name.as_str()).collect(),
        _ => Vec::new(),
    };
    let known = KINDS.iter().find(|(key, _)| keys.contains(key)).map(|(_, kind)| *kind);
    known.ok_or_else(|| unknown_kind(file, &text, &root, &keys))
}

fn unknown_kind(file: &Path, text: &str, root: &Node, keys: &[&str]) -> FileProblems {
    let names = KINDS.map(|(key, _)| key);
    let near = keys.iter().map(|key| did_you_mean(key, names)).find(|help| help.starts_with("did"));
    let help = near.unwrap_or_else(|| {
        "it begins with `cell:`, `procedure:`, `answers:`, `world:`, or, for a model, `arm:`".to_owned()
    });
    let problems = Problems::default();
    problems.add(root.place, "what kind of file this is cannot be told", help);
    match problems.into_result(file, text) {
        Err(problems) => problems,
        Ok(()) => FileProblems::whole_file(file, "what kind of file this is cannot be told", ""),
    }
}

/// Checks a cell, procedure, answers or model file with everything it names; a world file is read by the world alone, a study by the
/// program. A procedure or answers file is checked against the cells in its own
/// and the parent folder that name it.
///
/// # Errors
/// Every mistake of every file.
pub fn check_file(
    file: &Path,
    kind: FileKind,
    calculator: &Calculator,
) -> Result<CheckedFile, Vec<FileProblems>> {
    match kind {
        FileKind::Workcell => check_workcell(file, calculator),
        FileKind::Procedure => check_procedure_file(file, calculator),
        FileKind::Answers => check_answers_file(file, calculator),
        FileKind::Model => check_model(file)
            .map(|()| CheckedFile { what: "model".to_owned(), notes: Vec::new() })
            .map_err(|problems| vec![problems]),
        FileKind::World => Ok(CheckedFile { what: "world".to_owned(), notes: Vec::new() }),
        FileKind::Study => Ok(CheckedFile { what: "study".to_owned(), notes: Vec::new() }),
    }
}

fn check_workcell(file: &Path, calculator: &Calculator) -> Result<CheckedFile, Vec<FileProblems>> {
    let workcell = load_workcell(file, calculator)?;
    if let Some(answers) = &workcell.answers {
        check_answers_of(&workcell, answers).map_err(|problems| vec![problems])?;
    }
    let procedures = workcell
        .procedures
        .iter()
        .map(|procedure| format!("procedure `{}`: {}", procedure.name, procedure.title));
    Ok(CheckedFile { what: format!("cell `{}`", workcell.name), notes: procedures.collect() })
}

fn check_answers_of(workcell: &Workcell, answers: &Path) -> Result<(), FileProblems> {
    let procedures: Vec<_> = workcell.procedures.iter().map(AsRef::as_ref).collect();
    load_answers(answers, &procedures).map(|_| ())
}

fn check_procedure_file(file: &Path, calculator: &Calculator) -> Result<CheckedFile, Vec<FileProblems>> {
    let procedure = load_procedure(file, calculator)?;
    let mut notes = Vec::new();
    for cell in cells_that_name(file) {
        match load_workcell(&cell, calculator) {
            Ok(workcell) => notes.push(format!("fits cell `{}`", workcell.name)),
            Err(problems) => {
                let about_this: Vec<FileProblems> =
                    problems.into_iter().filter(|problems| same_file(&problems.file, file)).collect();
                if !about_this.is_empty() {
                    return Err(about_this);
                }
                notes.push(format!("{} names it but has mistakes of its own", cell.display()));
            }
        }
    }
    if notes.is_empty() {
        notes.push(
            "no cell beside it names it, so its devices, joints and values were not checked".to_owned(),
        );
    }
    Ok(CheckedFile { what: format!("procedure `{}`", procedure.name), notes })
}

fn check_answers_file(file: &Path, calculator: &Calculator) -> Result<CheckedFile, Vec<FileProblems>> {
    load_answers(file, &[]).map_err(|problems| vec![problems])?;
    let mut notes = Vec::new();
    for cell in cells_that_name(file) {
        match load_workcell(&cell, calculator) {
            Ok(workcell) => {
                check_answers_of(&workcell, file).map_err(|problems| vec![problems])?;
                notes.push(format!("fits cell `{}`", workcell.name));
            }
            Err(_) => notes.push(format!("{} names it but has mistakes of its own", cell.display())),
        }
    }
    if notes.is_empty() {
        notes.push("no cell beside it names it, so the steps it answers were not checked".to_owned());
    }
    Ok(CheckedFile { what: "answers".to_owned(), notes })
}

/// Workcell files in this file's folder and the one above whose text names the file.
fn cells_that_name(file: &Path) -> Vec<PathBuf> {
    let Some(name) = file.file_name().and_then(|name| name.to_str()) else { return Vec::new() };
    let folder = file.parent().map(Path::to_owned).unwrap_or_default();
    let folder = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder };
    let mut cells = Vec::new();
    for folder in [folder.clone(), folder.join("..")] {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        files.sort();
        for candidate in files {
            let is_yaml =
                candidate.extension().is_some_and(|extension| extension == "yaml" || extension == "yml");
            if is_yaml && !same_file(&candidate, file) && names_as_cell(&candidate, name) {
                cells.push(candidate);
            }
        }
    }
    cells
}

fn names_as_cell(candidate: &Path, name: &str) -> bool {
    matches!(kind_of_file(candidate), Ok(FileKind::Workcell))
        && read_text(candidate).is_ok_and(|text| text.contains(name))
}

fn same_file(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}
