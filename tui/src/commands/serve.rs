//! `plumb serve`: a page of the cell's runs for a browser, and answers from there.

mod answering;
mod drawings;
mod lease;
mod routes;
mod shared;
mod state;
mod token;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plumb_record::{Record, RecordError};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use shared::Shared;
use state::PageState;
use token::Token;

/// Show the runs of this machine's cells in a browser, live, and take answers to their prompts from there. Nothing on the page moves an arm by itself: what moves it,
/// or says where it is, is answered at the arm. Without a token the page can only be read.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Where to listen. Only this machine's own addresses; from another room come by a tunnel (`ssh -L 8717:localhost:8717 CELL`) or through a proxy with TLS.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8717")]
    listen: SocketAddr,
    /// A file with the token that lets a browser answer; readable by its owner alone.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Write a new token to FILE, and end.
    #[arg(long, value_name = "FILE", conflicts_with = "token_file")]
    new_token: Option<PathBuf>,
    /// A name under which a proxy is reached, beside localhost. May be given more than once.
    #[arg(long, value_name = "NAME")]
    name: Vec<String>,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// How often the record is looked at.
const LOOK: Duration = Duration::from_millis(300);

/// Readers at once at most; each takes a handle of the system and a few kilobytes.
const MOST_READERS: usize = 4_000;

/// Why nothing is served.
#[derive(Debug, thiserror::Error)]
enum ServeError {
    #[error(
        "{0} can be reached from other machines, and what is served is not encrypted: listen on 127.0.0.1 and come by a tunnel \
         (`ssh -L 8717:localhost:8717 THIS-MACHINE`) or a proxy with TLS"
    )]
    NotThisMachine(SocketAddr),
    #[error("cannot listen on {address}: {cause}")]
    Listen { address: SocketAddr, cause: std::io::Error },
}

/// Serves until it is asked to end.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    if let Some(path) = &arguments.new_token {
        token::write_new(path)?;
        print_line!(
            "a new token is in {}; give the file to --token-file, and its text to who may answer",
            path.display()
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    if !arguments.listen.ip().is_loopback() {
        return Err(ServeError::NotThisMachine(arguments.listen).into());
    }
    let token = arguments.token_file.as_deref().map(Token::read).transpose()?;
    let directory = record_directory(arguments.record.as_ref())?;
    allow_many_readers();
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?
        .block_on(serve(arguments, directory, token))?;
    Ok(ExitCode::SUCCESS)
}

async fn serve(
    arguments: &Arguments,
    directory: PathBuf,
    token: Option<Token>,
) -> Result<(), Box<dyn std::error::Error>> {
    let address = arguments.listen;
    let listener = TcpListener::bind(address).await.map_err(|cause| ServeError::Listen { address, cause })?;
    let record = Record::open(&directory)?;
    let first = state::read(&record, token.is_some(), None)?;
    let (to_readers, state) = watch::channel(Arc::new(first));
    let answers = token.is_some();
    let names = arguments.name.clone();
    let shared = Arc::new(Shared::new(directory, token, names, state));
    // A thread of its own: the record is read with calls that wait.
    let looks = Arc::clone(&shared);
    std::thread::spawn(move || look(&record, answers, &looks, &to_readers));
    let here = listener.local_addr()?;
    print_line!(
        "http://{here}/ ({}); Ctrl-C ends",
        if answers { "answers with a token" } else { "read only" }
    )?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let server = axum::serve(listener, routes::router(shared));
    tokio::select! {
        ended = async { server.await } => ended?,
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    Ok(())
}

/// Reads the record again and again, and hands on what changed. All readers share one state: a thousand cost no more reading
/// than one, and a slow one misses what lies between.
fn look(record: &Record, answers: bool, shared: &Shared, to_readers: &watch::Sender<Arc<PageState>>) {
    let mut trouble = String::new();
    while !to_readers.is_closed() {
        let holder = shared.leases().current_holder(Instant::now());
        match state::read(record, answers, holder) {
            Ok(state) => {
                to_readers.send_if_modified(|last| {
                    let changed = **last != state;
                    if changed {
                        *last = Arc::new(state);
                    }
                    changed
                });
                trouble.clear();
            }
            Err(error) => warn_once(&error, &mut trouble),
        }
        std::thread::sleep(LOOK);
    }
}

/// Says what is wrong with the record when it begins, not three times a second.
fn warn_once(error: &RecordError, trouble: &mut String) {
    let text = error.to_string();
    if *trouble != text {
        eprintln!("plumb serve: {text}");
        *trouble = text;
    }
}

/// Raises the number of open handles that the system allows by default, so that many may read.
fn allow_many_readers() {
    use nix::sys::resource::{Resource, getrlimit, setrlimit};
    if let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) {
        let requested = hard.min(MOST_READERS as u64 + 100);
        if soft < requested {
            // Where the system refuses, fewer may read at once.
            let _ = setrlimit(Resource::RLIMIT_NOFILE, requested, hard);
        }
    }
}
