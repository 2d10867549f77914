//! The one thread that starts host processes.
//!
//! A host asks the system for a signal when its parent dies, and to the system a child's parent is the *thread* that started it. This thread
//! lives as long as the program, so a host is not taken for an orphan when a worker thread ends.

use std::io;
use std::process::{Child, Command};
use std::sync::OnceLock;
use std::sync::mpsc::{Sender, channel};
use std::thread;

type Order = (Command, Sender<io::Result<Child>>);

/// Starts a process from the thread that lives as long as the program.
pub(super) fn spawn(command: Command) -> io::Result<Child> {
    static ORDERS: OnceLock<Sender<Order>> = OnceLock::new();
    let orders = ORDERS.get_or_init(|| {
        let (orders, received) = channel::<Order>();
        thread::spawn(move || {
            for (mut command, result) in received {
                // Who does not wait for the child any more does not want it.
                if let Err(unwanted) = result.send(command.spawn())
                    && let Ok(mut child) = unwanted.0
                {
                    let _ = child.kill();
                    let _ = child.wait();
                }
            }
        });
        orders
    });
    let (result, child) = channel();
    let gone = || io::Error::other("the thread that starts processes has ended");
    orders.send((command, result)).map_err(|_| gone())?;
    child.recv().map_err(|_| gone())?
}
