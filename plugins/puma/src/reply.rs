//! What the controller answers: lines up to a prompt or a question. Numbers are read as they come, whatever their columns.

use crate::controller_error::ControllerError;

/// What the controller waits for after an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// A command: `.`.
    Command,
    /// One of the few commands it takes while a motion or a program goes on: `*`.
    Busy,
    /// An answer to its question.
    Question,
}

/// An answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Reply {
    /// Its lines, without the prompt.
    pub lines: Vec<String>,
    /// How it ended: at a prompt, or with a question.
    pub ending: Ending,
}

/// How what has come so far ends, if it can be an end. How quiet the line is says nothing: on a busy machine an answer comes in pieces. A `*` may be
/// the beginning of an error, and an unknown question may go on: those are ends only if nothing has followed when all the time is over that an
/// answer may take. Nothing follows the question for changes of a point, or one that ends with `(Y/N)?`, but what is typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// It is an end.
    Sure(Ending),
    /// It is one if nothing has followed by the deadline.
    AtDeadline(Ending),
}

/// The text of bytes: NULs and other control characters that carry nothing are left out.
pub fn text_of(bytes: &[u8]) -> String {
    let kept = bytes.iter().filter(|byte| matches!(byte, b' '..=b'~' | b'\n' | b'\r'));
    kept.map(|byte| char::from(*byte)).collect::<String>().replace("\r\n", "\n").replace('\r', "\n")
}

/// Whether an answer may end here.
pub fn sign(bytes: &[u8]) -> Option<Sign> {
    let text = text_of(bytes);
    let (before, tail) = text.rsplit_once('\n').unwrap_or(("", &text));
    let behind = after_busy_prompt(tail);
    if tail.trim_end() == "*" || behind.trim_end() == "*" {
        return Some(Sign::AtDeadline(Ending::Busy));
    }
    let tail = behind;
    // A prompt is at the beginning of its line; a point behind spaces may be the beginning of a number.
    if tail.trim_end() == "." {
        return Some(Sign::Sure(Ending::Command));
    }
    let last = if tail.trim().is_empty() { before.lines().next_back().unwrap_or_default() } else { tail };
    match last.trim() {
        question if is_known_question(question) => Some(Sign::Sure(Ending::Question)),
        question if question.ends_with('?') => Some(Sign::AtDeadline(Ending::Question)),
        _ => None,
    }
}

/// Whether a line is a question after which nothing comes but what is typed: whether a point's values are to be changed, or one to be answered with Y or N.
fn is_known_question(line: &str) -> bool {
    let line = line.trim().to_ascii_uppercase();
    matches!(line.as_str(), "CHANGE?" | "CHANGES?") || line.ends_with("(Y/N)?")
}

/// A line without the `* ` behind which it was begun.
fn after_busy_prompt(line: &str) -> &str {
    line.strip_prefix("* ").unwrap_or(line)
}

/// What the controller may have begun to say without having ended it: the text behind the last line's end. None for nothing, for a prompt, and for a
/// single character, of which [`may_be_a_beginning`] says more.
pub fn unfinished(bytes: &[u8]) -> Option<String> {
    let tail = tail_of(bytes);
    let begun = tail.len() > 1 || matches!(tail.as_str(), "*" | "[");
    begun.then_some(tail)
}

/// Whether a single character stands behind the last line's end, and is no prompt: it is noise, unless the rest of a message follows at the rate of the line.
pub fn may_be_a_beginning(bytes: &[u8]) -> bool {
    let tail = tail_of(bytes);
    tail.len() == 1 && tail != "."
}

/// The text behind the last line's end, without a prompt before it.
fn tail_of(bytes: &[u8]) -> String {
    let text = text_of(bytes);
    let (_, tail) = text.rsplit_once('\n').unwrap_or(("", &text));
    after_busy_prompt(tail).trim().to_owned()
}

impl Reply {
    /// An answer that has ended so.
    pub fn of(bytes: &[u8], ending: Ending) -> Self {
        let text = text_of(bytes);
        let lines = text
            .lines()
            .map(|line| after_busy_prompt(line).trim_end().to_owned())
            .filter(|line| !line.trim().is_empty());
        let prompt = |line: &String| matches!(line.trim(), "." | "*");
        Self { lines: lines.filter(|line| !prompt(line)).collect(), ending }
    }

    /// The error it reports, if it does.
    pub fn controller_error(&self) -> Option<ControllerError> {
        self.lines.iter().find_map(|line| ControllerError::in_line(line))
    }

    /// Whether the controller introduces itself: it was started anew.
    pub fn is_greeting(&self) -> bool {
        self.lines.iter().any(|line| is_greeting(line))
    }

    /// The lines of numbers and nothing else, at least six each.
    pub fn rows(&self) -> Vec<[f64; 6]> {
        self.lines.iter().filter_map(|line| row(line)).collect()
    }
}

/// Whether a line is of those with which a controller begins.
pub fn is_greeting(line: &str) -> bool {
    let line = line.trim().to_ascii_uppercase();
    line.starts_with("VAL") || line.contains("LOAD VAL") || line.contains("INITIALIZE (Y/N)")
}

/// The first six numbers of a line that holds six or seven of them, and nothing else.
pub fn row(line: &str) -> Option<[f64; 6]> {
    let numbers = numbers(line)?;
    let beginning: [f64; 6] = numbers.get(..6)?.try_into().ok()?;
    (numbers.len() <= 7).then_some(beginning)
}

/// Every number of a line; none when something else is in it. Numbers may touch: a sign begins the next.
fn numbers(line: &str) -> Option<Vec<f64>> {
    let mut numbers = Vec::new();
    let mut begun = String::new();
    for character in line.chars().chain([' ']) {
        let ends = character == ' ' || character == ',' || character == '-' || character == '+';
        if ends && !begun.is_empty() {
            let decimals = begun.split_once('.').is_some_and(|(whole, decimals)| {
                whole.trim_start_matches(['-', '+']).len() <= 4 && (1..=4).contains(&decimals.len())
            });
            numbers.push(begun.parse().ok().filter(|number: &f64| number.is_finite() && decimals)?);
            begun.clear();
        }
        match character {
            ' ' | ',' => {}
            '0'..='9' | '.' | '-' | '+' => begun.push(character),
            _ => return None,
        }
    }
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_are_read_whatever_their_columns() {
        let expected = Some([-90.0, -180.0, 180.0, -100.25, 0.0, -135.5]);
        assert_eq!(row("   -90.000  -180.000   180.000  -100.250     0.000  -135.500"), expected);
        assert_eq!(row(" -90.00-180.00 180.00-100.25   0.00-135.50"), expected);
        assert_eq!(row("-90.0, -180.0, 180.0, -100.25, 0.0, -135.5, 12.00"), expected);
        for wrong in [
            "JT1 JT2 JT3",
            "1.0 2.0 3.0 4.0 5.0",
            "1.0 2.0 3.0 4.0 5.0 6.x",
            "1 2 3 4 5 6",
            "",
            "- - - - - -",
            "1.2.3 1.0 1.0 1.0 1.0 1.0",
        ] {
            assert_eq!(row(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn an_answer_ends_with_a_prompt_and_not_with_a_point_in_a_number() {
        assert_eq!(sign(b"\r\n 0.00 1.00\r\n."), Some(Sign::Sure(Ending::Command)));
        assert_eq!(sign(b"\r\n 0.00 1."), None);
        assert_eq!(sign(b"\r\n    ."), None, "a number may begin so");
        assert_eq!(sign(b"\r\n* \r\n. "), Some(Sign::Sure(Ending::Command)));
        assert_eq!(sign(b"\r\n* . "), Some(Sign::Sure(Ending::Command)));
        assert_eq!(sign(b"\r\n*"), Some(Sign::AtDeadline(Ending::Busy)));
        assert_eq!(sign(b"\r\n* "), Some(Sign::AtDeadline(Ending::Busy)));
        assert_eq!(sign(b"\r\n*Joint 3 out"), None);
        assert_eq!(sign(b"\r\nChange? "), Some(Sign::Sure(Ending::Question)));
        assert_eq!(sign(b"Change?\r\0\0\n"), Some(Sign::Sure(Ending::Question)));
        assert_eq!(sign(b"Are you sure (Y/N)?"), Some(Sign::Sure(Ending::Question)));
        assert_eq!(sign(b"Are you sure (Y/N)?\r\n"), Some(Sign::Sure(Ending::Question)));
        assert_eq!(sign(b"Are you sure?"), Some(Sign::AtDeadline(Ending::Question)));
        assert_eq!(sign(b""), None);
    }

    #[test]
    fn a_message_cut_in_mid_word_is_unfinished_and_a_prompt_is_not() {
        assert_eq!(unfinished(b"\r\n*Robot po"), Some("*Robot po".to_owned()));
        assert_eq!(unfinished(b"\r\n*"), Some("*".to_owned()));
        assert_eq!(unfinished(b"\r\n*Robot power off*\r\n"), None);
        assert_eq!(unfinished(b"*Robot power off*\r\n. "), None);
        assert_eq!(unfinished(b"x"), None);
        for (came, may_go_on) in
            [("x", true), ("\r\nV", true), ("*Servo*\r\n. ", false), ("\r\nVA", false), ("", false)]
        {
            assert_eq!(may_be_a_beginning(came.as_bytes()), may_go_on, "{came:?}");
        }
        assert_eq!(unfinished(b""), None);
    }

    #[test]
    fn an_error_behind_a_busy_prompt_is_one() {
        let reply = Reply::of(b"\r\n* *Panic command*\r\n. ", Ending::Command);
        assert_eq!(reply.controller_error().map(|error| error.line), Some("*Panic command*".to_owned()));
    }

    proptest! {
        #[test]
        fn no_bytes_at_all_bring_the_reader_down(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = (sign(&bytes), unfinished(&bytes));
            let reply = Reply::of(&bytes, Ending::Command);
            for row in reply.rows() {
                prop_assert!(row.iter().all(|number| number.is_finite()));
            }
            let _ = (reply.controller_error(), reply.is_greeting());
        }

        #[test]
        fn every_row_of_joints_is_read_back(values in prop::array::uniform6(-360.0..360.0_f64), width in 7usize..11) {
            let line: String = values.iter().map(|value| format!("{value:>width$.2}")).collect();
            // A column too narrow for a number without a sign leaves no way to distinguish it from the one before.
            let row = row(&line);
            if line.split_whitespace().count() == 6 || row.is_some() {
                let row = row.unwrap();
                for (read, value) in row.iter().zip(values) {
                    prop_assert!((read - value).abs() <= 0.005_1);
                }
            }
        }
    }
}
