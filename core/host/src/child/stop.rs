//! The thread that receives stops.

use std::thread;
use std::time::Duration;

use plumb_bus::{Listener, Signal};

use super::ending::end_at_once;
use crate::channel::exit_code;
use crate::context::Context;

/// Starts the thread that receives stops, whatever the plugin is doing. `wake` is the signal the main thread waits for.
pub(super) fn listen(context: &'static Context, listener: Listener, wake: Signal) {
    // A notification wakes at once; looking now and then as well costs nothing and leaves no way to miss one.
    const LOOK_EVERY: Duration = Duration::from_millis(250);
    thread::spawn(move || {
        loop {
            let received = listener.wait(LOOK_EVERY).and_then(|count| {
                if count > 0 {
                    context.stop.ask();
                    wake.notify()?;
                }
                Ok(())
            });
            if let Err(error) = received {
                // A host that cannot receive a stop must not go on.
                context.announce(plumb_plugin::LogLevel::Error, &error.to_string());
                end_at_once(context, exit_code::BUS);
            }
        }
    });
}
