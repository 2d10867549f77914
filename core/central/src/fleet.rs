//! What a fleet's page asks.

use serde::Serialize;
use sqlx::postgres::PgRow;
use sqlx::{FromRow, Row as _};

use crate::error::During as _;
use crate::sql::{from_row, utc};
use crate::{Central, CentralError};

/// A cell as its record last reported. Times are UTC, RFC 3339.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellState {
    /// Identity of its record.
    pub record: String,
    /// Its name.
    pub cell: String,
    /// The machine that ships its record.
    pub host: String,
    /// When its shipper was last heard of, by the database's clock.
    pub last_seen: String,
    /// How long ago that was, s.
    pub silent_s: f64,
    /// When its shipper ended in good order, where it has not come back since.
    pub signed_off: Option<String>,
    /// Number of its last run, in its own record.
    pub run: i64,
    /// Procedure of that run.
    pub procedure: String,
    /// `running`, `passed`, `failed`, `error`, `aborted`, `needs_operator`.
    pub state: String,
    /// When the run began.
    pub started: String,
    /// When it ended.
    pub ended: Option<String>,
    /// What it said at its end.
    pub message: Option<String>,
    /// The last step that began.
    pub step: Option<String>,
    /// Title of the prompt that waits.
    pub waits_for: Option<String>,
    /// Since when it has waited, by the cell's clock.
    pub waits_since: Option<String>,
    /// How long it has waited, s.
    pub waits_s: Option<f64>,
    /// The instrument of that run whose calibration runs out first.
    pub due_instrument: Option<String>,
    /// The day on which it does: 2027-03-31.
    pub due: Option<String>,
    /// When a run of it passed last.
    pub last_passed: Option<String>,
    /// Runs that wait in its queue.
    pub queued: i64,
    /// Its arms, as their model files name them.
    pub arm: Option<String>,
}

/// A prompt that nobody has answered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Waiting {
    /// Identity of the record.
    pub record: String,
    /// The cell.
    pub cell: String,
    /// The run, in the cell's own record.
    pub run: i64,
    /// The step that asks.
    pub step: String,
    /// What it asks.
    pub title: String,
    /// For how long, s.
    pub waits_s: f64,
}

/// One correction, for a trend over time and cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CorrectionPoint {
    /// The cell.
    pub cell: String,
    /// Identity of its record.
    pub record: String,
    /// The device.
    pub device: String,
    /// What was corrected: `joint_zero`.
    pub quantity: String,
    /// Where: a joint.
    pub place: String,
    /// The run that found it.
    pub run: Option<i64>,
    /// When, UTC.
    pub proposed: String,
    /// The value found.
    pub value: f64,
    /// One standard uncertainty; none where it was not determined.
    pub uncertainty: Option<f64>,
    /// Unit of both.
    pub unit: String,
}

/// One number of one effect, for a trend over time and cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectPoint {
    /// The cell.
    pub cell: String,
    /// Identity of its record.
    pub record: String,
    /// The device.
    pub device: String,
    /// When the model was written, UTC.
    pub made: String,
    /// Kind of effect.
    pub effect: String,
    /// Where it acts.
    pub place: String,
    /// Which of its numbers.
    pub parameter: String,
    /// The number, as the model file has it.
    pub value: f64,
    /// `mechanism` or `correction`.
    pub claim: String,
}

/// Something of which there is a trend.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// A correction, `arm.waist`, or an effect, `joint_compliance(shoulder)`.
    pub name: String,
    /// Whether it is an effect.
    pub is_effect: bool,
    /// The arm it is of; empty where no model file names one.
    pub arm: String,
    /// Cells that have it.
    pub cells: i64,
    /// Values in all.
    pub values: i64,
}

from_row!(CellState: record, cell, host, last_seen, silent_s, signed_off, run, procedure, state, started, ended, message, step, waits_for, waits_since, waits_s, due_instrument, due, last_passed, queued, arm);
from_row!(Quantity: name, is_effect, arm, cells, values);
from_row!(Waiting: record, cell, run, step, title, waits_s);
from_row!(CorrectionPoint: cell, record, device, quantity, place, run, proposed, value, uncertainty, unit);
from_row!(EffectPoint: cell, record, device, made, effect, place, parameter, value, claim);

impl Central {
    /// Every cell, by name.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn cells(&mut self) -> Result<Vec<CellState>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT record, cell, host, extract(epoch FROM now() - last_seen)::float8 AS silent_s, ",
            utc!("last_seen"),
            " AS last_seen, (SELECT ",
            utc!("signed_off"),
            " FROM records r WHERE r.record = cells.record) AS signed_off, run, procedure, state, ",
            utc!("started"),
            " AS started, ",
            utc!("ended"),
            " AS ended, message, step, waits_for, extract(epoch FROM now() - waits_since)::float8 AS waits_s, ",
            utc!("waits_since"),
            " AS waits_since, due_instrument, due, ",
            utc!("last_passed"),
            " AS last_passed, queued, arm FROM cells ORDER BY cell, record"
        ))
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list the cells")
    }

    /// Every prompt that waits, the oldest first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn waiting(&mut self) -> Result<Vec<Waiting>, CentralError> {
        sqlx::query_as(
            "SELECT record, cell, run, step, coalesce(title, '') AS title, extract(epoch FROM now() - asked)::float8 AS waits_s \
             FROM waiting ORDER BY asked",
        )
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list what waits")
    }

    /// Everything of which there is a trend, what most cells have first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn quantities(&mut self) -> Result<Vec<Quantity>, CentralError> {
        sqlx::query_as(
            "SELECT name, is_effect, coalesce(a.arm, '') AS arm, count(DISTINCT (q.record, q.cell)) AS cells, count(*) AS values FROM ( \
             SELECT record, cell, device, device || '.' || place AS name, false AS is_effect FROM corrections WHERE revision IS NOT NULL \
             UNION ALL SELECT record, cell, device, effect || CASE place WHEN '' THEN '' ELSE '(' || place || ')' END, true FROM effects) q \
             LEFT JOIN arms a ON a.record = q.record AND a.cell = q.cell AND a.device = q.device \
             GROUP BY name, is_effect, coalesce(a.arm, '') ORDER BY cells DESC, is_effect DESC, name",
        )
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list what there is")
    }

    /// All corrections of a quantity at a site (`arm.waist`: device and site), over all cells or those with one arm, the oldest first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn corrections(
        &mut self,
        device: &str,
        site: &str,
        arm: Option<&str>,
    ) -> Result<Vec<CorrectionPoint>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT cell, record, device, quantity, place, run, ",
            utc!("proposed"),
            " AS proposed, new AS value, uncertainty, unit FROM corrections c WHERE device = $1 AND place = $2 AND revision IS NOT NULL \
             AND ($3::text IS NULL OR EXISTS (SELECT FROM arms a WHERE a.record = c.record AND a.cell = c.cell AND a.device = c.device AND a.arm = $3)) \
             ORDER BY proposed, record, id"
        ))
        .bind(device)
        .bind(site)
        .bind(arm)
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list corrections")
    }

    /// All numbers of an effect at a site, over all cells or those with one arm, the oldest first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn effects(
        &mut self,
        effect: &str,
        site: &str,
        arm: Option<&str>,
    ) -> Result<Vec<EffectPoint>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT cell, record, device, ",
            utc!("made"),
            " AS made, effect, place, parameter, value, claim FROM effects e WHERE effect = $1 AND place = $2 \
             AND ($3::text IS NULL OR EXISTS (SELECT FROM arms a WHERE a.record = e.record AND a.cell = e.cell AND a.device = e.device AND a.arm = $3)) \
             ORDER BY made, record, sequence, parameter"
        ))
        .bind(effect)
        .bind(site)
        .bind(arm)
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list effects")
    }
}
