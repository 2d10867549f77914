//! What the screens hear and what they ask for.

use std::time::Duration;

use plumb_cell::command::Command;
use plumb_cell::event::StampedEvent;
use ratatui::crossterm::event::KeyEvent;

use super::history::{ArchiveAnswer, ArchiveRequest};
use super::model::{LabAnswer, LabRequest};

/// Something that happened outside the screens.
#[derive(Clone, Debug)]
pub(crate) enum Message {
    /// A key was pressed. The stop keys come as [`Message::StopKey`].
    Key(KeyEvent),
    /// A stop key was pressed; anyone who read it has informed the robots already.
    StopKey {
        /// The key also asks to leave.
        leave: bool,
    },
    /// The left mouse button was pressed in this column and row.
    Click {
        /// Counted from the left, from 0.
        column: u16,
        /// Counted from the top, from 0.
        row: u16,
    },
    /// The right mouse button was pressed in this column and row.
    Grab {
        /// Counted from the left, from 0.
        column: u16,
        /// Counted from the top, from 0.
        row: u16,
    },
    /// The mouse was dragged to this column and row.
    Drag {
        /// Counted from the left, from 0.
        column: u16,
        /// Counted from the top, from 0.
        row: u16,
        /// With the right button, or with Ctrl held.
        moves: bool,
    },
    /// A picture was saved under this name, or could not be.
    PictureSaved(Result<String, String>),
    /// The wheel was turned; up is negative.
    Scroll(i32),
    /// The terminal has this size now.
    Resized {
        /// Columns.
        width: u16,
        /// Rows.
        height: u16,
    },
    /// The engine says something.
    Engine(Box<StampedEvent>),
    /// The model lab has finished a piece of work.
    Lab(LabAnswer),
    /// How far the lab is with the work in hand: a fraction, and what it does.
    LabProgress(f64, String),
    /// The record was read.
    Archive(ArchiveAnswer),
    /// Time since the screens opened.
    Tick(Duration),
}

/// Something the screens want done outside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Action {
    /// Stop every robot by its own stop path, at once.
    Stop,
    /// Pass a command to the engine.
    Send(Command),
    /// Give the model lab a piece of work.
    Lab(LabRequest),
    /// End what the model lab is doing.
    CancelLab,
    /// Read something in the record.
    Archive(ArchiveRequest),
    /// Write a picture into the folder the program runs in, under a name nothing has yet.
    SavePicture {
        /// The name's beginning.
        name: String,
        /// PNG, or why there is none.
        bytes: Result<Vec<u8>, String>,
    },
    /// Ring the terminal's bell: somebody is needed.
    Bell,
    /// Close the screens.
    Leave,
}
