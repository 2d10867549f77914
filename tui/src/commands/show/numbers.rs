//! `plumb show --csv`: every number of a run, one a line.

use std::io;
use std::process::ExitCode;

use plumb_record::{Record, RunSummary};
use serde_json::Value;

use super::answer_in_words;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use plumb_report::csv::csv_field;

/// Prints them.
pub(super) fn print(record: &Record, run: &RunSummary) -> CommandResult {
    let id = run.run;
    print_line!("kind,step,name,value,unit,uncertainty")?;
    for reading in record.readings(id)? {
        let uncertainty = reading.uncertainty.map(|value| value.to_string()).unwrap_or_default();
        line([
            "value",
            &reading.step,
            &reading.name,
            &reading.value.to_string(),
            &reading.unit,
            &uncertainty,
        ])?;
    }
    for trigger in record.triggers(id)?.iter().filter(|trigger| trigger.fine) {
        for joint in trigger.joints.as_array().into_iter().flatten() {
            let text = |key: &str| joint.get(key).and_then(Value::as_str).unwrap_or_default();
            let value = joint.get("value").map(Value::to_string).unwrap_or_default();
            let uncertainty =
                if text("name") == trigger.joint { trigger.half_width.to_string() } else { String::new() };
            line(["trigger", &trigger.step, text("name"), &value, text("unit"), &uncertainty])?;
        }
    }
    for prompt in record.prompts(id)? {
        if let Some(answer) = &prompt.answer {
            line(["answer", &prompt.step, &answer.by, &answer_in_words(&answer.answer), "", ""])?;
        }
    }
    for one in record.corrections_of_run(id)? {
        let name = format!("{} {} {}", one.key.quantity, one.key.device, one.key.site);
        line(["as_found", &one.step, &name, &one.old.to_string(), &one.unit, ""])?;
        let uncertainty = one.uncertainty.map(|value| value.to_string()).unwrap_or_default();
        line(["as_left", &one.step, &name, &one.new.to_string(), &one.unit, &uncertainty])?;
        for part in one.budget.iter().flat_map(|budget| &budget.components) {
            let standard = part.standard.map(|value| value.to_string()).unwrap_or_default();
            line(["component", &one.step, &format!("{name}: {}", part.name), "0", &part.unit, &standard])?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn line(fields: [&str; 6]) -> io::Result<()> {
    print_line!("{}", fields.map(csv_field).join(","))
}
