//! How one controller's monitor differs from another's: wording, columns, and what happens while the arm moves.

use std::str::FromStr;

/// The monitors there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dialect {
    /// A Mark II controller: `Change?`, wide columns, and no prompt until a motion has ended.
    #[default]
    Mark2,
    /// A Mark I controller's words: `CHANGES?`, columns so narrow that numbers touch, angles folded, and `*` while the arm moves.
    Mark1,
    /// A late monitor: echoes in capitals, pads its lines with NULs, and puts a hand's opening beside the joints.
    Late,
}

/// What the monitor complains of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ControllerError {
    Unknown,
    Ambiguous,
    Syntax,
    Argument,
    Undefined,
    JointNumber,
    JointRange(usize),
    PowerOff,
    NotCalibrated,
    Panic,
    Envelope(usize),
    Aborted,
    NotNow,
    NoProgram,
}

impl Dialect {
    /// Every one, by the name it is asked for.
    pub const ALL: [(&'static str, Dialect); 3] =
        [("mark2", Dialect::Mark2), ("mark1", Dialect::Mark1), ("late", Dialect::Late)];

    /// The question whether shown values are to be changed.
    pub(super) fn changes(self) -> &'static str {
        match self {
            Dialect::Mark2 => "Change? ",
            Dialect::Mark1 => "CHANGES?",
            Dialect::Late => "Change?\r\n",
        }
    }

    /// The question before a command that is to be confirmed.
    pub(super) fn sure(self) -> &'static str {
        match self {
            Dialect::Mark2 => "Are you sure (Y/N)? ",
            Dialect::Mark1 => "ARE YOU SURE (Y/N)?",
            Dialect::Late => "Are you sure (Y/N)?",
        }
    }

    /// What the monitor shows when it waits for a command.
    pub(super) fn prompt(self) -> &'static str {
        match self {
            Dialect::Mark1 => ". ",
            _ => ".",
        }
    }

    /// What it shows while something goes on, where commands are taken then.
    pub(super) fn busy_prompt(self) -> Option<&'static str> {
        (self == Dialect::Mark1).then_some("* ")
    }

    /// The end of a line.
    pub(super) fn newline(self) -> &'static str {
        match self {
            Dialect::Late => "\r\0\0\n",
            _ => "\r\n",
        }
    }

    /// How a typed character comes back.
    pub(super) fn echo(self, character: u8) -> u8 {
        if self == Dialect::Late { character.to_ascii_uppercase() } else { character }
    }

    /// What greets anyone who switches it on.
    pub(super) fn greeting(self) -> &'static str {
        match self {
            Dialect::Mark2 => "VAL-II  1.4B\r\nLoad VAL from floppy (Y/N)? N\r\n",
            Dialect::Mark1 => "VAL 13.4\r\nINITIALIZE (Y/N)?N\r\n",
            Dialect::Late => "VAL-II 2.0 (C) UNIMATION\r\n",
        }
    }

    /// Whether angles are shown between -180 and 180 degrees only.
    pub(super) fn folds(self) -> bool {
        self == Dialect::Mark1
    }

    pub(super) fn text(self, error: ControllerError) -> String {
        let words = match error {
            ControllerError::Unknown => "Unknown instruction".to_owned(),
            ControllerError::Ambiguous => "Ambiguous name".to_owned(),
            ControllerError::Syntax => "Syntax error".to_owned(),
            ControllerError::Argument => "Invalid argument".to_owned(),
            ControllerError::Undefined => "Undefined value".to_owned(),
            ControllerError::JointNumber => "Illegal joint number".to_owned(),
            ControllerError::JointRange(joint) => match self {
                Dialect::Mark2 => format!("Joint {joint} out of range"),
                Dialect::Mark1 => "OUTSIDE JOINT RANGE".to_owned(),
                Dialect::Late => format!("Location out of range* Joint {joint}"),
            },
            ControllerError::PowerOff => match self {
                Dialect::Late => "Arm power off".to_owned(),
                _ => "Robot power off".to_owned(),
            },
            ControllerError::NotCalibrated => "Not calibrated".to_owned(),
            ControllerError::Panic => return self.fatal("Panic command"),
            ControllerError::Envelope(joint) => match self {
                Dialect::Mark2 => format!("Envelope error* Joint {joint}"),
                Dialect::Mark1 => format!("ENVELOPE ERROR JT {joint}"),
                Dialect::Late => return self.fatal(&format!("Servo error joint {joint}")),
            },
            ControllerError::Aborted => "Aborted".to_owned(),
            ControllerError::NotNow => "Not allowed while a program is executing".to_owned(),
            ControllerError::NoProgram => "Undefined program".to_owned(),
        };
        let words = if self == Dialect::Mark1 { words.to_uppercase() } else { words };
        if words.contains("* ") { format!("*{words}") } else { format!("*{words}*") }
    }

    fn fatal(self, words: &str) -> String {
        match self {
            Dialect::Mark1 => format!("*{}*", words.to_uppercase()),
            _ => format!("[Fatal] {words}"),
        }
    }
}

impl FromStr for Dialect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|(name, _)| *name == text);
        found.map(|(_, dialect)| dialect).ok_or_else(|| {
            let names = Self::ALL.map(|(name, _)| name).join(", ");
            format!("there is no dialect `{text}`; there are {names}")
        })
    }
}
