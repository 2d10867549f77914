//! The processes that use a domain.

use std::fmt;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::CallbackProgression;

use crate::service::Service;

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

/// The processes that use the domain of these settings now, this one among them when it does.
pub(crate) fn nodes_in_use(config: &Config) -> Vec<NodeInUse> {
    let mut users = Vec::new();
    // A domain that cannot be listed has no users: its directory is not there.
    let _ = Node::<Service>::list(config, |state| {
        if let NodeState::Alive(view) = state {
            let name = view.details().as_ref().map(|details| details.name().to_string());
            let process = view.id().pid::<Service>().map_or(0, |process| process.value().unsigned_abs());
            users.push(NodeInUse { name: name.unwrap_or_else(|| "a process".to_owned()), process });
        }
        CallbackProgression::Continue
    });
    users
}
