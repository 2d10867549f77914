//! How many files this process and its hosts may have open.

use std::io;

use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// What a cell needs: iceoryx2 opens some ten files a stream and request on either side, the record and the world some more; a cell of ten
/// devices has been seen with 160.
const NEEDED: u64 = 256;

/// What is asked for where the system allows it.
const WANTED: u64 = 4096;

/// Fewer files may be open than a cell needs.
#[derive(Debug, thiserror::Error)]
#[error(
    "only {allowed} files may be open at once, and a cell needs {NEEDED}: raise the limit with `ulimit -Hn {WANTED}` (or in /etc/security/limits.conf)"
)]
pub(crate) struct TooFew {
    allowed: u64,
}

/// How many files may be open at once, at most.
///
/// # Errors
/// What the system says.
pub(crate) fn allowed() -> io::Result<u64> {
    Ok(getrlimit(Resource::RLIMIT_NOFILE)?.1)
}

/// Makes use of as many as are allowed, up to what is wanted; the hosts take it over.
///
/// # Errors
/// [`TooFew`]
pub(crate) fn raise() -> Result<(), TooFew> {
    // Where the system does not say, whoever opens a file finds out.
    let Ok((now, most)) = getrlimit(Resource::RLIMIT_NOFILE) else { return Ok(()) };
    if most < NEEDED {
        return Err(TooFew { allowed: most });
    }
    if now < WANTED.min(most) {
        let _kept_as_it_is = setrlimit(Resource::RLIMIT_NOFILE, WANTED.min(most), most);
    }
    Ok(())
}
