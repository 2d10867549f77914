//! A connection to the world, as drivers and operators hold it.

use std::io;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plumb_plugin::PluginError;

use crate::lines::{Lines, Received};
use crate::protocol::{Answer, Call, Hello, PROTOCOL, Reading, Response, TruthReport, Welcome, WorldCommand};

/// How often a caller that waits is asked whether it still wants to.
const LOOK: Duration = Duration::from_millis(10);

/// How long the world may be silent where nothing moves.
const PATIENCE: Duration = Duration::from_secs(5);

/// Why the world could not be asked, or would not.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nobody listens there.
    #[error("no world listens at {}: {source}", socket.display())]
    Unreachable {
        /// Where it was looked for.
        socket: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The connection broke.
    #[error("the connection to the world broke: {0}")]
    Broken(#[from] io::Error),
    /// The world ended.
    #[error("the world has gone")]
    Gone,
    /// The world answered with something else than its protocol says.
    #[error("the world answered with what is not its protocol: {0}")]
    Garbled(String),
    /// The world did not answer.
    #[error("the world did not answer within {} s", PATIENCE.as_secs())]
    Silent,
    /// The world would not do what was asked.
    #[error("{0}")]
    Refused(String),
}

/// A connection to the world.
#[derive(Debug)]
pub struct WorldClient {
    lines: Lines,
    welcome: Welcome,
    calls: u64,
}

/// What a plugin in that world says of it.
impl From<ClientError> for PluginError {
    fn from(error: ClientError) -> Self {
        let text = error.to_string();
        match error {
            ClientError::Unreachable { .. } | ClientError::Broken(_) | ClientError::Gone => {
                Self::Disconnected(text)
            }
            ClientError::Silent => Self::TimedOut(text),
            ClientError::Refused(_) => Self::Refused(text),
            ClientError::Garbled(_) => Self::Failed(text),
        }
    }
}

impl WorldClient {
    /// Connects to the world at `socket` and says who calls.
    pub fn connect(socket: &Path, name: &str) -> Result<WorldClient, ClientError> {
        let stream = UnixStream::connect(socket)
            .map_err(|source| ClientError::Unreachable { socket: socket.to_owned(), source })?;
        let mut lines = Lines::over(stream)?;
        lines.send(&Hello { protocol: PROTOCOL, client: name.to_owned() })?;
        let line = patiently(&mut lines)?;
        if let Ok(Answer { response: Response::Refused { why }, .. }) = serde_json::from_slice(&line) {
            return Err(ClientError::Refused(why));
        }
        let welcome =
            serde_json::from_slice(&line).map_err(|error| ClientError::Garbled(error.to_string()))?;
        Ok(WorldClient { lines, welcome, calls: 0 })
    }

    /// What the world said of itself.
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// Makes a call and waits for its end. `on_the_way` hears what happens meanwhile; when `should_stop` turns true, whatever
    /// moves is stopped and the call ends with a reading that says so.
    pub fn call(
        &mut self,
        command: WorldCommand,
        should_stop: impl Fn() -> bool,
        mut on_the_way: impl FnMut(&Response),
    ) -> Result<Response, ClientError> {
        let id = self.send(command)?;
        let mut stop = None;
        let mut heard = Instant::now();
        let mut end = None;
        loop {
            if end.is_none() && stop.is_none() && should_stop() {
                stop = Some(self.send(WorldCommand::Stop {})?);
            }
            let line = match self.lines.receive(LOOK)? {
                Received::Line(line) => line,
                Received::Closed => return Err(ClientError::Gone),
                Received::Nothing if heard.elapsed() > PATIENCE => return Err(ClientError::Silent),
                Received::Nothing => continue,
            };
            heard = Instant::now();
            let answer: Answer =
                serde_json::from_slice(&line).map_err(|error| ClientError::Garbled(error.to_string()))?;
            match answer.response {
                Response::Joints(_) | Response::Change(_) | Response::Pixels { .. } => {
                    on_the_way(&answer.response)
                }
                response if answer.id == id => end = Some(response),
                _ if Some(answer.id) == stop => stop = None,
                other => return Err(ClientError::Garbled(format!("{other:?} for no call of ours"))),
            }
            if let (Some(_), None) = (&end, stop) {
                break;
            }
        }
        match end {
            Some(Response::Refused { why }) => Err(ClientError::Refused(why)),
            Some(response) => Ok(response),
            None => Err(ClientError::Gone),
        }
    }

    /// Makes a call that ends with a reading.
    pub fn read(&mut self, command: WorldCommand) -> Result<Reading, ClientError> {
        match self.call(command, || false, |_| {})? {
            Response::Reading(reading) => Ok(reading),
            other => Err(ClientError::Garbled(format!("{other:?} instead of a reading"))),
        }
    }

    /// Takes a picture with the camera on the hand.
    ///
    /// # Errors
    /// [`ClientError`]; [`ClientError::Garbled`] for a picture that did not come whole.
    pub fn expose(&mut self) -> Result<Exposed, ClientError> {
        let mut pixels = Vec::new();
        let mut whole = true;
        let end = self.call(
            WorldCommand::Expose {},
            || false,
            |response| {
                if let Response::Pixels { hex } = response {
                    whole &= add_pixels(hex, &mut pixels).is_some();
                }
            },
        )?;
        match end {
            Response::Exposed { time_ns, width, height, waiting }
                if whole && pixels.len() == width as usize * height as usize =>
            {
                Ok(Exposed { time_ns, width, height, waiting, pixels })
            }
            other => Err(ClientError::Garbled(format!("{other:?} after {} pixels", pixels.len()))),
        }
    }

    /// What is so.
    pub fn look(&mut self) -> Result<TruthReport, ClientError> {
        match self.call(WorldCommand::Look {}, || false, |_| {})? {
            Response::Truth(truth) => Ok(*truth),
            other => Err(ClientError::Garbled(format!("{other:?} instead of the truth"))),
        }
    }

    fn send(&mut self, command: WorldCommand) -> Result<u64, ClientError> {
        self.calls += 1;
        self.lines.send(&Call { id: self.calls, command })?;
        Ok(self.calls)
    }
}

/// A picture the world took.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exposed {
    /// The middle of the exposure, as the camera says, world time, ns.
    pub time_ns: u64,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How many that the camera took by itself still wait.
    pub waiting: u32,
    /// A row after the other.
    pub pixels: Vec<u8>,
}

/// Adds pixels of two hexadecimal digits each; none when that is not what they are.
fn add_pixels(hex: &str, pixels: &mut Vec<u8>) -> Option<()> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    for pair in hex.as_bytes().chunks(2) {
        let [high, low] = pair else { return None };
        pixels.push((digit(*high)? * 16 + digit(*low)?) as u8);
    }
    Some(())
}

fn patiently(lines: &mut Lines) -> Result<Vec<u8>, ClientError> {
    let began = Instant::now();
    while began.elapsed() < PATIENCE {
        match lines.receive(LOOK)? {
            Received::Line(line) => return Ok(line),
            Received::Closed => return Err(ClientError::Gone),
            Received::Nothing => {}
        }
    }
    Err(ClientError::Silent)
}
