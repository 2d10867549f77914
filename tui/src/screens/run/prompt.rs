//! The prompt that waits: what the operator has typed or chosen so far, and whether it would do as an answer.

use std::time::Duration;

use plumb_cell::answers::level_readings;
use plumb_cell::command::Command;
use plumb_cell::event::{Event, NamedValue, PlaneClearance};
use plumb_cell::prompt::{Answer, Decision, Prompt, PromptKind};

/// Steps a jog can make, in degrees (mm for a linear joint).
pub(crate) const JOG_STEPS: [f64; 5] = [0.1, 0.5, 1.0, 5.0, 10.0];

/// Characters the path of a picture may have.
const LONGEST_PATH: usize = 1000;

/// How long the first `h` waits for the second.
const SAID_TWICE_WITHIN: Duration = Duration::from_secs(10);

/// A prompt on the screen.
#[derive(Clone, Debug)]
pub(crate) struct OpenPrompt {
    /// As asked.
    pub prompt: Prompt,
    /// What is in the field of a number.
    pub field: String,
    /// The field still holds what was offered: the next digit replaces it.
    pub offered: bool,
    /// The option or joint that is chosen.
    pub chosen: usize,
    /// Which of [`JOG_STEPS`].
    pub jog_step: usize,
    /// Lines of the text that were scrolled away at its top.
    pub scrolled: usize,
    /// When the operator asked once to hand the arm to its pendant, by the screens' clock.
    pub handing_over: Option<Duration>,
    /// Why the last answer was not taken.
    pub refused: Option<String>,
    /// An answer was given and the engine has not replied yet.
    pub answered: bool,
    /// Whether the sensor that is shown with a jog has fired, once it was read.
    pub fired: Option<bool>,
    /// What the spirit level shows that a simulated arm is jogged to, deg; none within where its bubble is at an end.
    pub level: Option<Option<f64>>,
    /// What the ruler beside a simulated arm shows, mm over the table.
    pub ruler: Option<f64>,
    /// How far the robot of a jog is clear of its keep-out planes, mm; negative beyond one.
    pub clearances: Vec<PlaneClearance>,
}

impl OpenPrompt {
    /// The prompt as it opens: with what it offers written in the field or chosen.
    pub(crate) fn new(prompt: Prompt) -> Self {
        let field = match &prompt.kind {
            PromptKind::Number { default: Some(value), decimals, .. } => written(*value, *decimals),
            _ => String::new(),
        };
        let chosen = match &prompt.kind {
            PromptKind::Choice { options, default: Some(key) } => {
                options.iter().position(|option| option.key == *key).unwrap_or(0)
            }
            // The joint that has to come somewhere is the one to be jogged.
            PromptKind::JogTo { goals, joints, joint, .. } => {
                let asked_for = goals.first().map(|goal| goal.joint.as_str()).or(joint.as_deref());
                joints.iter().position(|joint| Some(joint.name.as_str()) == asked_for).unwrap_or(0)
            }
            _ => 0,
        };
        let offered = !field.is_empty();
        Self {
            prompt,
            field,
            offered,
            chosen,
            jog_step: 2,
            scrolled: 0,
            handing_over: None,
            refused: None,
            answered: false,
            fired: None,
            level: None,
            ruler: None,
            clearances: Vec::new(),
        }
    }

    /// Chooses joint and size of a jog as before; a prompt of another kind stays as it is.
    pub(crate) fn take_up_jogging(&mut self, joint: usize, size: usize) {
        if matches!(self.prompt.kind, PromptKind::JogTo { .. }) {
            self.choose_at(joint);
            self.jog_step = size.min(JOG_STEPS.len() - 1);
        }
    }

    /// Whether an arm is jogged in it.
    pub(crate) fn is_jog(&self) -> bool {
        self.jogged_robot().is_some()
    }

    /// The robot that is jogged in it.
    pub(crate) fn jogged_robot(&self) -> Option<&str> {
        match &self.prompt.kind {
            PromptKind::JogTo { device, .. } => Some(device),
            _ => None,
        }
    }

    /// Whether digits go into the answer.
    pub(crate) fn is_typed(&self) -> bool {
        matches!(self.prompt.kind, PromptKind::Number { .. } | PromptKind::Level { .. }) || self.is_written()
    }

    /// Whether letters do.
    pub(crate) fn is_written(&self) -> bool {
        matches!(self.prompt.kind, PromptKind::Text { .. } | PromptKind::Photo)
    }

    /// Types one character into the field of a number or a text. Says whether it belonged there.
    pub(crate) fn typed(&mut self, character: char) -> bool {
        let longest = match &self.prompt.kind {
            // Longer than any number one reads off an instrument.
            PromptKind::Number { .. } if matches!(character, '0'..='9' | '.' | ',' | '-' | '+') => 18,
            PromptKind::Level { .. } if matches!(character, '0'..='9' | '.' | ',' | '-' | '+' | ' ') => 24,
            PromptKind::Text { longest } if !character.is_control() => *longest,
            PromptKind::Photo if !character.is_control() => LONGEST_PATH,
            _ => return false,
        };
        if self.offered {
            self.field.clear();
        }
        if self.field.chars().count() < longest {
            self.field.push(character);
        }
        self.offered = false;
        self.refused = None;
        true
    }

    /// Takes the last character of the field away.
    pub(crate) fn erase(&mut self) {
        self.field.pop();
        self.offered = false;
        self.refused = None;
    }

    /// Moves the choice by `by`, staying within the list.
    pub(crate) fn choose(&mut self, by: isize) {
        self.choose_at(self.chosen.saturating_add_signed(by));
    }

    /// Scrolls the text by a page of `page` lines, of which `hidden` are out of sight.
    pub(crate) fn read_on(&mut self, forwards: bool, page: usize, hidden: usize) {
        self.scrolled = match forwards {
            true => (self.scrolled + page).min(hidden),
            false => self.scrolled.min(hidden).saturating_sub(page),
        };
    }

    /// Chooses the option or joint at an index of the list, or the last.
    pub(crate) fn choose_at(&mut self, index: usize) {
        let count = match &self.prompt.kind {
            PromptKind::Choice { options, .. } => options.len(),
            PromptKind::Decision { options, .. } => options.len(),
            PromptKind::JogTo { joints, .. } => joints.len(),
            _ => 0,
        };
        self.chosen = index.min(count.saturating_sub(1));
    }

    /// The answer as it is, or what is missing.
    pub(crate) fn answer(&self) -> Result<Answer, String> {
        match &self.prompt.kind {
            PromptKind::Acknowledge { .. } | PromptKind::JogTo { .. } => Ok(Answer::Done),
            PromptKind::ConfirmPose { .. } => Ok(Answer::Confirmed),
            PromptKind::Choice { options, .. } => options
                .get(self.chosen)
                .map(|option| Answer::Choice { key: option.key.clone() })
                .ok_or_else(|| "this prompt offers nothing to choose".to_owned()),
            PromptKind::Decision { options, .. } => options
                .get(self.chosen)
                .map(|decision| Answer::Decision { decision: *decision })
                .ok_or_else(|| "this prompt offers nothing to decide".to_owned()),
            PromptKind::Text { .. } => match self.field.trim() {
                "" => Err("Nothing is written: write a line.".to_owned()),
                text => Ok(Answer::Text { text: text.to_owned() }),
            },
            PromptKind::Photo => match self.field.trim() {
                "" => Err("Nothing is written: write the path of the picture you took.".to_owned()),
                file => Ok(Answer::Photo { file: file.to_owned() }),
            },
            PromptKind::Level { .. } => level_readings(&self.field).map(|(x, y)| Answer::Level { x, y }),
            PromptKind::Number { unit, minimum, maximum, .. } => {
                number(&self.field, unit, *minimum, *maximum).map(|value| Answer::Number { value })
            }
        }
    }

    /// Decides a step that went wrong, if that decision is offered.
    pub(crate) fn decide(&mut self, requested: Decision) -> Option<Answer> {
        let PromptKind::Decision { options, .. } = &self.prompt.kind else { return None };
        self.chosen = options.iter().position(|decision| *decision == requested)?;
        Some(Answer::Decision { decision: requested })
    }

    /// The command that jogs the chosen joint one step in the direction of `sign`.
    pub(crate) fn jog(&self, sign: f64) -> Option<Command> {
        let PromptKind::JogTo { joints, .. } = &self.prompt.kind else { return None };
        let joint = joints.get(self.chosen)?.name.clone();
        Some(Command::Jog { prompt: self.prompt.id, joint, by: sign * self.step() })
    }

    /// The command that hands the arm to its pendant, once the operator has said twice that it shall, with nothing in between.
    pub(crate) fn hand_over(&mut self, now: Duration) -> Result<Command, String> {
        if !matches!(self.prompt.kind, PromptKind::JogTo { hand_over: true, .. }) {
            return Err("this arm is not handed over here: jog it with the keys, or with its pendant if that moves it".to_owned());
        }
        if self.handing_over.take().is_none() {
            self.handing_over = Some(now);
            return Err(
                "From then on nothing stops the arm but STOP on its pendant: no key here, and not the end of this program. If you stand at it, press h again."
                    .to_owned(),
            );
        }
        Ok(Command::HandOver { prompt: self.prompt.id })
    }

    /// The operator did something else: what was asked once is forgotten, and so is what was said about it.
    pub(crate) fn keep_the_arm(&mut self) {
        if self.handing_over.take().is_some() {
            self.refused = None;
        }
    }

    /// Time passes: what was asked once is not taken for an answer to anything later.
    pub(crate) fn pass_time(&mut self, now: Duration) {
        if self.handing_over.is_some_and(|asked| now.saturating_sub(asked) > SAID_TWICE_WITHIN) {
            self.keep_the_arm();
        }
    }

    /// Size of one jog, in the joint's unit.
    pub(crate) fn step(&self) -> f64 {
        JOG_STEPS.get(self.jog_step).copied().unwrap_or(1.0)
    }

    /// Makes the jog greater or smaller by one size.
    pub(crate) fn change_step(&mut self, by: isize) {
        self.jog_step = self.jog_step.saturating_add_signed(by).min(JOG_STEPS.len() - 1);
    }

    /// Notes why the engine did not take the answer.
    pub(crate) fn refuse(&mut self, reason: &str) {
        self.refused = Some(reason.to_owned());
        self.answered = false;
    }

    /// Keeps the clearances of a jog's robot up to date.
    fn take_clearance(&mut self, moved: &str, planes: &[PlaneClearance]) {
        if matches!(&self.prompt.kind, PromptKind::JogTo { device, .. } if device == moved) {
            self.clearances = planes.to_vec();
        }
    }

    /// Keeps what is shown of devices with a prompt up to date.
    pub(crate) fn take_live(&mut self, event: &Event) {
        match event {
            Event::Joints { device, joints, .. } => self.take_joints(device, joints),
            Event::Clearance { device, planes } => self.take_clearance(device, planes),
            Event::Signal { device, on, .. } => self.take_signal(device, *on),
            Event::InstrumentRead { step, value, unit } if *step == self.prompt.step => match unit.as_str() {
                "mm" => self.ruler = *value,
                _ => self.level = Some(*value),
            },
            _ => {}
        }
    }

    /// Keeps the sensor that is shown with a jog up to date.
    fn take_signal(&mut self, device: &str, on: bool) {
        if matches!(&self.prompt.kind, PromptKind::JogTo { sensor: Some(sensor), .. } if sensor == device) {
            self.fired = Some(on);
        }
    }

    /// Keeps the joints of a jog, or of a pose to be confirmed, up to date.
    fn take_joints(&mut self, moved: &str, now: &[NamedValue]) {
        let (device, shown) = match &mut self.prompt.kind {
            PromptKind::JogTo { device, joints, .. } => (device, joints),
            PromptKind::ConfirmPose { device, reported, .. } => (device, reported),
            _ => return,
        };
        if device != moved {
            return;
        }
        for joint in shown {
            if let Some(value) = now.iter().find(|value| value.name == joint.name) {
                joint.value = value.value;
            }
        }
    }
}

/// Reads a number as people type it, with a decimal point or comma, and checks it against its bounds.
fn number(text: &str, unit: &str, minimum: Option<f64>, maximum: Option<f64>) -> Result<f64, String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("type a number, then Enter".to_owned());
    }
    if text.matches([',', '.']).count() > 1 {
        return Err(format!(
            "\u{201c}{text}\u{201d} has more than one decimal mark; write it without separators, as 1250.5"
        ));
    }
    let value: f64 = text
        .replace(',', ".")
        .parse()
        .map_err(|_| format!("\u{201c}{text}\u{201d} is not a number; write it like 12.5 or -3"))?;
    let (below, above) =
        (minimum.is_some_and(|least| value < least), maximum.is_some_and(|most| value > most));
    if below || above {
        return Err(format!(
            "{text} {unit} is {}: {}",
            if below { "too small" } else { "too large" },
            bounds(minimum, maximum, unit)
        ));
    }
    Ok(value)
}

/// The bounds of a number in words; empty without bounds.
pub(crate) fn bounds(minimum: Option<f64>, maximum: Option<f64>, unit: &str) -> String {
    // No instrument is read to more; what was computed has digits that mean nothing.
    let rounded = |bound: f64| (bound * 1e6).round() / 1e6;
    let (minimum, maximum) = (minimum.map(rounded), maximum.map(rounded));
    let text = match (minimum, maximum) {
        (Some(least), Some(most)) => format!("between {least} and {most} {unit}"),
        (Some(least), None) => format!("at least {least} {unit}"),
        (None, Some(most)) => format!("at most {most} {unit}"),
        (None, None) => String::new(),
    };
    text.trim_end().to_owned()
}

/// A number with the digits the prompt asks for.
pub(crate) fn written(value: f64, decimals: Option<u32>) -> String {
    match decimals {
        Some(decimals) => format!("{value:.*}", usize::try_from(decimals.min(12)).unwrap_or(12)),
        None => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_comma_is_read_like_a_point() {
        assert_eq!(number("269,5", "deg", None, None), Ok(269.5));
        assert_eq!(number(" -3 ", "deg", None, None), Ok(-3.0));
    }

    #[test]
    fn a_number_out_of_bounds_says_what_would_be_right() {
        assert_eq!(
            number("290", "deg", Some(252.75), Some(287.25)),
            Err("290 deg is too large: between 252.75 and 287.25 deg".to_owned())
        );
        let computed = bounds(Some(122.479_999_999_999_96), Some(242.479_999_999_999_96), "mm");
        assert_eq!(computed, "between 122.48 and 242.48 mm");
        assert_eq!(number("4", "mm", Some(5.0), None), Err("4 mm is too small: at least 5 mm".to_owned()));
    }

    #[test]
    fn what_is_no_number_is_named() {
        for text in ["-", "1-2", "+"] {
            let message = number(text, "mm", None, None).unwrap_err();
            assert!(message.contains(text) && message.contains("is not a number"), "{message}");
        }
        assert!(number("1.234,5", "mm", None, None).unwrap_err().contains("more than one decimal mark"));
        assert_eq!(number("", "mm", None, None), Err("type a number, then Enter".to_owned()));
    }
}
