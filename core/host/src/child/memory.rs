//! A limit on the memory of a host's process: a plugin that leaks takes its own host and not the machine.

use std::fs;
use std::thread;
use std::time::Duration;

use nix::sys::resource::{Resource, setrlimit};
use plumb_bus::Signal;
use plumb_plugin::LogLevel;

use super::ending::end_at_once;
use crate::channel::exit_code;
use crate::context::Context;

/// How often the process is weighed. Memory is taken at about a gigabyte a second at most.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// How long a device in motion has to come to rest before its host ends.
const LAST_STOP: Duration = Duration::from_millis(500);

const MEGABYTE: u64 = 1_000_000;

/// Limits the memory of this process: the system refuses to give more than a quarter above the limit, and a thread ends the process, with words,
/// when what it uses is above the limit itself. Memory shared with other processes does not count.
pub(super) fn limit(context: &'static Context, limit_mb: u64, wake: Signal) {
    let most = refused_above(limit_mb);
    if let Err(error) = setrlimit(Resource::RLIMIT_DATA, most, most) {
        let text = format!(
            "the system does not limit the memory of this process: {error}; it is watched all the same"
        );
        context.report(LogLevel::Warn, &text);
    }
    thread::spawn(move || watch(context, limit_mb, &wake));
}

/// From how many bytes on the system gives no more: a quarter above the limit.
fn refused_above(limit_mb: u64) -> u64 {
    limit_mb.saturating_mul(MEGABYTE).saturating_mul(5) / 4
}

fn watch(context: &'static Context, limit_mb: u64, wake: &Signal) {
    loop {
        thread::sleep(LOOK_EVERY);
        let used_mb = own_bytes() / MEGABYTE;
        if used_mb <= limit_mb {
            continue;
        }
        let text = format!(
            "its process uses {used_mb} MB of memory and may use {limit_mb} MB: the host ends (a device that needs more says so in the cell file \
             with `memory_limit_mb:`)"
        );
        context.announce(LogLevel::Error, &text);
        context.end_because(&text);
        if context.is_in_motion() {
            context.stop.ask();
            // A host whose signal fails ends below all the same.
            let _ = wake.notify();
            thread::sleep(LAST_STOP);
        }
        end_at_once(context, exit_code::MEMORY);
    }
}

/// The memory that this process has for itself and uses, in bytes: what it shares with other processes does not count.
fn own_bytes() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    own_kilobytes(&status).unwrap_or(0) * 1024
}

/// The line `RssAnon` of a process's status, kB.
fn own_kilobytes(status: &str) -> Option<u64> {
    status.lines().find_map(|line| line.strip_prefix("RssAnon:"))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_of_a_process_is_read_from_its_status() {
        assert_eq!(own_kilobytes("Name:\tplumb\nRssAnon:\t     912 kB\nRssFile:\t 5 kB\n"), Some(912));
        assert_eq!(own_kilobytes(""), None);
        assert!(own_bytes() > 100_000, "this test uses memory");
    }

    #[test]
    fn the_system_refuses_memory_a_quarter_above_the_limit() {
        assert_eq!(refused_above(400), 500_000_000);
        assert_eq!(refused_above(u64::MAX), u64::MAX / 4, "as much as there can be");
    }
}
