//! Which rows a report draws and lists.

use std::collections::HashSet;

use plumb_diagnosis::laboratory::{Comparison, RowResidual};

/// Rows that are drawn and listed at most, besides the worst: a page with more of them opens slowly.
const MOST_ROWS: usize = 1500;

/// The worst rows that are listed.
const WORST: usize = 10;

/// The rows with the largest error, the worst first.
pub(super) fn worst(comparison: &Comparison) -> Vec<&RowResidual> {
    worst_by(comparison, |row| row.size)
}

/// The rows whose orientation is farthest off, the worst first.
pub(super) fn most_turned(comparison: &Comparison) -> Vec<&RowResidual> {
    worst_by(comparison, |row| row.size_deg)
}

/// The rows with the largest error of some kind, the worst first; none without any.
fn worst_by(comparison: &Comparison, size: impl Fn(&RowResidual) -> Option<f64>) -> Vec<&RowResidual> {
    let sizes = comparison.rows.iter().filter_map(|row| Some((size(row)?, row)));
    let mut rows: Vec<(f64, &RowResidual)> =
        sizes.filter(|(size, _)| size.is_finite() && *size > 0.0).collect();
    rows.sort_by(|one, other| other.0.total_cmp(&one.0));
    rows.into_iter().take(WORST).map(|(_, row)| row).collect()
}

/// The lines of the rows that are shown: all, or some spread evenly and the worst.
pub(super) fn shown(comparison: &Comparison) -> HashSet<u32> {
    let every = comparison.rows.len().div_ceil(MOST_ROWS).max(1);
    let evenly = comparison.rows.iter().step_by(every);
    evenly.chain(worst(comparison)).chain(most_turned(comparison)).map(|row| row.line).collect()
}

#[cfg(test)]
mod tests {
    use plumb_estimation::Progress;

    use super::*;
    use crate::testing::two_links;

    #[test]
    fn of_many_rows_some_spread_evenly_and_the_worst_are_shown_and_of_few_all() {
        let few =
            two_links(200, "free: []", 0.02, 3, |_| [0.0, 0.0]).compare(&Progress::unwatched()).unwrap();
        assert_eq!(shown(&few).len(), 200);
        let many =
            two_links(3200, "free: []", 0.02, 3, |_| [0.0, 0.0]).compare(&Progress::unwatched()).unwrap();
        let lines = shown(&many);
        assert!((1000..=MOST_ROWS + WORST).contains(&lines.len()), "{}", lines.len());
        assert!(worst(&many).iter().all(|row| lines.contains(&row.line)));
        assert!(worst(&many).is_sorted_by(|one, other| one.size >= other.size));
    }
}
