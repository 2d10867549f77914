//! `listen`: the messages of a stream are taken in as they come, and numbers of them are kept.

use plumb_document::{MapReader, Node, Span, did_you_mean};

use super::declaration::{Action, numbers_shape};
use super::kind::{Kind, StepKind};
use super::read::check_name;
use super::time::TimeContext;
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::scope::{named_value, result_name};
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;
use crate::stream_names::{FieldName, StreamNames};

mod carry_out;
mod message_fields;
mod statistics;

use statistics::Statistic;

/// By which conditions name the message at hand.
const MESSAGE: &str = "message";

/// What the result holds beside the values that were chosen.
const ALWAYS: [&str; 2] = ["messages", "seconds"];

/// A declared time of listening.
#[derive(Debug, Clone)]
pub(crate) struct ListenStep {
    /// Whose stream it is.
    pub(crate) device: String,
    /// As its manifest calls it.
    pub(crate) stream: String,
    /// Where both are.
    pub(crate) span: Span,
    pub(crate) end: End,
    /// It fails when no message came for so long, s.
    pub(crate) longest_gap: Option<Expression>,
    /// What is kept.
    pub(crate) values: Vec<KeptValue>,
}

/// When it ends.
#[derive(Debug, Clone)]
pub(crate) enum End {
    /// After a time, s.
    After { seconds: Expression },
    /// After so many messages, which have to come within a time, s.
    Messages { count: Expression, within: Expression },
    /// With the first message for which a condition holds, which has to come within a time, s.
    Condition { holds: Expression, within: Expression },
}

/// A number that is kept of the messages.
#[derive(Debug, Clone)]
pub(crate) struct KeptValue {
    /// As later steps call it; it ends in its unit.
    pub(crate) name: String,
    name_span: Span,
    pub(crate) statistic: Statistic,
    /// Of which field: `joints.elbow_deg`.
    pub(crate) field: String,
    field_span: Span,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<ListenStep> {
    let mut map = MapReader::new(node, "a time of listening", context.problems)?;
    let stream = context.required_text(&mut map, "stream");
    let mut expression = |key: &'static str| {
        map.optional(key).map(|node| (context.expression(node, &format!("`{key}`")), node.span))
    };
    let given = [expression("for_s"), expression("messages"), expression("until")];
    let (within, longest_gap) = (expression("within_s"), expression("longest_gap_s"));
    let values = map.optional("values").and_then(|node| node.entries("`values`", context.problems));
    map.finish();
    let end = read_end(node.span, given, within, context);
    let mut kept = Vec::new();
    for (name, node) in values.unwrap_or_default() {
        check_name(&name.name, name.span, "the name of a value", context);
        if ALWAYS.contains(&name.name.as_str()) {
            let message = format!("no value can be called `{}` here", name.name);
            context.problems.add(
                name.span,
                message,
                "the step itself says how many messages came, and in how many seconds; choose another name",
            );
        }
        kept.push(read_value(&name.name, name.span, node, context)?);
    }
    let (stream, span) = stream?;
    let Some((device, stream)) = stream.split_once('/') else {
        let help = "write `stream: DEVICE/STREAM`, such as `arm/joints`; `plumb streams CELL` lists them";
        context.problems.add(span, format!("`{stream}` names no stream of a device"), help);
        return None;
    };
    let longest_gap = match longest_gap {
        Some((expression, _)) => Some(expression?),
        None => None,
    };
    Some(ListenStep {
        device: device.to_owned(),
        stream: stream.to_owned(),
        span,
        end: end?,
        longest_gap,
        values: kept,
    })
}

/// An expression of the file, where its key is given, and its span.
type Given = Option<(Option<Expression>, Span)>;

fn read_end(step: Span, given: [Given; 3], within: Given, context: &ReadContext<'_>) -> Option<End> {
    const ENDS: &str = "`for_s: 2`, `messages: 100` with `within_s`, or `until: CONDITION` with `within_s`";
    let problems = context.problems;
    let [after, messages, condition] = given;
    match (after, messages, condition, within) {
        (Some((seconds, _)), None, None, None) => Some(End::After { seconds: seconds? }),
        (None, Some((count, _)), None, Some((within, _))) => {
            Some(End::Messages { count: count?, within: within? })
        }
        (None, None, Some((holds, _)), Some((within, _))) => {
            Some(End::Condition { holds: holds?, within: within? })
        }
        (Some(_), None, None, Some((_, span))) => {
            let message =
                "`within_s` says how long to wait for `messages` or `until`; `for_s` is the time itself";
            problems.add(span, message, "leave `within_s` out");
            None
        }
        (None, Some((_, span)), None, None) | (None, None, Some((_, span)), None) => {
            let message = "this may never come about, and nothing says how long to wait for it";
            problems.add(span, message, "add `within_s`, such as `within_s: 10`");
            None
        }
        (None, None, None, _) => {
            problems.add(step, "nothing says when listening ends", format!("add {ENDS}"));
            None
        }
        _ => {
            problems.add(step, "listening ends in one way", format!("give one of {ENDS}"));
            None
        }
    }
}

/// `mean: joints.elbow_deg`.
fn read_value(name: &str, name_span: Span, node: &Node, context: &ReadContext<'_>) -> Option<KeptValue> {
    let words = || Statistic::ALL.map(Statistic::word);
    let help = || format!("write, for example, `{name}: {{mean: FIELD}}`; there are {}", words().join(", "));
    let entries = match &node.value {
        plumb_document::NodeValue::Map(entries) => entries.as_slice(),
        other => {
            let message =
                format!("`{name}` is a map of what is kept and of which field; this is {}", other.kind());
            context.problems.add(node.span, message, help());
            return None;
        }
    };
    let [(word, field)] = entries else {
        let message = format!("`{name}` is one number; this map has {} keys", entries.len());
        context.problems.add(node.span, message, help());
        return None;
    };
    let Some(statistic) = Statistic::ALL.into_iter().find(|statistic| statistic.word() == word.name) else {
        let message = format!("there is no `{}` of a field", word.name);
        context.problems.add(word.span, message, did_you_mean(&word.name, words()));
        return None;
    };
    let text = field.text("a field", context.problems)?.to_owned();
    Some(KeptValue { name: name.to_owned(), name_span, statistic, field: text, field_span: field.span })
}

impl End {
    /// The times and numbers of it, each with its key.
    fn numbers(&self) -> Vec<(&'static str, &Expression)> {
        match self {
            Self::After { seconds } => vec![("for_s", seconds)],
            Self::Messages { count, within } => vec![("messages", count), ("within_s", within)],
            Self::Condition { within, .. } => vec![("within_s", within)],
        }
    }
}

impl ListenStep {
    /// `arm/joints`.
    pub(crate) fn stream_name(&self) -> String {
        format!("{}/{}", self.device, self.stream)
    }

    /// What its manifest says of the stream; what is not there is reported. None where nobody knows the manifest, too.
    fn known_stream<'c>(&self, context: &CheckContext<'c>) -> Option<&'c StreamNames> {
        let devices = || context.robots.iter().map(|robot| &robot.name).chain(context.sensors);
        if !devices().any(|device| *device == self.device) {
            let help = did_you_mean(&self.device, devices().map(String::as_str));
            context.problems.add(
                self.span,
                format!("there is no device `{}` in the cell", self.device),
                help,
            );
            return None;
        }
        let known = context.streams.iter().find(|known| known.device == self.device)?;
        let found = known.streams.iter().find(|stream| stream.name == self.stream);
        if found.is_none() {
            let help = did_you_mean(&self.stream, known.streams.iter().map(|stream| stream.name.as_str()));
            let message = format!("device `{}` has no stream `{}`", self.device, self.stream);
            context.problems.add(self.span, message, help);
        }
        found
    }

    fn check_value(&self, value: &KeptValue, stream: &StreamNames, context: &CheckContext<'_>) {
        let Some(field) = stream.fields.iter().find(|field| field.path == value.field) else {
            let message = format!("stream `{}` has no field `{}`", self.stream_name(), value.field);
            let help = match stream.fields.is_empty() {
                true => format!(
                    "what is in `{}` only its plugin knows: list its numbers under `fields` in plugin.yaml",
                    stream.message
                ),
                false => did_you_mean(&value.field, stream.fields.iter().map(|field| field.path.as_str())),
            };
            context.problems.add(value.field_span, message, help);
            return;
        };
        if let Some((message, help)) = wrong_unit(value, field) {
            context.problems.add(value.name_span, message, help);
        }
    }
}

/// What is wrong with the unit at the end of a value's name.
fn wrong_unit(value: &KeptValue, field: &FieldName) -> Option<(String, String)> {
    let unit = if value.statistic == Statistic::Count { "" } else { field.unit.as_str() };
    let ending = result_name("", unit);
    if !unit.is_empty() {
        let message = format!("`{}` is in {unit}, and `{}` does not say so", field.path, value.name);
        let help = format!("give it a name that ends in `{ending}`");
        return (!value.name.ends_with(&ending)).then_some((message, help));
    }
    let claimed = named_value(&value.name, 0.0).unit;
    let message = format!("`{}` is said to be in {claimed}, and is a number without a unit", value.name);
    (!claimed.is_empty()).then_some((message, "choose another name".to_owned()))
}

impl Action for ListenStep {
    fn check(&self, context: &CheckContext<'_>) {
        for (key, expression) in
            self.end.numbers().into_iter().chain(self.longest_gap.iter().map(|gap| ("longest_gap_s", gap)))
        {
            context.check_expression(expression);
            if expression.text().parse::<f64>().is_ok_and(|number| number <= 0.0) {
                let message = format!("`{key}` is {}", expression.text());
                context.problems.add(expression.span(), message, "give a number above 0");
            }
        }
        let stream = self.known_stream(context);
        if let End::Condition { holds, .. } = &self.end {
            let mut names = context.names.clone();
            names.set(MESSAGE, stream.map_or(Shape::Anything, StreamNames::shape));
            holds.check_names(&names, context.file, context.problems);
        }
        for value in &self.values {
            if let Some(stream) = stream {
                self.check_value(value, stream, context);
            }
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        let names: Vec<&str> = self.values.iter().map(|value| value.name.as_str()).chain(ALWAYS).collect();
        numbers_shape(&names)
    }

    /// What is waited for comes nobody knows when: half of the time it has is at most twice what it takes, unless it comes in the first quarter.
    fn estimated_time_s(&self, context: &TimeContext<'_>) -> Option<f64> {
        match &self.end {
            End::After { seconds } => context.known(seconds),
            End::Messages { within, .. } | End::Condition { within, .. } => {
                context.known(within).map(|within| within / 2.0)
            }
        }
    }

    fn judged(&self) -> Vec<&str> {
        match &self.end {
            End::Condition { holds, .. } => vec![holds.text()],
            _ => Vec::new(),
        }
    }
}

pub(super) const KIND: Kind = Kind::entry::<ListenStep>();

impl StepKind for ListenStep {
    const NAME: &'static str = "listen";
    const SENTENCE: &'static str = "listens to a stream of a device for a time, or until something holds, and keeps numbers of its messages";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["stream"],
  "properties": {
    "stream": {"description": "DEVICE/STREAM, as `plumb streams CELL` lists them.", "type": "string", "pattern": "/"},
    "for_s": {"description": "How long it listens.", "$ref": "#/definitions/expression"},
    "messages": {"description": "It ends after so many.", "$ref": "#/definitions/expression"},
    "until": {"description": "It ends with the first message for which this holds, such as message.joints.elbow_deg > 40.", "$ref": "#/definitions/expression"},
    "within_s": {"description": "How long to wait for `messages` or `until`.", "$ref": "#/definitions/expression"},
    "longest_gap_s": {"description": "It fails when no message came for so long.", "$ref": "#/definitions/expression"},
    "values": {
      "description": "What is kept, each number under a name that ends in its unit.",
      "type": "object",
      "propertyNames": {"$ref": "#/definitions/name"},
      "additionalProperties": {
        "type": "object",
        "additionalProperties": false,
        "minProperties": 1,
        "maxProperties": 1,
        "properties": {
          "last": {"$ref": "#/definitions/text"}, "mean": {"$ref": "#/definitions/text"},
          "standard_deviation": {"$ref": "#/definitions/text"}, "minimum": {"$ref": "#/definitions/text"},
          "maximum": {"$ref": "#/definitions/text"}, "count": {"$ref": "#/definitions/text"}
        }
      }
    }
  },
  "oneOf": [
    {"required": ["for_s"], "not": {"anyOf": [{"required": ["messages"]}, {"required": ["until"]}, {"required": ["within_s"]}]}},
    {"required": ["messages", "within_s"], "not": {"anyOf": [{"required": ["for_s"]}, {"required": ["until"]}]}},
    {"required": ["until", "within_s"], "not": {"anyOf": [{"required": ["for_s"]}, {"required": ["messages"]}]}}
  ]
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_listen(self, at)
    }
}
