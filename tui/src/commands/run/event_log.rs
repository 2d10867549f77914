//! What happens in a run, written into its log beside what devices and hosts report.

use std::thread;

use plumb_cell::event::{Event, StampedEvent};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// Logs events, and passes each on. Where joints are and how far something has got comes too often to be kept.
pub(super) fn logged(mut events: UnboundedReceiver<StampedEvent>) -> UnboundedReceiver<StampedEvent> {
    let (sender, passed_on) = unbounded_channel();
    thread::spawn(move || {
        while let Some(event) = events.blocking_recv() {
            log(&event);
            // Who listened may have left; the log goes on.
            let _left = sender.send(event);
        }
    });
    passed_on
}

fn log(event: &StampedEvent) {
    match &event.event {
        Event::Joints { .. }
        | Event::Clearance { .. }
        | Event::StepProgress { .. }
        | Event::StripeTaken { .. } => {}
        // Lines of devices come from their hosts already.
        Event::Log { .. } => {}
        other => match serde_json::to_string(other) {
            Ok(text) => tracing::info!(target: "plumb::run", "{text}"),
            Err(error) => tracing::warn!(target: "plumb::run", "an event cannot be written down: {error}"),
        },
    }
}
