//! A study as it is written down: one cell and procedure, and what is changed about its world and its numbers from line to line.

use std::collections::BTreeMap;
use std::path::PathBuf;

use plumb_document::FileProblems;
use serde::Deserialize;
use serde_json::{Map, Value};

/// A study.
#[derive(Debug)]
pub struct StudyFile {
    /// Its name: a command of `plumb-studies`.
    pub study: String,
    /// Its title.
    pub title: String,
    /// What it is about, in words.
    pub about: String,
    /// How many runs each line and each point rests on, unless specified otherwise.
    pub runs: u32,
    /// What holds for all lines that do not say otherwise.
    pub common: Common,
    /// Its lines or curves.
    pub lines: Vec<Line>,
    /// Its figures.
    pub figures: Vec<Sweep>,
}

/// What a line of a study is run with. Paths are relative to the study's file.
#[derive(Debug, Clone, Default)]
pub struct Common {
    /// The cell.
    pub cell: Option<PathBuf>,
    /// The procedure of the cell that is run.
    pub procedure: Option<String>,
    /// Where the error is taken: the arm's angles there, in the cell's units.
    pub check_pose: BTreeMap<String, f64>,
    /// Laid over the world file.
    pub world: Value,
    /// Parameters of the procedure.
    pub set: BTreeMap<String, f64>,
}

/// One line of a table, or one curve of a figure.
#[derive(Debug, Clone)]
pub struct Line {
    /// Its title.
    pub title: String,
    /// What differs from the whole study.
    pub with: Common,
}

/// A figure: one number changed step by step.
#[derive(Debug)]
pub struct Sweep {
    /// Name of its files.
    pub figure: String,
    /// Its title.
    pub title: String,
    /// What is doubted or asked, in words.
    pub about: String,
    /// What is changed: a path in the world file, `world.sensor.optics.spot.diameter_mm`, or a parameter, `set.cycles`.
    pub vary: String,
    /// What the horizontal axis shows, with the unit.
    pub across: String,
    /// The values it takes.
    pub values: Vec<f64>,
    /// What its curves show.
    pub show: Vec<Shown>,
    /// Its lines or curves.
    pub lines: Vec<Line>,
    /// How many runs each point rests on, where it differs.
    pub runs: Option<u32>,
}

/// What a curve shows of the runs at each point.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shown {
    /// The quantity.
    pub of: Quantity,
    /// What is taken of it over many runs.
    pub r#as: Statistic,
}

/// What is taken of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Error of the waist, deg.
    WaistDeg,
    /// Error of the shoulder, deg.
    ShoulderDeg,
    /// Error of the elbow, deg.
    ElbowDeg,
    /// Error of the wrist away from the waist axis, mm.
    RadialMm,
    /// Error of the wrist sideways, mm.
    AcrossMm,
    /// Error of the wrist in height, mm.
    HeightMm,
    /// Error of the hand, mm.
    HandMm,
}

/// What is taken of many runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Statistic {
    /// The mean error.
    Bias,
    /// The standard deviation.
    Spread,
    /// The root mean square error.
    Rms,
}

/// Why a study's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StudyFileError {
    /// It cannot be read.
    #[error(
        "cannot read the study {path}: {cause}; name its file, as in `plumb-studies {name} workcells/teachmover/studies/{name}.yaml`"
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        cause: std::io::Error,
        /// The command that was to run it.
        name: String,
    },
    /// It is not written as a study is: every mistake in it.
    #[error(transparent)]
    Form(#[from] FileProblems),
}

impl Common {
    /// This, with what a line says in its place.
    pub fn with(&self, line: &Common) -> Common {
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
    pub fn varied(&self, what: &str, value: f64) -> Common {
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
pub fn lay_over(value: &mut Value, patch: &Value) {
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
