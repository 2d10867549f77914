//! Reading the steps of a procedure.

use std::sync::Arc;
use std::time::Duration;

use plumb_document::{MapReader, Node, NodeValue, Span};

use super::declaration::{Action, OnError, Step};
use crate::prompt::Decision;
use crate::read_context::ReadContext;

/// Reads the `steps:` of a procedure or repetition; none when one of them cannot be read.
pub(crate) fn read_steps(node: &Node, context: &ReadContext<'_>) -> Option<Vec<Step>> {
    let items = node.list("`steps`", context.problems)?;
    if items.is_empty() {
        context.problems.add(node.span, "`steps` is empty", "a procedure has at least one step");
    }
    let steps: Vec<Option<Step>> = items.iter().map(|item| read_step(item, context)).collect();
    steps.into_iter().collect()
}

fn read_step(node: &Node, context: &ReadContext<'_>) -> Option<Step> {
    let mut map = MapReader::new(node, "a step", context.problems)?;
    let id = context.required_text(&mut map, "id");
    let title =
        map.optional("title").and_then(|node| node.text("`title`", context.problems)).map(str::to_owned);
    let action = map.required("do").and_then(|node| read_action(node, context));
    let when = map.optional("when").and_then(|node| context.expression(node, "`when`"));
    let time_limit = map
        .optional("time_limit_s")
        .and_then(|node| node.number_between("`time_limit_s`", 0.001, 1e6, context.problems))
        .map(Duration::from_secs_f64);
    let on_error = map.optional("on_error").and_then(|node| read_on_error(node, context));
    let retries = map
        .optional("retries")
        .and_then(|node| node.count_between("`retries`", 1, 100, context.problems))
        .unwrap_or(3);
    map.finish();
    let (id, span) = id?;
    check_name(&id, span, "a step's id", context);
    let title = title.unwrap_or_else(|| id.replace('_', " "));
    let (kind, action) = action?;
    Some(Step { id, span, title, kind, action, when, time_limit, on_error, retries })
}

fn read_on_error(node: &Node, context: &ReadContext<'_>) -> Option<OnError> {
    let index = node.word("way to go on", &["ask", "retry", "skip", "abort"], context.problems)?;
    Some(match index {
        0 => OnError::Ask,
        1 => OnError::Decide(Decision::Retry),
        2 => OnError::Decide(Decision::Skip),
        _ => OnError::Decide(Decision::Abort),
    })
}

fn read_action(node: &Node, context: &ReadContext<'_>) -> Option<(&'static str, Arc<dyn Action>)> {
    let entries = match &node.value {
        NodeValue::Map(entries) => entries.as_slice(),
        other => {
            let message = format!("`do` is a map with the kind of step as its key; this is {}", other.kind());
            context.problems.add(
                node.span,
                message,
                "write, for example, `do: {move: {robot: arm, by_deg: {waist: 5}}}`",
            );
            return None;
        }
    };
    let [(kind, body)] = entries else {
        context.problems.add(
            node.span,
            format!("a step does one thing; this `do` has {} keys", entries.len()),
            "",
        );
        return None;
    };
    (context.read_action)(kind, body, context)
}

/// Characters of a name: it is in a column of a screen of 80, and in the names of files in shared memory.
pub(crate) const LONGEST_NAME: usize = 64;

/// Names that expressions use are words of letters, digits and underscores.
pub(crate) fn check_name(name: &str, span: Span, what: &str, context: &ReadContext<'_>) {
    let mut letters = name.chars();
    let good_start = letters.next().is_some_and(|c| c.is_ascii_alphabetic());
    let good = good_start && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
    if name.len() > LONGEST_NAME {
        let message = format!("{what} has {} characters", name.len());
        context.problems.add(span, message, format!("at most {LONGEST_NAME}"));
    } else if !good {
        let message = format!("`{name}` cannot be {what}");
        let help = "use letters, digits and `_`, beginning with a letter";
        context.problems.add(span, message, help);
    } else if context.calculator.compile_expression(name).is_err() {
        let message = format!("`{name}` cannot be {what}: it is a word of the expression language");
        context.problems.add(span, message, format!("choose another, as `{name}_1`"));
    }
}
