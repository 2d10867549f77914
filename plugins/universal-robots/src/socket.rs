//! A connection to one of the controller's servers.

use std::io;
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

/// Whether a read merely found nothing yet.
pub(crate) fn found_nothing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}
