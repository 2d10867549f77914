//! Trigger poses: where the arm was at the moment a sensor fired.

use rusqlite::params;
use serde::Serialize;
use serde_json::Value;

use crate::error::During;
use crate::run::json_column;
use crate::{Record, RecordError, RunId};

/// An edge a search has found.
#[derive(Debug, Clone, PartialEq)]
pub struct Trigger<'a> {
    /// The robot.
    pub device: &'a str,
    /// The sensor.
    pub sensor: &'a str,
    /// The condition began, rather than ended.
    pub fired: bool,
    /// Found by the slow approach, rather than the fast one.
    pub fine: bool,
    /// Clock of the cell, nanoseconds.
    pub time_ns: u64,
    /// Joint searched along.
    pub joint: &'a str,
    /// The pose: names, what the drive said, what it means with the zeros in force, units.
    pub joints: &'a Value,
    /// The searched joint is known to within this, either way.
    pub half_width: f64,
    /// Unit of the half width.
    pub unit: &'a str,
    /// Which way the searched joint went: 1 or -1.
    pub direction: i8,
    /// Which way each joint last went, by name: 1, -1, or 0 for one that has not moved.
    pub sides: &'a Value,
    /// What the sensor was over, as the robot's model file calls it, where the procedure says.
    pub surface: Option<&'a str>,
    /// How high over it, mm.
    pub height_mm: Option<f64>,
}

/// A trigger pose as the record holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoredTrigger {
    /// The search that found it.
    pub step: String,
    /// The robot.
    pub device: String,
    /// The sensor.
    pub sensor: String,
    /// The condition began, rather than ended.
    pub fired: bool,
    /// Found by the slow approach, rather than the fast one.
    pub fine: bool,
    /// Clock of the cell, nanoseconds.
    pub time_ns: i64,
    /// Joint searched along.
    pub joint: String,
    /// The pose, in the writer's own words.
    pub joints: Value,
    /// The searched joint is known to within this, either way.
    pub half_width: f64,
    /// Unit of the half width.
    pub unit: String,
    /// Which way the searched joint went: 1 or -1; not known of runs of older programs.
    pub direction: Option<i8>,
    /// Which way each joint last went, by name: 1, -1, or 0 for one that has not moved; null of runs of older programs.
    pub sides: Value,
    /// What the sensor was over, as the robot's model file calls it.
    pub surface: Option<String>,
    /// How high over it, mm.
    pub height_mm: Option<f64>,
}

impl Record {
    /// Notes a trigger pose.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn note_trigger(&mut self, run: RunId, step: &str, trigger: &Trigger<'_>) -> Result<(), RecordError> {
        self.connection
            .execute(
                "INSERT INTO triggers (run, step, device, sensor, fired, fine, time_ns, joint, joints, half_width, unit, \
                 surface, height_mm, direction, sides) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15)",
                params![
                    run.0,
                    step,
                    trigger.device,
                    trigger.sensor,
                    trigger.fired,
                    trigger.fine,
                    i64::try_from(trigger.time_ns).unwrap_or(i64::MAX),
                    trigger.joint,
                    trigger.joints.to_string(),
                    trigger.half_width,
                    trigger.unit,
                    trigger.surface,
                    trigger.height_mm,
                    trigger.direction,
                    trigger.sides.to_string()
                ],
            )
            .during("note a trigger pose")?;
        Ok(())
    }

    /// All trigger poses of a run, in the order they were found.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn triggers(&self, run: RunId) -> Result<Vec<StoredTrigger>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT step, device, sensor, fired, fine, time_ns, joint, joints, half_width, unit, surface, height_mm, direction, sides FROM triggers \
                 WHERE run = ?1 ORDER BY id",
            )
            .during("read the trigger poses of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(StoredTrigger {
                    step: row.get(0)?,
                    device: row.get(1)?,
                    sensor: row.get(2)?,
                    fired: row.get(3)?,
                    fine: row.get(4)?,
                    time_ns: row.get(5)?,
                    joint: row.get(6)?,
                    joints: json_column(row, 7)?,
                    half_width: row.get(8)?,
                    unit: row.get(9)?,
                    surface: row.get(10)?,
                    height_mm: row.get(11)?,
                    direction: row.get(12)?,
                    sides: json_column(row, 13)?,
                })
            })
            .during("read the trigger poses of a run")?;
        rows.collect::<Result<_, _>>().during("read the trigger poses of a run")
    }
}
