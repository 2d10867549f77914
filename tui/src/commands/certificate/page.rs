//! The certificate as a page of HTML that needs nothing else.

use plumb_cell::{corrected_quantity, known_within, left_open, uncertainty_digits};
use plumb_record::{
    Budget, Component, Instrument, LoadedFile, RunSummary, StoredCorrection, StoredNote, StoredPrompt,
    StoredTrigger,
};
use serde_json::Value;

use crate::commands::show::{by_size, correlations};
use plumb_report::run_words::skipped_in_words;

/// What it is made of.
pub(super) struct Certificate {
    pub(super) run: RunSummary,
    pub(super) corrections: Vec<StoredCorrection>,
    pub(super) instruments: Vec<Instrument>,
    pub(super) notes: Vec<StoredNote>,
    pub(super) triggers: Vec<StoredTrigger>,
    pub(super) prompts: Vec<StoredPrompt>,
    pub(super) loaded: Vec<LoadedFile>,
}

const STYLE: &str = "body{font:15px/1.5 Georgia,serif;max-width:52em;margin:3em auto;padding:0 1em;color:#111}\
h1{font-size:1.7em;margin-bottom:.2em}h2{font-size:1.1em;margin-top:2em;border-bottom:1px solid #999}\
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25em .6em;border-bottom:1px solid #ddd;vertical-align:top}\
.simulated{border:4px solid #111;padding:.4em .8em;font-weight:bold}.simulated b{font-size:1.5em;letter-spacing:.15em}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}code{font-size:.85em}.late{font-weight:bold}\
.sign{margin-top:4em;display:flex;gap:4em}.sign div{flex:1;border-top:1px solid #111;padding-top:.3em}@media print{body{margin:0}}";

/// The whole page.
pub(super) fn page(certificate: &Certificate) -> String {
    let Certificate { run, .. } = certificate;
    let title = format!("Certificate of calibration: {}, run {}", run.cell, run.run);
    let mut body = format!(
        "<h1>Certificate of calibration</h1><p>Cell <b>{}</b>, {}</p>",
        escaped(&run.cell),
        escaped(&run.title)
    );
    body.push_str(&simulated(&certificate.loaded));
    body.push_str(&facts(run));
    let found = newest(&certificate.corrections);
    body.push_str(&corrections(&found));
    body.push_str(&budgets(&found));
    body.push_str(&instruments(&certificate.instruments, run.started.get(..10).unwrap_or_default()));
    body.push_str(&triggers(&certificate.triggers));
    body.push_str(&answers(&certificate.prompts));
    body.push_str(&notes(&certificate.notes));
    body.push_str(&files(&certificate.loaded));
    body.push_str("<div class=\"sign\"><div>Operator, date</div><div>Approved, date</div></div>");
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title><style>{STYLE}</style></head>\n<body>{body}</body></html>\n",
        escaped(&title)
    )
}

/// A run in a simulated world has measured no machine, and its certificate says so first.
fn simulated(files: &[LoadedFile]) -> String {
    let worlds: Vec<String> =
        files.iter().filter(|file| file.role == "world").map(|file| escaped(&file.path)).collect();
    if worlds.is_empty() {
        return String::new();
    }
    format!(
        "<p class=\"simulated\"><b>SIMULATED</b><br>No machine was measured. Devices of this cell are simulated or emulated, in the world {}.</p>",
        worlds.join(", ")
    )
}

/// Of what a step found for a site again and again, as after an interruption, the last: and what came into force before what did not.
fn newest(corrections: &[StoredCorrection]) -> Vec<StoredCorrection> {
    let mut newest: Vec<StoredCorrection> = Vec::new();
    for one in corrections {
        match newest.iter_mut().find(|known| known.step == one.step && known.key == one.key) {
            Some(known) if known.revision.is_none() || one.revision.is_some() => *known = one.clone(),
            Some(_) => {}
            None => newest.push(one.clone()),
        }
    }
    newest
}

fn facts(run: &RunSummary) -> String {
    let parameters = run.parameters.as_object().into_iter().flatten();
    let parameters: Vec<String> = parameters.map(|(name, value)| format!("{name} = {value}")).collect();
    let how = if run.unattended { "unattended, with answers from a file" } else { "attended" };
    let rows = [
        ("Run", run.run.to_string()),
        ("Procedure", run.procedure.clone()),
        ("Parameters", parameters.join(", ")),
        ("Operator", format!("{} ({how})", run.operator)),
        ("Started (UTC)", run.started.clone()),
        ("Ended (UTC)", run.ended.clone().unwrap_or_default()),
        ("Outcome", format!("passed{}", skipped_in_words(run))),
        ("Made by", format!("plumb {}", run.program)),
    ];
    let rows = rows.map(|(name, value)| {
        let value = escaped(&value);
        let value =
            if name == "Outcome" && !run.skipped.is_empty() { format!("<b>{value}</b>") } else { value };
        format!("<tr><th>{name}</th><td>{value}</td></tr>")
    });
    format!("<table>{}</table>", rows.concat())
}

fn corrections(corrections: &[StoredCorrection]) -> String {
    let row = |one: &StoredCorrection| {
        let (name, left) = (corrected_quantity(&one.key.quantity, &one.key.device, &one.key.site), left(one));
        format!(
            "<tr><td>{}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:+.4}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td>{}</td><td>{left}</td></tr>",
            escaped(&name),
            one.old,
            one.new,
            one.new - one.old,
            uncertainty_digits(one.uncertainty),
            uncertainty_digits(one.uncertainty.map(|standard| COVERAGE_FACTOR * standard)),
            escaped(&one.unit)
        )
    };
    let head = "<tr><th>Quantity</th><th class=\"n\">As found</th><th class=\"n\">As left</th><th class=\"n\">Change</th>\
                <th class=\"n\">Standard uncertainty</th><th class=\"n\">Expanded (k = 2)</th><th>Unit</th><th>In force</th></tr>";
    let rows: String = corrections.iter().map(row).collect();
    format!(
        "<h2>As found, as left</h2><table>{head}{rows}</table>\
         <p>Standard uncertainties (k = 1) are combined by the GUM (JCGM 100:2008) from the components in the budgets below. The expanded \
         uncertainty is twice that; where the components are what they are said to be, the true value lies within it in about 95 % of cases. \
         &ldquo;Not determined&rdquo; is said where a component that matters is not known.</p>"
    )
}

/// Of the expanded uncertainty: about 95 % of a normal distribution lie within it (GUM 6.3.3).
const COVERAGE_FACTOR: f64 = 2.0;

/// What each uncertainty is made of.
fn budgets(corrections: &[StoredCorrection]) -> String {
    let tables: String =
        corrections.iter().filter_map(|one| Some(budget(one, one.budget.as_ref()?))).collect();
    if tables.is_empty() {
        return String::new();
    }
    let correlated: String =
        correlations(corrections).iter().map(|line| format!("<p>{}.</p>", escaped(line))).collect();
    format!("<h2>Uncertainty budgets</h2>{tables}{correlated}")
}

fn budget(one: &StoredCorrection, budget: &Budget) -> String {
    let row = |part: &&Component| {
        format!(
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{} {}</td><td class=\"n\">{:+.3}</td><td class=\"n\">{}</td></tr>",
            escaped(&part.name),
            escaped(&part.source),
            uncertainty_digits(part.standard),
            escaped(&part.unit),
            part.sensitivity,
            uncertainty_digits(part.contribution())
        )
    };
    let unit = escaped(&one.unit);
    let head = format!(
        "<tr><th>Component</th><th>From</th><th class=\"n\">Standard uncertainty</th><th class=\"n\">Sensitivity</th><th class=\"n\">Contribution, {unit}</th></tr>"
    );
    let rows: String = by_size(budget).iter().map(row).collect();
    let open = left_open(budget, &one.unit).map(|open| format!("<p><b>{}.</b></p>", escaped(&open)));
    format!(
        "<h3>{}</h3><table>{head}{rows}<tr><th>Combined</th><td></td><td></td><td></td><td class=\"n\">{}</td></tr></table>{}",
        escaped(&corrected_quantity(&one.key.quantity, &one.key.device, &one.key.site)),
        uncertainty_digits(one.uncertainty),
        open.unwrap_or_default()
    )
}

fn left(one: &StoredCorrection) -> String {
    match one.revision {
        Some(revision) => format!("since revision {revision}"),
        None => "no: the value found was not put in force, what was found is left".to_owned(),
    }
}

fn instruments(instruments: &[Instrument], day: &str) -> String {
    if instruments.is_empty() {
        return "<h2>Instruments</h2><p>The cell names none.</p>".to_owned();
    }
    let row = |one: &Instrument| {
        let due = one.calibration_due.clone().unwrap_or_else(|| "-".to_owned());
        let due = match one.is_overdue(day) {
            true => format!("<span class=\"late\">{} (overdue)</span>", escaped(&due)),
            false => escaped(&due),
        };
        let uncertainty = one.uncertainty.map_or_else(
            || "-".to_owned(),
            |value| format!("{value} {}", one.unit.as_deref().unwrap_or_default()),
        );
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{due}</td></tr>",
            escaped(&one.name),
            escaped(&one.what),
            escaped(one.serial.as_deref().unwrap_or("-")),
            escaped(&uncertainty)
        )
    };
    let head = "<tr><th>Name</th><th>What</th><th>Serial number</th><th>Standard uncertainty</th><th>Calibration due</th></tr>";
    let rows: String = instruments.iter().map(row).collect();
    format!("<h2>Instruments</h2><table>{head}{rows}</table>")
}

fn triggers(triggers: &[StoredTrigger]) -> String {
    let fine: Vec<&StoredTrigger> = triggers.iter().filter(|trigger| trigger.fine).collect();
    if fine.is_empty() {
        return String::new();
    }
    let row = |one: &&StoredTrigger| {
        let pose: Vec<String> =
            one.joints.as_array().into_iter().flatten().filter_map(joint_in_words).collect();
        format!(
            "<tr><td>{}</td><td>{} {}</td><td>{}</td><td class=\"n\">{}</td></tr>",
            escaped(&one.step),
            escaped(&one.sensor),
            if one.fired { "on" } else { "off" },
            escaped(&pose.join(", ")),
            escaped(known_within(one.half_width, &one.unit).trim_start_matches("± "))
        )
    };
    let rows: String = fine.iter().map(row).collect();
    let head = "<tr><th>Step</th><th>Sensor</th><th>Pose, zeros in force at the time</th><th class=\"n\">Known within +-</th></tr>";
    format!("<h2>Trigger poses (slow approach)</h2><table>{head}{rows}</table>")
}

fn joint_in_words(row: &Value) -> Option<String> {
    let name = row.get("name")?.as_str()?;
    Some(format!("{name} {:.4} {}", row.get("value")?.as_f64()?, row.get("unit")?.as_str()?))
}

fn answers(prompts: &[StoredPrompt]) -> String {
    let row = |prompt: &StoredPrompt| {
        let answer = prompt.answer.as_ref()?;
        let title = prompt.description.get("title").and_then(Value::as_str).unwrap_or_default();
        Some(format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(title),
            escaped(&crate::commands::show::answer_in_words(&answer.answer)),
            escaped(&answer.by),
            escaped(&answer.time)
        ))
    };
    let rows: String = prompts.iter().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<h2>Answers</h2><table><tr><th>Asked</th><th>Answer</th><th>By</th><th>When (UTC)</th></tr>{rows}</table>"
    )
}

fn notes(notes: &[StoredNote]) -> String {
    if notes.is_empty() {
        return String::new();
    }
    let row = |note: &StoredNote| {
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&note.text),
            escaped(&note.author),
            escaped(&note.time)
        )
    };
    let rows: String = notes.iter().map(row).collect();
    format!("<h2>Notes</h2><table><tr><th>Note</th><th>By</th><th>When (UTC)</th></tr>{rows}</table>")
}

fn files(files: &[LoadedFile]) -> String {
    let row = |file: &LoadedFile| {
        format!(
            "<tr><td>{}</td><td>{}</td><td><code>{}</code></td></tr>",
            escaped(&file.role),
            escaped(&file.path),
            escaped(&file.sha256)
        )
    };
    let rows: String = files.iter().map(row).collect();
    format!(
        "<h2>What was loaded</h2><table><tr><th>Role</th><th>File</th><th>SHA-256</th></tr>{rows}</table>"
    )
}

/// Text in which nothing is taken for HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn correction(step: &str, site: &str, revision: Option<i64>) -> StoredCorrection {
        let key = plumb_record::CorrectionKey {
            device: "arm".into(),
            quantity: "joint_zero".into(),
            site: site.into(),
        };
        StoredCorrection {
            id: 1,
            run: None,
            step: step.into(),
            key,
            old: 0.0,
            new: 1.7,
            uncertainty: None,
            budget: Some(Budget::of_one("level", "the cell file gives no `instruments.level`", None, "deg")),
            unit: "deg".into(),
            proposed: String::new(),
            revision,
        }
    }

    #[test]
    fn of_what_an_interrupted_step_proposed_twice_one_row_is_left_and_what_is_in_force_wins() {
        let both = [
            correction("a", "waist", None),
            correction("a", "waist", Some(3)),
            correction("a", "waist", None),
        ];
        assert_eq!(newest(&both), [correction("a", "waist", Some(3))]);
        let other = [correction("a", "waist", None), correction("b", "waist", None)];
        assert_eq!(newest(&other).len(), 2, "two steps found two things");
    }

    #[test]
    fn an_uncertainty_that_was_not_determined_is_called_so_with_the_reason() {
        let found = [correction("a", "waist", Some(1))];
        let text = format!("{}{}", corrections(&found), budgets(&found));
        assert!(text.contains("not determined") && !text.contains("0.0e0"), "{text}");
        assert!(text.contains("the cell file gives no `instruments.level`"), "{text}");
    }

    #[test]
    fn what_people_wrote_is_never_taken_for_html() {
        assert_eq!(escaped("a < b & \"c\""), "a &lt; b &amp; &quot;c&quot;");
    }
}
