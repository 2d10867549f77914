//! Where the servers listen: the ports of a real controller, on an address of this computer that nobody else uses.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener};

/// Which server of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Server {
    Dashboard,
    Primary,
    Secondary,
    Rtde,
}

/// The ports of a real controller.
pub const SERVERS: [u16; 4] = [29_999, 30_001, 30_002, 30_004];

const KINDS: [Server; 4] = [Server::Dashboard, Server::Primary, Server::Secondary, Server::Rtde];

/// How many addresses are tried.
const TRIES: u32 = 200;

/// Why the servers cannot listen.
#[derive(Debug, thiserror::Error)]
pub enum PortsError {
    /// One of the ports is taken, or the address is not this computer's.
    #[error("a controller cannot listen at {address}: {cause}")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// What the system says.
        cause: io::Error,
    },
}

/// Listens on all four ports of an address; without one, of the first free one of 127.0.0.0/8, which all lead to this computer alone.
pub(super) fn listen(address: Option<IpAddr>) -> Result<(IpAddr, Vec<(Server, TcpListener)>), PortsError> {
    if let Some(address) = address {
        return Ok((address, listen_at(address)?));
    }
    let first = std::process::id().wrapping_mul(7919);
    let mut last = None;
    for number in 0..TRIES {
        let address = IpAddr::V4(own_address(first.wrapping_add(number)));
        match listen_at(address) {
            Ok(listeners) => return Ok((address, listeners)),
            Err(error) => last = Some(error),
        }
    }
    Err(last.unwrap_or_else(|| PortsError::Listen {
        address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        cause: io::ErrorKind::AddrInUse.into(),
    }))
}

/// One of the addresses 127.64.0.1 to 127.127.255.254: apart from 127.0.0.1, where a simulator of the maker's may run.
fn own_address(number: u32) -> Ipv4Addr {
    let last = u8::try_from(number % 254).unwrap_or(0) + 1;
    let third = u8::try_from(number / 254 % 256).unwrap_or(0);
    let second = 64 + u8::try_from(number / (254 * 256) % 64).unwrap_or(0);
    Ipv4Addr::new(127, second, third, last)
}

fn listen_at(address: IpAddr) -> Result<Vec<(Server, TcpListener)>, PortsError> {
    let listen = |(kind, port): (Server, u16)| {
        let address = SocketAddr::new(address, port);
        let bind = || {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            Ok(listener)
        };
        bind().map(|listener| (kind, listener)).map_err(|cause| PortsError::Listen { address, cause })
    };
    KINDS.into_iter().zip(SERVERS).map(listen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_this_computers_own_and_never_the_usual_one() {
        for number in [0, 1, 253, 254, 65_023, 65_024, u32::MAX] {
            let [first, second, _, last] = own_address(number).octets();
            assert!(first == 127 && (64..128).contains(&second) && (1..255).contains(&last));
        }
        assert_ne!(own_address(1), own_address(2));
    }
}
