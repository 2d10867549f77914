//! `plumb check`: everything that can be known about a file before anything is connected.

use std::path::{Path, PathBuf};

use crate::answers::load_answers;
use crate::expression::Calculator;
use crate::procedure::load_procedure;
use crate::workcell::{Workcell, check_model, load_workcell};
use plumb_document::{DocumentKind, FileKind, FileProblems, kind_of, read_document};

/// A file that is in order, as far as can be known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckedFile {
    /// What kind of file it is, with its name: "cell `teachmover`".
    pub what: String,
    /// What could not be checked, and how it could be; and other things worth knowing.
    pub notes: Vec<String>,
}

/// What kind of file this is.
///
/// # Errors
/// When it cannot be read, or has none of the keys by which kinds are recognised.
pub fn kind_of_file(file: &Path) -> Result<DocumentKind, FileProblems> {
    kind_of(file, &read_document(file, FileKind::WORLD)?)
}

/// Checks a cell, procedure, answers or model file with everything it names; the other kinds are read by the program. A procedure or answers file is checked against the cells in its own
/// and the parent folder that name it.
///
/// # Errors
/// Every mistake of every file.
pub fn check_file(
    file: &Path,
    kind: DocumentKind,
    calculator: &Calculator,
) -> Result<CheckedFile, Vec<FileProblems>> {
    match kind {
        DocumentKind::Cell => check_workcell(file, calculator),
        DocumentKind::Procedure => check_procedure_file(file, calculator),
        DocumentKind::Answers => check_answers_file(file, calculator),
        DocumentKind::Model => check_model(file)
            .map(|()| CheckedFile { what: "model".to_owned(), notes: Vec::new() })
            .map_err(|problems| vec![problems]),
        DocumentKind::World
        | DocumentKind::Study
        | DocumentKind::Rig
        | DocumentKind::Scene
        | DocumentKind::Manifest => {
            let name = kind.name();
            let what = name.split_once(' ').map_or(name, |(_, name)| name);
            Ok(CheckedFile { what: what.to_owned(), notes: Vec::new() })
        }
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
    load_answers(answers, &procedures, &workcell.robots).map(|_| ())
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
    // Where no cell could be read that says what is asked, its form alone is looked at.
    load_answers(file, &[], &[]).map_err(|problems| vec![problems])?;
    if notes.is_empty() {
        notes.push("no cell beside it names it, so the steps it answers were not checked".to_owned());
    }
    Ok(CheckedFile { what: "answers".to_owned(), notes })
}

/// Workcell files in this file's folder and the one above whose text names the file.
pub fn cells_that_name(file: &Path) -> Vec<PathBuf> {
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
    matches!(kind_of_file(candidate), Ok(DocumentKind::Cell))
        && read_document(candidate, FileKind::CELL).is_ok_and(|text| text.contains(name))
}

fn same_file(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}
