//! A bell between processes: it carries nothing, and it never queues.

use std::fmt;
use std::time::{Duration, Instant};

use iceoryx2::port::listener::Listener as IceoryxListener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::service::port_factory::event::PortFactory;
use iceoryx2_bb_posix::file_descriptor_set::{FileDescriptorSet, FileDescriptorSetWaitError, FileEvent};

use crate::bus::{Service, service_name};
use crate::{Bus, OpenError};

/// How many may ring a bell, how many may hear it, and how many processes may know it.
const MAX_PORTS: usize = 24;

/// The ringing end of a bell.
pub struct Signal {
    name: String,
    port: Notifier<Service>,
}

/// A hearing end of a bell.
pub struct Listener {
    name: String,
    port: IceoryxListener<Service>,
}

/// A bell could not be rung or heard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("signal {name} failed: {cause}")]
pub struct SignalError {
    /// The bell.
    pub name: String,
    /// What the layer below said.
    pub cause: String,
}

impl Signal {
    pub(crate) fn open(bus: &Bus, name: &str) -> Result<Self, OpenError> {
        let what = format!("the ringing end of signal {name}");
        let port =
            service(bus, name)?.notifier_builder().create().map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { name: name.to_owned(), port })
    }

    /// Rings. Rings that nobody has heard yet are heard as one.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub fn ring(&self) -> Result<(), SignalError> {
        self.port.notify().map(|_| ()).map_err(|error| failed(&self.name, &error))
    }
}

impl Listener {
    pub(crate) fn open(bus: &Bus, name: &str) -> Result<Self, OpenError> {
        let what = format!("a hearing end of signal {name}");
        let port =
            service(bus, name)?.listener_builder().create().map_err(|error| OpenError::new(&what, error))?;
        Ok(Self { name: name.to_owned(), port })
    }

    /// Takes in all rings so far without waiting, and tells how many there were.
    ///
    /// # Errors
    /// [`SignalError`] when shared memory failed.
    pub fn drain(&self) -> Result<u64, SignalError> {
        self.port.try_wait(|_| ()).map_err(|error| failed(&self.name, &error))
    }

    /// Waits for a ring, at most for `timeout`, takes in all rings so far, and tells how many there were: 0 when none came.
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

    pub(crate) fn failed(&self, cause: &dyn fmt::Debug) -> SignalError {
        failed(&self.name, cause)
    }
}

/// Waits until one of the bells has been rung, at most for `timeout`. The rings stay to be drained.
///
/// # Errors
/// [`SignalError`] when the system cannot wait on so many.
pub fn wait_any(listeners: &[&Listener], timeout: Duration) -> Result<(), SignalError> {
    let names = || listeners.iter().map(|listener| listener.name.as_str()).collect::<Vec<_>>().join(", ");
    let set = FileDescriptorSet::new();
    let guards: Result<Vec<_>, _> = listeners.iter().map(|listener| set.add(listener.port())).collect();
    let _attached = guards.map_err(|error| failed(&names(), &error))?;
    let end = Instant::now() + timeout;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        match set.timed_wait(left, FileEvent::Read, |_| ()) {
            Err(FileDescriptorSetWaitError::Interrupt) if !left.is_zero() => {}
            Err(FileDescriptorSetWaitError::Interrupt) | Ok(_) => return Ok(()),
            Err(error) => return Err(failed(&names(), &error)),
        }
    }
}

fn service(bus: &Bus, name: &str) -> Result<PortFactory<Service>, OpenError> {
    let what = format!("signal {name}");
    bus.node()
        .service_builder(&service_name(&what, &format!("signal/{name}"))?)
        .event()
        .event_id_max_value(1)
        .max_listeners(MAX_PORTS)
        .max_notifiers(MAX_PORTS)
        .max_nodes(MAX_PORTS)
        .open_or_create()
        .map_err(|error| OpenError::new(&what, error))
}

fn failed(name: &str, cause: &dyn fmt::Debug) -> SignalError {
    SignalError { name: name.to_owned(), cause: format!("{cause:?}") }
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
