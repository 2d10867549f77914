//! A controller at work: a thread that moves bytes between the pseudo-terminal and the controller at the line's rate.

use std::fmt;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use super::dobot;
use super::feetech::ShaftError;
use super::line::Line;
use super::teachmover::MotorsError;
use super::terminal::TerminalError;
use super::val2::ArmError;

/// Why a controller does not work, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// There is no port to offer.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// The motors are gone.
    #[error(transparent)]
    Motors(#[from] MotorsError),
    /// The arm is gone.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// The Dobot's arm is gone.
    #[error(transparent)]
    Dobot(#[from] dobot::ArmError),
    /// The servos turn nothing any more.
    #[error(transparent)]
    Shafts(#[from] ShaftError),
    /// The system failed.
    #[error("the pseudo-terminal failed: {0}")]
    System(#[from] std::io::Error),
    /// The thread panicked.
    #[error("the emulator panicked: a fault in its code")]
    Panicked,
}

/// What one kind of controller does on its line. Times are ns of the line's clock.
pub trait Controls: Send + 'static {
    /// What happens to it besides its line.
    type Event: Send;
    /// Its status.
    type Status: Clone + Default + Send;

    /// When it has to work next, if no byte comes before.
    fn due(&self, now: u64) -> u64;

    /// Lets something happen.
    ///
    /// # Errors
    /// [`EmulatorError`] when the arm or the line is gone.
    fn happen(&mut self, event: Self::Event, line: &mut Line) -> Result<(), EmulatorError>;

    /// Works up to now: takes what was heard and puts its answers on the line.
    ///
    /// # Errors
    /// [`EmulatorError`] when the arm is gone.
    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError>;

    /// Its status now; `port` is what a host opens, as long as the plug is in.
    fn status(&mut self, port: Option<PathBuf>, line: &Line) -> Self::Status;
}

/// What its thread is given.
#[derive(Debug)]
enum Order<Event> {
    /// Something happens; anyone who reports it waits until it has happened.
    Happen(Event, SyncSender<()>),
    End,
}

/// A controller at work. Ends when it is dropped.
pub struct Emulator<C: Controls> {
    orders: Sender<Order<C::Event>>,
    wake: UnixStream,
    status: Arc<Mutex<C::Status>>,
    thread: Option<JoinHandle<Result<(), EmulatorError>>>,
}

impl<C: Controls> Emulator<C> {
    /// Switches a controller on.
    pub(super) fn switch_on(mut controller: C, mut line: Line) -> Result<Self, EmulatorError> {
        let (wake, woken) = UnixStream::pair()?;
        woken.set_nonblocking(true)?;
        let (orders, received) = channel();
        let status = Arc::new(Mutex::new(controller.status(line.port(), &line)));
        let noted = Arc::clone(&status);
        let thread = std::thread::spawn(move || serve(&mut controller, &mut line, &woken, &received, &noted));
        Ok(Self { orders, wake, status, thread: Some(thread) })
    }

    /// The status of the controller now.
    pub fn status(&self) -> C::Status {
        self.status.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Lets something happen to the controller, and returns when it has happened.
    pub fn inject(&mut self, event: C::Event) {
        let (happened, wait) = sync_channel(1);
        self.order(Order::Happen(event, happened));
        // A controller that has ended hears nothing more: `stop` says why it ended.
        let _ = wait.recv();
    }

    /// Whether it still works.
    pub fn is_working(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Switches the controller off.
    ///
    /// # Errors
    /// Why it had ended before, if it had.
    pub fn stop(mut self) -> Result<(), EmulatorError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), EmulatorError> {
        self.order(Order::End);
        match self.thread.take() {
            Some(thread) => thread.join().unwrap_or(Err(EmulatorError::Panicked)),
            None => Ok(()),
        }
    }

    fn order(&mut self, order: Order<C::Event>) {
        // One that has ended takes no orders, and need not be woken.
        let _ = self.orders.send(order);
        let _ = self.wake.write(&[0]);
    }
}

impl<C: Controls> fmt::Debug for Emulator<C> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Emulator").field("working", &self.is_working()).finish_non_exhaustive()
    }
}

impl<C: Controls> Drop for Emulator<C> {
    fn drop(&mut self) {
        // Anyone who wants to know why it ended asks with `stop`.
        let _ = self.end();
    }
}

/// Lets everybody see how the controller is now.
fn publish<C: Controls>(controller: &mut C, line: &Line, status: &Mutex<C::Status>) {
    let now = controller.status(line.port(), line);
    *status.lock().unwrap_or_else(PoisonError::into_inner) = now;
}

/// The thread's work, until it is asked to end.
fn serve<C: Controls>(
    controller: &mut C,
    line: &mut Line,
    woken: &UnixStream,
    orders: &Receiver<Order<C::Event>>,
    status: &Mutex<C::Status>,
) -> Result<(), EmulatorError> {
    loop {
        line.wait(woken, controller.due(line.now()))?;
        let mut happened = Vec::new();
        for order in orders.try_iter() {
            match order {
                Order::Happen(event, done) => {
                    controller.happen(event, line)?;
                    happened.push(done);
                }
                Order::End => return Ok(()),
            }
        }
        line.receive()?;
        controller.work(line)?;
        // Anyone who has read an answer finds the controller as it was when it answered; the port may be gone once it was sent.
        publish(controller, line, status);
        line.send()?;
        publish(controller, line, status);
        for done in happened {
            // Anyone who reported it may have gone.
            let _ = done.send(());
        }
    }
}
