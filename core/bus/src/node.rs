//! A process's own node in a domain, on which its ports are made.

use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use iceoryx2::node::{Node as IceoryxNode, NodeBuilder};
use iceoryx2::prelude::{NodeName, ServiceName, SignalHandlingMode};
use iceoryx2::service::builder::Builder;

use crate::limits::check_limits;
use crate::service::{Service, service_name};
use crate::{Domain, OpenError};

/// How long one process waits for another that cleans up after the same dead one.
const CLEANING_TIME: Duration = Duration::from_millis(500);

/// A process's own node in a domain. Cheap to clone; every port holds on to it.
#[derive(Clone)]
pub(crate) struct Node {
    domain: Domain,
    node: Arc<IceoryxNode<Service>>,
}

impl Node {
    /// Opens a domain, and removes what dead processes left behind. `who` names this process to others.
    ///
    /// # Errors
    /// [`OpenError`] when shared memory or the domain's directory cannot be used.
    pub(crate) fn open(domain: &Domain, who: &str) -> Result<Self, OpenError> {
        let what = format!("the bus of '{}'", domain.prefix());
        make_root(domain.root()).map_err(|cause| OpenError::new(&what, cause))?;
        check_limits().map_err(|cause| OpenError::new(&what, cause))?;
        let name = NodeName::new(who).map_err(|error| OpenError::new(&what, error))?;
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

    /// The domain this is a node of.
    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Begins to make the service of a name; `what` is the port it is for, as errors name it.
    pub(crate) fn service(&self, what: &str, name: &str) -> Result<Builder<Service>, OpenError> {
        let name: ServiceName = service_name(what, name)?;
        Ok(self.node.service_builder(&name))
    }

    /// Removes what dead processes left behind.
    pub(crate) fn clean_after_the_dead(&self) {
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
