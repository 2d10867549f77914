//! The controller at work: a thread that moves bytes between the pseudo-terminal and the monitor at the line's rate.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::arm::{ArmError, DrivenArm};
use super::dialect::Dialect;
use super::event::Event;
use super::monitor::Monitor;
use crate::emulate::fault::{Fault, Way};
use crate::emulate::terminal::{Terminal, TerminalError};
use crate::emulate::wire::Wire;
use crate::physics::random::Random;

/// How soon a character is echoed, ns.
const ECHO_NS: u64 = 200_000;
/// How long the monitor is busy with a character, ns: longer than the next one takes to come at 9600 baud.
const CHARACTER_NS: u64 = 1_500_000;
/// The same for a controller that keeps up with its line, ns.
const QUICK_CHARACTER_NS: u64 = 300_000;
/// How often a moving arm is looked at, ns.
const LOOK_NS: u64 = 2_000_000;
/// How often a controller at rest looks whether its arm is still there, ns.
const CHECK_NS: u64 = 1_000_000_000;

/// How an emulated controller is.
#[derive(Debug, Clone, Default)]
pub struct EmulatorOptions {
    /// The socket of the world whose arm it drives.
    pub world: PathBuf,
    /// How its monitor speaks.
    pub dialect: Dialect,
    /// The rate whose timing is kept; `None` for a line, and a monitor, that take no time.
    pub baud: Option<u32>,
    /// Whether it keeps up with its line. Otherwise it holds one character while it echoes another, and loses a third.
    pub keeps_up: bool,
    /// Where a link to the pseudo-terminal is wanted.
    pub link: Option<PathBuf>,
    /// What chance is drawn from.
    pub seed: u64,
    /// Bytes that will be damaged.
    pub faults: Vec<Fault>,
    /// The probability that any other byte is damaged.
    pub fault_probability: f64,
}

/// Why the controller does not work, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// There is no port to offer.
    #[error(transparent)]
    Terminal(#[from] TerminalError),
    /// The arm is gone.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// The system failed.
    #[error("the pseudo-terminal failed: {0}")]
    System(#[from] std::io::Error),
    /// The thread panicked.
    #[error("the emulator panicked: a fault in its code")]
    Panicked,
}

/// How the controller stands.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// The path a host opens, as long as the plug is in.
    pub port: Option<PathBuf>,
    /// Whether the arm is moved.
    pub moving: bool,
    /// Characters that came while it could take no more.
    pub lost: u64,
    /// When a control C was heard last.
    pub last_cancel: Option<Instant>,
}

/// A controller at work. Ends when it is dropped.
#[derive(Debug)]
pub struct Emulator {
    events: Sender<Option<Event>>,
    wake: UnixStream,
    standing: Arc<Mutex<Standing>>,
    thread: Option<JoinHandle<Result<(), EmulatorError>>>,
}

impl Emulator {
    /// Switches a controller on.
    ///
    /// # Errors
    /// [`EmulatorError`] when there is no world, or no pseudo-terminal or link can be made.
    pub fn start(options: EmulatorOptions) -> Result<Emulator, EmulatorError> {
        let arm = DrivenArm::connect(&options.world)?;
        let terminal = Terminal::open(options.link.as_deref())?;
        let (wake, woken) = UnixStream::pair()?;
        woken.set_nonblocking(true)?;
        let (events, received) = channel();
        let port = Some(terminal.path().to_owned());
        let standing = Arc::new(Mutex::new(Standing { port, ..Standing::default() }));
        let mut service = Service::new(options, terminal, arm, Arc::clone(&standing));
        let thread = std::thread::spawn(move || service.serve(&woken, &received));
        Ok(Emulator { events, wake, standing, thread: Some(thread) })
    }

    /// How the controller stands now.
    pub fn standing(&self) -> Standing {
        self.standing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Lets something happen to the controller.
    pub fn tell(&mut self, event: Event) {
        self.send(Some(event));
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
        self.send(None);
        match self.thread.take() {
            Some(thread) => thread.join().unwrap_or(Err(EmulatorError::Panicked)),
            None => Ok(()),
        }
    }

    fn send(&mut self, event: Option<Event>) {
        // A controller that has ended hears nothing more: `stop` says why it ended.
        let _ = self.events.send(event);
        let _ = self.wake.write(&[0]);
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Whoever wants to know why it ended asks with `stop`.
        let _ = self.end();
    }
}

/// The thread's own.
struct Service {
    options: EmulatorOptions,
    terminal: Option<Terminal>,
    to_arm: Wire,
    from_arm: Wire,
    monitor: Monitor,
    /// The one character the input buffer holds.
    held: Option<u8>,
    busy_until: u64,
    looked: u64,
    standing: Arc<Mutex<Standing>>,
    began: Instant,
}

impl Service {
    fn new(
        options: EmulatorOptions,
        terminal: Terminal,
        arm: DrivenArm,
        standing: Arc<Mutex<Standing>>,
    ) -> Service {
        let byte_ns = options.baud.map_or(0, |baud| 10_000_000_000 / u64::from(baud.max(1)));
        let wire = |purpose: &str| {
            let mut wire = Wire::new(byte_ns, Random::new(options.seed, purpose));
            wire.damage_at_random(options.fault_probability);
            wire
        };
        let mut service = Service {
            to_arm: wire("characters to VAL"),
            from_arm: wire("characters from VAL"),
            terminal: Some(terminal),
            monitor: Monitor::new(options.dialect, arm),
            held: None,
            busy_until: 0,
            looked: 0,
            standing,
            began: Instant::now(),
            options,
        };
        for fault in service.options.faults.clone() {
            service.damage(fault);
        }
        service
    }

    fn serve(&mut self, woken: &UnixStream, events: &Receiver<Option<Event>>) -> Result<(), EmulatorError> {
        loop {
            self.wait(woken)?;
            for event in events.try_iter() {
                match event {
                    Some(event) => self.happen(event)?,
                    None => return Ok(()),
                }
            }
            self.work()?;
        }
    }

    /// Waits until a byte comes, an event, or something is due.
    fn wait(&self, woken: &UnixStream) -> Result<(), EmulatorError> {
        let now = self.now();
        let rhythm = if self.monitor.is_moving() { LOOK_NS } else { CHECK_NS };
        let held = self.held.map(|_| self.busy_until);
        let due = [self.to_arm.next(), self.from_arm.next(), held, Some(self.looked + rhythm)];
        let due = due.into_iter().flatten().min().unwrap_or(now);
        let timeout = TimeSpec::from_duration(Duration::from_nanos(due.saturating_sub(now)));
        let mut polled = vec![PollFd::new(woken.as_fd(), PollFlags::POLLIN)];
        if let Some(terminal) = &self.terminal {
            polled.push(PollFd::new(terminal.wait_on(), PollFlags::POLLIN));
        }
        match ppoll(&mut polled, Some(timeout), None) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => {}
            Err(error) => return Err(EmulatorError::System(error.into())),
        }
        let mut bytes = [0; 64];
        // Nothing there is as good as something: it only wakes.
        let _ = (&*woken).read(&mut bytes);
        Ok(())
    }

    fn happen(&mut self, event: Event) -> Result<(), EmulatorError> {
        match event {
            Event::Damage(fault) => self.damage(fault),
            Event::DamageAtRandom(probability) => {
                self.to_arm.damage_at_random(probability);
                self.from_arm.damage_at_random(probability);
            }
            Event::Unplug => {
                self.terminal = None;
                self.to_arm.cut();
                self.from_arm.cut();
            }
            Event::Plug if self.terminal.is_none() => {
                self.terminal = Some(Terminal::open(self.options.link.as_deref())?);
            }
            Event::Plug => {}
            event => self.monitor.happen(&event)?,
        }
        Ok(())
    }

    fn damage(&mut self, fault: Fault) {
        match fault.way {
            Way::ToArm => self.to_arm.damage(fault.byte, fault.kind),
            Way::FromArm => self.from_arm.damage(fault.byte, fault.kind),
        }
    }

    /// Moves characters and lets the monitor work up to now.
    fn work(&mut self) -> Result<(), EmulatorError> {
        let now = self.now();
        if let Some(terminal) = &mut self.terminal {
            for byte in terminal.receive()? {
                self.to_arm.put(byte, 0, now);
            }
        }
        while let Some((arrived, byte)) = self.to_arm.take(now) {
            self.take_held(arrived)?;
            if arrived >= self.busy_until && self.held.is_none() && self.monitor.listens_to(byte) {
                self.hear(byte, arrived)?;
            } else if self.held.is_none() {
                self.held = Some(byte);
            } else {
                self.note(|standing| standing.lost += 1);
            }
        }
        self.take_held(now)?;
        let rhythm = if self.monitor.is_moving() { LOOK_NS } else { CHECK_NS };
        if now >= self.looked + rhythm {
            self.looked = now;
            self.monitor.look()?;
        }
        self.speak(now);
        while let Some((_, byte)) = self.from_arm.take(self.now()) {
            if let Some(terminal) = &mut self.terminal {
                terminal.send(byte)?;
            }
        }
        let (moving, port) =
            (self.monitor.is_moving(), self.terminal.as_ref().map(|terminal| terminal.path().to_owned()));
        self.note(|standing| {
            standing.moving = moving;
            standing.port = port;
        });
        Ok(())
    }

    fn take_held(&mut self, now: u64) -> Result<(), EmulatorError> {
        if let Some(byte) = self.held.filter(|byte| now >= self.busy_until && self.monitor.listens_to(*byte))
        {
            self.held = None;
            self.hear(byte, self.busy_until.max(self.looked))?;
        }
        Ok(())
    }

    fn hear(&mut self, byte: u8, at: u64) -> Result<(), EmulatorError> {
        let takes = match (self.options.baud, self.options.keeps_up) {
            (None, _) => 0,
            (Some(_), true) => QUICK_CHARACTER_NS,
            (Some(_), false) => CHARACTER_NS,
        };
        self.busy_until = at + takes;
        if byte == 3 {
            self.note(|standing| standing.last_cancel = Some(Instant::now()));
        }
        self.monitor.hear(byte)?;
        self.speak(if takes == 0 { at } else { at + ECHO_NS });
        Ok(())
    }

    /// Puts what the monitor says on the line.
    fn speak(&mut self, at: u64) {
        for byte in self.monitor.take_said() {
            self.from_arm.put(byte, 0, at);
        }
    }

    fn note(&self, change: impl FnOnce(&mut Standing)) {
        change(&mut self.standing.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn now(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }
}
