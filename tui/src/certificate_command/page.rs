//! The certificate as a page of HTML that needs nothing else.

use plumb_cell::corrected_quantity;
use plumb_record::{
    Instrument, LoadedFile, RunSummary, StoredCorrection, StoredNote, StoredPrompt, StoredTrigger,
};
use serde_json::Value;

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
    body.push_str(&facts(run));
    body.push_str(&corrections(&certificate.corrections));
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
        ("Outcome", "passed".to_owned()),
        ("Made by", format!("plumb {}", run.program)),
    ];
    let rows = rows.map(|(name, value)| format!("<tr><th>{name}</th><td>{}</td></tr>", escaped(&value)));
    format!("<table>{}</table>", rows.concat())
}

fn corrections(corrections: &[StoredCorrection]) -> String {
    let row = |one: &StoredCorrection| {
        let (name, left) =
            (corrected_quantity(&one.key.quantity, &one.key.device, &one.key.place), left(one));
        format!(
            "<tr><td>{}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:.4}</td><td class=\"n\">{:+.4}</td><td class=\"n\">{:.1e}</td><td>{}</td><td>{left}</td></tr>",
            escaped(&name),
            one.old,
            one.new,
            one.new - one.old,
            one.uncertainty,
            escaped(&one.unit)
        )
    };
    let head = "<tr><th>Quantity</th><th class=\"n\">As found</th><th class=\"n\">As left</th><th class=\"n\">Change</th>\
                <th class=\"n\">Standard uncertainty</th><th>Unit</th><th>In force</th></tr>";
    let rows: String = corrections.iter().map(row).collect();
    format!(
        "<h2>As found, as left</h2><table>{head}{rows}</table>\
         <p>The uncertainty is one standard deviation (k = 1) of the value found by this run.</p>"
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
            "<tr><td>{}</td><td>{} {}</td><td>{}</td><td class=\"n\">{:.1e} {}</td></tr>",
            escaped(&one.step),
            escaped(&one.sensor),
            if one.fired { "on" } else { "off" },
            escaped(&pose.join(", ")),
            one.half_width,
            escaped(&one.unit)
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
            escaped(&crate::show_command::answer_in_words(&answer.answer)),
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

    #[test]
    fn what_people_wrote_is_never_taken_for_html() {
        assert_eq!(escaped("a < b & \"c\""), "a &lt; b &amp; &quot;c&quot;");
    }
}
