//! `plumb alert`: calls people by webhook or e-mail when a cell needs them.

mod channel;
mod duration;
mod fleet_trouble;
mod mail;
mod reported;
mod sender;
mod trouble;
mod webhook;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use plumb_record::Record;

use crate::failure::{CommandResult, with_causes};
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use crate::unchecked_server::warn_unchecked;
use channel::Channel;
use fleet_trouble::Watch;
use reported::Reported;
use sender::Sender;
use trouble::{Limits, Trouble};

/// Call people by webhook or e-mail when a prompt waits, when a step takes far longer than planned, or when the program of a run has gone. It reads the record from outside:
/// no run waits for it, whatever becomes of a message. With --from it does so for all cells, from the central database, and reports also when one was not heard of: a
/// machine that is dead cannot.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Where to send a message by HTTP POST, as JSON with `text` in it: https, or http on this machine. An address is often a secret: PLUMB_WEBHOOK takes it too, where no
    /// list of processes shows it. May be given more than once.
    #[arg(long, value_name = "URL")]
    webhook: Vec<String>,
    /// Whom to send an e-mail, through this machine's own mailer. May be given more than once.
    #[arg(long, value_name = "ADDRESS")]
    mail: Vec<String>,
    /// The mailer: any program that takes `-i -- ADDRESS...` and a message, as sendmail, msmtp and nullmailer do.
    #[arg(long, value_name = "PROGRAM", default_value = "/usr/sbin/sendmail")]
    sendmail: PathBuf,
    /// Look at all cells of the central database, postgres://USER@HOST/DATABASE, in place of the record here.
    #[arg(long, value_name = "ADDRESS", conflicts_with = "record")]
    from: Option<String>,
    /// With --from: how long a cell may send nothing before its machine, its network or its `plumb ship` is taken to be gone; and how long the database may not answer. A
    /// machine that is shut down in good order while no run is open is not reported.
    #[arg(long, value_name = "TIME", value_parser = duration::read, default_value = "15min", requires = "from")]
    silent_after: Duration,
    /// How long a prompt may wait, as in 90s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = duration::read, default_value = "5min")]
    prompt_after: Duration,
    /// How much longer than planned a step may take.
    #[arg(long, value_name = "TIME", value_parser = duration::read, default_value = "10min")]
    step_after: Duration,
    /// Report also when a run ends otherwise than passed.
    #[arg(long)]
    ended: bool,
    /// Send what is due now, and end. With 1, when something did not arrive.
    #[arg(long)]
    once: bool,
    /// Send a message that says that it is a test, and end.
    #[arg(long, conflicts_with = "once")]
    test: bool,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// The variable that holds a webhook's address.
const WEBHOOK_VARIABLE: &str = "PLUMB_WEBHOOK";

/// How often the record is looked at. A person who is called does not come within less.
const LOOK: Duration = Duration::from_secs(1);

/// Exit code where a message did not arrive.
const NOT_DELIVERED: u8 = 1;

/// Why nothing is reported.
#[derive(Debug, thiserror::Error)]
enum AlertError {
    #[error("nobody to call: give --mail ADDRESS, --webhook URL, or an address in {WEBHOOK_VARIABLE}")]
    Nobody,
    #[error("there is no record in {}: `plumb run` makes one", .0.display())]
    NoRecord(PathBuf),
}

/// Reports until it is ended.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let channels = channels(arguments)?;
    if arguments.test {
        return test(&channels);
    }
    let limits =
        Limits { prompt: arguments.prompt_after, step: arguments.step_after, ended: arguments.ended };
    if let Some(from) = &arguments.from {
        warn_unchecked("alert", from)?;
        let reported = Reported::of_the_fleet(&record_directory(None)?)?;
        let mut watch = Watch::new(from, limits, arguments.silent_after, Sender::new(channels, reported))?;
        if arguments.once {
            return Ok(exit_code(watch.once()?));
        }
        print_line!("looking for cells that need somebody; Ctrl-C ends")?;
        watch.forever()?;
        return Ok(ExitCode::SUCCESS);
    }
    let directory = record_directory(arguments.record.as_ref())?;
    let record = open_when_there(arguments, &directory)?;
    let mut sender = Sender::new(channels, Reported::read(&directory)?);
    if arguments.once {
        return Ok(exit_code(sender.report_all(&trouble::look(&record, &limits)?)?));
    }
    print_line!("looking for runs that need somebody; Ctrl-C ends")?;
    let mut last_error = String::new();
    loop {
        let looked = trouble::look(&record, &limits).map_err(Box::<dyn std::error::Error>::from);
        match looked.and_then(|found| sender.report_all(&found)) {
            Ok(_) => last_error.clear(),
            // Said once, not every second; the next look may go better.
            Err(error) => {
                let text = with_causes(error.as_ref());
                if text != last_error {
                    eprintln!("plumb alert: {text}");
                    last_error = text;
                }
            }
        }
        sleep(LOOK);
    }
}

fn exit_code(arrived: bool) -> ExitCode {
    if arrived { ExitCode::SUCCESS } else { ExitCode::from(NOT_DELIVERED) }
}

fn channels(arguments: &Arguments) -> Result<Vec<Channel>, Box<dyn std::error::Error>> {
    let mut channels = Vec::new();
    let secret = std::env::var(WEBHOOK_VARIABLE).ok().filter(|address| !address.trim().is_empty());
    for address in arguments.webhook.iter().chain(&secret) {
        channels.push(Channel::webhook(address)?);
    }
    if !arguments.mail.is_empty() {
        channels.push(Channel::mail(&arguments.sendmail, &arguments.mail)?);
    }
    if channels.is_empty() { Err(AlertError::Nobody.into()) } else { Ok(channels) }
}

fn test(channels: &[Channel]) -> CommandResult {
    let mut arrived = true;
    for channel in channels {
        match channel.send(&Trouble::test()) {
            Ok(()) => print_line!("{}: delivered", channel.name())?,
            Err(error) => {
                arrived = false;
                eprintln!("plumb alert: {}: {}", channel.name(), with_causes(&error));
            }
        }
    }
    Ok(exit_code(arrived))
}

/// The record. One that is not there yet is waited for, so that a service may be started before the first run.
fn open_when_there(arguments: &Arguments, directory: &Path) -> Result<Record, Box<dyn std::error::Error>> {
    let file = Record::file_in(directory);
    if !file.exists() {
        if arguments.once {
            return Err(AlertError::NoRecord(directory.to_owned()).into());
        }
        print_line!("there is no record in {} yet; waiting for the first run", directory.display())?;
        while !file.exists() {
            sleep(LOOK);
        }
    }
    Ok(Record::open(directory)?)
}
