//! The errors of the controller, in one table: how each is recognised, what it means, what the operator should do.

use plumb_plugin::PluginError;

/// What follows from an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Consequence {
    /// Nothing moved; another command may be right.
    Refused,
    /// A joint would have left its range; nothing moved.
    OutOfRange,
    /// The arm cannot be moved until somebody did something at the controller.
    NotReady,
    /// The motion was ended; the arm is at rest.
    Stopped,
}

/// One row of the table.
#[derive(Debug, PartialEq, Eq)]
pub struct Known {
    /// Every one of these words is in the line, in any case.
    words: &'static [&'static str],
    /// What it means and what to do.
    pub remedy: &'static str,
    /// What follows.
    pub consequence: Consequence,
}

const fn known(words: &'static [&'static str], remedy: &'static str, consequence: Consequence) -> Known {
    Known { words, remedy, consequence }
}

/// The first row whose words all are in a line is meant.
pub const TABLE: &[Known] = &[
    known(
        &["panic"],
        "the PANIC button was pressed and arm power is off: see that the arm is clear, press ARM POWER, and activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["power off"],
        "arm power is off: press ARM POWER on the controller's panel and activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["not calibrated"],
        "the controller does not know where its joints are: give `calibrate: true` in the cell file, or type CALIBRATE at its terminal, and activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["envelope"],
        "a joint did not follow its servo and arm power is off: see what held it, press ARM POWER, and activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["servo"],
        "a servo failed and arm power is off: see the controller's manual, press ARM POWER, and activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["range"],
        "a joint would leave its range: choose another pose, or swing the arm the other way round",
        Consequence::OutOfRange,
    ),
    known(&["abort"], "the motion was aborted", Consequence::Stopped),
    known(
        &["not allowed"],
        "another program is running in the controller: abort it at its terminal first",
        Consequence::NotReady,
    ),
    known(
        &["undefined program"],
        "that program is not in the controller: load it from its floppy first (POTCAL)",
        Consequence::Refused,
    ),
    known(
        &["undefined"],
        "a point is not defined: the controller was started anew; activate the arm again",
        Consequence::NotReady,
    ),
    known(
        &["joint number"],
        "the driver named a joint that the controller does not have: is it a PUMA with six joints?",
        Consequence::Refused,
    ),
    known(
        &["argument"],
        "the controller did not take a value: see the line it was typed in",
        Consequence::Refused,
    ),
    known(
        &["syntax"],
        "the controller did not understand the line: see what it echoed, and the controller's version of VAL",
        Consequence::Refused,
    ),
    known(
        &["ambiguous"],
        "the controller did not understand the line: see what it echoed, and the controller's version of VAL",
        Consequence::Refused,
    ),
    known(
        &["unknown"],
        "the controller did not understand the line: see what it echoed, and the controller's version of VAL",
        Consequence::Refused,
    ),
    known(
        &["[fatal]"],
        "the controller stopped for a fault of its own and arm power is off: see its manual, and activate the arm again afterwards",
        Consequence::NotReady,
    ),
];

/// An error for which there is no row.
const UNLISTED: Known = known(
    &[],
    "the controller's manual says what this means; nothing more is sent until the arm is activated again",
    Consequence::NotReady,
);

/// A line with which the controller reported an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControllerError {
    /// As it came.
    pub line: String,
}

impl ControllerError {
    /// The error that a line is, if it is one: `*...*`, or `[Fatal] ...`.
    pub fn in_line(line: &str) -> Option<Self> {
        let text = line.trim();
        let between = text.strip_prefix('*').and_then(|rest| rest.split_once('*'));
        let starred = between.is_some_and(|(words, _)| words.chars().any(char::is_alphabetic));
        let fatal = text.get(..7).is_some_and(|begin| begin.eq_ignore_ascii_case("[fatal]"));
        let unclosed =
            text.len() > 4 && text.starts_with('*') && text.chars().nth(1).is_some_and(char::is_alphabetic);
        (starred || fatal || unclosed).then(|| Self { line: text.to_owned() })
    }

    /// Its row of the table.
    pub fn meaning(&self) -> &'static Known {
        let line = self.line.to_ascii_lowercase();
        TABLE.iter().find(|known| known.words.iter().all(|word| line.contains(word))).unwrap_or(&UNLISTED)
    }

    /// As an error of the driver.
    pub fn error(&self) -> PluginError {
        let known = self.meaning();
        let text = format!("the controller says \"{}\": {}", self.line, known.remedy);
        match known.consequence {
            Consequence::Refused => PluginError::Refused(text),
            Consequence::OutOfRange => PluginError::OutOfRange(text),
            Consequence::NotReady => PluginError::NotReady(text),
            Consequence::Stopped => PluginError::Stopped(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controller_errors_are_distinguished_from_other_lines() {
        for line in [
            "*Joint 3 out of range*",
            "*Envelope error* Joint 3",
            "[Fatal] Panic command",
            "  *NOT CALIBRATED*  ",
            "*ENVELOPE ERROR JT 3*",
        ] {
            assert!(ControllerError::in_line(line).is_some(), "{line}");
        }
        assert!(ControllerError::in_line("*Servo").is_some(), "its end has not come");
        assert!(ControllerError::in_line("[FATAL]").is_some());
        for line in [
            "*",
            "* ",
            "",
            "Change?",
            "JT1 JT2",
            " 1.000 2.000",
            "**",
            "*abc",
            "*12*",
            "*1234",
            "[fata",
            "a*b*",
        ] {
            assert_eq!(ControllerError::in_line(line), None, "{line}");
        }
    }

    #[test]
    fn each_row_can_be_met_and_says_what_to_do() {
        for known in TABLE {
            let error = ControllerError { line: format!("*{}*", known.words.join(" ")) };
            assert_eq!(error.meaning(), known, "another row is before it");
            assert!(known.remedy.len() > 20);
        }
        let unlisted = ControllerError { line: "*Moon in the way*".to_owned() }.error();
        assert!(unlisted.text().contains("Moon in the way"));
    }

    #[test]
    fn an_error_is_of_the_kind_that_its_consequence_says() {
        let error = |line: &str| ControllerError { line: line.to_owned() }.error();
        assert!(matches!(error("*Undefined program*"), PluginError::Refused(_)));
        assert!(matches!(error("*Joint 3 out of range*"), PluginError::OutOfRange(_)));
        assert!(matches!(error("*Not calibrated*"), PluginError::NotReady(_)));
        assert!(matches!(error("*Program aborted*"), PluginError::Stopped(_)));
        assert!(matches!(error("*Moon in the way*"), PluginError::NotReady(_)));
    }
}
