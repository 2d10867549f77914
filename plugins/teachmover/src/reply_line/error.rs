//! What can go wrong on the line, by the operation it went wrong in.

use std::time::Duration;

use plumb_plugin::PluginError;
use plumb_serial_line::{OpenFailure, Unplugged, WriteFailure};

use crate::protocol::{Fault, PrintableBytes};

/// What went wrong on the serial line, and in which operation.
#[derive(Debug, thiserror::Error)]
pub enum SerialError {
    /// The port cannot be opened.
    #[error("cannot open the serial port {port}: {failure}")]
    Open {
        /// Such as `/dev/ttyUSB0`.
        port: String,
        /// Why, and what to check.
        failure: OpenFailure,
    },
    /// The line does not take the bytes of a command.
    #[error("{port} took {sent} of the {length} bytes of {command}: {failure}")]
    WriteCommand {
        /// The port.
        port: String,
        /// The command as the manual writes it.
        command: String,
        /// How many bytes it took.
        sent: usize,
        /// How many there were.
        length: usize,
        /// Why.
        failure: WriteFailure,
    },
    /// The reply to a command does not come, or is none.
    #[error("the reply to {command} on {port}: {failure}")]
    ReadReply {
        /// The port.
        port: String,
        /// The command as the manual writes it.
        command: String,
        /// Why, and what to check.
        failure: ReplyFailure,
    },
    /// The line does not become quiet, so that no reply can be distinguished from what went before.
    #[error("{port} does not become quiet: {failure}")]
    Resynchronise {
        /// The port.
        port: String,
        /// Why, and what to check.
        failure: ReplyFailure,
    },
}

/// Why a reply does not come, or is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReplyFailure {
    /// Not one byte.
    #[error(
        "nothing came within {} ms; check that the arm is switched on, the cable and the port it is plugged into, and the rate (the switches SW1 to SW3 all off for 9600 baud); an arm under hand control or in a taught program answers once STOP is pressed on its pendant",
        waited.as_millis()
    )]
    Silent {
        /// For how long.
        waited: Duration,
    },
    /// Bytes came, but no carriage return.
    #[error("only '{}' came within {} ms, without its end; check the cable and the rate", PrintableBytes(received), waited.as_millis())]
    CutShort {
        /// What came.
        received: Vec<u8>,
        /// For how long.
        waited: Duration,
    },
    /// A line came that is no reply.
    #[error(
        "'{}' is not a reply: {fault}; check the cable and the rate, and that nothing else talks on the line",
        PrintableBytes(received)
    )]
    Garbled {
        /// What came.
        received: Vec<u8>,
        /// What is wrong with it.
        fault: Fault,
    },
    /// Bytes came on and on.
    #[error(
        "more than {limit} bytes came without being a reply, such as '{}'; check that the device is a TeachMover, and the rate",
        PrintableBytes(beginning)
    )]
    Babbling {
        /// More bytes than this.
        limit: usize,
        /// The first of them.
        beginning: Vec<u8>,
    },
    /// Bytes came although nothing had been asked.
    #[error(
        "'{}' had come before anything was asked; the replies are out of step with the commands; read the joints, look at the arm and activate it again",
        PrintableBytes(received)
    )]
    Stray {
        /// What came.
        received: Vec<u8>,
    },
    /// The port is gone.
    #[error(transparent)]
    Unplugged(#[from] Unplugged),
}

impl ReplyFailure {
    /// Of bytes that came on and on.
    pub(super) fn babbling(limit: usize, mut received: Vec<u8>) -> Self {
        received.truncate(20);
        Self::Babbling { limit, beginning: received }
    }

    /// Whether asking again may help: the line is there, but what came was damaged.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::CutShort { .. } | Self::Garbled { .. } | Self::Silent { .. } | Self::Stray { .. } => true,
            Self::Babbling { .. } | Self::Unplugged(_) => false,
        }
    }
}

impl From<SerialError> for PluginError {
    fn from(error: SerialError) -> Self {
        let text = error.to_string();
        match error {
            SerialError::Open { failure, .. } if failure.is_of_the_name() => Self::Refused(text),
            SerialError::Open { .. } | SerialError::WriteCommand { .. } => Self::Disconnected(text),
            SerialError::ReadReply { failure, .. } | SerialError::Resynchronise { failure, .. } => {
                match failure {
                    ReplyFailure::Silent { .. } | ReplyFailure::Unplugged(_) => Self::Disconnected(text),
                    ReplyFailure::CutShort { .. }
                    | ReplyFailure::Garbled { .. }
                    | ReplyFailure::Babbling { .. }
                    | ReplyFailure::Stray { .. } => Self::Failed(text),
                }
            }
        }
    }
}
