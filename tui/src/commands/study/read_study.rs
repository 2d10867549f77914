//! From a study's file to a study: as it was typed, then checked.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plumb_document::{
    DocumentKind, FileKind, FileProblems, Problems, Spanned, parse_as, read_text, schema_of, typed,
    with_words,
};
use serde::Deserialize;
use serde_json::Value;

use super::study_file::{Common, Line, Shown, StudyFile, StudyFileError, Sweep};

impl StudyFile {
    /// Reads a study.
    ///
    /// # Errors
    /// [`StudyFileError`]
    pub fn read(path: &Path, name: &str) -> Result<Self, StudyFileError> {
        let text = read_text(path, FileKind::STUDY).map_err(|cause| StudyFileError::Read {
            path: path.to_owned(),
            cause: cause.into(),
            name: name.to_owned(),
        })?;
        let problems = Problems::default();
        let root = parse_as(DocumentKind::Study, path, &text, &problems)?;
        let raw: Option<RawStudy> = typed(&root, "a study", &problems);
        let folder = path.parent().unwrap_or(Path::new("."));
        let study = raw.map(|raw| raw.checked(folder, &problems));
        problems.into_result(path, &text)?;
        study.ok_or_else(|| FileProblems::whole_file(path, "this is no study", "").into())
    }
}

/// What editors show beside a key.
const WORDS: &[(&str, &str)] = &[
    ("study", "Its name: a command of plumb-studies."),
    ("title", "Its title."),
    ("about", "What it is about, in words."),
    ("runs", "How many runs each line and each point rests on, unless said otherwise."),
    ("cell", "The cell, relative to this file."),
    ("procedure", "The procedure of the cell that is run; its first when left out."),
    ("check_pose", "Where the error is taken: the arm's joints there, in the cell's units."),
    ("world", "Laid over the world file."),
    ("set", "Parameters of the procedure."),
    ("lines", "The lines of its table, each with what differs."),
    ("figures", "Its figures: one number changed step by step."),
    (
        "figures.vary",
        "What is changed: a path in the world file, as world.sensor.optics.spot.diameter_mm, or a parameter, as set.cycles.",
    ),
];

/// The JSON Schema of study files, for editors.
pub(crate) fn study_schema() -> Value {
    with_words(schema_of::<RawStudy>(), "A study of a cell", WORDS)
}

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStudy {
    study: String,
    title: String,
    #[serde(default)]
    about: String,
    runs: u32,
    cell: PathBuf,
    procedure: Option<String>,
    #[serde(default)]
    check_pose: BTreeMap<String, f64>,
    #[serde(default)]
    world: Value,
    #[serde(default)]
    set: BTreeMap<String, f64>,
    #[serde(default)]
    lines: Vec<RawLine>,
    #[serde(default)]
    figures: Vec<RawSweep>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLine {
    title: String,
    cell: Option<PathBuf>,
    procedure: Option<String>,
    #[serde(default)]
    check_pose: BTreeMap<String, f64>,
    #[serde(default)]
    world: Value,
    #[serde(default)]
    set: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSweep {
    figure: String,
    title: String,
    #[serde(default)]
    about: String,
    vary: Spanned<String>,
    across: String,
    values: Vec<f64>,
    show: Vec<Shown>,
    #[serde(default)]
    lines: Vec<RawLine>,
    runs: Option<u32>,
}

impl RawStudy {
    /// The study, whose cells lie relative to its `folder`.
    fn checked(self, folder: &Path, problems: &Problems) -> StudyFile {
        let common = Common {
            cell: Some(folder.join(self.cell)),
            procedure: self.procedure,
            check_pose: self.check_pose,
            world: self.world,
            set: self.set,
        };
        StudyFile {
            study: self.study,
            title: self.title,
            about: self.about,
            runs: self.runs,
            common,
            lines: self.lines.into_iter().map(|line| line.checked(folder)).collect(),
            figures: self.figures.into_iter().map(|figure| figure.checked(folder, problems)).collect(),
        }
    }
}

impl RawLine {
    fn checked(self, folder: &Path) -> Line {
        let with = Common {
            cell: self.cell.map(|cell| folder.join(cell)),
            procedure: self.procedure,
            check_pose: self.check_pose,
            world: self.world,
            set: self.set,
        };
        Line { title: self.title, with }
    }
}

impl RawSweep {
    fn checked(self, folder: &Path, problems: &Problems) -> Sweep {
        let vary = self.vary.value;
        if !(vary.starts_with("world.") || vary.starts_with("set.")) {
            let help =
                "write a path in the world file, `world.sensor.input_bit`, or a parameter, `set.cycles`";
            let message =
                format!("`vary: {vary}` is neither in the `world.` nor among the parameters, `set.`");
            problems.add(self.vary.span, message, help);
        }
        Sweep {
            figure: self.figure,
            title: self.title,
            about: self.about,
            vary,
            across: self.across,
            values: self.values,
            show: self.show,
            lines: self.lines.into_iter().map(|line| line.checked(folder)).collect(),
            runs: self.runs,
        }
    }
}
