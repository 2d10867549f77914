//! What of a fleet somebody may have to be informed of, beside what its page shows.

use sqlx::postgres::PgRow;
use sqlx::{FromRow, Row as _};

use crate::error::During as _;
use crate::sql::{from_row, utc};
use crate::{Central, CentralError};

/// A step that goes on in the newest run of a cell, as far as the database knows.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenStep {
    /// Identity of the record.
    pub record: String,
    /// The cell.
    pub cell: String,
    /// The run, in the cell's own record.
    pub run: i64,
    /// The step's row, in the cell's own record.
    pub row: i64,
    /// The step.
    pub step: String,
    /// When it began, by the cell's clock.
    pub started: String,
    /// For how long it goes on, s.
    pub open_s: f64,
    /// How long it was planned to take, s; none where the plan does not say.
    pub planned_s: Option<f64>,
}

/// A run that ended otherwise than passed.
#[derive(Debug, Clone, PartialEq)]
pub struct BadEnd {
    /// Identity of the record.
    pub record: String,
    /// The cell.
    pub cell: String,
    /// The run, in the cell's own record.
    pub run: i64,
    /// `failed`, `error`, `aborted`, `needs_operator`.
    pub state: String,
    /// What it said at its end.
    pub message: Option<String>,
    /// When, by the cell's clock.
    pub ended: String,
}

from_row!(OpenStep: record, cell, run, row, step, started, open_s, planned_s);
from_row!(BadEnd: record, cell, run, state, message, ended);

impl Central {
    /// The innermost step that goes on in the newest run of each cell; not where a prompt waits.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn open_steps(&mut self) -> Result<Vec<OpenStep>, CentralError> {
        sqlx::query_as(concat!(
            "SELECT c.record, c.cell, c.run, s.number AS row, s.body->>'step' AS step, ",
            utc!("(s.body->>'started')::timestamptz"),
            " AS started, extract(epoch FROM now() - (s.body->>'started')::timestamptz)::float8 AS open_s, \
             (SELECT max((p.body->>'estimate_s')::float8) FROM outbox p WHERE p.record = c.record AND p.kind = 'plan' \
              AND (p.body->>'run')::bigint = c.run AND p.body->>'step' = s.body->>'step') AS planned_s \
             FROM cells c CROSS JOIN LATERAL ( \
              SELECT number, body FROM (SELECT DISTINCT ON (o.number) o.number, o.body FROM outbox o \
               WHERE o.record = c.record AND o.kind = 'steps' AND (o.body->>'run')::bigint = c.run \
               ORDER BY o.number DESC, o.sequence DESC) n WHERE body->>'ended' IS NULL ORDER BY number DESC LIMIT 1) s \
             WHERE c.state = 'running' AND c.waits_for IS NULL ORDER BY c.cell, c.record"
        ))
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list the steps that go on")
    }

    /// For how long the server has been up, s.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn up_s(&mut self) -> Result<f64, CentralError> {
        sqlx::query_scalar("SELECT extract(epoch FROM now() - pg_postmaster_start_time())::float8")
            .fetch_one(&mut self.connection)
            .await
            .during("cannot tell for how long it is up")
    }

    /// Runs that ended otherwise than passed within so many days.
    ///
    /// # Errors
    /// The database does not answer.
    pub async fn bad_ends(&mut self, days: u32) -> Result<Vec<BadEnd>, CentralError> {
        // A run's end is written when it ends: older rows need not be gone through.
        sqlx::query_as(concat!(
            "SELECT record, cell, run, state, message, ",
            utc!("ended"),
            " AS ended FROM (SELECT record, body->>'cell' AS cell, number AS run, body->>'state' AS state, body->>'message' AS message, \
              (body->>'ended')::timestamptz AS ended FROM ( \
               SELECT DISTINCT ON (record, number) record, number, body FROM outbox \
               WHERE kind = 'runs' AND made > now() - make_interval(days => $1) ORDER BY record, number, sequence DESC) n) r \
             WHERE state NOT IN ('running', 'passed') AND ended > now() - make_interval(days => $1) ORDER BY ended, record",
        ))
        .bind(i32::try_from(days).unwrap_or(i32::MAX))
        .fetch_all(&mut self.connection)
        .await
        .during("cannot list the runs that have ended")
    }
}
