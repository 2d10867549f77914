//! Trigger poses as a measurement table of the model lab.

use plumb_record::{StoredCorrection, StoredTrigger};
use serde_json::Value;

use crate::workcell::{ModelFile, RobotSetting};

/// Which zeros the joints of the table stand on. All rows stand on the same, although a run may put new ones in force on its way.
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
    /// No search says what it finds.
    #[error(
        "no search of the run says what its sensor stood over: give searches `finds: {{on: SURFACE, height_mm: ...}}`, with a surface of the \
         model file"
    )]
    NoSurface,
    /// A joint of the cell is not in the record.
    #[error("the record of the run has no joint `{0}`: the cell file was changed since")]
    NoJoint(String),
}

/// One trigger pose of the slow approach.
struct Row<'a> {
    trigger: &'a StoredTrigger,
    /// Of the model's joints, deg.
    joints: Vec<f64>,
    /// Side from which each joint of the model arrived: -1, 0 (it did not move), 1.
    approach: Vec<i8>,
}

/// The trigger poses of one robot as CSV with the model lab's columns: `q1_deg ...`, `approach_q1 ...`, `on`, `signal`, `height_mm`, `time_s`, and, as covariates,
/// `half_width_deg` and `step`. Only poses found by the slow approach of searches that say what they find.
///
/// # Errors
/// [`TableError`]
pub fn trigger_table(
    robot: &RobotSetting,
    triggers: &[StoredTrigger],
    corrections: &[StoredCorrection],
    zeros: Zeros,
) -> Result<String, TableError> {
    let model = robot.model.as_ref().ok_or_else(|| TableError::NoModel(robot.device.clone()))?;
    let wanted =
        triggers.iter().filter(|one| one.fine && one.device == robot.device && one.surface.is_some());
    let rows = wanted.map(|trigger| row(robot, model, trigger, corrections, zeros));
    let rows: Vec<Row<'_>> = rows.collect::<Result<_, _>>()?;
    let Some(first) = rows.first() else { return Err(TableError::NoSurface) };
    let begin_ns = first.trigger.time_ns;
    let count = model.joints.len();
    let mut columns: Vec<String> = (1..=count).map(|joint| format!("q{joint}_deg")).collect();
    columns.extend((1..=count).map(|joint| format!("approach_q{joint}")));
    columns.extend(["on", "signal", "height_mm", "time_s", "half_width_deg", "step"].map(str::to_owned));
    let mut text = columns.join(",") + "\n";
    for row in &rows {
        let mut fields: Vec<String> = row.joints.iter().map(f64::to_string).collect();
        fields.extend(row.approach.iter().map(i8::to_string));
        fields.push(row.trigger.surface.clone().unwrap_or_default());
        fields.push(if row.trigger.fired { "on" } else { "off" }.to_owned());
        fields.push(row.trigger.height_mm.map(|height| height.to_string()).unwrap_or_default());
        fields.push(((row.trigger.time_ns - begin_ns) as f64 / 1e9).to_string());
        fields.push(row.trigger.half_width.to_string());
        fields.push(row.trigger.step.clone());
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    Ok(text)
}

fn row<'a>(
    robot: &RobotSetting,
    model: &ModelFile,
    trigger: &'a StoredTrigger,
    corrections: &[StoredCorrection],
    zeros: Zeros,
) -> Result<Row<'a>, TableError> {
    let mut drive = Vec::new();
    for (joint, unit) in &robot.joints {
        let (said, value) =
            joint_of(&trigger.joints, joint).ok_or_else(|| TableError::NoJoint(joint.clone()))?;
        let mut of_joint = corrections.iter().filter(|known| {
            known.key.device == robot.device && known.key.place == *joint && known.revision.is_some()
        });
        let zero = match zeros {
            Zeros::AsFound => of_joint.next().map(|first| first.old),
            Zeros::AsLeft => of_joint.next_back().map(|last| last.new),
        };
        drive.push(unit.to_internal(said + zero.unwrap_or(value - said)));
    }
    let searched = robot.joints.iter().position(|(joint, _)| *joint == trigger.joint);
    let side = |(joint, _): &(String, _)| {
        let recorded = trigger.sides.get(joint).and_then(Value::as_i64).map_or(0, |side| side.signum() as i8);
        if *joint == trigger.joint { trigger.direction.unwrap_or(recorded) } else { recorded }
    };
    let sides: Vec<i8> = robot.joints.iter().map(side).collect();
    Ok(Row {
        trigger,
        joints: model.model_joints(&drive).into_iter().map(f64::to_degrees).collect(),
        approach: model.model_sides(&sides, searched),
    })
}

/// What the drive said of a joint, and what it meant with the zero in force.
fn joint_of(joints: &Value, name: &str) -> Option<(f64, f64)> {
    let row = joints.as_array()?.iter().find(|row| row.get("name").and_then(Value::as_str) == Some(name))?;
    Some((row.get("drive")?.as_f64()?, row.get("value")?.as_f64()?))
}
