//! One connection to a server of the controller: what was sent on it, and what is on its way out.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use super::controller::Controller;
use super::ports::Server;
use super::rtde::RtdeSession;
use super::{dashboard, primary, script};
use crate::physics::random::Random;

/// A client that has so many bytes waiting reads nothing: it is left alone.
const MOST_WAITING: usize = 1 << 20;

/// The longest text that is no program yet, bytes.
const LONGEST_PROGRAM: usize = 1 << 16;

/// The fraction of packages that come in two pieces, as they may on any network.
const IN_TWO_PIECES: f64 = 0.05;

/// What is wrong with the connection.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trouble {
    /// States repeat the last one.
    pub(super) frozen: bool,
    /// No states.
    pub(super) silent: bool,
    /// States come so much later.
    pub(super) late: Duration,
    /// The next state is cut off.
    pub(super) cut: bool,
}

/// What is spoken on a connection.
#[derive(Debug)]
enum Speaks {
    Dashboard,
    Scripts,
    Rtde(Box<RtdeSession>),
}

/// A connection.
#[derive(Debug)]
pub(super) struct Client {
    stream: TcpStream,
    speaks: Speaks,
    heard: Vec<u8>,
    out: VecDeque<(Instant, Vec<u8>)>,
    last_state: Vec<u8>,
    pub(super) ended: bool,
}

impl Client {
    pub(super) fn greet(stream: TcpStream, server: Server, controller: &Controller, protocol: u16) -> Self {
        // Without these it works as well, slower and with a wait for every read.
        let _ = stream.set_nodelay(true);
        let blocking = stream.set_nonblocking(true).is_err();
        let speaks = match server {
            Server::Dashboard => Speaks::Dashboard,
            Server::Primary | Server::Secondary => Speaks::Scripts,
            Server::Rtde => Speaks::Rtde(Box::new(RtdeSession::new(protocol))),
        };
        let mut client = Self {
            stream,
            speaks,
            heard: Vec::new(),
            out: VecDeque::new(),
            last_state: Vec::new(),
            ended: blocking,
        };
        match client.speaks {
            Speaks::Dashboard => client.send(dashboard::GREETING.into()),
            Speaks::Scripts => client.send(primary::version(controller)),
            Speaks::Rtde(_) => {}
        }
        client
    }

    pub(super) fn wait_on(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }

    /// The registers this client writes.
    pub(super) fn claimed(&self) -> Vec<usize> {
        match &self.speaks {
            Speaks::Rtde(session) => session.claimed().collect(),
            _ => Vec::new(),
        }
    }

    /// Takes what was sent, and answers.
    pub(super) fn hear(&mut self, controller: &mut Controller, claimed_by_others: &[usize]) {
        let mut bytes = [0; 4096];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => self.ended = true,
                Ok(count) => {
                    self.understand(bytes.get(..count).unwrap_or_default(), controller, claimed_by_others);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Err(_) => self.ended = true,
            }
            if self.ended {
                return;
            }
        }
    }

    fn understand(&mut self, bytes: &[u8], controller: &mut Controller, claimed_by_others: &[usize]) {
        let reported = match &mut self.speaks {
            Speaks::Rtde(session) => match session.hear(bytes, controller, claimed_by_others) {
                Some(reported) => reported,
                None => {
                    self.ended = true;
                    return;
                }
            },
            Speaks::Scripts => {
                self.heard.extend(bytes);
                while let Some(program) = script::take_program(&mut self.heard) {
                    controller.load(&program);
                }
                Vec::new()
            }
            Speaks::Dashboard => {
                self.heard.extend(bytes);
                let mut reported = String::new();
                while let Some(end) = self.heard.iter().position(|byte| *byte == b'\n') {
                    let line: Vec<u8> = self.heard.drain(..=end).collect();
                    reported += &dashboard::answer(controller, &String::from_utf8_lossy(&line));
                }
                reported.into()
            }
        };
        self.ended |= self.heard.len() > LONGEST_PROGRAM;
        self.send(reported);
    }

    /// Reports how the robot is, if it is time; `slow` where the slower interfaces are due.
    pub(super) fn send_state(&mut self, controller: &Controller, trouble: &Trouble, slow: bool) {
        match &mut self.speaks {
            Speaks::Dashboard => {}
            Speaks::Scripts if slow => self.send(primary::state(controller)),
            Speaks::Scripts => {}
            Speaks::Rtde(session) => {
                let Some(state) = session.state(controller) else { return };
                if trouble.silent {
                    return;
                }
                if !trouble.frozen || self.last_state.is_empty() {
                    self.last_state = state;
                }
                let mut state = self.last_state.clone();
                if trouble.cut {
                    state.truncate(state.len() / 2);
                }
                self.out.push_back((Instant::now() + trouble.late, state));
            }
        }
    }

    /// Reports an error or a text to those who hear about them.
    pub(super) fn send_message(&mut self, message: &[u8]) {
        if matches!(self.speaks, Speaks::Scripts) {
            self.send(message.to_vec());
        }
    }

    /// Whether states are reported on it.
    pub(super) fn sends_states(&self) -> bool {
        matches!(self.speaks, Speaks::Rtde(_))
    }

    fn send(&mut self, bytes: Vec<u8>) {
        if !bytes.is_empty() {
            self.out.push_back((Instant::now(), bytes));
        }
    }

    /// Sends what is due.
    pub(super) fn flush(&mut self, random: &mut Random) {
        while let Some((due, bytes)) = self.out.front_mut() {
            if *due > Instant::now() || self.ended {
                break;
            }
            let length = bytes.len();
            let piece = if random.chance(IN_TWO_PIECES) { length.div_ceil(2) } else { length };
            match self.stream.write(bytes.get(..piece).unwrap_or(bytes)) {
                Ok(count) if count >= length => drop(self.out.pop_front()),
                Ok(count) => drop(bytes.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => self.ended = true,
            }
        }
        let waiting: usize = self.out.iter().map(|(_, bytes)| bytes.len()).sum();
        self.ended |= waiting > MOST_WAITING;
    }
}
