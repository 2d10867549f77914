//! What a fleet's page asks.

use serde::Serialize;
use sqlx::postgres::PgRow;
use sqlx::{FromRow, Row as _};

use crate::error::During as _;
use crate::{Central, CentralError};

/// A cell as its record last told. Times are UTC, RFC 3339.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellState {
    /// Identity of its record.
    pub record: String,
    /// Its name.
    pub cell: String,
    /// The machine that ships its record.
    pub host: String,
    /// How long ago its shipper was last heard of, s.
    pub silent_s: f64,
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
    /// How long it has waited, s.
    pub waits_s: Option<f64>,
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

/// Reads a row whose columns have the names of the fields.
macro_rules! from_row {
    ($name:ident: $($field:ident),+) => {
        impl<'r> FromRow<'r, PgRow> for $name {
            fn from_row(row: &'r PgRow) -> Result<Self, sqlx::Error> {
                Ok(Self { $($field: row.try_get(stringify!($field))?),+ })
            }
        }
    };
}

from_row!(CellState: record, cell, host, silent_s, run, procedure, state, started, ended, message, step, waits_for, waits_s);
from_row!(Waiting: record, cell, run, step, title, waits_s);
from_row!(CorrectionPoint: cell, record, device, quantity, place, run, proposed, value, uncertainty, unit);
from_row!(EffectPoint: cell, record, device, made, effect, place, parameter, value, claim);

/// A time as RFC 3339, as SQL.
macro_rules! utc {
    ($column:literal) => {
        concat!("to_char(", $column, " AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"')")
    };
}

impl Central {
    /// Every cell, by name.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn cells(&mut self) -> Result<Vec<CellState>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT record, cell, host, extract(epoch FROM now() - last_seen)::float8 AS silent_s, run, procedure, state, ",
            utc!("started"),
            " AS started, ",
            utc!("ended"),
            " AS ended, message, step, waits_for, extract(epoch FROM now() - waits_since)::float8 AS waits_s \
             FROM cells ORDER BY cell, record"
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

    /// All corrections of a quantity at a place (`arm.waist`: device and place), over all cells, the oldest first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn corrections(
        &mut self,
        device: &str,
        place: &str,
    ) -> Result<Vec<CorrectionPoint>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT cell, record, device, quantity, place, run, ",
            utc!("proposed"),
            " AS proposed, new AS value, uncertainty, unit FROM corrections WHERE device = $1 AND place = $2 AND revision IS NOT NULL ORDER BY proposed, record, id"
        ))
        .bind(device)
        .bind(place)
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list corrections")
    }

    /// All numbers of an effect at a place, over all cells, the oldest first.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn effects(&mut self, effect: &str, place: &str) -> Result<Vec<EffectPoint>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT cell, record, device, ",
            utc!("made"),
            " AS made, effect, place, parameter, value, claim FROM effects WHERE effect = $1 AND place = $2 ORDER BY made, record, sequence, parameter"
        ))
        .bind(effect)
        .bind(place)
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list effects")
    }
}
