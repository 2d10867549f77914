//! A central database that is reached by TLS, but could be another server.

use plumb_central::{Central, CentralError};

/// Says on standard error what nobody checks of the server; nothing where all is checked, or nothing crosses a network.
///
/// # Errors
/// The address cannot be read, or would send rows unprotected.
pub(crate) fn warn_unchecked(command: &str, address: &str) -> Result<(), CentralError> {
    if let Some(unchecked) = Central::unchecked(address)? {
        eprintln!("plumb {command}: {unchecked}");
    }
    Ok(())
}
