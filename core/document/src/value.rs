//! Single values out of a tree, each with a message that says what would be right.

use crate::{Key, Node, NodeValue, Problems};

/// Units that are at the end of a key.
pub(crate) const UNITS: &[&str] = &[
    "mm", "m", "in", "deg", "rad", "s", "ms", "min", "h", "kg", "g", "n", "hz", "c", "percent", "micron",
    "um",
];

/// No length, angle, time or mass of a cell is larger, in whatever unit (1e12 mm is a million kilometres); what is computed from numbers
/// within it stays finite.
const LARGEST_NUMBER: f64 = 1e12;

/// Longer texts are shown to nobody: a screen of 80 x 24 characters has 1,920.
const LONGEST_TEXT: usize = 20_000;

impl Node {
    /// A text, not empty.
    pub fn text<'n>(&'n self, what: &str, problems: &Problems) -> Option<&'n str> {
        match &self.value {
            NodeValue::Text(text) if text.len() > LONGEST_TEXT => {
                let help = format!("a text has at most {LONGEST_TEXT} bytes");
                problems.add(self.span, format!("{what} has {} bytes", text.len()), help);
                None
            }
            NodeValue::Text(text) if !text.trim().is_empty() => Some(text),
            NodeValue::Text(_) => {
                problems.add(self.span, format!("{what} is empty"), "");
                None
            }
            other => self.mismatch(what, "a text", other, problems),
        }
    }

    /// A number that is finite, and of a size that a cell can have.
    pub fn number(&self, what: &str, problems: &Problems) -> Option<f64> {
        match &self.value {
            NodeValue::Number(number) if number.is_finite() => {
                if number.abs() > LARGEST_NUMBER {
                    let help = format!("numbers lie between -{LARGEST_NUMBER:e} and {LARGEST_NUMBER:e}");
                    problems.add(self.span, format!("{what} is {number:e}"), help);
                    return None;
                }
                Some(*number)
            }
            NodeValue::Text(text) => {
                problems.add(
                    self.span,
                    format!("{what} is a number; this is the text `{text}`"),
                    number_help(text),
                );
                None
            }
            other => self.mismatch(what, "a finite number", other, problems),
        }
    }

    /// A number between two bounds, both allowed.
    pub fn number_between(&self, what: &str, least: f64, most: f64, problems: &Problems) -> Option<f64> {
        let number = self.number(what, problems)?;
        if number < least || number > most {
            problems.add(
                self.span,
                format!("{what} is {number}"),
                format!("it lies between {least} and {most}"),
            );
            return None;
        }
        Some(number)
    }

    /// A whole number between two bounds, both allowed.
    pub fn count_between(&self, what: &str, least: u32, most: u32, problems: &Problems) -> Option<u32> {
        let number = self.number_between(what, f64::from(least), f64::from(most), problems)?;
        if number.fract() != 0.0 {
            problems.add(self.span, format!("{what} is {number}"), "it is a whole number");
            return None;
        }
        Some(number as u32)
    }

    /// `true` or `false`.
    pub fn boolean(&self, what: &str, problems: &Problems) -> Option<bool> {
        match &self.value {
            NodeValue::Bool(value) => Some(*value),
            other => self.mismatch(what, "`true` or `false`", other, problems),
        }
    }

    /// One word out of several; gives its index in `known`.
    pub fn word(&self, what: &str, known: &[&str], problems: &Problems) -> Option<usize> {
        let text = match &self.value {
            NodeValue::Text(text) => text.clone(),
            NodeValue::Bool(value) => value.to_string(),
            other => return self.mismatch(what, "a word", other, problems),
        };
        let found = known.iter().position(|word| *word == text);
        if found.is_none() {
            let help = crate::did_you_mean(&text, known.iter().copied());
            problems.add(self.span, format!("`{text}` is no {what}"), help);
        }
        found
    }

    /// The items of a list.
    pub fn list<'n>(&'n self, what: &str, problems: &Problems) -> Option<&'n [Node]> {
        match &self.value {
            NodeValue::List(items) => Some(items),
            other => self.mismatch(what, "a list", other, problems),
        }
    }

    /// The entries of a map whose keys are free.
    pub fn entries<'n>(&'n self, what: &str, problems: &Problems) -> Option<&'n [(Key, Node)]> {
        match &self.value {
            NodeValue::Map(entries) => Some(entries),
            other => self.mismatch(what, "a map of keys and values", other, problems),
        }
    }

    /// Exactly `N` finite numbers.
    pub fn numbers<const N: usize>(&self, what: &str, problems: &Problems) -> Option<[f64; N]> {
        let items = self.list(what, problems)?;
        if items.len() != N {
            problems.add(self.span, format!("{what} has {} numbers", items.len()), format!("it has {N}"));
            return None;
        }
        let mut numbers = [0.0; N];
        let mut complete = true;
        for (item, entry) in items.iter().zip(numbers.iter_mut()) {
            match item.number(what, problems) {
                Some(number) => *entry = number,
                None => complete = false,
            }
        }
        complete.then_some(numbers)
    }

    fn mismatch<T>(&self, what: &str, right: &str, found: &NodeValue, problems: &Problems) -> Option<T> {
        problems.add(self.span, format!("{what} is {right}; this is {}", found.kind()), "");
        None
    }

    /// The same as plain JSON, for a plugin's configuration.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.value {
            NodeValue::Null => serde_json::Value::Null,
            NodeValue::Bool(value) => (*value).into(),
            NodeValue::Number(number) if number.fract() == 0.0 && number.abs() < 9e15 => {
                (*number as i64).into()
            }
            NodeValue::Number(number) => (*number).into(),
            NodeValue::Text(text) => text.as_str().into(),
            NodeValue::List(items) => items.iter().map(Node::to_json).collect(),
            NodeValue::Map(entries) => serde_json::Value::Object(
                entries.iter().map(|(key, node)| (key.name.clone(), node.to_json())).collect(),
            ),
        }
    }
}

/// What is wrong with a text that should be a number.
pub(crate) fn number_help(text: &str) -> String {
    let number: String =
        text.chars().take_while(|c| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E')).collect();
    let rest = text.get(number.len()..).unwrap_or_default().trim();
    match number.parse::<f64>() {
        Ok(_) if rest.is_empty() => "write it without quotes".to_owned(),
        Ok(_) if rest.starts_with(',') => "write a point, not a comma".to_owned(),
        Ok(value) => format!("the unit belongs to the key; write the number alone: {value}"),
        Err(_) => String::new(),
    }
}
