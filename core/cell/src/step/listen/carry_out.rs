//! How listening is carried out.

use std::time::{Duration, Instant};

use plumb_document::counted;
use plumb_plugin::message::Layout;
use serde_json::{Map, Value, json};

use super::message_fields::{message_fields, number_at};
use super::statistics::{Numbers, Statistic};
use super::{End, KeptValue, ListenStep, MESSAGE};
use crate::engine::Engine;
use crate::engine::scope::result_name;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Expression;
use crate::in_words::short_number;
use crate::stream_fields::{field_names, robot_of};

/// How often is looked whether somebody interrupts, or a device was lost.
const LOOK: Duration = Duration::from_millis(50);

/// How often is shown how far it is.
const SHOW: Duration = Duration::from_millis(500);

/// The longest time of listening, s: a day.
const LONGEST_S: f64 = 86_400.0;

/// What the step was given, in numbers.
struct Requested<'s> {
    /// How long it listens, or waits at most.
    within: Duration,
    /// How many messages it takes.
    messages: Option<u64>,
    /// What ends it.
    until: Option<&'s Expression>,
    longest_gap: Option<Duration>,
}

/// What has come so far.
struct Heard {
    /// A row for each value that is kept.
    numbers: Vec<Numbers>,
    messages: u64,
    /// Messages dated before the step began, and when the last of them was dated.
    stale: u64,
    last_stale_ns: u64,
    /// When the first and the last message were dated, ns of the cell's clock.
    first_ns: u64,
    last_ns: u64,
    /// The fields of the last.
    last: Map<String, Value>,
    /// When it came.
    last_came: Instant,
}

impl Engine {
    pub(super) fn execute_listen(&mut self, step: &ListenStep, at: &StepContext) -> Result<Done, StepError> {
        let requested = self.listen_wanted(step, at)?;
        self.look_for_interrupt()?;
        let opened = self.links.listen(&step.device, &step.stream);
        let mut link = opened.map_err(|error| self.device_error(error))?;
        let Some(layout) = link.layout().cloned() else {
            return Err(StepError::error(format!(
                "what is in the messages of {} only its plugin knows: list its numbers under `fields` in plugin.yaml",
                step.stream_name()
            )));
        };
        // What was sent before is drained when the stream is opened; what is under way then is recognised by its date.
        let not_before_ns = link.began_ns().unwrap_or_default().max(self.rest_ns);
        let mut values = match requested.until {
            Some(until) => self.values(at.scope, &[until.text()])?,
            None => Map::new(),
        };
        let began = Instant::now();
        let mut heard = Heard::new(step.values.len(), began);
        let mut shown = began;
        let mut holds = false;
        while !holds && requested.messages != Some(heard.messages) {
            self.look_at_others()?;
            heard.check_gap(step, &requested)?;
            let left = requested.within.saturating_sub(began.elapsed());
            if left.is_zero() {
                break;
            }
            if shown.elapsed() >= SHOW {
                shown = Instant::now();
                let fraction = began.elapsed().as_secs_f64() / requested.within.as_secs_f64();
                let fraction = requested.until.is_none().then_some(fraction);
                self.journal.progress(&at.path, fraction, format!("{} messages", heard.messages));
            }
            let received = link.next(left.min(LOOK)).map_err(|error| self.device_error(error))?;
            let Some(bytes) = received else { continue };
            let fields = self.listened_fields(step, &layout, &bytes)?;
            if heard.take(step, fields, not_before_ns)?
                && let Some(until) = requested.until
            {
                values.insert(MESSAGE.to_owned(), Value::Object(heard.last.clone()));
                holds = until.truth(&self.calculator, &values)?;
            }
        }
        heard.check_end(step, &requested, holds, not_before_ns)?;
        let kept = self.kept_values(step, &layout, &heard)?;
        self.journal.noted(&at.path, &step.device, &kept)?;
        Ok(heard.done_with(step, kept))
    }

    fn listen_wanted<'s>(
        &mut self,
        step: &'s ListenStep,
        at: &StepContext,
    ) -> Result<Requested<'s>, StepError> {
        let mut positive = |key: &str, expression: &Expression, most: f64| {
            let number = self.number(at.scope, expression)?;
            if number > 0.0 && number <= most {
                return Ok(number);
            }
            Err(StepError::error(format!("`{key}` is {number}: it has to be above 0 and at most {most}")))
        };
        let longest_gap = match &step.longest_gap {
            Some(gap) => Some(Duration::from_secs_f64(positive("longest_gap_s", gap, LONGEST_S)?)),
            None => None,
        };
        let (seconds, messages, until) = match &step.end {
            End::After { seconds } => (positive("for_s", seconds, LONGEST_S)?, None, None),
            End::Messages { count, within } => {
                let count = positive("messages", count, 1e9)?;
                if count.fract() != 0.0 {
                    return Err(StepError::error(format!(
                        "`messages` is {count}: it has to be a whole number"
                    )));
                }
                (positive("within_s", within, LONGEST_S)?, Some(count as u64), None)
            }
            End::Condition { holds, within } => (positive("within_s", within, LONGEST_S)?, None, Some(holds)),
        };
        Ok(Requested { within: Duration::from_secs_f64(seconds), messages, until, longest_gap })
    }

    /// Takes in commands, and gives up where one interrupts or a device's process has ended.
    fn look_at_others(&mut self) -> Result<(), StepError> {
        self.look_for_interrupt()?;
        match self.links.lost().filter(|lost| !self.lost.contains(&lost.device)) {
            Some(lost) => Err(StepError::Lost { device: lost.device, message: lost.message }),
            None => Ok(()),
        }
    }

    fn listened_fields(
        &mut self,
        step: &ListenStep,
        layout: &Layout,
        message: &[u8],
    ) -> Result<Map<String, Value>, StepError> {
        let device = self.cell.devices.iter().find(|device| device.name == step.device);
        let robot =
            device.and_then(|device| robot_of(device, &self.cell.robots)).map(|robot| robot.device.clone());
        let arm = robot.and_then(|robot| self.arms.iter().find(|arm| arm.name == robot));
        message_fields(layout, message, arm)
            .map_err(|what| StepError::error(format!("{} {what}", step.stream_name())))
    }

    /// The numbers that are kept, as people read them.
    fn kept_values(
        &self,
        step: &ListenStep,
        layout: &Layout,
        heard: &Heard,
    ) -> Result<Vec<NamedValue>, StepError> {
        let device = self.cell.devices.iter().find(|device| device.name == step.device);
        let robot = device.and_then(|device| robot_of(device, &self.cell.robots));
        let fields =
            field_names(layout, robot.map(|robot| robot.joints.as_slice()).unwrap_or_default(), None);
        let value = |(kept, numbers): (&KeptValue, &Numbers)| {
            let Some(value) = numbers.value(kept.statistic) else {
                let (name, stream, came) = (&kept.name, step.stream_name(), messages(heard.messages));
                return Err(StepError::error(format!(
                    "`{name}` needs more than one message of {stream}, and {came} came"
                )));
            };
            let field = fields.iter().find(|field| field.path == kept.field);
            let unit = field
                .map(|field| field.unit.clone())
                .filter(|_| kept.statistic != Statistic::Count)
                .unwrap_or_default();
            let name = kept.name.strip_suffix(&result_name("", &unit)).unwrap_or(&kept.name).to_owned();
            Ok(NamedValue { name, value, unit, uncertainty: None })
        };
        step.values.iter().zip(&heard.numbers).map(value).collect()
    }
}

impl Heard {
    fn new(values: usize, began: Instant) -> Self {
        Self {
            numbers: vec![Numbers::default(); values],
            messages: 0,
            stale: 0,
            last_stale_ns: 0,
            first_ns: 0,
            last_ns: 0,
            last: Map::new(),
            last_came: began,
        }
    }

    /// Takes a message in; false for one that is dated before the step began, which is no value.
    fn take(
        &mut self,
        step: &ListenStep,
        fields: Map<String, Value>,
        not_before_ns: u64,
    ) -> Result<bool, StepError> {
        let time_ns = fields.get("time_ns").and_then(Value::as_u64).unwrap_or_default();
        if time_ns < not_before_ns {
            self.stale += 1;
            self.last_stale_ns = time_ns;
            return Ok(false);
        }
        if time_ns < self.last_ns {
            return Err(StepError::error(format!(
                "a message of {} is dated {:.3} s before the one that came before it",
                step.stream_name(),
                (self.last_ns - time_ns) as f64 * 1e-9
            )));
        }
        for (kept, numbers) in step.values.iter().zip(&mut self.numbers) {
            let Some(number) = number_at(&fields, &kept.field) else {
                return Err(StepError::error(format!(
                    "{} sends a `{}` that is not a number",
                    step.stream_name(),
                    kept.field
                )));
            };
            numbers.add(number);
        }
        if self.messages == 0 {
            self.first_ns = time_ns;
        }
        self.messages += 1;
        self.last_ns = time_ns;
        self.last = fields;
        self.last_came = Instant::now();
        Ok(true)
    }

    /// What later expressions see, and the same for people.
    fn done_with(&self, step: &ListenStep, values: Vec<NamedValue>) -> Done {
        let seconds = self.last_ns.saturating_sub(self.first_ns) as f64 * 1e-9;
        let mut result = Map::from_iter([
            ("messages".to_owned(), json!(self.messages)),
            ("seconds".to_owned(), json!(seconds)),
        ]);
        result.extend(
            step.values.iter().zip(&values).map(|(kept, value)| (kept.name.clone(), json!(value.value))),
        );
        let shown = values.iter().map(|value| {
            format!(", {} {} {}", value.name, short_number(value.value), value.unit).trim_end().to_owned()
        });
        let message =
            format!("{} of {}{}", messages(self.messages), step.stream_name(), shown.collect::<String>());
        Done { result: Value::Object(result), values, message }
    }

    fn check_gap(&self, step: &ListenStep, requested: &Requested<'_>) -> Result<(), StepError> {
        let silent = self.last_came.elapsed();
        match requested.longest_gap.filter(|longest| silent > *longest) {
            Some(longest) => Err(StepError::error(format!(
                "{} was silent for {:.3} s, after {}; `longest_gap_s` is {}",
                step.stream_name(),
                silent.as_secs_f64(),
                messages(self.messages),
                longest.as_secs_f64()
            ))),
            None => Ok(()),
        }
    }

    /// Whether what was to come has come.
    fn check_end(
        &self,
        step: &ListenStep,
        requested: &Requested<'_>,
        holds: bool,
        not_before_ns: u64,
    ) -> Result<(), StepError> {
        let (stream, seconds) = (step.stream_name(), requested.within.as_secs_f64());
        if self.messages == 0 {
            let old = not_before_ns.saturating_sub(self.last_stale_ns) as f64 * 1e-9;
            let stale = match self.stale {
                0 => String::new(),
                count => format!(
                    "; {} came late: the last is dated {old:.3} s before the step began",
                    messages(count)
                ),
            };
            return Err(StepError::error(format!(
                "{stream} was silent: no message came in {seconds} s{stale}; `plumb streams CELL {stream}` shows when its device sends"
            )));
        }
        if let Some(count) = requested.messages.filter(|count| self.messages < *count) {
            return Err(StepError::error(format!(
                "only {} of {count} messages of {stream} came in {seconds} s",
                self.messages
            )));
        }
        match requested.until.filter(|_| !holds) {
            Some(until) => Err(StepError::Failed(format!(
                "`{}` did not come about in {seconds} s: {} of {stream} came, the last with {}",
                until.text(),
                messages(self.messages),
                self.named_in(until.text())
            ))),
            None => Ok(()),
        }
    }

    /// The fields of the last message that a condition names, with their numbers.
    fn named_in(&self, condition: &str) -> String {
        let below = |path: String, value: &Value| match value {
            Value::Object(inner) => {
                inner.iter().map(|(name, value)| (format!("{path}.{name}"), value.clone())).collect()
            }
            single => vec![(path, single.clone())],
        };
        let all = self.last.iter().flat_map(|(name, value)| below(name.clone(), value));
        let named = all.filter(|(path, _)| names_path(condition, path));
        let words: Vec<String> = named
            .map(|(path, value)| match value.as_f64() {
                Some(number) => format!("{path} {}", short_number(number)),
                None => format!("{path} {value}"),
            })
            .collect();
        words.join(", ")
    }
}

/// Whether an expression names a field of the message: the whole of its path, and not the beginning of a longer one.
fn names_path(expression: &str, path: &str) -> bool {
    let whole = format!("{MESSAGE}.{path}");
    expression.match_indices(&whole).any(|(at, _)| {
        let after = expression[at + whole.len()..].chars().next();
        !after.is_some_and(|letter| letter.is_alphanumeric() || letter == '_')
    })
}

fn messages(count: u64) -> String {
    counted(count, "message", "messages")
}

#[cfg(test)]
mod tests {
    use super::names_path;

    #[test]
    fn a_condition_names_a_field_by_the_whole_of_its_path() {
        assert!(names_path("message.joints.elbow_deg > 40", "joints.elbow_deg"));
        assert!(!names_path("message.line_12 == 1", "line_1"));
        assert!(names_path("message.line_12 == 1 && message.line_1 == 0", "line_1"));
        assert!(!names_path("moving == 1", "moving"));
    }
}
