//! The model lab at work beside the screens: it fits and judges on a thread of its own and answers when it is done.

use std::sync::mpsc::Sender;

use tokio::sync::mpsc::UnboundedReceiver;

use super::state::{Preview, Standing};

/// A piece of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LabRequest {
    /// What would be left with this candidate added?
    Preview(String),
    /// Add this candidate to the model.
    Add(String),
    /// Take the effect added last away.
    Undo,
}

/// What came of it.
#[derive(Clone, Debug)]
#[expect(dead_code, reason = "the lab's thread comes with the model library")]
pub(crate) enum LabAnswer {
    /// The lab does this now.
    Doing(String),
    /// The model as it is now, held against the table.
    Examined(Box<Standing>),
    /// What would be left.
    Previewed(Box<Preview>),
    /// It could not be done, and why.
    Failed(String),
}

/// The line to the lab.
pub(crate) struct Lab {
    requests: Sender<LabRequest>,
    answers: UnboundedReceiver<LabAnswer>,
}

impl Lab {
    /// Where requests go.
    pub(crate) fn requests(&self) -> Sender<LabRequest> {
        self.requests.clone()
    }

    /// The next answer; none when the lab has ended.
    pub(crate) async fn answer(&mut self) -> Option<LabAnswer> {
        self.answers.recv().await
    }
}
