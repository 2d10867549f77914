//! What a driver says, read as it comes: its answers go to the caller, all else to the host.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{ChildStderr, ChildStdin, ChildStdout};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use plumb_plugin::message::{self, Layout};
use plumb_plugin::{Host, LogLevel, Manifest, PluginError, Value};
use serde_json::json;

use crate::line::{Line, kind_of, understood};

/// The longest line of a driver, bytes: a message of 4 MB in hexadecimal.
const LONGEST_LINE: u64 = 8 << 20;

/// The longest message of an input, bytes.
const LONGEST_INPUT: usize = 4 << 20;

/// What the thread that calls the driver and those that listen to it share.
#[derive(Clone)]
pub(crate) struct Shared {
    pub(crate) stdin: Arc<Mutex<ChildStdin>>,
    /// What went wrong with something the driver emitted: the call under way fails with it.
    pub(crate) fault: Arc<Mutex<Option<String>>>,
    /// The last line the driver wrote to its standard error.
    pub(crate) last_words: Arc<Mutex<String>>,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Sends the driver a line.
    pub(crate) fn send(&self, line: &Value) -> io::Result<()> {
        let mut stdin = locked(&self.stdin);
        stdin.write_all(format!("{line}\n").as_bytes())?;
        stdin.flush()
    }
}

/// Reads what a driver says until it says no more.
pub(crate) struct Reader {
    host: Host,
    /// The layout of each stream and input; none where only its plugin knows it.
    layouts: BTreeMap<String, Option<Layout>>,
    shared: Shared,
    answers: Sender<Result<Value, PluginError>>,
}

impl Reader {
    pub(crate) fn new(
        manifest: &Manifest,
        host: Host,
        shared: Shared,
        answers: Sender<Result<Value, PluginError>>,
    ) -> Self {
        let streams = manifest.streams.iter().map(|stream| (stream.name.clone(), Layout::of(stream)));
        let inputs = manifest.inputs.iter().map(|input| (input.name.clone(), Layout::known(&input.message)));
        Self { host, layouts: streams.chain(inputs).collect(), shared, answers }
    }

    /// Reads to the end; anyone who waits for an answer learns of it, because the channel of answers ends with this.
    pub(crate) fn run(self, output: ChildStdout) {
        let mut output = BufReader::new(output);
        let mut line = Vec::new();
        loop {
            line.clear();
            let read = output.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
            match read {
                Ok(0) | Err(_) => return,
                Ok(_) if line.last() != Some(&b'\n') && line.len() as u64 == LONGEST_LINE => {
                    self.fail(PluginError::Failed(format!(
                        "the driver wrote a line of more than {LONGEST_LINE} bytes"
                    )));
                    return;
                }
                Ok(_) => {}
            }
            let text = String::from_utf8_lossy(&line);
            match understood(text.trim()) {
                Ok(line) => self.take(line),
                Err(why) => {
                    let short: String = text.trim().chars().take(200).collect();
                    self.fail(PluginError::Failed(format!(
                        "the driver wrote what is no message of its protocol ({why}): {short}"
                    )));
                }
            }
        }
    }

    fn fail(&self, error: PluginError) {
        // Nobody waits where the device has ended.
        let _ = self.answers.send(Err(error));
    }

    fn take(&self, line: Line) {
        match line {
            Line::Done(answer) => drop(self.answers.send(Ok(answer))),
            Line::Failed(error) => self.fail(error),
            Line::Log(level, text) => self.host.log(level, &text),
            Line::Progress(fraction, text) => self.host.progress(fraction, &text),
            Line::Emit { stream, message } => {
                if let Err(why) = self.emit(&stream, &message) {
                    locked(&self.shared.fault).get_or_insert(why);
                }
            }
            Line::AskTime => self.reply(Ok(self.host.now_ns().into())),
            Line::AskInput(input) => self.reply(self.next_of(&input)),
        }
    }

    fn emit(&self, stream: &str, fields: &Value) -> Result<(), String> {
        let layout = self.layouts.get(stream);
        let layout = layout.ok_or_else(|| {
            format!("the driver emits on '{stream}', which its plugin.yaml does not declare")
        })?;
        let bytes = message::from_json(layout.as_ref(), fields)
            .map_err(|why| format!("a message of the driver on '{stream}' cannot be used: {why}"))?;
        self.host.emit_bytes(stream, &bytes).map_err(|error| error.to_string())
    }

    /// The next message of an input, or null.
    fn next_of(&self, input: &str) -> Result<Value, PluginError> {
        let layout = self.layouts.get(input);
        let layout =
            layout.ok_or_else(|| PluginError::Refused(format!("plugin.yaml declares no input '{input}'")))?;
        let length = layout.as_ref().and_then(Layout::length);
        let mut bytes = vec![0; length.unwrap_or(LONGEST_INPUT)];
        let length = self.host.receive_bytes(input, &mut bytes)?;
        let taken = length.and_then(|length| bytes.get(..length));
        Ok(taken.map_or(Value::Null, |bytes| message::to_json(layout.as_ref(), bytes)))
    }

    fn reply(&self, answer: Result<Value, PluginError>) {
        let line = match answer {
            Ok(answer) => json!({"answer": answer}),
            Err(error) => json!({"error": error.text(), "kind": kind_of(&error)}),
        };
        // A driver that has ended asks nothing more.
        let _ = self.shared.send(&line);
    }
}

/// Passes on what a driver writes to its standard error, and keeps the last line: it says why a driver ended.
pub(crate) fn pass_on(errors: ChildStderr, last_words: &Mutex<String>, host: &Host) {
    for line in BufReader::new(errors).split(b'\n') {
        let Ok(line) = line else { return };
        let text = String::from_utf8_lossy(&line);
        if !text.trim().is_empty() {
            *locked(last_words) = text.trim().to_owned();
            host.log(LogLevel::Info, text.trim_end());
        }
    }
}
