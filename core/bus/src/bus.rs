//! A process's place on a cell's bus.

use std::fmt;
use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use iceoryx2::node::{Node, NodeBuilder, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, NodeName, ServiceName, SignalHandlingMode, ipc_threadsafe};
use plumb_plugin::StreamDescription;

use crate::limits::check_limits;
use crate::publisher::{signal_name, stream_name};
use crate::request::{reply_signal, request_signal};
use crate::{Client, Domain, Listener, OpenError, Publisher, Server, Signal, StreamShape, Subscriber};

/// The kind of services used throughout: shared memory, and ports that may be handed to another thread.
pub(crate) type Service = ipc_threadsafe::Service;

/// Shared memory is handed out in whole words, so that every message lies aligned to 8.
pub(crate) const WORD: usize = size_of::<u64>();

/// How long one process waits for another that cleans up after the same dead one.
const CLEANING_TIME: Duration = Duration::from_millis(500);

/// A process's place on a cell's bus, from which its ports are made. Cheap to clone.
#[derive(Clone)]
pub struct Bus {
    domain: Domain,
    node: Arc<Node<Service>>,
}

/// A process that uses a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeInUse {
    /// What it called itself, such as `host of arm`.
    pub name: String,
    /// Its process number.
    pub process: u32,
}

impl fmt::Display for NodeInUse {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} (process {})", self.name, self.process)
    }
}

impl Bus {
    /// Opens a domain. `who` names this process to others. What dead processes left behind is removed on the way.
    ///
    /// # Errors
    /// [`OpenError`] when shared memory or the domain's directory cannot be used.
    pub fn open(domain: &Domain, who: &str) -> Result<Self, OpenError> {
        let what = format!("the bus of '{}'", domain.prefix());
        make_root(domain.root()).map_err(|cause| OpenError::new(&what, cause))?;
        check_limits().map_err(|cause| OpenError::new(&what, cause))?;
        let name = NodeName::new(who).map_err(|error| OpenError::new(&what, format!("{error:?}")))?;
        domain.remove_stillborn();
        let node = NodeBuilder::new()
            .name(&name)
            .config(&domain.config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| OpenError::new(&what, error))?;
        restrict(domain);
        Ok(Self { domain: domain.clone(), node: Arc::new(node) })
    }

    /// The domain this is open in.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The processes that use a domain now, this one among them when it does.
    pub fn users(domain: &Domain) -> Vec<NodeInUse> {
        let mut users = Vec::new();
        let Ok(config) = domain.config() else { return users };
        // A domain that cannot be listed has no users: its directory is not there.
        let _ = Node::<Service>::list(&config, |state| {
            if let NodeState::Alive(view) = state {
                let name = view.details().as_ref().map(|details| details.name().to_string());
                let process = view.id().pid::<Service>().map_or(0, |process| process.value().unsigned_abs());
                users.push(NodeInUse { name: name.unwrap_or_else(|| "a process".to_owned()), process });
            }
            CallbackProgression::Continue
        });
        users
    }

    /// Removes what dead processes left behind. Called after a child has ended.
    pub fn clean_after_the_dead(&self) {
        self.domain.remove_stillborn();
        let state = self.node.blocking_cleanup_dead_nodes(CLEANING_TIME);
        if state.cleanups > 0 || state.failed_cleanups > 0 {
            tracing::debug!(
                cleaned = state.cleanups,
                failed = state.failed_cleanups,
                "cleaned up after dead processes"
            );
        }
    }

    /// The sending end of a device's stream.
    ///
    /// # Errors
    /// [`OpenError`], also when the stream exists with another layout or two devices already send on it.
    pub fn publisher(&self, device: &str, stream: &StreamDescription) -> Result<Publisher, OpenError> {
        Publisher::open(self, device, stream, StreamShape::of(stream))
    }

    /// A receiving end of a device's stream; it may be opened before the device sends.
    ///
    /// # Errors
    /// [`OpenError`], also when the stream exists with another layout or has all the receivers it may have.
    pub fn subscriber(&self, device: &str, stream: &StreamDescription) -> Result<Subscriber, OpenError> {
        Subscriber::open(self, device, stream, StreamShape::of(stream))
    }

    /// The bell rung with every message of a device's stream, for who waits for messages; drained before they are received.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn stream_listener(&self, device: &str, stream: &StreamDescription) -> Result<Listener, OpenError> {
        Listener::open(self, &signal_name(&stream_name(device, stream)))
    }

    /// The end of a device that answers requests.
    ///
    /// # Errors
    /// [`OpenError`], also when the device is served already.
    pub fn server(&self, device: &str) -> Result<Server, OpenError> {
        Server::open(self, device)
    }

    /// An end that asks a device.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn client(&self, device: &str) -> Result<Client, OpenError> {
        Client::open(self, device)
    }

    /// The bell a device's host waits on: rung, it looks for something to do.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn request_signal(&self, device: &str) -> Result<Signal, OpenError> {
        Signal::open(self, &request_signal(device))
    }

    /// The bell a device's askers wait on: rung, they look for an answer.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn reply_signal(&self, device: &str) -> Result<Signal, OpenError> {
        Signal::open(self, &reply_signal(device))
    }

    /// The ringing end of a bell; names are shared by the whole domain, such as `stop/arm`.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn signal(&self, name: &str) -> Result<Signal, OpenError> {
        Signal::open(self, name)
    }

    /// A hearing end of a bell.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn listener(&self, name: &str) -> Result<Listener, OpenError> {
        Listener::open(self, name)
    }

    pub(crate) fn node(&self) -> &Node<Service> {
        &self.node
    }
}

/// Makes the directory of a domain's sockets and locks for its owner alone. One that another user has put there in advance is not used.
fn make_root(root: &Path) -> io::Result<()> {
    const OWNER_ONLY: u32 = 0o700;
    fs::DirBuilder::new().recursive(true).mode(OWNER_ONLY).create(root)?;
    let found = fs::symlink_metadata(root)?;
    let wrong = |text: String| Err(io::Error::new(io::ErrorKind::PermissionDenied, text));
    if !found.is_dir() {
        return wrong(format!("{} is no directory", root.display()));
    }
    if found.uid() != fs::metadata("/proc/self")?.uid() {
        return wrong(format!("{} belongs to another user, number {}", root.display(), found.uid()));
    }
    if found.permissions().mode() & 0o077 != 0 {
        fs::set_permissions(root, fs::Permissions::from_mode(OWNER_ONLY))?;
    }
    Ok(())
}

/// Takes the rights of other users away from what the layer below has made for everybody: the piece in which the processes of a domain find each
/// other.
fn restrict(domain: &Domain) {
    for piece in domain.shared_memory() {
        let Ok(found) = fs::metadata(&piece) else { continue };
        let mode = found.permissions().mode();
        if mode & 0o077 != 0 {
            // A piece that has gone meanwhile, or is another user's, is not ours to restrict.
            let _ = fs::set_permissions(&piece, fs::Permissions::from_mode(mode & 0o700));
        }
    }
}

/// The name of a service.
pub(crate) fn service_name(what: &str, name: &str) -> Result<ServiceName, OpenError> {
    ServiceName::new(name).map_err(|error| OpenError::new(what, format!("{error:?}")))
}

impl fmt::Debug for Bus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Bus").field("domain", &self.domain).finish_non_exhaustive()
    }
}
