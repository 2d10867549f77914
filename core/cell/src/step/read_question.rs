//! Reading what a prompt asks.

use plumb_document::{MapReader, Node, NodeValue, did_you_mean};

use super::question::{Arrival, ArrivalSide, Goal, PromptQuestion};
use crate::deg_or_mm::DegOrMm;
use crate::prompt::ChoiceOption;
use crate::read_context::ReadContext;

pub(super) fn read_choice(
    node: &Node,
    default: Option<&Node>,
    context: &ReadContext<'_>,
) -> Option<PromptQuestion> {
    let entries = node.entries("`choice`", context.problems)?;
    if entries.len() < 2 {
        context.problems.add(
            node.span,
            "a choice has at least two options",
            "write `choice: {light: Light paper, dark: Dark paper}`",
        );
    }
    let options: Vec<ChoiceOption> = entries
        .iter()
        .filter_map(|(key, node)| {
            let label = node.text("the label of an option", context.problems)?;
            Some(ChoiceOption { key: key.name.clone(), label: label.to_owned() })
        })
        .collect();
    let default = default.and_then(|node| {
        let key = node.text("`default`", context.problems)?;
        if !options.iter().any(|option| option.key == key) {
            let help = did_you_mean(key, options.iter().map(|option| option.key.as_str()));
            context.problems.add(node.span, format!("`{key}` is no option of this choice"), help);
        }
        Some(key.to_owned())
    });
    Some(PromptQuestion::Choice { options, default })
}

pub(super) fn read_number(node: &Node, context: &ReadContext<'_>) -> Option<PromptQuestion> {
    let mut map = MapReader::new(node, "a number prompt", context.problems)?;
    let unit = context.required_text(&mut map, "unit");
    let minimum = map.optional("minimum").and_then(|node| context.expression(node, "`minimum`"));
    let maximum = map.optional("maximum").and_then(|node| context.expression(node, "`maximum`"));
    let default = map.optional("default").and_then(|node| context.expression(node, "`default`"));
    map.finish();
    let unit = match unit?.0.as_str() {
        "none" => String::new(),
        unit => unit.to_owned(),
    };
    Some(PromptQuestion::Number { unit, minimum, maximum, default })
}

/// The most characters a written line may have, unless said otherwise, and whatever is said.
const USUALLY_LONGEST: f64 = 80.0;
const LONGEST: f64 = 400.0;

pub(super) fn read_write(node: &Node, context: &ReadContext<'_>) -> Option<PromptQuestion> {
    let mut map = MapReader::new(node, "`write`", context.problems)?;
    let longest = context.number_or(&mut map, "longest", (1.0, LONGEST), USUALLY_LONGEST);
    map.finish();
    Some(PromptQuestion::Text { longest: longest as usize })
}

/// How far a level shows to either side unless said otherwise, and whatever is said, deg.
const USUALLY_MOST: f64 = 10.0;
const MOST: f64 = 90.0;

pub(super) fn read_level(node: &Node, context: &ReadContext<'_>) -> Option<PromptQuestion> {
    let mut map = MapReader::new(node, "`level`", context.problems)?;
    let most = context.number_or(&mut map, "most_deg", (0.01, MOST), USUALLY_MOST);
    map.finish();
    Some(PromptQuestion::Level { most })
}

pub(super) fn read_photo(node: &Node, context: &ReadContext<'_>) -> Option<PromptQuestion> {
    MapReader::new(node, "`photo`", context.problems)?.finish();
    Some(PromptQuestion::Photo)
}

pub(super) fn read_jog(node: &Node, context: &ReadContext<'_>) -> Option<PromptQuestion> {
    let mut map = MapReader::new(node, "`jog_to`", context.problems)?;
    let robot = context.required_text(&mut map, "robot");
    let mut goals = Vec::new();
    for (key, unit) in [("within_deg", DegOrMm::Deg), ("within_mm", DegOrMm::Mm)] {
        let Some(entries) =
            map.optional(key).and_then(|node| node.entries(&format!("`{key}`"), context.problems))
        else {
            continue;
        };
        for (joint, node) in entries {
            let bounds = match &node.value {
                NodeValue::List(items) => items.as_slice(),
                _ => &[],
            };
            let [minimum, maximum] = bounds else {
                context.problems.add(
                    node.span,
                    format!("the bounds of `{}` are two numbers", joint.name),
                    "write `[least, most]`",
                );
                continue;
            };
            let what = "a bound";
            if let (Some(minimum), Some(maximum)) =
                (context.expression(minimum, what), context.expression(maximum, what))
            {
                goals.push(Goal { joint: joint.name.clone(), span: joint.span, unit, minimum, maximum });
            }
        }
    }
    let arrivals = map.optional("from").map(|node| read_arrivals(node, context)).unwrap_or_default();
    map.finish();
    let (robot, span) = robot?;
    Some(PromptQuestion::JogTo { robot, span, goals, arrivals })
}

fn read_arrivals(node: &Node, context: &ReadContext<'_>) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    for (joint, node) in node.entries("`from`", context.problems).unwrap_or_default() {
        let from = match node.text("a side", context.problems) {
            Some("below") => ArrivalSide::Below,
            Some("above") => ArrivalSide::Above,
            Some(other) => {
                let help = "write `below`, for a reading that increases until the joint is there, or `above`";
                context.problems.add(node.span, format!("`{other}` is no side to arrive from"), help);
                continue;
            }
            None => continue,
        };
        arrivals.push(Arrival { joint: joint.name.clone(), span: joint.span, from });
    }
    arrivals
}
