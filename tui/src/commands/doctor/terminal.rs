//! The terminal: can the screens be drawn on it.

use std::io::IsTerminal as _;

use super::finding::Finding;

const TOPIC: &str = "terminal";

/// What the screens are drawn for.
const COLUMNS: u16 = 80;
const ROWS: u16 = 24;

pub(super) fn look() -> Vec<Finding> {
    if !std::io::stdout().is_terminal() {
        return vec![Finding::note(TOPIC, "standard output is none: runs print lines instead of screens")];
    }
    let mut findings = Vec::new();
    findings.push(match ratatui::crossterm::terminal::size() {
        Ok((columns, rows)) if columns < COLUMNS || rows < ROWS => Finding::wrong(
            TOPIC,
            format!("{columns} columns, {rows} rows"),
            format!(
                "make it at least {COLUMNS} columns by {ROWS} rows, or the font smaller: screens are cut off"
            ),
        ),
        Ok((columns, rows)) => Finding::good(TOPIC, format!("{columns} columns, {rows} rows")),
        Err(error) => Finding::note(TOPIC, format!("its size is not known: {error}")),
    });
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let kind = variable("TERM");
    findings.push(match kind.as_str() {
        "" | "dumb" => {
            let text = format!("TERM is `{kind}`: nothing can be drawn");
            Finding::wrong(TOPIC, text, "set it to what your terminal is, as in: export TERM=xterm-256color")
        }
        _ => Finding::good(
            TOPIC,
            format!("TERM is {kind}, {}", colours(&kind, &variable("COLORTERM"), &variable("NO_COLOR"))),
        ),
    });
    findings
}

fn colours(kind: &str, more: &str, none: &str) -> &'static str {
    match (none, more) {
        (set, _) if !set.is_empty() => "no colours (NO_COLOR is set)",
        (_, "truecolor" | "24bit") => "full colours",
        _ if kind.contains("256color") => "256 colours",
        _ => "16 colours",
    }
}
