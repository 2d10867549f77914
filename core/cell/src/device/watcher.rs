//! Watches where a robot's joints are while it moves, on the robot's own stream.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use plumb_bus::{Bus, OpenError};
use plumb_plugin::{JointState, StreamDescription};

/// Called with each pose, at most twenty times a second.
pub type PoseListener = Box<dyn Fn(&JointState) + Send>;

/// Shortest time between two reported poses.
const PAUSE: Duration = Duration::from_millis(50);

/// A thread that listens to a robot's `joints` stream; ends when dropped.
pub(super) struct JointWatcher {
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl JointWatcher {
    pub(super) fn start(
        bus: &Bus,
        device: &str,
        stream: &StreamDescription,
        listener: PoseListener,
    ) -> Result<Self, OpenError> {
        let mut subscriber = bus.subscriber(device, stream)?;
        let signal = bus.stream_listener(device, stream)?;
        let ended = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&ended);
        let thread = std::thread::spawn(move || {
            let mut reported: Option<Instant> = None;
            while !end.load(Ordering::Relaxed) {
                if signal.wait(Duration::from_millis(100)).is_err() {
                    return;
                }
                let mut last = None;
                // Messages that were passed over are of no interest here: only the newest pose is shown.
                loop {
                    match subscriber.receive::<JointState>() {
                        Ok(Some(state)) => last = Some(state),
                        Ok(None) => break,
                        Err(_) => {}
                    }
                }
                let is_due = reported.is_none_or(|at| at.elapsed() >= PAUSE);
                if let Some(state) = last.filter(|state| !state.is_moving() || is_due) {
                    listener(&state);
                    reported = Some(Instant::now());
                }
            }
        });
        Ok(Self { ended, thread: Some(thread) })
    }
}

impl Drop for JointWatcher {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use plumb_bus::Domain;
    use plumb_plugin::JointVector;

    use super::*;

    #[test]
    fn where_a_robot_comes_to_rest_is_shown_however_soon_after_the_last_pose() {
        let directory = tempfile::tempdir().unwrap();
        let domain = Domain::of_cell(&directory.path().join("cell.yaml")).unwrap();
        let bus = Bus::open(&domain, "test").unwrap();
        let stream = StreamDescription::of::<JointState>("joints");
        let mut sender = bus.publisher("arm", &stream).unwrap();
        let (shown, showing) = channel();
        let listener = move |state: &JointState| {
            let _ = shown.send((state.time_ns, state.is_moving()));
        };
        let watcher = JointWatcher::start(&bus, "arm", &stream, Box::new(listener)).unwrap();
        let long = Duration::from_secs(20);
        for (time_ns, moving) in [(1, true), (2, false), (3, false)] {
            let state = JointState::new(time_ns, JointVector::zeros(6), moving);
            sender.emit(bytemuck::bytes_of(&state)).unwrap();
            assert_eq!(showing.recv_timeout(long), Ok((time_ns, moving)));
        }
        drop(watcher);
        assert!(showing.recv_timeout(long).is_err(), "it ends with its watcher");
        drop((sender, bus));
        domain.remove().unwrap();
    }
}
