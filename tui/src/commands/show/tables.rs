//! The parts of a run as tables of text, one string a line. A heading is at the margin, its rows are indented.

use plumb_cell::{corrected_quantity, give_or_take, known_within, left_open, uncertainty_digits};
use plumb_record::{
    Budget, Component, Instrument, LoadedFile, StoredCorrection, StoredInterruption, StoredNote,
    StoredPrompt, StoredReading, StoredStep, StoredTrigger,
};
use serde_json::Value;

/// The width of a terminal that tables of values keep within, and that of a row's step in them.
const LINE_WIDTH: usize = 80;
const STEP_WIDTH: usize = 24;

/// Begins a table.
fn head(lines: &mut Vec<String>, title: &str) {
    lines.extend([String::new(), title.to_owned()]);
}

/// Every attempt at every step.
pub(super) fn steps(lines: &mut Vec<String>, steps: &[StoredStep]) {
    head(lines, "steps");
    for step in steps {
        let outcome = step.outcome.as_deref().unwrap_or("not ended");
        let again = if step.attempt > 1 { format!(" (attempt {})", step.attempt) } else { String::new() };
        let message = step.message.as_deref().unwrap_or_default();
        lines.push(format!("  {:<34} {outcome:<12} {message}{again}", step.step));
    }
}

/// Who answered what.
pub(super) fn answers(lines: &mut Vec<String>, prompts: &[StoredPrompt]) {
    if prompts.is_empty() {
        return;
    }
    head(lines, "answers");
    for prompt in prompts {
        let text = match &prompt.answer {
            Some(answer) => {
                format!("{} by {} at {}", answer_in_words(&answer.answer), answer.by, answer.time)
            }
            None => "not answered".to_owned(),
        };
        lines.push(format!("  {:<34} {text}", prompt.step));
    }
}

/// An answer as it would be typed.
pub(crate) fn answer_in_words(answer: &Value) -> String {
    let kind = answer.get("kind").and_then(Value::as_str).unwrap_or_default();
    match ["key", "value", "text", "decision"].iter().find_map(|name| answer.get(name)) {
        Some(Value::String(word)) => word.clone(),
        Some(other) => other.to_string(),
        None => kind.to_owned(),
    }
}

/// Where the arm was when the sensor changed.
pub(super) fn triggers(lines: &mut Vec<String>, triggers: &[StoredTrigger]) {
    let fine: Vec<&StoredTrigger> = triggers.iter().filter(|trigger| trigger.fine).collect();
    if fine.is_empty() {
        return;
    }
    head(lines, "trigger poses (slow approach)");
    for trigger in fine {
        let change = if trigger.fired { "on" } else { "off" };
        lines.push(format!(
            "  {:<34} {} {change:<3} {}  ({} {})",
            trigger.step,
            trigger.sensor,
            pose_in_words(&trigger.joints),
            trigger.joint,
            known_within(trigger.half_width, &trigger.unit)
        ));
    }
}

fn pose_in_words(joints: &Value) -> String {
    let joint = |row: &Value| {
        let name = row.get("name")?.as_str()?;
        let value = row.get("value")?.as_f64()?;
        let unit = row.get("unit")?.as_str()?;
        Some(format!("{name} {value:.4} {unit}"))
    };
    let joints: Vec<String> = joints.as_array().into_iter().flatten().filter_map(joint).collect();
    joints.join(", ")
}

/// Values that steps worked out. Those a step works out in every turn of a repetition are in one table, a row a turn.
pub(super) fn readings(lines: &mut Vec<String>, readings: &[StoredReading]) {
    let mut groups: Vec<(String, Vec<&StoredReading>)> = Vec::new();
    for reading in readings {
        let group = without_turns(&reading.step);
        match groups.iter_mut().find(|(name, _)| *name == group) {
            Some((_, members)) => members.push(reading),
            None => groups.push((group, vec![reading])),
        }
    }
    for (group, members) in groups {
        head(lines, &format!("values of {group}"));
        let mut steps: Vec<&str> = members.iter().map(|reading| reading.step.as_str()).collect();
        steps.dedup();
        let columns = columns_of(&members);
        match steps.as_slice() {
            [_] if blocks(&columns).len() > 1 => one_a_line(lines, &members, &columns),
            steps => blocks(&columns).into_iter().for_each(|block| one_a_row(lines, &members, steps, block)),
        }
    }
}

/// The values of one step that are too many for one line.
fn one_a_line(lines: &mut Vec<String>, members: &[&StoredReading], columns: &[String]) {
    let width = columns.iter().map(|column| column.chars().count()).max().unwrap_or_default();
    for column in columns {
        let found = members.iter().rev().find(|reading| head_of(reading) == *column);
        let text = found.map_or_else(String::new, |reading| number(reading.value));
        lines.push(format!("  {column:<width$}{text:>18}"));
    }
}

/// These columns of the values of steps, a row a step.
fn one_a_row(lines: &mut Vec<String>, members: &[&StoredReading], steps: &[&str], columns: &[String]) {
    let heads: String = columns.iter().map(|column| format!("{column:>0$}", width_of(column))).collect();
    lines.push(format!("  {:<STEP_WIDTH$}{heads}", ""));
    for step in steps {
        let cell = |column: &String| {
            let found =
                members.iter().rev().find(|reading| reading.step == *step && head_of(reading) == *column);
            let text = found.map_or_else(String::new, |reading| number(reading.value));
            format!("{text:>0$}", width_of(column))
        };
        lines.push(format!("  {step:<STEP_WIDTH$}{}", columns.iter().map(cell).collect::<String>()));
    }
}

/// The columns that fit beside each other in a line, block by block.
fn blocks(columns: &[String]) -> Vec<&[String]> {
    let mut blocks = Vec::new();
    let mut rest = columns;
    while !rest.is_empty() {
        let mut width = 2 + STEP_WIDTH;
        let fits = |column: &&String| {
            width += width_of(column);
            width <= LINE_WIDTH
        };
        let (block, next) = rest.split_at(rest.iter().take_while(fits).count().max(1));
        blocks.push(block);
        rest = next;
    }
    blocks
}

/// A column is as wide as a number, or as its head with a gap before it.
fn width_of(head: &str) -> usize {
    (head.chars().count() + 2).max(18)
}

fn columns_of(readings: &[&StoredReading]) -> Vec<String> {
    let mut columns: Vec<String> = Vec::new();
    for reading in readings {
        let head = head_of(reading);
        if !columns.contains(&head) {
            columns.push(head);
        }
    }
    columns
}

fn head_of(reading: &StoredReading) -> String {
    format!("{} {}", reading.name, reading.unit).trim_end().to_owned()
}

/// Eight significant digits, without an exponent where that is readable.
fn number(value: f64) -> String {
    let size = value.abs();
    if value != 0.0 && !(1e-3..1e7).contains(&size) {
        return format!("{value:.4e}");
    }
    let digits_before = if size < 1.0 { 1 } else { size.log10().floor() as usize + 1 };
    let decimals = 8_usize.saturating_sub(digits_before);
    format!("{value:.decimals$}")
}

fn without_turns(step: &str) -> String {
    let mut depth = 0;
    let outside = |c: &char| {
        match c {
            '[' => depth += 1,
            ']' => {
                depth -= 1;
                return false;
            }
            _ => {}
        }
        depth == 0
    };
    step.chars().filter(outside).collect()
}

/// What the run found out about the machine.
/// `undone` are those that were taken back in the run, each by its number with the revision that did so.
pub(super) fn corrections(lines: &mut Vec<String>, corrections: &[StoredCorrection], undone: &[(i64, i64)]) {
    if corrections.is_empty() {
        return;
    }
    head(lines, "corrections");
    for one in corrections {
        let back = undone.iter().find(|(id, _)| *id == one.id).map(|(_, revision)| *revision);
        let state = match (one.revision, back) {
            (Some(made), Some(back)) => {
                format!("in force from revision {made} until undone by revision {back}")
            }
            (Some(made), None) => format!("in force since revision {made}"),
            (None, _) => "not put in force".to_owned(),
        };
        lines.push(format!(
            "  {:<30} {:>10.4} -> {:>10.4} {} ({}; {state})",
            corrected_quantity(&one.key.quantity, &one.key.device, &one.key.site),
            one.old,
            one.new,
            one.unit,
            give_or_take(one.uncertainty, &one.unit)
        ));
        lines.extend(one.budget.iter().flat_map(|budget| budget_lines(budget, &one.unit)));
    }
    lines.extend(correlations(corrections).into_iter().map(|line| format!("  {line}")));
}

/// What an uncertainty is made of, a line a component; the greatest contribution first, what was not determined before all.
fn budget_lines(budget: &Budget, unit: &str) -> Vec<String> {
    let mut lines: Vec<String> = by_size(budget)
        .into_iter()
        .map(|part| {
            let contribution = give_or_take(part.contribution(), unit);
            let standard = uncertainty_digits(part.standard);
            format!(
                "      {contribution:<22} {:<52} {standard} {} x {:+.3} {unit}/{} ({})",
                part.name, part.unit, part.sensitivity, part.unit, part.source
            )
        })
        .collect();
    lines.extend(left_open(budget, unit).map(|open| format!("      {open}")));
    lines
}

/// The components that matter, the greatest contribution first, what was not determined before all.
pub(crate) fn by_size(budget: &Budget) -> Vec<&Component> {
    let mut parts: Vec<&Component> = budget
        .components
        .iter()
        .filter(|part| {
            part.contribution().is_none_or(|one| one.abs() > NO_CONTRIBUTION) && part.sensitivity != 0.0
        })
        .collect();
    let size = |part: &Component| part.contribution().map_or(f64::INFINITY, f64::abs);
    parts.sort_by(|a, b| size(b).total_cmp(&size(a)));
    parts
}

/// A contribution smaller than this is not listed, in the unit of the value: nobody can measure it.
const NO_CONTRIBUTION: f64 = 1e-6;

/// Correlations worth showing between corrections that came from one step: what one of them is off by, the other is off by too.
pub(crate) fn correlations(corrections: &[StoredCorrection]) -> Vec<String> {
    const WORTH_SHOWING: f64 = 0.1;
    let mut reported = Vec::new();
    for (index, one) in corrections.iter().enumerate() {
        for other in corrections.iter().skip(index + 1).filter(|other| other.step == one.step) {
            let (Some(mine), Some(theirs)) = (&one.budget, &other.budget) else { continue };
            let Some(correlation) = mine.correlation(theirs).filter(|c| c.abs() >= WORTH_SHOWING) else {
                continue;
            };
            reported.push(format!(
                "{} and {} are correlated by what both depend on: coefficient {correlation:+.2}",
                one.key.site, other.key.site
            ));
        }
    }
    reported
}

/// Pauses, stops, losses and resumes.
pub(super) fn interruptions(lines: &mut Vec<String>, interruptions: &[StoredInterruption]) {
    if interruptions.len() < 2 {
        return;
    }
    head(lines, "interruptions");
    for one in interruptions {
        lines.push(format!(
            "  {}  {:<14} {:<30} {}",
            one.time,
            one.kind.replace('_', " "),
            one.step.as_deref().unwrap_or(""),
            one.reason
        ));
    }
}

/// What was measured with.
pub(super) fn instruments(lines: &mut Vec<String>, instruments: &[Instrument], day: &str) {
    if instruments.is_empty() {
        return;
    }
    head(lines, "instruments");
    for one in instruments {
        let serial = one.serial.as_deref().map(|serial| format!(", no. {serial}")).unwrap_or_default();
        let unit = one.unit.as_deref().unwrap_or_default();
        let uncertainty = one.uncertainty.map(|value| format!(", +- {value} {unit}")).unwrap_or_default();
        let due = match &one.calibration_due {
            Some(due) if one.is_overdue(day) => format!(", calibration OVERDUE since {due}"),
            Some(due) => format!(", calibrated until {due}"),
            None => String::new(),
        };
        lines.push(format!("  {:<20} {}{serial}{uncertainty}{due}", one.name, one.what));
    }
}

/// What people wanted remembered.
pub(super) fn notes(lines: &mut Vec<String>, notes: &[StoredNote]) {
    if notes.is_empty() {
        return;
    }
    head(lines, "notes");
    for note in notes {
        lines.push(format!("  {}  {}: {}", note.time, note.author, note.text));
    }
}

/// What the run was made of.
pub(super) fn files(lines: &mut Vec<String>, files: &[LoadedFile]) {
    head(lines, "loaded");
    for file in files {
        lines.push(format!(
            "  {:<10} {}  {}",
            file.role,
            file.sha256.get(..12).unwrap_or(&file.sha256),
            file.path
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_eight_digits_and_stay_readable() {
        assert_eq!(number(-10138.62), "-10138.620");
        assert_eq!(number(178.2412345), "178.24123");
        assert_eq!(number(0.1766), "0.1766000");
        assert_eq!(number(-5.437e-6), "-5.4370e-6");
        assert_eq!(number(0.0), "0.0000000");
    }

    fn value(step: &str, name: &str, value: f64) -> StoredReading {
        let (step, name, source) = (step.to_owned(), name.to_owned(), "computed".to_owned());
        StoredReading { step, source, name, value, unit: "mm".to_owned(), uncertainty: None }
    }

    fn shown(values: &[StoredReading]) -> Vec<String> {
        let mut lines = Vec::new();
        readings(&mut lines, values);
        lines
    }

    #[test]
    fn values_of_one_step_that_are_too_many_for_a_line_are_one_a_line() {
        let lines = shown(&["x", "y", "z", "longer"].map(|name| value("probe", name, 1.5)));
        assert_eq!(lines[..3], ["", "values of probe", "  x mm              1.5000000"]);
        assert_eq!(lines[5], "  longer mm         1.5000000");
        let three = shown(&["x", "y", "z"].map(|name| value("probe", name, 1.5)));
        assert_eq!(three.len(), 4, "three fit: {three:?}");
    }

    #[test]
    fn values_of_many_turns_are_in_as_many_tables_as_the_width_of_a_terminal_asks_for() {
        let names = ["a", "b", "c", "d", "a_rather_long_name_of_a_quantity_in_a_table_that_is_wide"];
        let turns = ["probe[1]", "probe[2]"];
        let values: Vec<StoredReading> =
            turns.iter().flat_map(|turn| names.map(|name| value(turn, name, 2.5))).collect();
        let lines = shown(&values);
        let heads: Vec<&str> = lines[2..].iter().step_by(3).map(|line| line.trim_start()).collect();
        assert_eq!(heads.len(), 3, "{lines:#?}");
        assert!(heads[0].starts_with("a mm") && heads[1].starts_with("d mm") && heads[2].len() > 50);
        let fits = |line: &&String| line.chars().count() <= LINE_WIDTH;
        assert_eq!(lines.iter().filter(fits).count(), lines.len() - 3, "one column alone may be wider");
        assert_eq!(lines.iter().filter(|line| line.starts_with("  probe[2]")).count(), 3);
    }

    #[test]
    fn the_turns_of_a_repetition_share_one_name() {
        assert_eq!(without_turns("cycle[2].height"), "cycle.height");
        assert_eq!(without_turns("a.b[1].c[12].d"), "a.b.c.d");
    }
}
