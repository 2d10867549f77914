//! What a host is given when it is started.

use std::path::PathBuf;

use plumb_bus::{Domain, DomainError};
use plumb_plugin::{StreamDescription, Value};
use serde::{Deserialize, Serialize};

use crate::time_limits::WATCHDOG_GRACE;

/// What a host is given when it is started: one line of JSON on its first descriptor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostArguments {
    /// The device's name in the cell file.
    pub device: String,
    /// The prefix of the cell's shared memory.
    pub domain_prefix: String,
    /// The directory of the cell's sockets and locks.
    pub domain_root: PathBuf,
    /// The plugin's manifest.
    pub manifest: PathBuf,
    /// The plugin's library.
    pub library: PathBuf,
    /// The SHA-256 of the library as it was when the run began, in hexadecimal; another one is not loaded. Not looked at when none.
    pub library_sha256: Option<String>,
    /// The device's `config:` in the cell file.
    pub config: Value,
    /// The device's inputs, each wired to another device's stream.
    pub inputs: Vec<WiredInput>,
    /// Ranges narrower than the robot's own, for some joints.
    pub joint_ranges: Vec<JointRange>,
    /// What the program makes its [`MoveGuard`](crate::MoveGuard) from; null for none.
    pub guard: Value,
    /// The file in which the cell's simulated world keeps the cell's clock; none where that is `CLOCK_MONOTONIC`.
    #[serde(default)]
    pub clock: Option<PathBuf>,
    /// How long after its time limit a call may still run before the host ends itself: ms.
    pub watchdog_grace_ms: u64,
    /// The most memory the host's process may take: MB.
    pub memory_limit_mb: u64,
    /// Whether the orchestrator or the host may be held by a debugger: then neither minds that the other is silent, and requests have a day.
    pub under_debugger: bool,
}

/// An input wired to another device's stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WiredInput {
    /// The input's name in the manifest.
    pub input: String,
    /// The device that emits the stream.
    pub device: String,
    /// The stream, as that device's manifest declares it.
    pub stream: StreamDescription,
}

/// A range for a joint, within the robot's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRange {
    /// The joint's name.
    pub joint: String,
    /// The lowest it may go: rad, or mm where the description says so.
    pub lower: f64,
    /// The highest it may go.
    pub upper: f64,
}

/// The most memory a host's process may take unless the cell says otherwise, MB: ten times what the light stripe sensor takes.
pub const MEMORY_LIMIT_MB: u64 = 2048;

impl HostArguments {
    /// A device of a plugin in a domain, with nothing wired and no further limits.
    pub fn new(device: &str, domain: &Domain, plugin: &crate::Plugin) -> Self {
        Self {
            device: device.to_owned(),
            domain_prefix: domain.prefix().to_owned(),
            domain_root: domain.root().to_owned(),
            manifest: plugin.manifest_path.clone(),
            library: plugin.library_path.clone(),
            library_sha256: None,
            config: Value::Null,
            inputs: Vec::new(),
            joint_ranges: Vec::new(),
            guard: Value::Null,
            clock: None,
            watchdog_grace_ms: WATCHDOG_GRACE.as_millis() as u64,
            memory_limit_mb: MEMORY_LIMIT_MB,
            under_debugger: false,
        }
    }

    /// The cell's domain.
    ///
    /// # Errors
    /// As [`Domain::new`].
    pub fn domain(&self) -> Result<Domain, DomainError> {
        Domain::new(&self.domain_prefix, &self.domain_root)
    }
}
