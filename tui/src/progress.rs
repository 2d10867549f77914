//! A line on standard error while something long goes on.

use std::io::{self, IsTerminal as _, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use plumb_estimation::Progress;

/// What takes less is over before a line could be read.
const SHOWN_AFTER: Duration = Duration::from_millis(500);

/// Runs `work`, reporting on a terminal what it does from half a second on.
pub fn watched<T>(work: impl FnOnce(&Progress) -> T) -> T {
    let progress = Progress::unwatched();
    if !io::stderr().is_terminal() {
        return work(&progress);
    }
    let done = Arc::new(AtomicBool::new(false));
    let watcher = {
        let (progress, done) = (progress.clone(), Arc::clone(&done));
        thread::spawn(move || watch(&progress, &done))
    };
    let outcome = work(&progress);
    done.store(true, Ordering::Relaxed);
    let _ = watcher.join();
    outcome
}

fn watch(progress: &Progress, done: &AtomicBool) {
    let start = Instant::now();
    let mut shown = false;
    while !done.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_millis(50));
        if start.elapsed() > SHOWN_AFTER {
            let (fraction, doing) = progress.state();
            eprint!("\r\x1b[K{:3.0} % {doing}", fraction * 100.0);
            let _ = io::stderr().flush();
            shown = true;
        }
    }
    if shown {
        eprint!("\r\x1b[K");
    }
}
