//! The world as a process: it serves its clients over a Unix-domain socket, outlives each of them, and ends when it is asked to
//! or when nobody has been there for long.

mod address;
mod clock;
mod error;
mod session;
mod shared;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use address::Address;
pub use clock::clock_file;
pub use error::ServeError;
use shared::Shared;

use crate::protocol::Pace;
use crate::world_file;

/// How often the world looks for new clients, and lets time pass when nobody asks for it.
const TICK: Duration = Duration::from_millis(10);

/// What to serve, and where.
#[derive(Debug, Clone)]
pub struct ServeOptions {
    /// The world file.
    pub file: PathBuf,
    /// Where to listen.
    pub socket: PathBuf,
    /// Draw from this seed instead of the file's.
    pub seed: Option<u64>,
    /// How time runs at the beginning.
    pub pace: Pace,
    /// Ends the world when nobody has been there for so long.
    pub idle: Duration,
}

/// Serves a world until a client ends it or nobody has been there for the idle time.
pub fn serve(options: &ServeOptions) -> Result<(), ServeError> {
    let mut described = world_file::read(&options.file)?;
    if let Some(seed) = options.seed {
        described.set_seed(seed);
    }
    let (_address, listener, shared) = Address::take(&options.socket, || {
        let clock = clock_file(&options.socket);
        Shared::new(described.into_world(), options.pace, &clock)
            .map_err(|source| ServeError::Clock { file: clock, source })
    })?;
    let shared = Arc::new(shared);
    let mut sessions = Vec::new();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                let shared = Arc::clone(&shared);
                let session = std::thread::Builder::new().spawn(move || session::serve(shared, stream));
                // A client there is no thread for finds its connection closed.
                sessions.extend(session.ok());
            }
            // Nobody calls; or one who went at once, or more than there are file descriptors for. The world goes on.
            Err(_) => std::thread::sleep(TICK),
        }
        if shared.is_ending() || shared.now().idle() >= options.idle {
            break;
        }
        sessions.retain(|session| !session.is_finished());
    }
    shared.end();
    for session in sessions {
        // A session that panicked has said so on the error output; the world ends either way.
        let _ = session.join();
    }
    Ok(())
}
