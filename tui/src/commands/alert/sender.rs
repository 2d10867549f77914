//! Messages that are sent once, and again while they do not arrive.

use std::time::{Duration, Instant};

use super::channel::{Channel, Delivery};
use super::reported::Reported;
use super::trouble::Trouble;
use crate::failure::with_causes;
use crate::print_line::print_line;

/// How long until a message that did not arrive is sent again.
const TRY_AGAIN: Duration = Duration::from_secs(30);

/// Sends each trouble over each channel, once.
pub(super) struct Sender {
    channels: Vec<Channel>,
    reported: Reported,
    /// What did not arrive: channel and trouble, and when it was tried last.
    failing: Vec<(String, String, Instant)>,
}

impl Sender {
    pub(super) fn new(channels: Vec<Channel>, reported: Reported) -> Self {
        Self { channels, reported, failing: Vec::new() }
    }

    /// Sends what was not sent, and forgets what is over; whether everything has arrived.
    pub(super) fn report_all(&mut self, found: &[Trouble]) -> Result<bool, Box<dyn std::error::Error>> {
        self.reported.keep_only(found)?;
        self.failing.retain(|(_, key, _)| found.iter().any(|trouble| trouble.key == *key));
        self.report_also(found)
    }

    /// Sends what was not sent yet. What was reported before may go on, although it is not among it.
    pub(super) fn report_also(&mut self, found: &[Trouble]) -> Result<bool, Box<dyn std::error::Error>> {
        let mut all = true;
        for trouble in found {
            for index in 0..self.channels.len() {
                all &= self.report(index, trouble)?;
            }
        }
        Ok(all)
    }

    fn report(&mut self, index: usize, trouble: &Trouble) -> Result<bool, Box<dyn std::error::Error>> {
        let Some(channel) = self.channels.get(index) else { return Ok(true) };
        let (name, channel_key) = (channel.name().to_owned(), channel.key().to_owned());
        if self.reported.has(&trouble.key, &channel_key) {
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
                self.reported.note(&trouble.key, &channel_key)?;
                // The next channel is tried also where nobody reads along any more.
                let _unread = print_line!("{name}: reported {}", trouble.text);
                Ok(true)
            }
            Err(error) => {
                let again = match error.delivery() {
                    // Asking again would get the same answer.
                    Delivery::Refused => {
                        self.reported.note(&trouble.key, &channel_key)?;
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
