//! One corrected quantity over time.

use plumb_record::{CorrectionKey, StoredCorrection};

/// Every value a quantity ever had in force.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trend {
    /// What it is, for people: `waist zero of arm`.
    pub name: String,
    /// The cell.
    pub cell: String,
    /// The device.
    pub device: String,
    /// Unit of the values.
    pub unit: String,
    /// Oldest first.
    pub points: Vec<TrendPoint>,
}

impl Trend {
    /// What going back to a revision changes of this quantity, in words; none where that is in force.
    pub(super) fn change_to(&self, revision: i64) -> Option<String> {
        let now = self.points.last()?;
        let then = self.points.iter().rfind(|point| point.revision <= revision);
        let unit = &self.unit;
        match then {
            Some(then) if then.value == now.value => None,
            Some(then) => Some(format!("{}: {:.4} -> {:.4} {unit}", self.name, now.value, then.value)),
            None => Some(format!(
                "{}: {:.4} {unit} -> what was before its first correction",
                self.name, now.value
            )),
        }
    }
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrendPoint {
    /// When it was found, RFC 3339 in UTC.
    pub time: String,
    /// The same in seconds since 1970.
    pub seconds: f64,
    /// The value.
    pub value: f64,
    /// Its standard uncertainty; none where it was not determined.
    pub uncertainty: Option<f64>,
    /// The revision that put it in force.
    pub revision: i64,
    /// The run that found it; none where an older value was brought back.
    pub run: Option<i64>,
}

/// The trend of a quantity from what the record holds of it.
pub(super) fn of(cell: &str, key: &CorrectionKey, history: &[StoredCorrection]) -> Trend {
    let what = match key.quantity.strip_prefix("joint_") {
        Some(of_joint) => format!("{} {}", key.site, of_joint.replace('_', " ")),
        // A parameter's name says what it is.
        None if key.quantity == "sensor_parameter" => key.site.replace('_', " "),
        None => format!("{} {}", key.site, key.quantity.replace('_', " ")),
    };
    let point = |one: &StoredCorrection| {
        Some(TrendPoint {
            seconds: seconds_of(&one.proposed)?,
            time: one.proposed.clone(),
            value: one.new,
            uncertainty: one.uncertainty,
            revision: one.revision.unwrap_or_default(),
            run: one.run.map(|run| run.0),
        })
    };
    Trend {
        name: format!("{what} of {}", key.device),
        cell: cell.to_owned(),
        device: key.device.clone(),
        unit: history.first().map_or_else(String::new, |one| one.unit.clone()),
        points: history.iter().filter_map(point).collect(),
    }
}

/// Seconds since 1970 of a time as the record writes it, `2026-11-21T09:17:24.250Z`; none if it is written otherwise.
pub(super) fn seconds_of(time: &str) -> Option<f64> {
    let (date, clock) = time.strip_suffix('Z')?.split_once('T')?;
    let mut date = date.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (date.next()?.ok()?, date.next()?.ok()?, date.next()?.ok()?);
    let mut clock = clock.splitn(3, ':').map(str::parse::<f64>);
    let (hours, minutes, seconds) = (clock.next()?.ok()?, clock.next()?.ok()?, clock.next()?.ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    Some(days_from_1970(year, month, day) as f64 * 86_400.0 + hours * 3600.0 + minutes * 60.0 + seconds)
}

/// Days from 1970-01-01 to a date of the Gregorian calendar. The year is taken to begin in March, so that the leap day is
/// its last (H. Hinnant, "chrono-compatible low-level date algorithms", `days_from_civil`).
fn days_from_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_record_become_seconds_since_1970() {
        assert_eq!(seconds_of("1970-01-01T00:00:00.000Z"), Some(0.0));
        assert_eq!(seconds_of("2000-02-29T12:00:00.500Z"), Some(951_825_600.5));
        assert_eq!(seconds_of("2026-11-21T09:17:24.250Z"), Some(1_795_252_644.25));
        for wrong in ["", "yesterday", "2026-11-21", "2026-13-21T00:00:00Z", "2026-11-21T09:17Z"] {
            assert_eq!(seconds_of(wrong), None, "{wrong}");
        }
    }
}
