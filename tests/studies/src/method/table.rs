//! Tables of many runs, as text and as CSV.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use plumb_cell::event::RunOutcome;

use super::bench::Run;
use super::runs::values;
use super::statistics::Summary;
use plumb::commands::study::study_file::Quantity;

/// The quantities of the tables and their names.
pub(super) const QUANTITIES: [(Quantity, &str); 6] = [
    (Quantity::WaistDeg, "waist_deg"),
    (Quantity::ShoulderDeg, "shoulder_deg"),
    (Quantity::ElbowDeg, "elbow_deg"),
    (Quantity::RadialMm, "radial_mm"),
    (Quantity::AcrossMm, "across_mm"),
    (Quantity::HeightMm, "height_mm"),
];

/// A line of the table and its runs.
pub(super) struct Row {
    pub(super) title: String,
    pub(super) runs: Vec<Run>,
}

/// What the columns mean.
pub(super) const LEGEND: &str = "\
Each column: mean over the runs +- their standard deviation, mm. The hand's place by the corrected angles is compared with the truth, at the check\n\
pose, coming to it from the side the searches come from. worst: greatest distance of the hand. time: what the arm needs. steps: steps done.\n";

/// The table as text: how far the hand is off after a run, its time and its steps.
pub(super) fn text(rows: &[Row]) -> String {
    let width = rows.iter().map(|row| row.title.chars().count()).max().unwrap_or(0).max(4);
    let mut text = format!(
        "{:<width$}  {:>7}  {:>17}  {:>17}  {:>17}  {:>7}  {:>6}  {:>5}\n",
        "", "passed", "radial", "across", "height", "worst", "time s", "steps"
    );
    for row in rows {
        let spread = |quantity| {
            let summary = Summary::of(&values(&row.runs, quantity));
            match summary.count {
                0 => "-".to_owned(),
                _ => format!("{:+.3} +- {:.3}", summary.mean, summary.spread),
            }
        };
        let passed: Vec<&Run> = row.runs.iter().filter(|run| run.outcome == RunOutcome::Passed).collect();
        let shown = |value: f64, digits: usize| match passed.is_empty() {
            true => "-".to_owned(),
            false => format!("{value:.digits$}"),
        };
        let mean = |of: &dyn Fn(&Run) -> f64| {
            shown(passed.iter().map(|run| of(run)).sum::<f64>() / passed.len() as f64, 0)
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:<width$}  {:>7}  {:>17}  {:>17}  {:>17}  {:>7}  {:>6}  {:>5}",
            row.title,
            format!("{}/{}", passed.len(), row.runs.len()),
            spread(Quantity::RadialMm),
            spread(Quantity::AcrossMm),
            spread(Quantity::HeightMm),
            shown(Summary::of(&values(&row.runs, Quantity::HandMm)).worst, 3),
            mean(&|run| run.seconds),
            mean(&|run| run.steps as f64),
        );
    }
    text
}

/// Why runs did not pass, each reason once with how often; empty when all did.
pub(super) fn failures(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
        for run in row.runs.iter().filter(|run| run.outcome != RunOutcome::Passed) {
            *reasons.entry(reason(&run.message)).or_default() += 1;
        }
        for (reason, count) in reasons {
            let _ = writeln!(text, "{}: {count} of {} did not pass: {reason}", row.title, row.runs.len());
        }
    }
    text
}

/// The last word of a run without what differs from run to run: turns, and how to resume what is gone.
fn reason(message: &str) -> String {
    let message = message.split(" (go on with").next().unwrap_or(message);
    let mut text = String::new();
    let mut inside = false;
    for letter in message.chars() {
        match letter {
            '[' => inside = true,
            ']' => inside = false,
            other if !inside => text.push(other),
            _ => {}
        }
    }
    text
}

/// Every run as a row of CSV.
pub(super) fn csv(rows: &[Row]) -> String {
    let names: Vec<&str> = QUANTITIES.iter().map(|(_, name)| *name).collect();
    let mut text = format!("line,seed,outcome,{},time_s,steps,message\n", names.join(","));
    for row in rows {
        for run in &row.runs {
            let numbers = QUANTITIES.iter().map(|(quantity, _)| {
                run.missed.map_or(String::new(), |missed| missed.of(*quantity).to_string())
            });
            let numbers = numbers.collect::<Vec<_>>().join(",");
            let _ = writeln!(
                text,
                "{},{},{:?},{numbers},{},{},{}",
                quoted(&row.title),
                run.seed,
                run.outcome,
                run.seconds,
                run.steps,
                quoted(&run.message)
            );
        }
    }
    text
}

/// A text as a field of CSV.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::truth::Missed;

    fn run(outcome: RunOutcome, radial: f64, message: &str) -> Run {
        let missed = Missed { zeros_deg: [0.0; 3], stated_deg: [None; 3], hand_mm: [radial, 0.0, 0.0] };
        let missed = (outcome == RunOutcome::Passed).then_some(missed);
        Run { seed: 1, outcome, message: message.to_owned(), missed, seconds: 60.0, steps: 30 }
    }

    #[test]
    fn runs_that_did_not_pass_count_in_no_mean_and_their_reason_is_reported_once() {
        let lost = |turn: u32| {
            run(RunOutcome::Error, 0.0, &format!("step `cycle[{turn}].edge`: eye stayed ON (go on with: x)"))
        };
        let passed = |radial| run(RunOutcome::Passed, radial, "all steps passed");
        let rows =
            [Row { title: "noise".to_owned(), runs: vec![passed(0.1), lost(1), passed(0.3), lost(2)] }];
        let table = text(&rows);
        assert!(
            table.contains("2/4") && table.contains("+0.200 +- 0.141") && table.contains("0.300"),
            "{table}"
        );
        assert_eq!(failures(&rows), "noise: 2 of 4 did not pass: step `cycle.edge`: eye stayed ON\n");
        assert_eq!(csv(&rows).lines().count(), 5);
    }
}
