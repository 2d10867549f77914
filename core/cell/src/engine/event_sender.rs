//! Where events leave the engine.

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::mpsc::UnboundedSender;

use crate::event::{Event, StampedEvent};

/// Stamps events and sends them to anyone who watches; events of several threads keep one sequence.
#[derive(Clone)]
pub struct EventSender {
    next: Arc<Mutex<u64>>,
    watcher: UnboundedSender<StampedEvent>,
}

impl EventSender {
    /// Sends to this channel; what is sent when nobody listens any more is dropped.
    pub fn new(watcher: UnboundedSender<StampedEvent>) -> Self {
        Self { next: Arc::new(Mutex::new(1)), watcher }
    }

    /// Sends an event.
    pub fn send(&self, event: Event) {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let time = plumb_record::timestamp();
        let _ = self.watcher.send(StampedEvent { sequence: *next, time, event });
        *next += 1;
    }
}
