//! A connection to one of the controller's servers.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::time::Duration;

use plumb_plugin::PluginError;

/// How long a controller on the same network may take to take a connection, and to answer.
pub(crate) const ANSWERS_WITHIN: Duration = Duration::from_secs(2);

/// How often a thread that reads looks whether it is still wanted.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// Connects; `what` is the server as people call it.
///
/// # Errors
/// [`PluginError::Disconnected`] with what to check.
pub(crate) fn connect(address: &str, port: u16, what: &str) -> Result<TcpStream, PluginError> {
    let failed = |cause: io::Error| {
        let check = match cause.kind() {
            io::ErrorKind::ConnectionRefused => {
                "nothing listens there: is it the controller, and is this interface enabled in its settings (Security, Services)?"
            }
            io::ErrorKind::TimedOut | io::ErrorKind::HostUnreachable | io::ErrorKind::NetworkUnreachable => {
                "check that the controller is on, its cable and its address"
            }
            _ => "check the address",
        };
        PluginError::Disconnected(format!("{what} of the controller at {address}:{port}: {cause}; {check}"))
    };
    let found: Vec<SocketAddr> = (address, port).to_socket_addrs().map_err(failed)?.collect();
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for one in found {
        match TcpStream::connect_timeout(&one, ANSWERS_WITHIN) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(failed)?;
                stream.set_read_timeout(Some(LOOK)).map_err(failed)?;
                stream.set_write_timeout(Some(ANSWERS_WITHIN)).map_err(failed)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(failed(last))
}

/// What a read found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// So many bytes.
    Bytes(usize),
    /// Nothing yet.
    Nothing,
    /// The controller has ended the connection.
    End,
}

/// Reads what has come, for as long as the read timeout of the connection.
///
/// # Errors
/// What is neither silence nor the controller's end of the connection.
pub(crate) fn hear(stream: &mut TcpStream, bytes: &mut [u8]) -> io::Result<Found> {
    match stream.read(bytes) {
        Ok(0) => Ok(Found::End),
        Ok(count) => Ok(Found::Bytes(count)),
        Err(error) if is_end(&error) => Ok(Found::End),
        Err(error) => match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted => {
                Ok(Found::Nothing)
            }
            _ => Err(error),
        },
    }
}

/// Sends all of this; `ended` is the error where the controller has ended the connection, and `failed` begins any other.
///
/// # Errors
/// [`PluginError::Disconnected`].
pub(crate) fn send(
    stream: &mut TcpStream,
    bytes: &[u8],
    ended: &str,
    failed: &str,
) -> Result<(), PluginError> {
    stream.write_all(bytes).map_err(|error| {
        PluginError::Disconnected(match is_end(&error) {
            true => ended.to_owned(),
            false => format!("{failed}: {error}"),
        })
    })
}

/// Whether the controller has ended the connection.
///
/// One that still had bytes to read resets it instead of closing it (RFC 1122, 4.2.2.13); a write after that fails, too.
fn is_end(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionReset | io::ErrorKind::ConnectionAborted | io::ErrorKind::BrokenPipe
    )
}

#[cfg(test)]
pub(crate) mod tests {
    use std::net::TcpListener;

    use super::*;

    /// A connection that the other side has ended with a byte unread.
    pub(crate) fn reset() -> TcpStream {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut ours = connect("127.0.0.1", listener.local_addr().unwrap().port(), "a test").unwrap();
        let (theirs, _) = listener.accept().unwrap();
        ours.write_all(&[1]).unwrap();
        theirs.peek(&mut [0]).unwrap();
        ours
    }

    #[test]
    fn a_connection_is_ended_whether_it_is_closed_or_reset() {
        let mut bytes = [0; 8];
        assert_eq!(hear(&mut reset(), &mut bytes).unwrap(), Found::End);
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut ours = connect("127.0.0.1", listener.local_addr().unwrap().port(), "a test").unwrap();
        let (mut theirs, _) = listener.accept().unwrap();
        assert_eq!(hear(&mut ours, &mut bytes).unwrap(), Found::Nothing);
        theirs.write_all(&[7, 8]).unwrap();
        assert_eq!(hear(&mut ours, &mut bytes).unwrap(), Found::Bytes(2));
        drop(theirs);
        assert_eq!(hear(&mut ours, &mut bytes).unwrap(), Found::End);
    }

    #[test]
    fn a_write_to_a_connection_that_was_reset_says_that_it_has_ended() {
        let mut ours = reset();
        assert_eq!(
            send(&mut ours, &[2], "ended", "failed"),
            Err(PluginError::Disconnected("ended".to_owned()))
        );
    }
}
