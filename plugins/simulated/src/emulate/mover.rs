//! What makes the motions of an arm in a world: a thread with a connection of its own, which a motion keeps busy until it has ended.

use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::time::Duration;

use crate::client::{ClientError, WorldClient};
use crate::protocol::{Reading, Response, WorldCommand};

/// How a motion ended.
type End = Result<Reading, ClientError>;

/// What becomes of a motion.
#[derive(Debug)]
enum News {
    /// The world has begun it.
    Begun,
    /// It has ended, or the world has refused it.
    Ended(End),
}

/// Makes one motion at a time. Another connection stops it.
#[derive(Debug)]
pub(super) struct Mover {
    motions: Sender<WorldCommand>,
    news: Receiver<News>,
    /// The end of a motion that was refused instead of begun.
    refused: Option<End>,
}

impl Mover {
    /// Connects to the world at `socket`; `name` says who calls.
    pub(super) fn connect(socket: &Path, name: &str) -> Result<Self, ClientError> {
        let mut world = WorldClient::connect(socket, name)?;
        let (motions, requested) = channel();
        let (report, news) = channel();
        std::thread::spawn(move || {
            for motion in requested {
                let end = make(&mut world, motion, &report);
                if report.send(News::Ended(end)).is_err() {
                    break;
                }
            }
        });
        Ok(Self { motions, news, refused: None })
    }

    /// Begins a motion; the one before has ended. Returns when the world has begun or refused it: a stop over another connection that came to the world
    /// before the motion would stop nothing, and the motion would be made to its end.
    pub(super) fn begin(&mut self, motion: WorldCommand) -> Result<(), ClientError> {
        self.motions.send(motion).map_err(|_| ClientError::Gone)?;
        // A world that is silent is given up by the connection.
        match self.news.recv() {
            Ok(News::Begun) => Ok(()),
            Ok(News::Ended(end)) => {
                self.refused = Some(end);
                Ok(())
            }
            Err(_) => Err(ClientError::Gone),
        }
    }

    /// How the motion ended, if it has.
    pub(super) fn ended(&mut self) -> Option<End> {
        match self.refused.take().map_or_else(|| self.news.try_recv(), |end| Ok(News::Ended(end))) {
            Ok(News::Ended(end)) => Some(end),
            Ok(News::Begun) | Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(ClientError::Gone)),
        }
    }

    /// Waits for the end of a motion that was stopped; none where it has not ended within this time.
    pub(super) fn end(&mut self, within: Duration) -> Option<End> {
        match self.refused.take().map_or_else(|| self.news.recv_timeout(within), |end| Ok(News::Ended(end))) {
            Ok(News::Ended(end)) => Some(end),
            Ok(News::Begun) | Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Err(ClientError::Gone)),
        }
    }
}

/// Makes a motion to its end, and reports when the world has begun it.
fn make(world: &mut WorldClient, motion: WorldCommand, report: &Sender<News>) -> End {
    let mut begun = false;
    let end = world.call(
        motion,
        || false,
        |say| {
            // The world says where the arm is as soon as the motion has begun.
            if matches!(say, Response::Joints(_)) && !begun {
                begun = true;
                // Where nobody waits for it, the motion ends as any other.
                let _ = report.send(News::Begun);
            }
        },
    )?;
    match end {
        Response::Reading(reading) => Ok(reading),
        other => Err(ClientError::Garbled(format!("{other:?} instead of a reading"))),
    }
}
