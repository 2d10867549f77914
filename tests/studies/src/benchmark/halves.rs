//! Replication: the rows of one table in two halves, each diagnosed for itself. What one half names, or locates at a joint, the other should.

use std::path::Path;

use plumb_calibration::effect::kind;
use plumb_diagnosis::laboratory::LaboratoryError;
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::Random;
use plumb_simulated::physics::campaign::Case;
use serde::Serialize;

use super::cells::Work;
use super::error::BenchmarkError;
use super::lab;
use super::trials::over_cases;
use crate::interval::Proportion;

/// A way of cutting a table in two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Cut {
    /// Poses at random; returns to one pose stay together.
    #[serde(rename = "lot")]
    AtRandom,
    /// Earlier and later rows.
    Order,
    /// Poses with the first joint below and above its median.
    Region,
}

impl Cut {
    pub(crate) const ALL: [Self; 3] = [Self::AtRandom, Self::Order, Self::Region];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::AtRandom => "poses at random",
            Self::Order => "earlier and later rows",
            Self::Region => "below and above the first joint's median",
        }
    }
}

/// What two halves say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Agreement {
    /// The same name, or the same site.
    Same,
    /// One names or locates something, and the other neither names nor locates anything.
    OneAlone,
    /// Each names or locates something, at different sites.
    Contrary,
    /// Neither names or locates anything.
    Neither,
}

impl Agreement {
    fn of(one: &Diagnosis, other: &Diagnosis) -> Self {
        match (site(one), site(other)) {
            (Some(one), Some(other)) if one == other => Self::Same,
            (Some(_), Some(_)) => Self::Contrary,
            (None, None) => Self::Neither,
            _ => Self::OneAlone,
        }
    }
}

/// The site that a diagnosis names or locates.
fn site(diagnosis: &Diagnosis) -> Option<&str> {
    match diagnosis.verdict {
        Verdict::Named => diagnosis.named.as_ref().map(|named| named.effect.site.as_str()),
        Verdict::Located => diagnosis.located.as_ref().map(|located| located.site.as_str()),
        _ => None,
    }
}

/// What became of a cell's tables, or of real ones, cut one way.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    cut: Cut,
    /// Only tables in which nothing goes by time.
    steady: bool,
    tables: usize,
    /// Of the tables of which a half names or locates something: the other says the same.
    replicated: Proportion,
    /// Of the same: the other says something else.
    contrary: Proportion,
    agreements: Vec<Agreement>,
}

impl Row {
    fn of(cut: Cut, steady: bool, agreements: Vec<Agreement>) -> Self {
        let decided = || agreements.iter().filter(|one| **one != Agreement::Neither);
        let fraction = |expected: Agreement| Proportion::of(decided().map(|one| *one == expected));
        let (replicated, contrary) = (fraction(Agreement::Same), fraction(Agreement::Contrary));
        Self { cut, steady, tables: agreements.len(), replicated, contrary, agreements }
    }
}

/// The two halves of a table's text; its columns of joints are those named `qN_deg` (or `_rad`, `_mm`).
pub(crate) fn halves(table: &str, cut: Cut, seed: u64) -> [String; 2] {
    let mut lines = table.lines();
    let header = lines.next().unwrap_or_default();
    let rows: Vec<&str> = lines.filter(|line| !line.trim().is_empty()).collect();
    let is_joint = |name: &str| {
        let number = name.trim().strip_prefix('q').and_then(|rest| rest.split_once('_'));
        number.is_some_and(|(digits, _)| {
            !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit())
        })
    };
    let joints: Vec<usize> =
        (0..).zip(header.split(',')).filter(|(_, name)| is_joint(name)).map(|(at, _)| at).collect();
    let cell = |row: &str, at: usize| row.split(',').nth(at).unwrap_or_default().trim().to_owned();
    let first: Vec<bool> = match cut {
        Cut::Order => (0..rows.len()).map(|row| 2 * row < rows.len()).collect(),
        Cut::Region => {
            let at =
                |row: &&str| joints.first().and_then(|joint| cell(row, *joint).parse().ok()).unwrap_or(0.0);
            let angles: Vec<f64> = rows.iter().map(at).collect();
            let mut sorted = angles.clone();
            sorted.sort_by(f64::total_cmp);
            let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
            angles.into_iter().map(|angle| angle < median).collect()
        }
        Cut::AtRandom => {
            let pose = |row: &&str| joints.iter().map(|joint| cell(row, *joint)).collect::<Vec<_>>();
            let mut poses: Vec<Vec<String>> = rows.iter().map(pose).collect();
            poses.sort();
            poses.dedup();
            let mut order: Vec<usize> = (0..poses.len()).collect();
            Random::seeded(seed).shuffle(&mut order);
            let in_first = |row: &&str| {
                let known = poses.binary_search(&pose(row));
                known.is_ok_and(|at| order.get(at).is_some_and(|rank| 2 * rank < poses.len()))
            };
            rows.iter().map(in_first).collect()
        }
    };
    [true, false].map(|expected| {
        let own = rows.iter().zip(&first).filter(|(_, first)| **first == expected).map(|(row, _)| *row);
        std::iter::once(header).chain(own).fold(String::new(), |text, line| text + line + "\n")
    })
}

/// What the halves of a table say, cut each way.
fn agreements(model: &str, table: &str, seed: u64) -> Result<Vec<Agreement>, LaboratoryError> {
    let of_cut = |cut: Cut| {
        let [one, other] = halves(table, cut, seed);
        Ok(Agreement::of(&lab::of_part(model, &one)?, &lab::of_part(model, &other)?))
    };
    Cut::ALL.into_iter().map(of_cut).collect()
}

/// A row for each way of cutting.
fn rows(steady: bool, compared: &[&Vec<Agreement>]) -> Vec<Row> {
    let of_cut = |(at, cut): (usize, Cut)| {
        Row::of(cut, steady, compared.iter().filter_map(|agreements| agreements.get(at).copied()).collect())
    };
    (0..).zip(Cut::ALL).map(of_cut).collect()
}

/// Whether something hidden happens once or goes by time: then earlier and later rows may each show another part of it, or only one of them any.
fn goes_by_time(case: &Case) -> bool {
    case.truth.hidden.iter().any(|hidden| changes_with_time(&hidden.effect))
}

/// Whether an effect happens once or goes by time.
pub(crate) fn changes_with_time(effect: &str) -> bool {
    kind(effect).is_some_and(|kind| kind.is_event || kind.depends_on_time)
}

/// Cuts every trial of a cell in two.
pub(super) fn replicated(work: &Work, seed: u64, count: usize) -> Result<Vec<Row>, BenchmarkError> {
    let found = over_cases(work, seed, count, |case| {
        let diagnosed = agreements(&case.model_yaml(), &case.table_csv(), case.truth.seed);
        let diagnosed = diagnosed
            .map_err(|source| BenchmarkError::Lab { seed: case.truth.seed, source: Box::new(source) })?;
        Ok((goes_by_time(case), diagnosed))
    })?;
    let all: Vec<&Vec<Agreement>> = found.iter().map(|(_, diagnosed)| diagnosed).collect();
    let steady: Vec<&Vec<Agreement>> =
        found.iter().filter(|(timed, _)| !timed).map(|(_, diagnosed)| diagnosed).collect();
    let by_order = rows(true, &steady).into_iter().filter(|row| row.cut == Cut::Order);
    Ok(rows(false, &all).into_iter().chain(by_order).collect())
}

/// Cuts one table of a real machine in two.
pub(super) fn of_files(model: &Path, table: &Path, seed: u64) -> Result<Vec<Row>, BenchmarkError> {
    let read = |path: &Path| {
        std::fs::read_to_string(path).map_err(|source| BenchmarkError::Read { path: path.to_owned(), source })
    };
    let found = agreements(&read(model)?, &read(table)?, seed)
        .map_err(|source| BenchmarkError::Table { path: table.to_owned(), source: Box::new(source) })?;
    Ok(rows(false, &[&found]))
}

/// The head of the table.
pub(super) fn heading() -> String {
    format!(
        "{:<60} {:>12} {:>24} {:>22}\n",
        "percent", "say anything", "the other says the same", "something else"
    )
}

/// Lines of the table.
pub(super) fn lines(title: &str, rows: &[Row]) -> String {
    let line = |row: &Row| {
        let diagnosed = format!("{} of {}", row.replicated.trials, row.tables);
        let without = if row.steady { ", nothing that goes by time" } else { "" };
        let name = format!("{}{without}", row.cut.name());
        let (same, other) = (row.replicated.percent(), row.contrary.percent());
        format!("  {name:<58} {diagnosed:>12} {same:>24} {other:>22}\n")
    };
    format!("{title}\n{}", rows.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "q1_deg,q2_deg,p1_x_mm\n10,0,1\n20,0,2\n10,0,3\n30,5,4\n40,5,5\n20,0,6\n";

    #[test]
    fn halves_hold_every_row_once_and_keep_returns_to_a_pose_together() {
        for cut in Cut::ALL {
            let parts = halves(TABLE, cut, 3);
            let mut rows: Vec<&str> = parts.iter().flat_map(|part| part.lines().skip(1)).collect();
            rows.sort_unstable();
            let mut all: Vec<&str> = TABLE.lines().skip(1).collect();
            all.sort_unstable();
            assert_eq!(rows, all, "{cut:?}");
            assert!(
                parts.iter().all(|part| part.starts_with("q1_deg") && part.lines().count() > 1),
                "{cut:?}"
            );
        }
        let at_random = halves(TABLE, Cut::AtRandom, 3);
        assert!(
            at_random.iter().all(|part| part.contains("10,0,1") == part.contains("10,0,3")),
            "{at_random:?}"
        );
        let by_order = halves(TABLE, Cut::Order, 3);
        assert!(by_order[0].ends_with("10,0,3\n"), "{by_order:?}");
    }

    #[test]
    fn shares_are_of_the_tables_of_which_a_half_says_something() {
        let row = Row::of(
            Cut::AtRandom,
            false,
            vec![
                Agreement::Same,
                Agreement::Same,
                Agreement::OneAlone,
                Agreement::Contrary,
                Agreement::Neither,
            ],
        );
        assert_eq!((row.replicated.count, row.replicated.trials, row.contrary.count), (2, 4, 1));
    }
}
