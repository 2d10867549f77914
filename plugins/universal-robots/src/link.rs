//! The RTDE connection: agreed once, then read all the time by a thread of its own, so that what is asked for is never an old state that waited in a buffer.

use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_plugin::PluginError;

use crate::freshness::ClockOffset;
use crate::rtde::{self, Kind, Packages, RtdeError, State};
use crate::socket::{ANSWERS_WITHIN, Found, connect, hear, send};

/// The error once the controller has ended this connection, whether a read or a write finds it.
const ENDED: &str = "the controller has ended the RTDE connection";

/// States a second: what every generation of controllers can send.
const STATES_HZ: f64 = 125.0;

/// A state, and when it was true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Received {
    pub(crate) state: State,
    /// Counts the states from 1.
    pub(crate) number: u64,
    pub(crate) arrived: Instant,
    /// When it was true, s since the link began.
    true_at: f64,
    origin: Instant,
}

impl Received {
    /// How old it is.
    pub(crate) fn age(&self) -> Duration {
        let age = self.origin.elapsed().as_secs_f64() - self.true_at;
        Duration::try_from_secs_f64(age).unwrap_or(Duration::ZERO)
    }
}

/// The connection.
#[derive(Debug)]
pub(crate) struct Link {
    stream: TcpStream,
    /// Major, minor, bugfix, build of the controller's software.
    pub(crate) version: [u32; 4],
    input_recipe: u8,
    signs_of_life: SignsOfLife,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    closing: AtomicBool,
    book: Mutex<Book>,
    news: Condvar,
}

#[derive(Debug, Default)]
struct Book {
    latest: Option<Received>,
    ended: Option<String>,
    texts: Vec<String>,
}

/// The times between signs of life.
#[derive(Debug, Default)]
struct SignsOfLife {
    last: Option<Instant>,
    longest: Duration,
}

impl SignsOfLife {
    fn note(&mut self, now: Instant) {
        let since = self.last.map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        self.longest = self.longest.max(since);
        self.last = Some(now);
    }
}

/// As many texts of the controller's are kept until somebody looks.
const MOST_TEXTS: usize = 100;

impl Link {
    /// Connects, agrees on a version and on what states and inputs hold, and begins.
    ///
    /// # Errors
    /// [`PluginError::Disconnected`], [`PluginError::TimedOut`]; [`PluginError::Failed`] for a controller that does not agree.
    pub(crate) fn connect(address: &str, port: u16, first_register: u8) -> Result<Self, PluginError> {
        let stream = connect(address, port, "RTDE")?;
        let mut agreeing =
            Agreeing { stream, packages: Packages::default(), address: format!("{address}:{port}") };
        agreeing.version()?;
        let version = agreeing.controller_version()?;
        let output_recipe = agreeing.outputs(first_register)?;
        let input_recipe = agreeing.inputs(first_register)?;
        agreeing.start()?;
        let Agreeing { stream, packages, .. } = agreeing;
        let mut reading = stream.try_clone()?;
        let shared = Arc::new(Shared::default());
        let noted = Arc::clone(&shared);
        let thread = std::thread::spawn(move || noted.listen(&mut reading, packages, output_recipe));
        let signs_of_life = SignsOfLife::default();
        Ok(Self { stream, version, input_recipe, signs_of_life, shared, thread: Some(thread) })
    }

    /// A state with a higher number than `after`, if one comes within a time.
    ///
    /// # Errors
    /// [`PluginError::Disconnected`] once the connection has ended.
    pub(crate) fn newer(&self, after: u64, within: Duration) -> Result<Option<Received>, PluginError> {
        let end = Instant::now() + within;
        let mut book = self.shared.book();
        loop {
            if let Some(latest) = book.latest.filter(|latest| latest.number > after) {
                return Ok(Some(latest));
            }
            if let Some(ended) = &book.ended {
                return Err(PluginError::Disconnected(ended.clone()));
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            book = self.shared.news.wait_timeout(book, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The last state that has come, if any has.
    pub(crate) fn latest(&self) -> Option<Received> {
        self.shared.book().latest
    }

    /// What the controller has said since this was asked last.
    pub(crate) fn take_texts(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.book().texts)
    }

    /// Why the connection has ended, if it has.
    pub(crate) fn ended(&self) -> Option<String> {
        self.shared.book().ended.clone()
    }

    /// Begins anew to measure how long the controller waits for a sign of life.
    pub(crate) fn begin_signs_of_life(&mut self) {
        self.signs_of_life = SignsOfLife::default();
    }

    /// The longest time from one sign of life to the next since they began.
    pub(crate) fn longest_silence(&self) -> Duration {
        self.signs_of_life.longest
    }

    /// Gives the controller a sign of life.
    ///
    /// # Errors
    /// [`PluginError::Disconnected`].
    pub(crate) fn sign_of_life(&mut self, value: i32) -> Result<(), PluginError> {
        self.signs_of_life.note(Instant::now());
        let package = rtde::integer_input(self.input_recipe, value);
        send(&mut self.stream, &package, ENDED, "RTDE: nothing can be sent to the controller")
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It has panicked or ended: either way it reads no more.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads until the connection ends or is wanted no more.
    fn listen(&self, stream: &mut TcpStream, mut packages: Packages, recipe: u8) {
        let origin = Instant::now();
        let mut clock = ClockOffset::new(origin);
        let mut bytes = [0; 8192];
        while !self.closing.load(Ordering::Acquire) {
            let end = match hear(stream, &mut bytes) {
                Ok(Found::Nothing) => None,
                Ok(Found::End) => Some(ENDED.to_owned()),
                Ok(Found::Bytes(count)) => {
                    packages.push(bytes.get(..count).unwrap_or_default());
                    self.note_all(&mut packages, recipe, &mut clock, origin).err()
                }
                Err(error) => Some(format!("the RTDE connection broke: {error}")),
            };
            if let Some(end) = end {
                self.book().ended = Some(end);
                self.news.notify_all();
                return;
            }
        }
    }

    fn note_all(
        &self,
        packages: &mut Packages,
        recipe: u8,
        clock: &mut ClockOffset,
        origin: Instant,
    ) -> Result<(), String> {
        let wrong = |error: RtdeError| format!("the RTDE connection is not used any more: {error}");
        while let Some((kind, body)) = packages.take().map_err(wrong)? {
            match kind {
                Kind::Data => {
                    let state = State::read(recipe, &body).map_err(wrong)?;
                    let arrived = Instant::now();
                    let true_at = clock.arrived(state.timestamp, arrived).map_err(|back| {
                        format!("the controller's clock went back by {:.1} s: it was started anew", back.by)
                    })?;
                    let mut book = self.book();
                    let number = book.latest.map_or(0, |latest| latest.number) + 1;
                    book.latest = Some(Received { state, number, arrived, true_at, origin });
                }
                Kind::Text => {
                    let mut book = self.book();
                    if book.texts.len() < MOST_TEXTS {
                        book.texts.push(rtde::text(&body));
                    }
                }
                // Answers to what is asked only while agreeing.
                _ => {}
            }
        }
        self.news.notify_all();
        Ok(())
    }
}

/// The first exchange.
struct Agreeing {
    stream: TcpStream,
    packages: Packages,
    address: String,
}

impl Agreeing {
    fn ask(&mut self, kind: Kind, package: &[u8]) -> Result<Vec<u8>, PluginError> {
        let ended = format!("RTDE at {}: the controller has ended the connection", self.address);
        let failed = format!("RTDE at {}: nothing can be sent to the controller", self.address);
        send(&mut self.stream, package, &ended, &failed)?;
        let begin = Instant::now();
        let mut bytes = [0; 4096];
        loop {
            while let Some((found, body)) = self.packages.take().map_err(|error| self.failed(&error))? {
                if found == kind {
                    return Ok(body);
                }
            }
            if begin.elapsed() > ANSWERS_WITHIN {
                return Err(PluginError::TimedOut(format!(
                    "RTDE at {}: no answer to '{}' within {} s",
                    self.address,
                    char::from(kind as u8),
                    ANSWERS_WITHIN.as_secs()
                )));
            }
            match hear(&mut self.stream, &mut bytes)? {
                Found::Nothing => {}
                Found::End => {
                    return Err(PluginError::Disconnected(format!(
                        "RTDE at {}: the controller has ended the connection while it was asked for '{}'",
                        self.address,
                        char::from(kind as u8)
                    )));
                }
                Found::Bytes(count) => self.packages.push(bytes.get(..count).unwrap_or_default()),
            }
        }
    }

    fn failed(&self, error: &dyn std::fmt::Display) -> PluginError {
        PluginError::Failed(format!("RTDE at {}: {error}", self.address))
    }

    fn version(&mut self) -> Result<(), PluginError> {
        let body = self.ask(Kind::RequestVersion, &rtde::request_version())?;
        match rtde::accepted(Kind::RequestVersion, &body).map_err(|error| self.failed(&error))? {
            true => Ok(()),
            false => Err(self.failed(&format!(
                "the controller does not speak version {} of the protocol: update its software to 3.4 or later (CB3), any 5.x has it",
                rtde::VERSION
            ))),
        }
    }

    fn controller_version(&mut self) -> Result<[u32; 4], PluginError> {
        let body = self.ask(Kind::ControllerVersion, &rtde::package(Kind::ControllerVersion, &[]))?;
        rtde::controller_version(&body).map_err(|error| self.failed(&error))
    }

    fn outputs(&mut self, first_register: u8) -> Result<u8, PluginError> {
        let outputs = rtde::outputs(first_register);
        let names: Vec<String> = outputs.iter().map(|(name, _)| name.clone()).collect();
        let body = self.ask(Kind::SetUpOutputs, &rtde::set_up_outputs(STATES_HZ, &names))?;
        let (recipe, types) = rtde::recipe(Kind::SetUpOutputs, &body).map_err(|error| self.failed(&error))?;
        for (index, (name, requested)) in outputs.iter().enumerate() {
            let found = types.get(index).map_or("nothing", String::as_str);
            if found != *requested {
                return Err(self.failed(&format!(
                    "the controller sends `{name}` as {found}, not {requested}: its software is of another version than this driver knows"
                )));
            }
        }
        Ok(recipe)
    }

    fn inputs(&mut self, first_register: u8) -> Result<u8, PluginError> {
        let name = format!("input_int_register_{first_register}");
        let body = self.ask(Kind::SetUpInputs, &rtde::set_up_inputs(std::slice::from_ref(&name)))?;
        let (recipe, types) = rtde::recipe(Kind::SetUpInputs, &body).map_err(|error| self.failed(&error))?;
        match types.first().map(String::as_str) {
            Some("INT32") => Ok(recipe),
            Some("IN_USE") => Err(self.failed(&format!(
                "another program writes `{name}` of this controller: end it, or give this driver another `first_register`"
            ))),
            other => Err(self.failed(&format!(
                "the controller takes `{name}` as {}, not INT32",
                other.unwrap_or("nothing")
            ))),
        }
    }

    fn start(&mut self) -> Result<(), PluginError> {
        let body = self.ask(Kind::Start, &rtde::package(Kind::Start, &[]))?;
        match rtde::accepted(Kind::Start, &body).map_err(|error| self.failed(&error))? {
            true => Ok(()),
            false => Err(self.failed(&"the controller does not begin to send states")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_by_the_controller_is_its_end_of_the_connection() {
        let shared = Shared::default();
        shared.listen(&mut crate::socket::tests::reset(), Packages::default(), 1);
        assert_eq!(shared.book().ended.as_deref(), Some(ENDED));
    }
}
