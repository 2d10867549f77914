//! May enough files be open at once.

use super::finding::Finding;
use crate::open_files::{allowed, raise};

const TOPIC: &str = "open files";

pub(super) fn look() -> Vec<Finding> {
    vec![match (raise(), allowed()) {
        (Err(too_few), _) => Finding::wrong(
            TOPIC,
            too_few.to_string(),
            "in a shell of root: ulimit -n 4096; for good: /etc/security/limits.conf",
        ),
        (Ok(()), Ok(most)) => Finding::good(TOPIC, format!("{most} may be open at once")),
        (Ok(()), Err(error)) => Finding::note(TOPIC, format!("how many may be open is not known: {error}")),
    }]
}
