//! A conversation with the controller: one command at a time, each with a deadline, sent again where its answer was lost or damaged.

use std::time::{Duration, Instant};

use plumb_plugin::PluginError;
use plumb_serial_line::{OpenFailure, SerialLine, Unplugged, WriteError, WriteFailure};

use crate::frame::{Control, command, take};

/// The rate of the arm's USB line; the controller knows no other (protocol, 1.1).
const BAUD: u32 = 115_200;
/// How often a command is sent in all.
const TRIES: u32 = 3;
/// A line on which nothing has come for so long holds nothing of an earlier answer.
const QUIET: Duration = Duration::from_millis(20);
/// The longest the line is listened to until it is quiet.
const QUIET_WITHIN: Duration = Duration::from_millis(200);
/// The bytes of a frame around its parameters.
const AROUND: usize = 6;

/// What went wrong on the line.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum LinkError {
    /// The port cannot be opened.
    #[error("{port}: {failure}")]
    Open { port: String, failure: OpenFailure },
    /// The adapter is gone.
    #[error("{port}: {unplugged}")]
    Unplugged { port: String, unplugged: Unplugged },
    /// The adapter takes no bytes.
    #[error("{port}: the line took too little: {error}")]
    Write { port: String, error: WriteError },
    /// No answer; some may have come damaged.
    #[error(
        "the Dobot on {port} does not answer {what}{}: is its 12 V supply in and its power button lit, and is this its port?",
        damage(*damaged)
    )]
    Silent { port: String, what: &'static str, damaged: u32 },
}

fn damage(damaged: u32) -> String {
    match damaged {
        0 => String::new(),
        count => format!(" ({count} damaged answers came: check cable and plugs)"),
    }
}

impl From<LinkError> for PluginError {
    fn from(error: LinkError) -> Self {
        Self::Disconnected(error.to_string())
    }
}

/// How the line did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    /// Commands sent.
    pub(crate) sent: u64,
    /// Answers that did not come.
    pub(crate) lost: u64,
    /// Frames whose checksum was wrong.
    pub(crate) damaged: u64,
}

/// The line to the controller.
#[derive(Debug)]
pub(crate) struct Link {
    line: SerialLine,
    within: Duration,
    /// Whether something may still be under way that belongs to a command given up.
    unsettled: bool,
    pub(crate) counts: Counts,
}

impl Link {
    pub(crate) fn open(port: &str, within: Duration) -> Result<Self, LinkError> {
        let line = SerialLine::open(port, BAUD)
            .map_err(|failure| LinkError::Open { port: port.to_owned(), failure })?;
        Ok(Self { line, within, unsettled: true, counts: Counts::default() })
    }

    /// Sends a command until its answer has come, and gives the answer's parameters, `length` bytes. What is sent here may be carried out twice without harm.
    pub(crate) fn ask(
        &mut self,
        what: &'static str,
        id: u8,
        control: Control,
        parameters: &[u8],
        length: usize,
    ) -> Result<Vec<u8>, LinkError> {
        let bytes = command(id, control, parameters);
        let mut damaged = 0;
        for _ in 0..TRIES {
            if let Some(answer) = self.once(&bytes, id, length, &mut damaged)? {
                return Ok(answer);
            }
        }
        Err(LinkError::Silent { port: self.line.name().to_owned(), what, damaged })
    }

    fn once(
        &mut self,
        bytes: &[u8],
        id: u8,
        length: usize,
        damaged: &mut u32,
    ) -> Result<Option<Vec<u8>>, LinkError> {
        self.settle()?;
        self.counts.sent += 1;
        let limit = self.within + self.line.duration(bytes.len());
        self.line.write(bytes, limit).map_err(|error| self.not_written(error))?;
        let deadline = Instant::now() + self.within + self.line.duration(bytes.len() + length + AROUND);
        let (mut heard, before) = (Vec::new(), *damaged);
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                self.unsettled = true;
                self.counts.lost += 1;
                self.counts.damaged += u64::from(*damaged - before);
                return Ok(None);
            }
            heard.extend(self.line.read(left).map_err(|unplugged| self.gone(unplugged))?);
            while let Some(frame) = take(&mut heard, damaged) {
                // An answer names its command, but not which sending of it: what is asked twice means the same both times.
                if frame.id == id && frame.parameters.len() >= length {
                    self.counts.damaged += u64::from(*damaged - before);
                    return Ok(Some(frame.parameters));
                }
            }
        }
    }

    /// Lets what belongs to an earlier command go by.
    fn settle(&mut self) -> Result<(), LinkError> {
        let deadline = Instant::now() + QUIET_WITHIN;
        let quiet = if self.unsettled { QUIET } else { Duration::ZERO };
        while !self.line.read(quiet).map_err(|unplugged| self.gone(unplugged))?.is_empty()
            && Instant::now() < deadline
        {}
        self.unsettled = false;
        Ok(())
    }

    fn gone(&self, unplugged: Unplugged) -> LinkError {
        LinkError::Unplugged { port: self.line.name().to_owned(), unplugged }
    }

    fn not_written(&self, error: WriteError) -> LinkError {
        match error.failure {
            WriteFailure::Unplugged(unplugged) => self.gone(unplugged),
            WriteFailure::Full { .. } => LinkError::Write { port: self.line.name().to_owned(), error },
        }
    }
}
