//! A controller that is played: what it answers to each line is written in the test.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

/// What represents a control C among the lines that were typed.
pub(crate) const CONTROL_C: &str = "^C";

/// The answer to a line that does what it should.
pub(crate) const DONE: &str = "\r\n. ";

/// The other end of the driver's line.
pub(crate) struct Played {
    pub(crate) port: String,
    typed: Arc<Mutex<Vec<String>>>,
    ended: Arc<AtomicBool>,
    hangs_up: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Kept open, so that the line is there before the driver opens it.
    _driver: File,
}

impl Played {
    /// Echoes what is typed, and answers each line, and a control C, with what this says.
    pub(crate) fn answering(mut answer: impl FnMut(&str) -> String + Send + 'static) -> Self {
        let pair = nix::pty::openpty(None, None).unwrap();
        let mut settings = tcgetattr(&pair.master).unwrap();
        cfmakeraw(&mut settings);
        tcsetattr(&pair.master, SetArg::TCSANOW, &settings).unwrap();
        let port = nix::unistd::ttyname(&pair.slave).unwrap().display().to_string();
        let (typed, ended) = (Arc::new(Mutex::new(Vec::new())), Arc::new(AtomicBool::new(false)));
        let (lines, end) = (Arc::clone(&typed), Arc::clone(&ended));
        let hangs_up = Arc::new(AtomicBool::new(false));
        let hung_up = Arc::clone(&hangs_up);
        let mut line_end = File::from(pair.master);
        let thread = std::thread::spawn(move || {
            let mut line = String::new();
            while !end.load(Ordering::Relaxed) {
                let mut polled = [PollFd::new(line_end.as_fd(), PollFlags::POLLIN)];
                if poll(&mut polled, PollTimeout::from(20u8)).is_ok_and(|ready| ready == 0) {
                    continue;
                }
                let mut byte = [0];
                if line_end.read_exact(&mut byte).is_err() || hung_up.load(Ordering::Relaxed) {
                    return;
                }
                let reply = match byte[0] {
                    3 => {
                        line.clear();
                        lines.lock().unwrap().push(CONTROL_C.to_owned());
                        answer(CONTROL_C)
                    }
                    b'\r' => {
                        let line = std::mem::take(&mut line);
                        lines.lock().unwrap().push(line.clone());
                        answer(&line)
                    }
                    other => {
                        line.push(char::from(other));
                        char::from(other).to_string()
                    }
                };
                if line_end.write_all(reply.as_bytes()).is_err() {
                    return;
                }
            }
        });
        Self { port, typed, ended, hangs_up, thread: Some(thread), _driver: pair.slave.into() }
    }

    /// The cable is pulled at the next character.
    pub(crate) fn hang_up(&self) {
        self.hangs_up.store(true, Ordering::Relaxed);
    }

    /// What was typed since this was asked last.
    pub(crate) fn take_typed(&self) -> Vec<String> {
        std::mem::take(&mut self.typed.lock().unwrap())
    }
}

impl Drop for Played {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The answer to WHERE of an arm that is so, degrees.
pub(crate) fn where_reply(joints: &[f64; 6]) -> String {
    let row = |values: &[f64; 6]| values.map(|value| format!("{value:10.3}")).concat();
    let joints = row(joints);
    format!("\r\n X Y Z O A T\r\n{}\r\n JT1 JT2 JT3 JT4 JT5 JT6\r\n{joints}\r\n. ", row(&[1.0; 6]))
}
