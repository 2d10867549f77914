//! Progress and cancellation of long computations.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// A handle shared between a computation and anyone who watches it. Cloning shares it.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    cancelled: AtomicBool,
    permille: AtomicU32,
    doing: Mutex<String>,
}

/// The computation was asked to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

impl Progress {
    /// A handle nobody watches.
    pub fn unwatched() -> Self {
        Self::default()
    }

    /// Asks the computation to end at its next step.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to end.
    pub fn is_cancelled(&self) -> bool {
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Notes how far the computation is (0 to 1) and what it does.
    ///
    /// # Errors
    /// It was asked to end.
    pub fn report(&self, fraction: f64, doing: &str) -> Result<(), Cancelled> {
        self.shared.permille.store((fraction.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
        let mut text = self.shared.doing.lock().unwrap_or_else(PoisonError::into_inner);
        if *text != doing {
            doing.clone_into(&mut text);
        }
        self.check()
    }

    /// Goes on unless asked to end.
    ///
    /// # Errors
    /// It was asked to end.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// How far it is, 0 to 1, and what it does.
    pub fn state(&self) -> (f64, String) {
        let text = self.shared.doing.lock().unwrap_or_else(PoisonError::into_inner).clone();
        (f64::from(self.shared.permille.load(Ordering::Relaxed)) / 1000.0, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anyone_who_watches_sees_how_far_it_is_and_can_end_it() {
        let progress = Progress::default();
        let watched = progress.clone();
        assert_eq!(watched.state(), (0.0, String::new()));
        assert_eq!(progress.report(0.25, "fitting"), Ok(()));
        assert_eq!(watched.state(), (0.25, "fitting".to_owned()));
        assert_eq!(progress.report(1.5, "testing"), Ok(()));
        assert_eq!(watched.state(), (1.0, "testing".to_owned()), "more than all is all");
        assert_eq!(progress.report(-1.0, "testing"), Ok(()));
        assert_eq!(watched.state().0, 0.0);
        watched.cancel();
        assert!(progress.is_cancelled());
        assert_eq!((progress.check(), progress.report(0.5, "on")), (Err(Cancelled), Err(Cancelled)));
        assert!(Progress::unwatched().check().is_ok(), "another is not ended with it");
    }
}
