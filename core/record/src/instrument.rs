//! What the operator measured with.

use rusqlite::{Transaction, params};
use serde::Serialize;

use crate::error::During;
use crate::record::timestamp;
use crate::{Record, RecordError, RunId};

/// An instrument, as the cell file describes it and the record keeps it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Instrument {
    /// Its name in the cell.
    pub name: String,
    /// What it is, in words.
    pub what: String,
    /// Its serial number.
    pub serial: Option<String>,
    /// One standard uncertainty of a reading, in `unit`.
    pub uncertainty: Option<f64>,
    /// `mm` or `deg`.
    pub unit: Option<String>,
    /// The day until which its calibration holds: `2027-03-31`.
    pub calibration_due: Option<String>,
}

impl Instrument {
    /// Whether its calibration was due before a day, written `2026-11-21`.
    pub fn is_overdue(&self, today: &str) -> bool {
        self.calibration_due.as_deref().is_some_and(|due| due < today)
    }
}

/// Today by the wall clock, UTC: `2026-11-21`.
pub fn today() -> String {
    timestamp().chars().take(10).collect()
}

/// Whether a text is a day of the calendar, as `2026-11-21`.
pub fn is_day(text: &str) -> bool {
    text.len() == 10 && text.parse::<jiff::civil::Date>().is_ok()
}

impl Record {
    /// The instruments of a run, by name.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn instruments(&self, run: RunId) -> Result<Vec<Instrument>, RecordError> {
        let mut statement = self
            .connection
            .prepare(
                "SELECT name, what, serial, uncertainty, unit, calibration_due FROM instruments WHERE run = ?1 ORDER BY name",
            )
            .during("read the instruments of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(Instrument {
                    name: row.get(0)?,
                    what: row.get(1)?,
                    serial: row.get(2)?,
                    uncertainty: row.get(3)?,
                    unit: row.get(4)?,
                    calibration_due: row.get(5)?,
                })
            })
            .during("read the instruments of a run")?;
        rows.collect::<Result<_, _>>().during("read the instruments of a run")
    }
}

pub(crate) fn insert(
    transaction: &Transaction<'_>,
    run: RunId,
    instruments: &[Instrument],
) -> rusqlite::Result<()> {
    for one in instruments {
        transaction.execute(
            "INSERT OR REPLACE INTO instruments (run, name, what, serial, uncertainty, unit, calibration_due) \
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            params![run.0, one.name, one.what, one.serial, one.uncertainty, one.unit, one.calibration_due],
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_is_overdue_the_day_after_it_was_due() {
        let gauge = Instrument { calibration_due: Some("2026-11-20".to_owned()), ..Instrument::default() };
        assert!(!gauge.is_overdue("2026-11-20"));
        assert!(gauge.is_overdue("2026-11-21"));
        assert!(!Instrument::default().is_overdue("2026-11-21"), "one without a due date never is");
    }

    #[test]
    fn days_are_days_of_the_calendar() {
        assert!(is_day("2028-02-29") && is_day(&today()));
        assert!(!is_day("2027-02-29") && !is_day("2027-2-3") && !is_day("soon"));
    }
}
