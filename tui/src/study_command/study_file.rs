//! A study as it is written down: one cell and procedure, and what is changed about its world and its numbers from line to line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plumb_cell::yaml::did_you_mean;
use plumb_document::{FileKind, read_text, yaml};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::{Map, Value};

/// The keys of a study. Those of [`Common`] stand among its own, so that serde itself lets any other pass.
const KEYS: [&str; 11] = [
    "study",
    "title",
    "about",
    "runs",
    "cell",
    "procedure",
    "check_pose",
    "world",
    "set",
    "lines",
    "figures",
];

/// A study.
#[derive(Debug, Deserialize)]
pub(super) struct StudyFile {
    /// Its name; `plumb study` calls it so.
    pub(super) study: String,
    pub(super) title: String,
    #[serde(default)]
    pub(super) about: String,
    /// How many runs each line and each point rests on, unless told otherwise.
    pub(super) runs: u32,
    /// What holds for all lines that do not say otherwise.
    #[serde(flatten)]
    pub(super) common: Common,
    #[serde(default)]
    pub(super) lines: Vec<Line>,
    #[serde(default)]
    pub(super) figures: Vec<Sweep>,
}

/// What a line of a study is run with. Paths are relative to the study's file.
#[derive(Debug, Clone, Default, Deserialize)]
pub(super) struct Common {
    pub(super) cell: Option<PathBuf>,
    pub(super) procedure: Option<String>,
    /// Where the error is taken: the arm's angles there, in the cell's units.
    #[serde(default)]
    pub(super) check_pose: BTreeMap<String, f64>,
    /// Laid over the world file.
    #[serde(default)]
    pub(super) world: Value,
    /// Parameters of the procedure.
    #[serde(default)]
    pub(super) set: BTreeMap<String, f64>,
}

/// One line of a table, or one curve of a figure.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Line {
    pub(super) title: String,
    #[serde(flatten)]
    pub(super) with: Common,
}

/// A figure: one number changed step by step.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sweep {
    /// Name of its files.
    pub(super) figure: String,
    pub(super) title: String,
    /// What is doubted or asked, in words.
    #[serde(default)]
    pub(super) about: String,
    /// What is changed: a path in the world file, `world.sensor.optics.spot.diameter_mm`, or a parameter, `set.cycles`.
    pub(super) vary: String,
    pub(super) across: String,
    pub(super) values: Vec<f64>,
    pub(super) show: Vec<Shown>,
    #[serde(default)]
    pub(super) lines: Vec<Line>,
    #[serde(default)]
    pub(super) runs: Option<u32>,
}

/// What a curve shows of the runs at each point.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shown {
    pub(super) of: Quantity,
    pub(super) r#as: Statistic,
}

/// What is taken of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Quantity {
    WaistDeg,
    ShoulderDeg,
    ElbowDeg,
    RadialMm,
    AcrossMm,
    HeightMm,
    HandMm,
}

/// What is taken of many runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Statistic {
    Bias,
    Spread,
    Rms,
}

/// Why a study's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StudyFileError {
    /// It cannot be read.
    #[error(
        "cannot read the study {path}: {cause}; name its file, as in `plumb study {name} workcells/teachmover/studies/{name}.yaml`"
    )]
    Read { path: PathBuf, cause: std::io::Error, name: String },
    /// It is not written as a study is.
    #[error("{path}: {cause}")]
    Form { path: PathBuf, cause: String },
}

impl StudyFile {
    /// Reads a study.
    ///
    /// # Errors
    /// [`StudyFileError`]
    pub(super) fn read(path: &Path, name: &str) -> Result<Self, StudyFileError> {
        let text = read_text(path, FileKind::STUDY).map_err(|cause| StudyFileError::Read {
            path: path.to_owned(),
            cause: cause.into(),
            name: name.to_owned(),
        })?;
        let wrong = |cause: String| StudyFileError::Form { path: path.to_owned(), cause };
        let keys: BTreeMap<String, IgnoredAny> =
            serde_yaml::from_str(&text).map_err(|error| wrong(yaml::in_words(&error)))?;
        if let Some(unknown) = keys.keys().find(|key| !KEYS.contains(&key.as_str())) {
            let help = did_you_mean(unknown, KEYS.iter().copied());
            return Err(wrong(format!("a study has no key `{unknown}`: {help}")));
        }
        let mut study: StudyFile =
            serde_yaml::from_str(&text).map_err(|error| wrong(yaml::in_words(&error)))?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let lines =
            study.lines.iter_mut().chain(study.figures.iter_mut().flat_map(|figure| &mut figure.lines));
        for with in lines.map(|line| &mut line.with).chain([&mut study.common]) {
            with.cell = with.cell.take().map(|cell| folder.join(cell));
        }
        if study.common.cell.is_none() {
            return Err(wrong("it names no `cell`".to_owned()));
        }
        for figure in &study.figures {
            if !(figure.vary.starts_with("world.") || figure.vary.starts_with("set.")) {
                let what = &figure.vary;
                return Err(wrong(format!(
                    "`vary: {what}` is neither in the `world.` nor among the parameters, `set.`"
                )));
            }
        }
        Ok(study)
    }
}

impl Common {
    /// This, with what a line says in its place.
    pub(super) fn with(&self, line: &Common) -> Common {
        let mut world = self.world.clone();
        join(&mut world, &line.world);
        let joined = |ours: &BTreeMap<String, f64>, theirs: &BTreeMap<String, f64>| {
            ours.clone().into_iter().chain(theirs.clone()).collect()
        };
        Common {
            cell: line.cell.clone().or_else(|| self.cell.clone()),
            procedure: line.procedure.clone().or_else(|| self.procedure.clone()),
            check_pose: joined(&self.check_pose, &line.check_pose),
            world,
            set: joined(&self.set, &line.set),
        }
    }

    /// This with one number changed.
    pub(super) fn varied(&self, what: &str, value: f64) -> Common {
        let mut varied = self.clone();
        match what.split_once('.') {
            Some(("set", parameter)) => {
                varied.set.insert(parameter.to_owned(), value);
            }
            Some((_, path)) => {
                let patch = path.rsplit('.').fold(Value::from(value), |inner, key| {
                    Value::Object(Map::from_iter([(key.to_owned(), inner)]))
                });
                join(&mut varied.world, &patch);
            }
            None => {}
        }
        varied
    }
}

/// Lays a patch over a value: maps are laid over key by key, `null` takes a key away, anything else takes its place.
pub(super) fn lay_over(value: &mut Value, patch: &Value) {
    merge(value, patch, false);
}

/// Makes one patch of two, the second over the first.
fn join(patch: &mut Value, over: &Value) {
    merge(patch, over, true);
}

fn merge(value: &mut Value, patch: &Value, keep_nulls: bool) {
    let Value::Object(patch) = patch else {
        if !patch.is_null() {
            *value = patch.clone();
        }
        return;
    };
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
    let Some(entries) = value.as_object_mut() else { return };
    for (key, entry) in patch {
        match entry {
            Value::Null if keep_nulls => drop(entries.insert(key.clone(), Value::Null)),
            Value::Null => drop(entries.remove(key)),
            entry => merge(entries.entry(key.clone()).or_insert(Value::Null), entry, keep_nulls),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_patch_is_laid_over_key_by_key() {
        let mut world = json!({"arm": {"lengths": {"upper": 1, "lower": 2}}, "optics": {"ideal": {}}});
        lay_over(
            &mut world,
            &json!({"arm": {"lengths": {"upper": 3}}, "optics": {"ideal": null, "spot": {"d": 4}}}),
        );
        assert_eq!(
            world,
            json!({"arm": {"lengths": {"upper": 3, "lower": 2}}, "optics": {"spot": {"d": 4}}})
        );
    }

    #[test]
    fn what_one_patch_takes_away_stays_away_when_another_is_joined_to_it() {
        let first =
            Common { world: json!({"optics": {"ideal": null, "spot": {"d": 4}}}), ..Common::default() };
        let joined = Common { world: json!({"seed": 3}), ..Common::default() }
            .with(&first)
            .varied("world.optics.spot.d", 2.0);
        let mut world = json!({"optics": {"ideal": {"h": 8}}});
        lay_over(&mut world, &joined.world);
        assert_eq!(world, json!({"optics": {"spot": {"d": 2.0}}, "seed": 3}));
    }

    #[test]
    fn one_number_is_changed_in_the_world_or_among_the_parameters() {
        let common = Common { world: json!({"sensor": {"bit": 0}}), ..Common::default() };
        let world = common.varied("world.sensor.optics.spot.diameter_mm", 4.0).world;
        assert_eq!(world, json!({"sensor": {"bit": 0, "optics": {"spot": {"diameter_mm": 4.0}}}}));
        assert_eq!(common.varied("set.cycles", 2.0).set, BTreeMap::from([("cycles".to_owned(), 2.0)]));
    }
}
