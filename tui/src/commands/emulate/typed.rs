//! What is typed to an emulated controller while it works, and the signals that end it.

use std::io::{self, Read};
use std::os::fd::AsFd;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};

/// How often the controller is asked whether it still works, ms.
const LOOK: u16 = 200;

/// Lines typed on standard input, and signals.
pub(in crate::commands) struct Typing {
    signals: SignalFd,
    input: Option<io::Stdin>,
    typed: Vec<u8>,
}

impl Typing {
    /// Takes SIGTERM and SIGINT over; with `ends_with_parent` the end of the program that started this one is a SIGTERM too. Before any thread is
    /// there, so that the signals come here and nowhere else.
    pub(in crate::commands) fn listen(ends_with_parent: bool) -> Result<Self, nix::Error> {
        if ends_with_parent {
            nix::sys::prctl::set_pdeathsig(Signal::SIGTERM)?;
        }
        let mut signals = SigSet::empty();
        signals.add(Signal::SIGTERM);
        signals.add(Signal::SIGINT);
        signals.thread_block()?;
        let signals = SignalFd::with_flags(&signals, SfdFlags::SFD_CLOEXEC)?;
        Ok(Self { signals, input: Some(io::stdin()), typed: Vec::new() })
    }

    /// The lines typed within a little while; none once a signal has come.
    pub(in crate::commands) fn next(&mut self) -> Result<Option<Vec<String>>, Box<dyn std::error::Error>> {
        let mut polled = vec![PollFd::new(self.signals.as_fd(), PollFlags::POLLIN)];
        if let Some(input) = &self.input {
            polled.push(PollFd::new(input.as_fd(), PollFlags::POLLIN));
        }
        match poll(&mut polled, PollTimeout::from(LOOK)) {
            Ok(_) | Err(nix::Error::EINTR) => {}
            Err(error) => return Err(error.into()),
        }
        let ready = |index: usize| polled.get(index).and_then(PollFd::any).unwrap_or(false);
        let (signal, input) = (ready(0), ready(1));
        if signal {
            return Ok(None);
        }
        if input && !self.read_some()? {
            // Anyone who started it has nothing more to type; it works on.
            self.input = None;
        }
        Ok(Some(self.whole_lines()))
    }

    /// Adds what was typed; `false` at the end of the input.
    fn read_some(&mut self) -> io::Result<bool> {
        let mut bytes = [0; 1024];
        // Not through a buffer: what it held back would not be waited for.
        let count = io::stdin().lock().read(&mut bytes)?;
        self.typed.extend_from_slice(bytes.get(..count).unwrap_or_default());
        Ok(count > 0)
    }

    fn whole_lines(&mut self) -> Vec<String> {
        let Some(end) = self.typed.iter().rposition(|byte| *byte == b'\n') else { return Vec::new() };
        let lines: Vec<u8> = self.typed.drain(..=end).collect();
        String::from_utf8_lossy(&lines).lines().map(str::to_owned).collect()
    }
}
