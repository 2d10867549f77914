//! Events as lines of JSON: which of them, and in which version of the form.

use std::io::{self, Write};
use std::str::FromStr;

use plumb_cell::event::{Event, StampedEvent};
use plumb_document::did_you_mean;
use serde_json::{Value, json};

/// The form of the events. It changes where a reader of earlier ones would be misled: a key or an event that is taken away or means
/// something else. New keys and events change nothing.
const VERSION: u32 = 1;

/// Before the name of an event that is left out.
const NOT: &str = "no:";

/// One word of `--events`: an event, or `no:` and an event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Requested {
    name: String,
    left_out: bool,
}

impl FromStr for Requested {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, left_out) = match text.strip_prefix(NOT) {
            Some(name) => (name, true),
            None => (text, false),
        };
        let known = event_names();
        if known.iter().any(|one| one == name) {
            return Ok(Self { name: name.to_owned(), left_out });
        }
        Err(format!("there is no event `{name}`; {}", did_you_mean(name, known.iter().map(String::as_str))))
    }
}

/// The names of all events, as the type itself lists them when it meets one that it does not know.
fn event_names() -> Vec<String> {
    let refused = serde_json::from_value::<Event>(json!({"event": "?"})).err();
    let listed = refused.map(|error| error.to_string()).unwrap_or_default();
    let after = listed.split_once("expected one of ").map(|(_, names)| names.to_owned()).unwrap_or_default();
    after.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Writes an event as a line, unless it is not wanted. The first of a sitting, `run_started`, says the version.
pub(super) fn write(event: &StampedEvent, requested: &[Requested], out: &mut impl Write) -> io::Result<()> {
    let mut line = serde_json::to_value(event)?;
    let name = line.get("event").and_then(Value::as_str).unwrap_or_default();
    let named = |left_out: bool| requested.iter().any(|one| one.left_out == left_out && one.name == name);
    let only_some = requested.iter().any(|one| !one.left_out);
    if named(true) || only_some && !named(false) {
        return Ok(());
    }
    if let (Event::RunStarted { .. }, Some(entries)) = (&event.event, line.as_object_mut()) {
        entries.insert("version".to_owned(), json!(VERSION));
    }
    serde_json::to_writer(&mut *out, &line)?;
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_of_the_events() {
        let names = event_names();
        for name in ["run_started", "joints", "step_finished", "run_ended"] {
            assert!(names.iter().any(|one| one == name), "{name}: {names:?}");
        }
        assert!(names.len() > 15, "{names:?}");
    }
}
