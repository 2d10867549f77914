//! Takes pictures off the driver's hands, in a thread of its own: a driver has few buffers, and loses what finds none free.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use plumb_plugin::{Host, LogLevel};

use crate::capture::{Capture, CaptureError};
use crate::film::Film;

/// So long the thread waits for a picture before it looks whether it is over.
const LOOK: Duration = Duration::from_millis(100);

/// A camera that is being listened to, until this is dropped.
#[derive(Debug)]
pub(crate) struct Recorder {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    film: Mutex<Film>,
    changed: Condvar,
    is_over: AtomicBool,
}

impl Recorder {
    pub(crate) fn start(capture: Box<dyn Capture>, film: Film, host: Host) -> Self {
        let shared = Arc::new(Shared {
            film: Mutex::new(film),
            changed: Condvar::new(),
            is_over: AtomicBool::new(false),
        });
        let listening = Listening(Arc::clone(&shared));
        let thread = thread::spawn(move || listen(capture, &listening.0, &host));
        Self { shared, thread: Some(thread) }
    }

    pub(crate) fn film(&self) -> MutexGuard<'_, Film> {
        self.shared.film()
    }

    /// Waits until something may have come, `wait` at most.
    pub(crate) fn wait<'f>(&self, film: MutexGuard<'f, Film>, wait: Duration) -> MutexGuard<'f, Film> {
        self.shared.changed.wait_timeout(film, wait).unwrap_or_else(PoisonError::into_inner).0
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has reported so on its film.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn film(&self) -> MutexGuard<'_, Film> {
        self.film.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self, why: &CaptureError) {
        self.film().end(why);
        self.changed.notify_all();
    }
}

/// Reports it when the thread ends by a panic: else a reader would wait for pictures in vain.
struct Listening(Arc<Shared>);

impl Drop for Listening {
    fn drop(&mut self) {
        if thread::panicking() {
            let what = "its driver answered what no driver should; start the device again";
            self.0.end(&CaptureError::System(std::io::Error::other(what)));
        }
    }
}

fn listen(mut capture: Box<dyn Capture>, shared: &Shared, host: &Host) {
    while !shared.is_over.load(Ordering::Acquire) {
        match capture.next(LOOK) {
            Ok(Some(shot)) => {
                shared.film().take(&shot, host.now_ns());
                shared.changed.notify_all();
            }
            Ok(None) => {}
            Err(error) => {
                host.log(LogLevel::Error, &format!("the camera gives no more pictures: {error}"));
                shared.end(&error);
                return;
            }
        }
    }
}
