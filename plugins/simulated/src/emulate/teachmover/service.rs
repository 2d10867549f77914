//! The controller at work: a thread that moves bytes between the pseudo-terminal and the controller at the line's rate.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::controller::{Controller, Registers};
use super::event::Event;
use super::motors::{Motors, MotorsError};
use crate::emulate::fault::{Fault, Way};
use crate::emulate::terminal::{Terminal, TerminalError};
use crate::emulate::wire::Wire;
use crate::physics::random::Random;

/// How often a controller that has nothing to do looks whether its arm is still there.
const CHECK: Duration = Duration::from_secs(1);

/// How the line of an emulated controller is.
#[derive(Debug, Clone, Default)]
pub struct EmulatorOptions {
    /// The rate whose timing is kept; `None` for a line that takes no time.
    pub baud: Option<u32>,
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
    Motors(#[from] MotorsError),
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
    /// The registers.
    pub registers: Registers,
    /// Whether it is busy and hears nothing.
    pub busy: bool,
    /// When the last half-step was made.
    pub last_half_step: Option<Instant>,
    /// How long the motors have turned in all.
    pub turned: Duration,
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
    /// Switches a controller of these motors on.
    ///
    /// # Errors
    /// [`EmulatorError`] when no pseudo-terminal or link can be made.
    pub fn start(options: EmulatorOptions, motors: Box<dyn Motors>) -> Result<Emulator, EmulatorError> {
        let terminal = Terminal::open(options.link.as_deref())?;
        let (wake, woken) = UnixStream::pair()?;
        woken.set_nonblocking(true)?;
        let (events, received) = channel();
        let standing =
            Arc::new(Mutex::new(Standing { port: Some(terminal.path().to_owned()), ..Standing::default() }));
        let mut service = Service::new(options, terminal, motors, standing.clone());
        let thread = std::thread::spawn(move || service.serve(&woken, &received));
        Ok(Emulator { events, wake, standing, thread: Some(thread) })
    }

    /// How the controller stands now.
    pub fn standing(&self) -> Standing {
        lock(&self.standing).clone()
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

fn lock(standing: &Mutex<Standing>) -> MutexGuard<'_, Standing> {
    standing.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The thread's own.
struct Service {
    options: EmulatorOptions,
    terminal: Option<Terminal>,
    to_arm: Wire,
    from_arm: Wire,
    controller: Controller,
    standing: Arc<Mutex<Standing>>,
    began: Instant,
}

impl Service {
    fn new(
        options: EmulatorOptions,
        terminal: Terminal,
        motors: Box<dyn Motors>,
        standing: Arc<Mutex<Standing>>,
    ) -> Service {
        let byte_ns = options.baud.map_or(0, |baud| 10_000_000_000 / u64::from(baud.max(1)));
        let wire = |purpose: &str| {
            let mut wire = Wire::new(byte_ns, Random::new(options.seed, purpose));
            wire.damage_at_random(options.fault_probability);
            wire
        };
        let mut service = Service {
            to_arm: wire("bytes to the arm"),
            from_arm: wire("bytes from the arm"),
            terminal: Some(terminal),
            controller: Controller::new(motors),
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
        let mut checked = Instant::now();
        loop {
            self.wait(woken)?;
            if checked.elapsed() >= CHECK {
                checked = Instant::now();
                self.controller.motors().check()?;
            }
            for event in events.try_iter() {
                match event {
                    Some(event) => self.happen(event)?,
                    None => return Ok(()),
                }
            }
            self.work()?;
            self.tell_standing();
        }
    }

    /// Waits until a byte comes, an event, or something is due.
    fn wait(&self, woken: &UnixStream) -> Result<(), EmulatorError> {
        let now = self.now();
        let due = [self.to_arm.next(), self.from_arm.next(), self.controller.next(now)];
        let due = due.into_iter().flatten().min();
        let left = due.map_or(CHECK, |due| Duration::from_nanos(due.saturating_sub(now)).min(CHECK));
        let timeout = Some(TimeSpec::from_duration(left));
        let mut polled = vec![PollFd::new(woken.as_fd(), PollFlags::POLLIN)];
        if let Some(terminal) = &self.terminal {
            polled.push(PollFd::new(terminal.wait_on(), PollFlags::POLLIN));
        }
        match ppoll(&mut polled, timeout, None) {
            Ok(_) | Err(nix::errno::Errno::EINTR) => {}
            Err(error) => return Err(EmulatorError::System(error.into())),
        }
        let mut bytes = [0; 64];
        // Nothing there is as good as something: it only wakes.
        let _ = (&*woken).read(&mut bytes);
        Ok(())
    }

    fn happen(&mut self, event: Event) -> Result<(), EmulatorError> {
        let now = self.now();
        match event {
            Event::Press(key) => self.controller.press(key, now)?,
            Event::StopAfter(half_steps) => self.controller.stop_after(half_steps),
            Event::Drive { motor, half_steps } => self.controller.drive(motor, half_steps, now)?,
            Event::Line { bit, level } => {
                self.controller.motors().set_input(bit, level);
            }
            Event::Between(width_mm) => {
                self.controller.motors().put_between_fingers(width_mm)?;
            }
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
        }
        Ok(())
    }

    fn damage(&mut self, fault: Fault) {
        match fault.way {
            Way::ToArm => self.to_arm.damage(fault.byte, fault.kind),
            Way::FromArm => self.from_arm.damage(fault.byte, fault.kind),
        }
    }

    /// Moves bytes and lets the controller work up to now.
    fn work(&mut self) -> Result<(), EmulatorError> {
        let now = self.now();
        if let Some(terminal) = &mut self.terminal {
            for byte in terminal.receive()? {
                self.to_arm.put(byte, 0, now);
            }
        }
        while let Some((arrived, byte)) = self.to_arm.take(now) {
            self.controller.run(arrived)?;
            self.speak(arrived);
            self.controller.hear(byte, arrived)?;
            self.speak(arrived);
        }
        self.controller.run(now)?;
        self.speak(now);
        while let Some((_, byte)) = self.from_arm.take(now) {
            if let Some(terminal) = &mut self.terminal {
                terminal.send(byte)?;
            }
        }
        Ok(())
    }

    /// Puts what the controller says on the line.
    fn speak(&mut self, now: u64) {
        let (bytes, pause) = self.controller.take_reply();
        for byte in bytes {
            self.from_arm.put(byte, pause, now);
        }
    }

    fn tell_standing(&mut self) {
        let registers = self.controller.registers(self.now());
        let (last, turned) = self.controller.turned();
        let mut standing = lock(&self.standing);
        *standing = Standing {
            port: self.terminal.as_ref().map(|terminal| terminal.path().to_owned()),
            registers,
            busy: self.controller.is_busy(),
            last_half_step: last.map(|last| self.began + Duration::from_nanos(last)),
            turned: Duration::from_nanos(turned),
        };
    }

    fn now(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }
}
