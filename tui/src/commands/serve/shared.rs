//! What all requests share.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use super::lease::Leases;
use super::state::PageState;
use super::token::Token;

/// The server's own state.
pub(super) struct Shared {
    /// Where the record lies.
    pub(super) directory: PathBuf,
    /// What lets somebody answer; none where the page can only be read.
    pub(super) token: Option<Token>,
    /// Names of this server beside those of the machine itself.
    pub(super) names: Vec<String>,
    leases: Mutex<Leases>,
    /// Held while a picture is drawn.
    pub(super) drawing: tokio::sync::Mutex<()>,
    /// What the page shows now.
    pub(super) state: watch::Receiver<Arc<PageState>>,
}

impl Shared {
    pub(super) fn new(
        directory: PathBuf,
        token: Option<Token>,
        names: Vec<String>,
        state: watch::Receiver<Arc<PageState>>,
    ) -> Self {
        Self {
            directory,
            token,
            names,
            leases: Mutex::default(),
            drawing: tokio::sync::Mutex::default(),
            state,
        }
    }

    /// The lease, for a moment: nobody waits while holding it.
    pub(super) fn leases(&self) -> MutexGuard<'_, Leases> {
        self.leases.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
