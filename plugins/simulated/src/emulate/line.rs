//! The line of a controller: a pseudo-terminal for a plug, and a wire each way with its own rate and faults.

use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;

use super::fault::{Fault, Way};
use super::terminal::{Terminal, TerminalError};
use super::wire::Wire;
use crate::physics::random::Random;

/// How the line of an emulated controller is.
#[derive(Debug, Clone, Default)]
pub struct LineOptions {
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

/// The line, with a clock of its own in ns.
#[derive(Debug)]
pub struct Line {
    link: Option<PathBuf>,
    terminal: Option<Terminal>,
    to_arm: Wire,
    from_arm: Wire,
    began: Instant,
}

impl Line {
    /// A line with its plug in.
    pub(super) fn new(options: LineOptions) -> Result<Line, TerminalError> {
        let byte_ns = options.baud.map_or(0, |baud| 10_000_000_000 / u64::from(baud.max(1)));
        let wire = |purpose: &str| Wire::new(byte_ns, Random::new(options.seed, purpose));
        let mut line = Line {
            terminal: Some(Terminal::open(options.link.as_deref())?),
            link: options.link,
            to_arm: wire("bytes to the arm"),
            from_arm: wire("bytes from the arm"),
            began: Instant::now(),
        };
        line.damage_at_random(options.fault_probability);
        for fault in options.faults {
            line.damage(fault);
        }
        Ok(line)
    }

    /// The time of the line's clock, ns.
    pub(super) fn now(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    /// The instant of a time of the line's clock.
    pub(super) fn instant(&self, time: u64) -> Instant {
        self.began + Duration::from_nanos(time)
    }

    /// What a host opens, as long as the plug is in.
    pub(super) fn port(&self) -> Option<PathBuf> {
        self.terminal.as_ref().map(|terminal| terminal.path().to_owned())
    }

    /// Pulls the plug: what is under way is lost.
    pub(super) fn unplug(&mut self) {
        self.terminal = None;
        self.to_arm.cut();
        self.from_arm.cut();
    }

    /// Puts the plug back, if it is out.
    pub(super) fn plug(&mut self) -> Result<(), TerminalError> {
        if self.terminal.is_none() {
            self.terminal = Some(Terminal::open(self.link.as_deref())?);
        }
        Ok(())
    }

    /// Will damage a byte to come.
    pub(super) fn damage(&mut self, fault: Fault) {
        match fault.way {
            Way::ToArm => self.to_arm.damage(fault.byte, fault.kind),
            Way::FromArm => self.from_arm.damage(fault.byte, fault.kind),
        }
    }

    /// Damages every byte from now on with this probability.
    pub(super) fn damage_at_random(&mut self, probability: f64) {
        self.to_arm.damage_at_random(probability);
        self.from_arm.damage_at_random(probability);
    }

    /// Waits until a byte comes, somebody wakes it, or `due` (ns) is reached.
    pub(super) fn wait(&self, woken: &UnixStream, due: u64) -> io::Result<()> {
        let due = [self.to_arm.next(), self.from_arm.next()].into_iter().flatten().fold(due, u64::min);
        let timeout = TimeSpec::from_duration(Duration::from_nanos(due.saturating_sub(self.now())));
        let mut polled = vec![PollFd::new(woken.as_fd(), PollFlags::POLLIN)];
        if let Some(terminal) = &self.terminal {
            polled.push(PollFd::new(terminal.wait_on(), PollFlags::POLLIN));
        }
        match ppoll(&mut polled, Some(timeout), None) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(error) => return Err(error.into()),
        }
        let mut bytes = [0; 64];
        // Nothing there is as good as something: it only wakes.
        let _ = (&*woken).read(&mut bytes);
        Ok(())
    }

    /// Puts what a host has written on its way to the arm.
    pub(super) fn receive(&mut self) -> io::Result<()> {
        let now = self.now();
        if let Some(terminal) = &mut self.terminal {
            for byte in terminal.receive()? {
                self.to_arm.put(byte, 0, now);
            }
        }
        Ok(())
    }

    /// The next byte that has arrived at the arm by `now`, with when it did.
    pub(super) fn heard(&mut self, now: u64) -> Option<(u64, u8)> {
        self.to_arm.take(now)
    }

    /// Puts a byte of the arm's on the line; `pause` ns pass before it.
    pub(super) fn reply(&mut self, byte: u8, pause: u64, now: u64) {
        self.from_arm.put(byte, pause, now);
    }

    /// Whether bytes of the arm's are still on their way.
    pub(super) fn is_busy(&self) -> bool {
        self.from_arm.next().is_some()
    }

    /// Hands the host what has reached it. Without a plug it is lost.
    pub(super) fn send(&mut self) -> io::Result<()> {
        while let Some((_, byte)) = self.from_arm.take(self.now()) {
            if let Some(terminal) = &mut self.terminal {
                terminal.send(byte)?;
            }
        }
        Ok(())
    }
}
