//! What the system allows a process: open files, address space, threads.

use super::finding::Finding;

const TOPIC: &str = "limits";

pub(super) fn look() -> Vec<Finding> {
    vec![match plumb_bus::check_limits() {
        Ok(()) => Finding::good(
            TOPIC,
            format!("{} open files, enough memory and threads", plumb_bus::open_files_allowed()),
        ),
        Err(text) => Finding::wrong(
            TOPIC,
            text,
            "for good: a line in /etc/security/limits.conf, or the settings of the container or service",
        ),
    }]
}
