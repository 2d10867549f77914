//! What came out of the study's worlds: as rows, and as a summary.

use std::fmt::Write as _;

use clap::ValueEnum;

use plumb::commands::stripe::study_world::Hidden;

/// What came out for one world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    /// The cell's name.
    pub(crate) rig: String,
    pub(crate) hidden: Hidden,
    pub(crate) seed: u64,
    /// The direction-dependent error as the drawings have arm and rig, mm.
    pub(crate) on_paper_mm: f64,
    /// After zeros and rig were adjusted, mm.
    pub(crate) classical_mm: f64,
    /// After what was named was added, mm.
    pub(crate) added_mm: f64,
    /// Of the first diagnosis.
    pub(crate) verdict: String,
    /// What was named, in that order; empty for nothing.
    pub(crate) named: String,
}

impl Outcome {
    /// Whether the first that was named is what was hidden; with nothing hidden, whether nothing was named.
    pub(crate) fn is_right(&self) -> bool {
        match (self.hidden, self.named.split(" + ").next()) {
            (Hidden::Nothing, _) => self.named.is_empty(),
            (hidden, Some(first)) => hidden.is_named_by(first),
            (_, None) => false,
        }
    }
}

/// Over the lines.
pub(super) const HEADER: &str =
    "rig         hidden               seed  on paper mm  zeros+rig mm  with it mm  verdict    named";

/// One world, for people.
pub(super) fn line(outcome: &Outcome) -> String {
    format!(
        "{:<11} {:<20} {:>4} {:>12.2} {:>13.2} {:>11.2}  {:<9}  {}",
        outcome.rig,
        outcome.hidden.name(),
        outcome.seed,
        outcome.on_paper_mm,
        outcome.classical_mm,
        outcome.added_mm,
        outcome.verdict,
        outcome.named
    )
}

/// The verdict that names a cause.
pub(super) const NAMED: &str = "named";

/// The verdicts of `plumb stripe diagnose --json`.
const VERDICTS: [&str; 7] =
    ["at_floor", NAMED, "located", "tied", "unknown", "not_repeatable", "floor_unknown"];

const COLUMNS: &str = "rig,hidden,seed,on_paper_mm,zeros_and_rig_mm,with_effect_mm,verdict,named";

/// One world as a row of a CSV table.
pub(super) fn row(one: &Outcome) -> String {
    format!(
        "{},{},{},{:.4},{:.4},{:.4},{},\"{}\"\n",
        one.rig,
        one.hidden.name(),
        one.seed,
        one.on_paper_mm,
        one.classical_mm,
        one.added_mm,
        one.verdict,
        one.named
    )
}

/// The world of a row; none when it is none.
pub(super) fn read_row(text: &str) -> Option<Outcome> {
    let mut parts = text.splitn(8, ',');
    let mut next = || parts.next();
    let rig = next()?.to_owned();
    let hidden = next()?;
    let hidden = Hidden::value_variants().iter().copied().find(|known| known.name() == hidden)?;
    let seed = next()?.parse().ok()?;
    let mut number = || next()?.parse::<f64>().ok();
    let (on_paper_mm, classical_mm, added_mm) = (number()?, number()?, number()?);
    let verdict = next()?;
    let verdict = VERDICTS.into_iter().find(|known| *known == verdict)?.to_owned();
    let named = next()?.strip_prefix('"')?.strip_suffix('"')?.to_owned();
    Some(Outcome { rig, hidden, seed, on_paper_mm, classical_mm, added_mm, verdict, named })
}

/// All worlds as a CSV table.
pub(super) fn table(outcomes: &[Outcome]) -> String {
    let rows: String = outcomes.iter().map(row).collect();
    format!("{COLUMNS}\n{rows}")
}

/// The 90th percentile: of few values the greatest.
fn percentile_90(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let index = (0.9 * values.len() as f64).ceil() as usize;
    values.get(index.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

/// The 90th percentiles of each rig and each effect, and how often it was named.
pub(super) fn summary(outcomes: &[Outcome]) -> String {
    let mut text = "90th percentile of the direction-dependent error, mm\n\n\
                    | rig | hidden | worlds | as drawn | zeros and rig | with what was named | worst | named rightly |\n\
                    |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let mut rigs: Vec<&str> = outcomes.iter().map(|one| one.rig.as_str()).collect();
    rigs.sort_unstable();
    rigs.dedup();
    for (rig, hidden) in rigs.into_iter().flat_map(|rig| Hidden::ALL.map(|hidden| (rig, hidden))) {
        let of: Vec<&Outcome> =
            outcomes.iter().filter(|outcome| outcome.rig == rig && outcome.hidden == hidden).collect();
        if of.is_empty() {
            continue;
        }
        let fraction = |value: fn(&Outcome) -> f64| percentile_90(of.iter().map(|outcome| value(outcome)));
        let right = of.iter().filter(|outcome| outcome.is_right()).count();
        let _ = writeln!(
            text,
            "| {rig} | {} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {right} of {} |",
            hidden.name(),
            of.len(),
            fraction(|one| one.on_paper_mm),
            fraction(|one| one.classical_mm),
            fraction(|one| one.added_mm),
            of.iter().map(|one| one.added_mm).fold(0.0, f64::max),
            of.len()
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(seed: u64, added_mm: f64, named: &str) -> Outcome {
        Outcome {
            rig: "cell".to_owned(),
            hidden: Hidden::Wheel,
            seed,
            on_paper_mm: 7.5,
            classical_mm: 4.25,
            added_mm,
            verdict: NAMED.to_owned(),
            named: named.to_owned(),
        }
    }

    #[test]
    fn a_result_that_was_written_is_read_again() {
        let one = outcome(3, 0.125, "joint_harmonic(shoulder, 3) + joint_gain(elbow)");
        assert_eq!(read_row(row(&one).trim()), Some(one));
        assert_eq!(read_row("cell,wheel out of true,3,7.5,4.25"), None, "a result cut off is none");
    }

    #[test]
    fn the_summary_takes_the_90th_percentile_and_counts_who_was_named_first() {
        let ten: Vec<Outcome> =
            (1..=10).map(|seed| outcome(seed, seed as f64 / 100.0, "joint_harmonic(shoulder, 3)")).collect();
        let wrong = outcome(11, 0.01, "joint_gain(elbow) + joint_harmonic(shoulder, 3)");
        let text = summary(&[ten.as_slice(), &[wrong]].concat());
        let row = text.lines().last().unwrap();
        assert_eq!(row, "| cell | wheel out of true | 11 | 7.50 | 4.25 | 0.09 | 0.10 | 10 of 11 |");
    }
}
