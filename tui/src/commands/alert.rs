//! `plumb alert`: tells people by webhook or e-mail when a cell needs them.

mod channel;
mod duration;
mod mail;
mod told;
mod trouble;
mod webhook;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::sleep;
use std::time::{Duration, Instant};

use plumb_record::Record;

use crate::failure::{CommandResult, with_causes};
use crate::record_directory::record_directory;
use crate::say::say;
use channel::{Channel, Delivery};
use told::Told;
use trouble::{Limits, Trouble};

/// Tell people by webhook or e-mail when a prompt waits, when a step takes far longer than planned, or when the program of a run has gone. It reads the record from outside:
/// no run waits for it, whatever becomes of a message.
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
    /// How long a prompt may wait, as in 90s, 5min, 2h.
    #[arg(long, value_name = "TIME", value_parser = duration::read, default_value = "5min")]
    prompt_after: Duration,
    /// How much longer than planned a step may take.
    #[arg(long, value_name = "TIME", value_parser = duration::read, default_value = "10min")]
    step_after: Duration,
    /// Tell also when a run ends otherwise than passed.
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

/// How long until a message that did not arrive is sent again.
const TRY_AGAIN: Duration = Duration::from_secs(30);

/// Exit code where a message did not arrive.
const NOT_DELIVERED: u8 = 1;

/// Why nobody is told.
#[derive(Debug, thiserror::Error)]
enum AlertError {
    #[error("nobody to tell: give --mail ADDRESS, --webhook URL, or an address in {WEBHOOK_VARIABLE}")]
    Nobody,
    #[error("there is no record in {}: `plumb run` makes one", .0.display())]
    NoRecord(PathBuf),
}

/// Tells until it is ended.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let channels = channels(arguments)?;
    let directory = record_directory(arguments.record.as_ref())?;
    if arguments.test {
        return test(&channels);
    }
    let record = open_when_there(arguments, &directory)?;
    let limits =
        Limits { prompt: arguments.prompt_after, step: arguments.step_after, ended: arguments.ended };
    let mut sender = Sender { channels, told: Told::read(&directory)?, failing: Vec::new() };
    if arguments.once {
        let delivered = sender.tell_all(&trouble::look(&record, &limits)?)?;
        return Ok(if delivered { ExitCode::SUCCESS } else { ExitCode::from(NOT_DELIVERED) });
    }
    say!("looking for runs that need somebody; Ctrl-C ends")?;
    let mut last_error = String::new();
    loop {
        let looked = trouble::look(&record, &limits).map_err(Box::<dyn std::error::Error>::from);
        match looked.and_then(|found| sender.tell_all(&found)) {
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
            Ok(()) => say!("{}: delivered", channel.name())?,
            Err(error) => {
                arrived = false;
                eprintln!("plumb alert: {}: {}", channel.name(), with_causes(&error));
            }
        }
    }
    Ok(if arrived { ExitCode::SUCCESS } else { ExitCode::from(NOT_DELIVERED) })
}

/// The record. One that is not there yet is waited for, so that a service may be started before the first run.
fn open_when_there(arguments: &Arguments, directory: &Path) -> Result<Record, Box<dyn std::error::Error>> {
    let file = directory.join("plumb.sqlite3");
    if !file.exists() {
        if arguments.once {
            return Err(AlertError::NoRecord(directory.to_owned()).into());
        }
        say!("there is no record in {} yet; waiting for the first run", directory.display())?;
        while !file.exists() {
            sleep(LOOK);
        }
    }
    Ok(Record::open(directory)?)
}

/// Sends each trouble over each channel, once.
struct Sender {
    channels: Vec<Channel>,
    told: Told,
    /// What did not arrive: channel and trouble, and when it was tried last.
    failing: Vec<(String, String, Instant)>,
}

impl Sender {
    /// Sends what was not sent; whether everything has arrived.
    fn tell_all(&mut self, found: &[Trouble]) -> Result<bool, Box<dyn std::error::Error>> {
        self.told.keep_only(found)?;
        self.failing.retain(|(_, key, _)| found.iter().any(|trouble| trouble.key == *key));
        let mut all = true;
        for trouble in found {
            for index in 0..self.channels.len() {
                all &= self.tell(index, trouble)?;
            }
        }
        Ok(all)
    }

    fn tell(&mut self, index: usize, trouble: &Trouble) -> Result<bool, Box<dyn std::error::Error>> {
        let Some(channel) = self.channels.get(index) else { return Ok(true) };
        let (name, channel_key) = (channel.name().to_owned(), channel.key().to_owned());
        if self.told.has(&trouble.key, &channel_key) {
            return Ok(true);
        }
        let is_this = |entry: &&(String, String, Instant)| entry.0 == channel_key && entry.1 == trouble.key;
        if self.failing.iter().find(is_this).is_some_and(|(.., tried)| tried.elapsed() < TRY_AGAIN) {
            return Ok(false);
        }
        let first = !self.failing.iter().any(|entry| is_this(&entry));
        self.failing.retain(|entry| !is_this(&entry));
        match channel.send(trouble) {
            Ok(()) => {
                self.told.note(&trouble.key, &channel_key)?;
                say!("{name}: told of {}", trouble.text)?;
                Ok(true)
            }
            Err(error) => {
                let again = match error.delivery() {
                    // Asking again would get the same answer.
                    Delivery::Refused => {
                        self.told.note(&trouble.key, &channel_key)?;
                        "not tried again".to_owned()
                    }
                    Delivery::MayPass => format!("trying again every {} s", TRY_AGAIN.as_secs()),
                };
                if first {
                    eprintln!("plumb alert: {name}: {}; {again}: {}", with_causes(&error), trouble.text);
                }
                self.failing.push((channel_key, trouble.key.clone(), Instant::now()));
                Ok(false)
            }
        }
    }
}
