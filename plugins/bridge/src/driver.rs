//! A driver in a process of its own: started, called, stopped, ended.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use plumb_plugin::{Host, Manifest, PluginError, Value};
use serde_json::json;

use crate::reader::{Reader, Shared, locked, pass_on};

/// The version of the protocol.
const PROTOCOL: u32 = 1;

/// How often a call under way is looked at for a stop; the contract wants at least every 50 ms.
const LOOK: Duration = Duration::from_millis(5);

/// How long a driver has to end when it is asked to, or after it has closed its output. Half of what a host has.
const ENDING: Duration = Duration::from_secs(2);

/// How long the last words of a driver that has ended may take to arrive.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// A driver in a process of its own.
pub(crate) struct Driver {
    /// As its manifest has it, for messages.
    command: String,
    process: Child,
    shared: Shared,
    answers: Receiver<Result<Value, PluginError>>,
    host: Host,
    /// Why nothing more can be asked of it.
    gone: Option<String>,
}

impl Driver {
    /// Starts the command of a manifest in the manifest's folder. It belongs to the host's group of processes: anyone who ends the host ends it.
    pub(crate) fn start(manifest: &Manifest, folder: &Path, host: Host) -> Result<Self, PluginError> {
        let command = manifest.driver.join(" ");
        let Some((program, arguments)) = manifest.driver.split_first() else {
            return Err(PluginError::Refused("its manifest names no driver".to_owned()));
        };
        let mut process = Command::new(program);
        process.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if !folder.as_os_str().is_empty() {
            process.current_dir(folder);
        }
        let mut process = process.spawn().map_err(|error| {
            PluginError::Refused(format!(
                "its driver `{command}` cannot be started: {program}: {error}; install it, or name another command under `driver:` in plugin.yaml"
            ))
        })?;
        let pipes = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(PluginError::Failed("the system gave the driver no pipes".to_owned()));
        };
        let shared =
            Shared { stdin: Arc::new(Mutex::new(stdin)), fault: Arc::default(), last_words: Arc::default() };
        let (send, answers) = channel();
        let reader = Reader::new(manifest, host.clone(), shared.clone(), send);
        thread::spawn(move || reader.run(stdout));
        let (last_words, log) = (Arc::clone(&shared.last_words), host.clone());
        thread::spawn(move || pass_on(stderr, &last_words, &log));
        Ok(Self { command, process, shared, answers, host, gone: None })
    }

    /// Has the driver connect to its device; what it says about itself.
    pub(crate) fn create(&mut self, config: &Value) -> Result<Value, PluginError> {
        self.ask(&json!({"call": "create", "arguments": [config], "protocol": PROTOCOL, "stop": false}))
    }

    /// Calls a function of the driver and waits for its answer. A stop is passed on meanwhile.
    pub(crate) fn call(&mut self, name: &str, arguments: Value) -> Result<Value, PluginError> {
        self.ask(&json!({"call": name, "arguments": arguments, "stop": self.host.should_stop()}))
    }

    fn ask(&mut self, question: &Value) -> Result<Value, PluginError> {
        if let Some(why) = &self.gone {
            return Err(PluginError::Panicked(why.clone()));
        }
        let mut stop_requested = question["stop"] == true;
        if self.shared.send(question).is_err() {
            return Err(self.has_ended());
        }
        loop {
            let answer = self.answers.recv_timeout(LOOK);
            match answer {
                Ok(answer) => return self.checked(answer),
                Err(RecvTimeoutError::Disconnected) => return Err(self.has_ended()),
                Err(RecvTimeoutError::Timeout) if !stop_requested && self.host.should_stop() => {
                    stop_requested = true;
                    // A driver that does not take it has ended, which the next look finds.
                    let _ = self.shared.send(&json!({"stop": true}));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// An answer, unless something that was emitted before it could not be.
    fn checked(&self, answer: Result<Value, PluginError>) -> Result<Value, PluginError> {
        match (answer, locked(&self.shared.fault).take()) {
            (Ok(_), Some(fault)) => Err(PluginError::Refused(fault)),
            (answer, _) => answer,
        }
    }

    /// It will never answer again.
    fn has_ended(&mut self) -> PluginError {
        let how = match self.end_within(ENDING) {
            Some(how) => how,
            None => "it closed its output, did not end, and was killed".to_owned(),
        };
        thread::sleep(LAST_WORDS);
        let last_words = locked(&self.shared.last_words).clone();
        let colon = if last_words.is_empty() { "" } else { ": " };
        let why = format!(
            "its driver `{}` (process {}) has ended ({how}){colon}{last_words}",
            self.command,
            self.process.id()
        );
        self.gone = Some(why.clone());
        // As a panic: nothing that was known of the device holds any more, and a retry starts it anew.
        PluginError::Panicked(why)
    }

    /// How it ended; none when it had to be killed.
    fn end_within(&mut self, limit: Duration) -> Option<String> {
        let begin = Instant::now();
        while begin.elapsed() < limit {
            match self.process.try_wait() {
                Ok(Some(status)) => return Some(status.to_string()),
                Ok(None) => thread::sleep(LOOK),
                Err(_) => break,
            }
        }
        // Fails only where it has just ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
        None
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        if self.gone.is_none() {
            let _ = self.shared.send(&json!({"call": "close", "arguments": []}));
            self.end_within(ENDING);
        }
    }
}
