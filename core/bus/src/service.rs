//! What every port is made of: the kind of services used, and the unit in which shared memory is given out.

use iceoryx2::prelude::{ServiceName, ipc_threadsafe};

use crate::OpenError;

/// The version of iceoryx2, whose shared memory no other version understands: programs in other languages need the same.
pub const LAYER_VERSION: &str = "0.10.0";

/// The kind of services used throughout: shared memory, and ports that may be handed to another thread.
pub(crate) type Service = ipc_threadsafe::Service;

/// Shared memory is given out in whole words, so that every message lies aligned to 8.
pub(crate) const WORD: usize = size_of::<u64>();

/// The name of a service; `what` is the port it is for, as errors name it.
pub(crate) fn service_name(what: &str, name: &str) -> Result<ServiceName, OpenError> {
    ServiceName::new(name).map_err(|error| OpenError::new(what, error))
}

#[cfg(test)]
mod tests {
    use super::LAYER_VERSION;

    #[test]
    fn the_version_that_is_reported_is_the_one_that_is_built_in() {
        let lock = include_str!("../../../Cargo.lock");
        let found = lock.lines().skip_while(|line| *line != "name = \"iceoryx2\"").nth(1).unwrap();
        assert_eq!(found, format!("version = \"{LAYER_VERSION}\""));
    }
}
