//! A signal between processes: a notification without content that never queues.

use std::fmt;
use std::time::{Duration, Instant};

use iceoryx2::port::listener::Listener as IceoryxListener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::service::port_factory::event::PortFactory;
use iceoryx2_bb_posix::file_descriptor_set::{FileDescriptorSet, FileDescriptorSetWaitError, FileEvent};

use crate::node::Node;
use crate::service::Service;
use crate::{Cause, OpenError};

/// How many may send a signal, how many may listen to it, and how many processes may open it.
const MAX_PORTS: usize = 24;

/// The sending end of a signal.
pub struct Signal {
    name: String,
    port: Notifier<Service>,
}

/// A receiving end of a signal.
pub struct Listener {
    name: String,
    port: IceoryxListener<Service>,
}

/// A signal could not be sent or received.
#[derive(Debug, thiserror::Error)]
#[error("signal {name} failed: {source}")]
pub struct SignalError {
    /// The signal.
    pub name: String,
    /// The error of the layer below.
    pub source: Cause,
}

impl Signal {
    pub(crate) fn open(node: &Node, name: &str) -> Result<Self, OpenError> {
        let what = format!("the sending end of signal {name}");
        let port =
            service(node, name)?.notifier_builder().create().map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { name: name.to_owned(), port })
    }

    /// Notifies the listeners. Notifications that were not yet received count as one.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub fn notify(&self) -> Result<(), SignalError> {
        self.port.notify().map(|_| ()).map_err(|error| failed(&self.name, error))
    }
}

impl Listener {
    pub(crate) fn open(node: &Node, name: &str) -> Result<Self, OpenError> {
        let what = format!("a receiving end of signal {name}");
        let port =
            service(node, name)?.listener_builder().create().map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { name: name.to_owned(), port })
    }

    /// Takes all notifications so far without waiting, and returns how many there were.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub fn drain(&self) -> Result<u64, SignalError> {
        self.port.try_wait(|_| ()).map_err(|error| failed(&self.name, error))
    }

    /// Waits for a notification, at most for `timeout`, takes all so far, and returns how many there were: 0 when none came.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub fn wait(&self, timeout: Duration) -> Result<u64, SignalError> {
        wait_any(&[self], timeout)?;
        self.drain()
    }

    pub(crate) fn port(&self) -> &IceoryxListener<Service> {
        &self.port
    }

    pub(crate) fn failed(&self, cause: impl Into<Cause>) -> SignalError {
        failed(&self.name, cause)
    }
}

/// Waits until one of the signals was sent, at most for `timeout`. The notifications stay to be drained.
///
/// # Errors
/// [`SignalError`] when the system cannot wait on so many.
pub fn wait_any(listeners: &[&Listener], timeout: Duration) -> Result<(), SignalError> {
    let names = || listeners.iter().map(|listener| listener.name.as_str()).collect::<Vec<_>>().join(", ");
    let set = FileDescriptorSet::new();
    let guards: Result<Vec<_>, _> = listeners.iter().map(|listener| set.add(listener.port())).collect();
    let _attached = guards.map_err(|error| failed(&names(), format!("{error:?}")))?;
    let end = Instant::now() + timeout;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        match set.timed_wait(left, FileEvent::Read, |_| ()) {
            Err(FileDescriptorSetWaitError::Interrupt) if !left.is_zero() => {}
            Err(FileDescriptorSetWaitError::Interrupt) | Ok(_) => return Ok(()),
            Err(error) => return Err(failed(&names(), format!("{error:?}"))),
        }
    }
}

fn service(node: &Node, name: &str) -> Result<PortFactory<Service>, OpenError> {
    let what = format!("signal {name}");
    node.service(&what, &format!("signal/{name}"))?
        .event()
        .event_id_max_value(1)
        .max_listeners(MAX_PORTS)
        .max_notifiers(MAX_PORTS)
        .max_nodes(MAX_PORTS)
        .open_or_create()
        .map_err(|error| OpenError::new(&what, error))
}

fn failed(name: &str, source: impl Into<Cause>) -> SignalError {
    SignalError { name: name.to_owned(), source: source.into() }
}

impl fmt::Debug for Signal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Signal").field(&self.name).finish()
    }
}

impl fmt::Debug for Listener {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Listener").field(&self.name).finish()
    }
}
