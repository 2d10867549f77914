//! What a run measured, as a measurement table of the model lab: trigger poses of its searches, and the rows its procedures write.

use std::collections::{BTreeMap, BTreeSet};

use plumb_record::{CONTROLLER_ZERO, StoredCorrection, StoredStep, StoredTrigger};
use serde_json::Value;

use crate::step::CIRCUMSTANCES;
use crate::workcell::{ModelFile, RobotSetting};

/// Which zeros the joints of the table are based on. All rows are on the same, although a run may put new ones in force on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zeros {
    /// Those in force when the run began: a model shows what the run found wrong.
    AsFound,
    /// Those the run found: a model shows what is left.
    AsLeft,
}

/// Why there is no table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// The robot has no model.
    #[error(
        "robot `{0}` has no model in its cell, so its joints have no place in a table: give it one under `robots:`"
    )]
    NoModel(String),
    /// The procedure says of nothing what was measured there.
    #[error(
        "no step of the run says what it measured: write steps of kind `row`, or give searches `finds: {{on: SURFACE, height_mm: ...}}` with a \
         surface of the model file"
    )]
    NothingMeasured,
    /// A joint of the cell is not in the record.
    #[error("the record of the run has no joint `{0}`: the cell file was changed since")]
    NoJoint(String),
}

/// What the record holds of a run.
#[derive(Debug, Clone, Copy)]
pub struct Recorded<'a> {
    /// The run.
    pub run: i64,
    /// Its steps, in the order they were begun.
    pub steps: &'a [StoredStep],
    /// Its trigger poses.
    pub triggers: &'a [StoredTrigger],
    /// What it corrected.
    pub corrections: &'a [StoredCorrection],
}

/// One row.
struct Row {
    time_ns: i64,
    step: String,
    /// Of the model's joints, deg, or mm of one that slides.
    joints: Vec<f64>,
    /// Side from which each joint of the model arrived: -1, 0 (it did not move), 1; for a row of a record that says nothing of it, none.
    approach: Option<Vec<i8>>,
    /// What was measured: column, cell.
    cells: Vec<(String, String)>,
}

/// A table as CSV with the model lab's columns: `q1_deg ...` (`q3_mm` of a joint that slides), what was measured, `approach_q1 ...`, `time_s`, and, as a covariate, `step`. Trigger poses
/// also have `half_width_deg`, or `half_width_mm`; only those of the slow approach of searches that say what they find. Rows of several runs bear the run as
/// their `session`, and no time: each run has a clock of its own.
///
/// [`provenance`] gives comments for its head.
///
/// # Errors
/// [`TableError`]
pub fn measurement_table(
    robot: &RobotSetting,
    runs: &[Recorded<'_>],
    zeros: Zeros,
) -> Result<String, TableError> {
    let model = robot.model.as_ref().ok_or_else(|| TableError::NoModel(robot.device.clone()))?;
    let mut all = Vec::new();
    for recorded in runs {
        let maker = Maker { robot, model, recorded, zeros };
        let mut rows = maker.written_rows()?;
        rows.extend(maker.trigger_rows()?);
        rows.sort_by_key(|row| row.time_ns);
        if let Some(begin_ns) = rows.first().map(|first| first.time_ns) {
            for row in &mut rows {
                row.cells.push(match runs.len() {
                    1 => ("time_s".to_owned(), ((row.time_ns - begin_ns) as f64 / 1e9).to_string()),
                    _ => ("session".to_owned(), recorded.run.to_string()),
                });
            }
        }
        all.extend(rows);
    }
    if all.is_empty() { Err(TableError::NothingMeasured) } else { Ok(in_columns(&all, model)) }
}

/// Comments for the head of a table: which cell and runs it is of, and which model their joints belong to. The model lab compares the model.
pub fn provenance(cell: &str, runs: &[i64], model: &ModelFile) -> String {
    let runs: Vec<String> = runs.iter().map(i64::to_string).collect();
    let name = model.file.file_name().unwrap_or(model.file.as_os_str()).to_string_lossy();
    let hash = plumb_record::sha256_hex(model.text.as_bytes());
    format!(
        "# cell: {cell}\n# run: {}\n# {MODEL_COMMENT}: {name}\n# {HASH_COMMENT}: {hash}\n",
        runs.join(", ")
    )
}

/// How the comment with the name of the model's file begins.
pub const MODEL_COMMENT: &str = "model";
/// How the comment with the SHA-256 of the model's file begins.
pub const HASH_COMMENT: &str = "model sha256";

fn in_columns(rows: &[Row], model: &ModelFile) -> String {
    let joints = model.joints.len();
    let measured: BTreeSet<&str> =
        rows.iter().flat_map(|row| &row.cells).map(|(name, _)| name.as_str()).collect();
    let sided = rows.iter().any(|row| row.approach.is_some());
    let mut columns: Vec<String> = (0..joints)
        .map(|joint| format!("q{}_{}", joint + 1, if model.slides(joint) { "mm" } else { "deg" }))
        .collect();
    if sided {
        columns.extend((1..=joints).map(|joint| format!("approach_q{joint}")));
    }
    columns.extend(measured.iter().map(|name| (*name).to_owned()));
    columns.push("step".to_owned());
    let mut text = columns.join(",") + "\n";
    for row in rows {
        let mut fields: Vec<String> = row.joints.iter().map(f64::to_string).collect();
        if sided {
            let side = |joint: usize| row.approach.as_ref().and_then(|sides| sides.get(joint));
            fields.extend((0..joints).map(|joint| side(joint).map(i8::to_string).unwrap_or_default()));
        }
        for column in &measured {
            let cell = row.cells.iter().find(|(name, _)| name == column);
            fields.push(cell.map(|(_, cell)| cell.clone()).unwrap_or_default());
        }
        fields.push(row.step.clone());
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    text
}

struct Maker<'a> {
    robot: &'a RobotSetting,
    model: &'a ModelFile,
    recorded: &'a Recorded<'a>,
    zeros: Zeros,
}

impl Maker<'_> {
    /// What steps of kind `row` have written: nothing else ends with such a result.
    fn written_rows(&self) -> Result<Vec<Row>, TableError> {
        let mut rows = Vec::new();
        let newest: BTreeMap<&str, usize> = self
            .recorded
            .steps
            .iter()
            .enumerate()
            .map(|(position, step)| (step.step.as_str(), position))
            .collect();
        for (position, step) in self.recorded.steps.iter().enumerate() {
            // A row that was written again, or was to be when the run ended, no longer counts.
            if newest.get(step.step.as_str()) != Some(&position) {
                continue;
            }
            let of = |key: &str| step.result.get(key);
            let (Some(joints), Some(Value::Object(columns))) = (of("joints"), of("columns")) else {
                continue;
            };
            if of("robot").and_then(Value::as_str) != Some(self.robot.device.as_str()) {
                continue;
            }
            let cells = columns.iter().map(|(name, value)| (name.clone(), cell_of(value)));
            rows.push(Row {
                time_ns: of("time_ns").and_then(Value::as_i64).unwrap_or(0),
                step: step.step.clone(),
                joints: self.model_joints(joints, position)?,
                approach: of("sides").map(|sides| self.model.model_sides(&self.sides(sides), None)),
                cells: cells.collect(),
            });
        }
        Ok(rows)
    }

    fn trigger_rows(&self) -> Result<Vec<Row>, TableError> {
        let requested = self.recorded.triggers.iter();
        let requested =
            requested.filter(|one| one.fine && one.device == self.robot.device && one.surface.is_some());
        requested.map(|trigger| self.trigger_row(trigger)).collect()
    }

    fn trigger_row(&self, trigger: &StoredTrigger) -> Result<Row, TableError> {
        let searched = self.robot.joints.iter().position(|(joint, _)| *joint == trigger.joint);
        let mut sides = self.sides(&trigger.sides);
        if let (Some(side), Some(direction)) =
            (searched.and_then(|joint| sides.get_mut(joint)), trigger.direction)
        {
            *side = direction;
        }
        let height = trigger.height_mm.map(|height| height.to_string()).unwrap_or_default();
        let position = self.position_of(&trigger.step);
        let half_width = if trigger.unit == "mm" { "half_width_mm" } else { "half_width_deg" };
        let cells = [
            ("on", trigger.surface.clone().unwrap_or_default()),
            ("signal", if trigger.fired { "on" } else { "off" }.to_owned()),
            ("height_mm", height),
            (half_width, trigger.half_width.to_string()),
        ];
        Ok(Row {
            time_ns: trigger.time_ns,
            step: trigger.step.clone(),
            joints: self.model_joints(&trigger.joints, position)?,
            approach: Some(self.model.model_sides(&sides, searched)),
            cells: cells
                .map(|(name, cell)| (name.to_owned(), cell))
                .into_iter()
                .chain(self.circumstances(position))
                .collect(),
        })
    }

    /// Under which load and so on a search ended.
    fn circumstances(&self, position: usize) -> impl Iterator<Item = (String, String)> {
        let entries =
            self.recorded.steps.get(position).and_then(|step| step.result.get(CIRCUMSTANCES)?.as_object());
        entries.into_iter().flatten().map(|(column, value)| (column.clone(), cell_of(value)))
    }

    /// The way each joint of the drive last went, as the record holds it.
    fn sides(&self, recorded: &Value) -> Vec<i8> {
        let side = |(joint, _): &(String, _)| recorded.get(joint).and_then(Value::as_i64);
        self.robot.joints.iter().map(|joint| side(joint).map_or(0, |side| side.signum() as i8)).collect()
    }

    /// Where a step is among all that were begun: at its last attempt.
    fn position_of(&self, step: &str) -> usize {
        self.recorded.steps.iter().rposition(|known| known.step == step).unwrap_or(0)
    }

    /// The model's joints, deg, or mm of one that slides, on the zeros that are asked for. `position` is where the step that read them is.
    fn model_joints(&self, joints: &Value, position: usize) -> Result<Vec<f64>, TableError> {
        let mut drive = Vec::new();
        for (joint, unit) in &self.robot.joints {
            let (reported, value) =
                joint_of(joints, joint).ok_or_else(|| TableError::NoJoint(joint.clone()))?;
            let zero = self.zero(joint).unwrap_or(value - reported);
            drive.push(unit.to_internal(reported + zero + self.declared_since(joint, position)));
        }
        let shown = |(joint, value): (usize, f64)| {
            if self.model.slides(joint) { value } else { value.to_degrees() }
        };
        Ok(self.model.model_joints(&drive).into_iter().enumerate().map(shown).collect())
    }

    fn in_force(&self, joint: &str) -> impl DoubleEndedIterator<Item = &StoredCorrection> {
        let joint = joint.to_owned();
        self.recorded.corrections.iter().filter(move |known| {
            known.key.device == self.robot.device && known.key.site == joint && known.revision.is_some()
        })
    }

    /// The zero of a joint that this program keeps, if the run put one in force.
    fn zero(&self, joint: &str) -> Option<f64> {
        let mut kept = self.in_force(joint).filter(|known| known.key.quantity != CONTROLLER_ZERO);
        match self.zeros {
            Zeros::AsFound => kept.next().map(|first| first.old),
            Zeros::AsLeft => kept.next_back().map(|last| last.new),
        }
    }

    /// What a joint's reading lacks because its controller was given another zero in the run: after the reading, or before it.
    fn declared_since(&self, joint: &str, position: usize) -> f64 {
        let declared = self.in_force(joint).filter(|known| known.key.quantity == CONTROLLER_ZERO);
        declared
            .map(|known| {
                let before = self.position_of(&known.step) < position;
                match (self.zeros, before) {
                    (Zeros::AsFound, true) => known.old - known.new,
                    (Zeros::AsLeft, false) => known.new - known.old,
                    _ => 0.0,
                }
            })
            .sum()
    }
}

/// A cell of a CSV file.
fn cell_of(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// What the drive said of a joint, and what it meant with the zero in force.
fn joint_of(joints: &Value, name: &str) -> Option<(f64, f64)> {
    let row = joints.as_array()?.iter().find(|row| row.get("name").and_then(Value::as_str) == Some(name))?;
    Some((row.get("drive")?.as_f64()?, row.get("value")?.as_f64()?))
}
