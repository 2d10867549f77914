//! Whether a candidate's card keeps its promise: what it says adding the effect leaves, against what `add` leaves on the rows that were held out.

use serde::Serialize;

use super::cells::Work;
use super::error::BenchmarkError;
use super::lab::{self, Card};
use super::trials::over_cases;
use crate::interval::Proportion;

/// A promise is kept if it is within this share of what is delivered.
const KEPT: f64 = 0.2;

/// Cards tried of one diagnosis: those that a user looks at first.
const CARDS: usize = 3;

/// What became of a cell's cards.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    cell: &'static str,
    #[serde(skip)]
    title: &'static str,
    locked: Proportion,
    validated: Proportion,
    /// Median of promised over delivered on locked rows.
    median: f64,
    cards: Vec<Card>,
}

fn is_kept(promised: f64, delivered: f64) -> bool {
    (promised - delivered).abs() <= KEPT * delivered
}

/// Adds what the first cards offer, each alone, in every trial of a cell.
pub(super) fn delivered(work: &Work, seed: u64, count: usize) -> Result<Row, BenchmarkError> {
    let cards = over_cases(work, seed, count, |case| {
        lab::cards(case, CARDS)
            .map_err(|source| BenchmarkError::Lab { seed: case.truth.seed, source: Box::new(source) })
    })?;
    let cards: Vec<Card> = cards.into_iter().flatten().collect();
    let mut ratios: Vec<f64> = cards.iter().map(|card| card.promised_mm / card.locked_mm).collect();
    ratios.sort_by(f64::total_cmp);
    Ok(Row {
        cell: work.name(),
        title: work.title(),
        locked: Proportion::of(cards.iter().map(|card| is_kept(card.promised_mm, card.locked_mm))),
        validated: Proportion::of(cards.iter().map(|card| is_kept(card.promised_mm, card.validated_mm))),
        median: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
        cards,
    })
}

/// The head of the table.
pub(super) fn heading() -> String {
    format!(
        "{:<52} {:>24} {:>24} {:>22}\n",
        "percent of cards within 20 %", "of held-out rows", "of cross-validation", "promised / held out"
    )
}

/// A cell's line.
pub(super) fn line(row: &Row) -> String {
    let percent = Proportion::percent;
    format!(
        "{:<52} {:>24} {:>24} {:>22.3}\n",
        format!("{} ({} cards)", row.title, row.cards.len()),
        percent(&row.locked),
        percent(&row.validated),
        row.median
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_promise_is_kept_within_a_fifth_of_what_is_delivered() {
        assert!(is_kept(0.8, 1.0) && is_kept(1.2, 1.0) && is_kept(1.0, 1.0));
        assert!(!is_kept(0.79, 1.0) && !is_kept(1.21, 1.0) && !is_kept(f64::NAN, 1.0));
    }
}
