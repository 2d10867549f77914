//! One line of the conversation.

use plumb_plugin::{LogLevel, PluginError, Value};
use serde_json::Map;

/// What a driver says.
#[derive(Debug, PartialEq)]
pub(crate) enum Line {
    /// The answer to the call under way.
    Done(Value),
    /// Why the call under way failed.
    Failed(PluginError),
    Log(LogLevel, String),
    /// A message on a stream.
    Emit {
        stream: String,
        message: Value,
    },
    Progress(f64, String),
    /// A question to the host: the time.
    AskTime,
    /// A question to the host: the next message of an input.
    AskInput(String),
}

/// Understands a line.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn understood(line: &str) -> Result<Line, String> {
    let mut fields: Map<String, Value> = serde_json::from_str(line).map_err(|error| error.to_string())?;
    let text = |name: &str| {
        let value = fields.get(name).and_then(Value::as_str);
        value.map(str::to_owned).ok_or_else(|| format!("`{name}` has to be a text"))
    };
    if fields.contains_key("error") {
        return Ok(Line::Failed(error_of(&text("kind")?, text("error")?)));
    }
    if fields.contains_key("log") {
        return Ok(Line::Log(level_of(&text("log")?), text("text")?));
    }
    if fields.contains_key("emit") {
        let stream = text("emit")?;
        let message = fields.remove("message").ok_or("a message on a stream has `message`")?;
        return Ok(Line::Emit { stream, message });
    }
    if let Some(fraction) = fields.get("progress") {
        let fraction = fraction.as_f64().ok_or("`progress` has to be a number")?;
        return Ok(Line::Progress(fraction, text("text")?));
    }
    if fields.contains_key("ask") {
        return match text("ask")?.as_str() {
            "now_ns" => Ok(Line::AskTime),
            "receive" => Ok(Line::AskInput(text("input")?)),
            other => Err(format!("'{other}' cannot be asked: now_ns and receive can")),
        };
    }
    match fields.remove("done") {
        Some(answer) => Ok(Line::Done(answer)),
        None => Err("it has none of done, error, log, emit, progress and ask".to_owned()),
    }
}

fn level_of(name: &str) -> LogLevel {
    match name {
        "error" => LogLevel::Error,
        "warn" | "warning" => LogLevel::Warn,
        "debug" => LogLevel::Debug,
        _ => LogLevel::Info,
    }
}

/// Makes an error of one kind from its text.
type Make = fn(String) -> PluginError;

/// The kinds of errors, as drivers name them.
const KINDS: [(&str, Make); 9] = [
    ("refused", PluginError::Refused),
    ("out_of_range", PluginError::OutOfRange),
    ("unsupported", PluginError::Unsupported),
    ("stopped", PluginError::Stopped),
    ("not_ready", PluginError::NotReady),
    ("disconnected", PluginError::Disconnected),
    ("timed_out", PluginError::TimedOut),
    ("input_lost", PluginError::InputLost),
    ("failed", PluginError::Failed),
];

fn error_of(kind: &str, text: String) -> PluginError {
    let make: Make =
        KINDS.iter().find(|(name, _)| *name == kind).map_or(PluginError::Failed, |(_, make)| *make);
    make(text)
}

/// The name of an error's kind.
pub(crate) fn kind_of(error: &PluginError) -> &'static str {
    KINDS.iter().find(|(_, make)| make(error.text().to_owned()) == *error).map_or("failed", |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn each_kind_of_line_is_understood() {
        assert_eq!(understood(r#"{"done": null}"#), Ok(Line::Done(Value::Null)));
        assert_eq!(
            understood(r#"{"error": "no", "kind": "stopped"}"#),
            Ok(Line::Failed(PluginError::Stopped("no".to_owned())))
        );
        assert_eq!(
            understood(r#"{"log": "warn", "text": "hot"}"#),
            Ok(Line::Log(LogLevel::Warn, "hot".to_owned()))
        );
        let emitted = Line::Emit { stream: "joints".to_owned(), message: json!({"time_ns": 1}) };
        assert_eq!(understood(r#"{"emit": "joints", "message": {"time_ns": 1}}"#), Ok(emitted));
        assert_eq!(understood(r#"{"ask": "now_ns"}"#), Ok(Line::AskTime));
    }

    #[test]
    fn what_is_no_message_is_reported() {
        for (line, expected) in [
            ("hello", "expected"),
            ("[1]", "invalid type"),
            ("{}", "none of done"),
            (r#"{"ask": "money"}"#, "now_ns and receive can"),
            (r#"{"emit": "joints"}"#, "`message`"),
            (r#"{"error": 5, "kind": "failed"}"#, "`error` has to be a text"),
            (r#"{"progress": "half"}"#, "a number"),
        ] {
            let error = understood(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }

    #[test]
    fn an_error_keeps_its_kind_both_ways() {
        for (name, make) in KINDS {
            assert_eq!(kind_of(&error_of(name, "why".to_owned())), name);
            assert_eq!(make("why".to_owned()).text(), "why");
        }
    }
}
