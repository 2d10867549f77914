//! The one place where the bus's events become tokio's, and the only unsafe code of this crate: both sides ask for it where a file
//! descriptor changes hands.

#![allow(unsafe_code, reason = "a file descriptor is handed from the bus to tokio")]

use std::fmt;
use std::os::fd::{AsRawFd, RawFd};

use iceoryx2::prelude::FileDescriptorBased;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use crate::{Listener, SignalError};

/// A [`Listener`] to await in tokio.
pub struct AsyncListener {
    readiness: AsyncFd<Registered>,
}

struct Registered(Listener);

impl AsRawFd for Registered {
    fn as_raw_fd(&self) -> RawFd {
        // SAFETY: tokio keeps the number no longer than the listener, and neither closes nor replaces what it represents.
        unsafe { self.0.port().file_descriptor().native_handle() }
    }
}

impl AsyncListener {
    /// Takes over a listener. Called within a tokio runtime.
    ///
    /// # Errors
    /// [`SignalError`] when the reactor does not take the descriptor.
    pub fn new(listener: Listener) -> Result<Self, SignalError> {
        // SAFETY: the listener owns the descriptor, never replaces it, and goes into the registration, which ends first.
        let registered = unsafe { AsyncFd::register_with_interest(Registered(listener), Interest::READABLE) };
        let readiness = registered.map_err(|error| {
            let (Registered(listener), cause) = error.into_parts();
            listener.failed(cause)
        })?;
        Ok(Self { readiness })
    }

    /// Waits for a notification, takes all so far, and returns how many there were: at least 1. May be dropped without losing one.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub async fn notified(&self) -> Result<u64, SignalError> {
        let listener = &self.readiness.get_ref().0;
        loop {
            let mut ready = self.readiness.readable().await.map_err(|error| listener.failed(error))?;
            // Cleared before draining: a notification that comes in between makes the descriptor ready again.
            ready.clear_ready();
            let count = listener.drain()?;
            if count > 0 {
                return Ok(count);
            }
        }
    }
}

impl fmt::Debug for AsyncListener {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("AsyncListener").field(&self.readiness.get_ref().0).finish()
    }
}
