//! `plumb ship`: sends what the record holds to a central database.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use plumb_central::{Central, CentralError, Shipped, Shipper};
use plumb_record::Record;
use tokio::signal::unix::{SignalKind, signal};

use crate::failure::{CommandResult, with_causes};
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use crate::unchecked_server::warn_unchecked;

/// Send what the record holds to a central PostgreSQL database, row by row, and go on as runs write more. May be killed, and the network may be gone for
/// days: it goes on where the database is. A cell never waits for it.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The database: postgres://USER@HOST/DATABASE. A password is better kept in ~/.pgpass or PGPASSWORD, where no list of processes shows it.
    #[arg(long, value_name = "ADDRESS")]
    to: String,
    /// Send what is there now, and end.
    #[arg(long)]
    once: bool,
    /// Send what is there now, then take rows off the record's outbox that are older than DAYS and that the database has, and end. The outbox holds every row a second time; once the
    /// database has it, only another database would miss it.
    #[arg(long, value_name = "DAYS", conflicts_with = "once")]
    trim: Option<u32>,
    /// Make the record one of its own first, and send it from the beginning: for one that was copied, or brought back from a backup.
    #[arg(long)]
    new_identity: bool,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

impl Arguments {
    /// Whether it ends when everything is sent.
    fn ends(&self) -> bool {
        self.once || self.trim.is_some()
    }
}

/// How often the record is looked at for new rows. A second behind is what a page of a fleet may be.
const LOOK: Duration = Duration::from_millis(300);

/// How often the database is informed that this cell is still there while it writes nothing.
const SAY_ALIVE: Duration = Duration::from_secs(5);

/// How long the database may take for a batch of rows. On a network that was cut the system itself would wait for a quarter of an hour.
const ANSWER_WITHIN: Duration = Duration::from_secs(10);

/// How long until a database that did not answer is asked again.
const TRY_AGAIN: Duration = Duration::from_secs(2);

/// How long who ends the shipper waits until the database knows: below the patience of a person, and of systemd (90 s).
const SIGN_OFF_WITHIN: Duration = Duration::from_secs(3);

/// Why nothing was sent.
#[derive(Debug, thiserror::Error)]
enum ShipError {
    #[error("there is no record in {}: `plumb run` makes one", .0.display())]
    NoRecord(PathBuf),
}

/// Sends until it is asked to end, or everything is sent.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let directory = record_directory(arguments.record.as_ref())?;
    warn_unchecked("ship", &arguments.to)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        tokio::select! {
            result = ship(arguments, &directory) => return result,
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
        if !arguments.ends() {
            sign_off(&arguments.to, &directory).await;
        }
        Ok(())
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Sends what is left, and lets the database know that this shipper ends in good order. Where the database does not answer in time, its cells will count as
/// silent.
async fn sign_off(to: &str, directory: &Path) {
    if !Record::file_in(directory).exists() {
        return;
    }
    let leaving = async {
        let record = Record::open(directory)?;
        let mut shipper = Shipper::begin(Central::connect(to).await?, &record, &host_name()).await?;
        while shipper.turn(&record).await?.left > 0 {}
        shipper.sign_off().await
    };
    let error = match tokio::time::timeout(SIGN_OFF_WITHIN, leaving).await {
        Ok(Ok(())) => return,
        Ok(Err(error)) => with_causes(&error),
        Err(_) => format!("the database did not answer within {} s", SIGN_OFF_WITHIN.as_secs()),
    };
    eprintln!(
        "plumb ship: {error}; the database does not know that this shipper ended, and its cells will count as silent"
    );
}

async fn ship(arguments: &Arguments, directory: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut record = open_when_there(arguments, directory).await?;
    if arguments.new_identity {
        print_line!("the record is now {}", record.renew_identity()?)?;
    }
    let mut last_trouble = String::new();
    loop {
        match session(arguments, &mut record).await {
            Ok(()) => return Ok(()),
            Err(error) => {
                let passes = error.downcast_ref::<CentralError>().is_some_and(CentralError::may_pass);
                if arguments.ends() || !passes {
                    return Err(error);
                }
                let trouble = with_causes(error.as_ref());
                if trouble != last_trouble {
                    eprintln!(
                        "plumb ship: {trouble}; trying again every {} s, nothing is lost",
                        TRY_AGAIN.as_secs()
                    );
                    last_trouble = trouble;
                }
            }
        }
        tokio::time::sleep(TRY_AGAIN).await;
    }
}

/// The record. One that is not there yet is waited for, so that a service may be started before the first run.
async fn open_when_there(
    arguments: &Arguments,
    directory: &Path,
) -> Result<Record, Box<dyn std::error::Error>> {
    let file = Record::file_in(directory);
    if !file.exists() {
        if arguments.ends() {
            return Err(ShipError::NoRecord(directory.to_owned()).into());
        }
        print_line!("there is no record in {} yet; waiting for the first run", directory.display())?;
        while !file.exists() {
            tokio::time::sleep(TRY_AGAIN).await;
        }
    }
    Ok(Record::open(directory)?)
}

/// One connection: until everything is sent with `--once`, else until it breaks.
async fn session(arguments: &Arguments, record: &mut Record) -> Result<(), Box<dyn std::error::Error>> {
    let central = Central::connect(&arguments.to).await?;
    let mut shipper = within(Shipper::begin(central, record, &host_name())).await?;
    let (mut sent, mut is_reported) = (0, false);
    let mut alive = Instant::now();
    loop {
        let Shipped { rows, up_to, left } = within(shipper.turn(record)).await?;
        sent += rows;
        if left > 0 {
            continue;
        }
        if !is_reported || arguments.ends() {
            print_line!("record {}: {sent} rows sent, {up_to} of {up_to} are there", record.identity()?)?;
            is_reported = true;
        }
        if let Some(days) = arguments.trim {
            let rows = shipper.trim(record, days)?;
            print_line!("{rows} rows older than {days} days are off the outbox; the database has them")?;
        }
        if arguments.ends() {
            return Ok(());
        }
        if alive.elapsed() > SAY_ALIVE {
            within(shipper.say_alive()).await?;
            alive = Instant::now();
        }
        tokio::time::sleep(LOOK).await;
    }
}

/// Waits for the database, but not for ever.
async fn within<T>(asked: impl Future<Output = Result<T, CentralError>>) -> Result<T, CentralError> {
    let limit_s = ANSWER_WITHIN.as_secs();
    tokio::time::timeout(ANSWER_WITHIN, asked).await.unwrap_or(Err(CentralError::Slow { limit_s }))
}

/// The name of this machine, as the system has it.
fn host_name() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name = name.trim();
    if name.is_empty() { "a machine without a name".to_owned() } else { name.to_owned() }
}
