//! The line from a watcher to a running engine.

use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};

use crate::command::{Command, PauseWhen};

/// Something that stops one robot at once, from any thread, without waiting for the engine or for a call in progress.
pub type StopAction = Box<dyn Fn() + Send + Sync>;

/// The robots of a run that can be stopped; shared between the engine, which fills it, and every handle.
#[derive(Clone, Default)]
pub struct StopActions(Arc<Mutex<Vec<(String, StopAction)>>>);

impl StopActions {
    /// Sets how `device` is stopped, in place of what was set for it before.
    pub fn set(&self, device: &str, action: StopAction) {
        let mut actions = self.lock();
        actions.retain(|(name, _)| name != device);
        actions.push((device.to_owned(), action));
    }

    /// Forgets all robots: they were shut down.
    pub fn clear(&self) {
        self.lock().clear();
    }

    /// Stops every robot.
    pub fn fire(&self) {
        for (_, action) in self.lock().iter() {
            action();
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<(String, StopAction)>> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// Sends commands to a run. Cloned freely; works from any thread and from async code, and never blocks.
#[derive(Clone)]
pub struct RunHandle {
    commands: Sender<Command>,
    stops: StopActions,
}

impl RunHandle {
    /// Joins the engine's queue of commands with the robots' own stop paths.
    pub fn new(commands: Sender<Command>, stops: StopActions) -> Self {
        Self { commands, stops }
    }

    /// Passes a command on. Commands that end motion stop the robots here and now, before the engine reads them. Returns false when the
    /// run is over and nobody reads commands any more (the robots were commanded to stop all the same).
    pub fn send(&self, command: Command) -> bool {
        let ends_motion = matches!(
            command,
            Command::Stop
                | Command::Abort
                | Command::EndFromOutside { .. }
                | Command::Finish
                | Command::Keep
                | Command::Pause { when: PauseWhen::Now }
        );
        let taken = self.commands.send(command).is_ok();
        if ends_motion {
            self.stops.fire();
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;

    #[test]
    fn a_stop_reaches_the_robots_although_the_engine_reads_no_commands() {
        let (commands, _kept_but_never_read) = std::sync::mpsc::channel();
        let stops = StopActions::default();
        let count = Arc::new(AtomicU32::new(0));
        let counter = Arc::clone(&count);
        let stop = move || {
            counter.fetch_add(1, Ordering::SeqCst);
        };
        stops.set("arm", Box::new(stop));
        let handle = RunHandle::new(commands, stops);
        handle.send(Command::Resume);
        assert_eq!(count.load(Ordering::SeqCst), 0);
        handle.send(Command::Stop);
        assert_eq!(count.load(Ordering::SeqCst), 1);
    }
}
