//! A process's access to a cell's bus.

use std::fmt;

use plumb_plugin::StreamDescription;

use crate::names::{reply_signal, request_signal, stream_name, stream_service_name, stream_signal};
use crate::node::Node;
use crate::node_in_use::nodes_in_use;
use crate::{
    Client, Domain, Listener, NodeInUse, OpenError, Publisher, Server, Signal, StreamShape, Subscriber,
};

/// A process's access to a cell's bus, from which its ports are made. Cheap to clone.
#[derive(Clone)]
pub struct Bus {
    node: Node,
}

impl Bus {
    /// Opens a domain. `who` names this process to others. What dead processes left behind is removed on the way.
    ///
    /// # Errors
    /// [`OpenError`] when shared memory or the domain's directory cannot be used.
    pub fn open(domain: &Domain, who: &str) -> Result<Self, OpenError> {
        Ok(Self { node: Node::open(domain, who)? })
    }

    /// The domain this is open in.
    pub fn domain(&self) -> &Domain {
        self.node.domain()
    }

    /// The processes that use a domain now, this one among them when it does.
    pub fn users(domain: &Domain) -> Vec<NodeInUse> {
        domain.config().map_or_else(|_| Vec::new(), |config| nodes_in_use(&config))
    }

    /// Removes what dead processes left behind. Called after a child has ended.
    pub fn clean_after_the_dead(&self) {
        self.node.clean_after_the_dead();
    }

    /// The sending end of a device's stream.
    ///
    /// # Errors
    /// [`OpenError`], also when the stream exists with another layout or two devices already send on it.
    pub fn publisher(&self, device: &str, stream: &StreamDescription) -> Result<Publisher, OpenError> {
        Publisher::open(&self.node, device, stream, StreamShape::of(stream))
    }

    /// A receiving end of a device's stream; it may be opened before the device sends.
    ///
    /// # Errors
    /// [`OpenError`], also when the stream exists with another layout or has all the receivers it may have.
    pub fn subscriber(&self, device: &str, stream: &StreamDescription) -> Result<Subscriber, OpenError> {
        Subscriber::open(&self.node, device, stream, StreamShape::of(stream))
    }

    /// The name of the service in shared memory on which a stream's messages go, for programs in other languages.
    pub fn stream_service(device: &str, stream: &StreamDescription) -> String {
        stream_service_name(&stream_name(device, stream))
    }

    /// The signal sent with every message of a device's stream, for who waits for messages; drained before they are received.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn stream_listener(&self, device: &str, stream: &StreamDescription) -> Result<Listener, OpenError> {
        Listener::open(&self.node, &stream_signal(&stream_name(device, stream)))
    }

    /// The end of a device that answers requests.
    ///
    /// # Errors
    /// [`OpenError`], also when the device is served already.
    pub fn server(&self, device: &str) -> Result<Server, OpenError> {
        Server::open(&self.node, device)
    }

    /// An end that asks a device.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn client(&self, device: &str) -> Result<Client, OpenError> {
        Client::open(&self.node, device)
    }

    /// The signal a device's host waits for; then it looks for something to do.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn request_signal(&self, device: &str) -> Result<Signal, OpenError> {
        Signal::open(&self.node, &request_signal(device))
    }

    /// The signal a device's clients wait for; then they look for an answer.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn reply_signal(&self, device: &str) -> Result<Signal, OpenError> {
        Signal::open(&self.node, &reply_signal(device))
    }

    /// The sending end of a signal; names are shared by the whole domain, such as `stop/arm`.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn signal(&self, name: &str) -> Result<Signal, OpenError> {
        Signal::open(&self.node, name)
    }

    /// A receiving end of a signal.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn listener(&self, name: &str) -> Result<Listener, OpenError> {
        Listener::open(&self.node, name)
    }
}

impl fmt::Debug for Bus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Bus").field("domain", self.node.domain()).finish_non_exhaustive()
    }
}
