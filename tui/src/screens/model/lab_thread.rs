//! The end of the line at which a lab's own thread works, whichever lab it is: it takes requests, answers, and gives up what it does when asked to.

use std::fmt::Display;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use plumb_estimation::Progress;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

use super::request::{LabAnswer, LabRequest};

/// The progress of the work in hand, by which it is watched and ended.
#[derive(Clone, Default)]
pub(super) struct InHand(Arc<Mutex<Progress>>);

impl InHand {
    /// That of the work in hand.
    pub(super) fn progress(&self) -> Progress {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Puts that of new work in its place.
    fn renew(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Progress::default();
    }
}

/// Why a piece of work was not done; being asked to end is one of the reasons.
pub(super) trait WorkError: Display {
    /// Whether it was asked to end.
    fn is_cancelled(&self) -> bool;
}

/// What the screens keep of a line: where requests go, the work in hand, and where answers come from.
pub(super) struct ScreensEnd {
    pub(super) requests: Sender<LabRequest>,
    pub(super) in_hand: InHand,
    pub(super) answers: UnboundedReceiver<LabAnswer>,
}

/// What the lab's thread keeps of it.
pub(super) struct LabThread {
    to_do: Receiver<LabRequest>,
    in_hand: InHand,
    to_screens: UnboundedSender<LabAnswer>,
    /// What it does is to judge candidates: what was asked for before that is done.
    judging: bool,
}

/// A line between the screens and a lab.
pub(super) fn line() -> (ScreensEnd, LabThread) {
    let (requests, to_do) = channel();
    let (to_screens, answers) = unbounded_channel();
    let in_hand = InHand::default();
    let screens = ScreensEnd { requests, in_hand: in_hand.clone(), answers };
    (screens, LabThread { to_do, in_hand, to_screens, judging: false })
}

impl LabThread {
    /// The next request; none when the screens are gone.
    pub(super) fn next(&self) -> Option<LabRequest> {
        self.to_do.recv().ok()
    }

    /// Begins a piece of work, which can be asked to end from now on.
    pub(super) fn begin(&mut self) {
        self.in_hand.renew();
        self.judging = false;
    }

    /// From here on the work in hand only judges candidates.
    pub(super) fn begin_judging(&mut self) {
        self.judging = true;
    }

    /// Ends a piece of work: says what went wrong with it, if something did.
    pub(super) fn end(&self, done: Result<(), impl WorkError>) {
        match done {
            Ok(()) => {}
            Err(error) if error.is_cancelled() => self.report(LabAnswer::GaveUp { judging: self.judging }),
            Err(error) => self.report(LabAnswer::Failed(error.to_string())),
        }
    }

    /// The progress of the work in hand.
    pub(super) fn progress(&self) -> Progress {
        self.in_hand.progress()
    }

    /// Reports to the screens; screens that are gone hear nothing.
    pub(super) fn report(&self, answer: LabAnswer) {
        let _gone = self.to_screens.send(answer);
    }
}
