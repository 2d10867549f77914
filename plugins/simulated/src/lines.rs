//! JSON lines over a Unix-domain socket, for both ends of it.

use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use serde::Serialize;

use crate::protocol::LONGEST_LINE;

/// A peer that does not take its lines for this long is taken for gone.
const WRITE_PATIENCE: Duration = Duration::from_secs(5);

/// One end of a connection.
#[derive(Debug)]
pub(crate) struct Lines {
    stream: UnixStream,
    received: Vec<u8>,
}

/// What came within the time given.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// A whole line, without its end.
    Line(Vec<u8>),
    /// Nothing, or not a whole line yet.
    Nothing,
    /// The peer has gone.
    Closed,
}

impl Lines {
    pub(crate) fn over(stream: UnixStream) -> io::Result<Lines> {
        stream.set_nonblocking(false)?;
        stream.set_write_timeout(Some(WRITE_PATIENCE))?;
        Ok(Lines { stream, received: Vec::new() })
    }

    /// Sends a value as a line.
    pub(crate) fn send(&mut self, value: &impl Serialize) -> io::Result<()> {
        let mut line = serde_json::to_vec(value)?;
        line.push(b'\n');
        self.stream.write_all(&line)
    }

    /// The next line, if it comes within `patience`.
    pub(crate) fn receive(&mut self, patience: Duration) -> io::Result<Received> {
        if let Some(line) = self.take_line() {
            return Ok(Received::Line(line));
        }
        self.stream.set_read_timeout(Some(patience.max(Duration::from_millis(1))))?;
        let mut block = [0; 65536];
        match self.stream.read(&mut block) {
            Ok(0) => return Ok(Received::Closed),
            Ok(length) => self.received.extend_from_slice(block.get(..length).unwrap_or_default()),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) => {}
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
                return Ok(Received::Closed);
            }
            Err(error) => return Err(error),
        }
        if self.received.len() > LONGEST_LINE && !self.received.contains(&b'\n') {
            return Err(io::Error::new(
                ErrorKind::InvalidData,
                format!("a line is longer than {LONGEST_LINE} bytes"),
            ));
        }
        Ok(self.take_line().map_or(Received::Nothing, Received::Line))
    }

    fn take_line(&mut self) -> Option<Vec<u8>> {
        let end = self.received.iter().position(|byte| *byte == b'\n')?;
        let mut line: Vec<u8> = self.received.drain(..=end).collect();
        line.pop();
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_millis(20);

    #[test]
    fn lines_come_whole_however_they_were_cut() {
        let (mut here, there) = UnixStream::pair().unwrap();
        let mut lines = Lines::over(there).unwrap();
        here.write_all(b"{\"a\":").unwrap();
        assert_eq!(lines.receive(SOON).unwrap(), Received::Nothing);
        here.write_all(b"1}\n{}\n").unwrap();
        assert_eq!(lines.receive(SOON).unwrap(), Received::Line(b"{\"a\":1}".to_vec()));
        assert_eq!(lines.receive(SOON).unwrap(), Received::Line(b"{}".to_vec()));
        drop(here);
        assert_eq!(lines.receive(SOON).unwrap(), Received::Closed);
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let (mut here, there) = UnixStream::pair().unwrap();
        let mut lines = Lines::over(there).unwrap();
        let writer = std::thread::spawn(move || {
            let _ = here.write_all(&vec![b'x'; 2 * LONGEST_LINE]);
        });
        let error = loop {
            match lines.receive(SOON) {
                Ok(Received::Nothing) => {}
                Ok(other) => panic!("{other:?}"),
                Err(error) => break error,
            }
        };
        assert_eq!(error.to_string(), "a line is longer than 65536 bytes");
        drop(lines);
        writer.join().unwrap();
    }
}
