//! The emulated controller over its pseudo-terminal: every file under `teachmover_emulator/` is a conversation with it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, Event, LineOptions, TerminalError};
use serde::Deserialize;

/// How long an answer may take; generous, because the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(20);

/// How long a line must be silent to be called so.
const SILENCE: Duration = Duration::from_millis(60);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Conversation {
    title: String,
    line: Vec<Turn>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Turn {
    /// The host sends these bytes.
    Send(String),
    /// The host hears exactly these bytes; nothing, if empty.
    Hear(String),
    /// Something happens to the arm.
    Happen(String),
}

struct Host {
    port: File,
}

impl Host {
    fn on(emulator: &Emulator) -> Host {
        let path = emulator.status().port.unwrap();
        Host { port: File::options().read(true).write(true).open(path).unwrap() }
    }

    fn send(&mut self, text: &str) {
        self.port.write_all(text.as_bytes()).unwrap();
    }

    /// The next `count` bytes, or those that come until the line has been silent for `patience`.
    fn hear(&mut self, count: usize, patience: Duration) -> String {
        let mut heard = Vec::new();
        while heard.len() < count {
            let mut polled = [PollFd::new(self.port.as_fd(), PollFlags::POLLIN)];
            if poll(&mut polled, PollTimeout::try_from(patience).unwrap()).unwrap() == 0 {
                break;
            }
            let mut bytes = [0; 256];
            let length = self.port.read(&mut bytes).unwrap();
            heard.extend_from_slice(&bytes[..length]);
        }
        heard.escape_ascii().to_string()
    }
}

/// An emulator as fast as it can be, open by 20 mm.
fn bare(options: LineOptions) -> Emulator {
    let at_once = options.baud.is_none();
    Emulator::start(options, Box::new(BareMotors::new(at_once, 20.0))).unwrap()
}

fn play(file: &Path) {
    let text = std::fs::read_to_string(file).unwrap();
    let conversation: Conversation =
        serde_yaml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut emulator = bare(LineOptions::default());
    let mut host = Host::on(&emulator);
    for (index, turn) in conversation.line.iter().enumerate() {
        let context = format!("{}, turn {} ({})", file.display(), index + 1, conversation.title);
        match turn {
            Turn::Send(text) => host.send(text),
            Turn::Hear(text) if text.is_empty() => assert_eq!(host.hear(1, SILENCE), "", "{context}"),
            Turn::Hear(text) => {
                let heard = host.hear(text.len(), PATIENCE);
                assert_eq!(heard, text.as_bytes().escape_ascii().to_string(), "{context}");
            }
            Turn::Happen(event) => {
                let event: Event = event.parse().unwrap_or_else(|error| panic!("{context}: {error}"));
                emulator.inject(event);
            }
        }
    }
    assert_eq!(host.hear(1, SILENCE), "", "{}: said too much", file.display());
    emulator.stop().unwrap();
}

#[test]
fn every_conversation_goes_as_its_file_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/teachmover_emulator");
    let files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(files.len() > 10, "the conversations are not found");
    let threads: Vec<_> =
        files.into_iter().map(|file| (file.clone(), std::thread::spawn(move || play(&file)))).collect();
    let failed: Vec<PathBuf> =
        threads.into_iter().filter_map(|(file, thread)| thread.join().is_err().then_some(file)).collect();
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn bytes_and_half_steps_take_their_time() {
    let emulator = bare(LineOptions { baud: Some(9600), ..LineOptions::default() });
    let mut host = Host::on(&emulator);
    let began = Instant::now();
    host.send("@STEP 220,20,0,0,0,0,0\r");
    assert_eq!(host.hear(2, PATIENCE), "1\\r");
    // 23 bytes there, 20 half-steps at 290 a second, 2 bytes back: never sooner, however busy the machine.
    let least = Duration::from_secs_f64(25.0 * 10.0 / 9600.0 + 20.0 * 35.0 / (141.0 * 72.0));
    assert!(began.elapsed() >= least, "{:?}", began.elapsed());
    let status = emulator.status();
    assert_eq!(status.registers, [20, 0, 0, 0, 0, 0]);
    assert!(status.last_half_step.unwrap() > began);
}

#[test]
fn a_key_stops_a_move_under_way() {
    let mut emulator = bare(LineOptions { baud: Some(9600), ..LineOptions::default() });
    let mut host = Host::on(&emulator);
    host.send("@STEP 0,2000,-1000,0,0,0,0\r");
    let deadline = Instant::now() + PATIENCE;
    while emulator.status().registers == [0; 6] && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    emulator.inject("key stop".parse().unwrap());
    assert_eq!(host.hear(2, PATIENCE), "2\\r");
    let [base, shoulder, ..] = emulator.status().registers;
    assert!(base > 0 && base < 2000);
    assert!((shoulder + base / 2).abs() <= 1, "{base} {shoulder}");
}

#[test]
fn the_plug_can_be_pulled_and_put_back() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("arm");
    let mut emulator = bare(LineOptions { link: Some(link.clone()), ..LineOptions::default() });
    Host::on(&emulator).send("@STEP 220,5,0,0,0,0,0\r");
    let wait_for = |emulator: &Emulator, there: bool| {
        let deadline = Instant::now() + PATIENCE;
        while emulator.status().port.is_some() != there && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(2));
        }
        assert_eq!(link.exists(), there);
    };
    let plugged_in = |emulator: &mut Emulator| {
        emulator.inject(Event::Plug);
        wait_for(emulator, true);
        Host { port: File::options().read(true).write(true).open(&link).unwrap() }
    };
    assert!(link.exists());
    let mut host = Host::on(&emulator);
    assert_eq!(host.hear(2, PATIENCE), "1\\r");
    emulator.inject(Event::Unplug);
    wait_for(&emulator, false);
    let mut host = plugged_in(&mut emulator);
    host.send("@READ\r");
    assert_eq!(host.hear(16, PATIENCE), "1\\r5,0,0,0,0,0,0\\r");
    // In mid-move: nothing is answered, and the arm moves on to the end.
    emulator.inject(Event::UnplugAfter(3));
    host.send("@STEP 220,5,0,0,0,0,0\r");
    wait_for(&emulator, false);
    let mut host = plugged_in(&mut emulator);
    host.send("@READ\r");
    assert_eq!(host.hear(17, PATIENCE), "1\\r10,0,0,0,0,0,0\\r");
    emulator.stop().unwrap();
    assert!(std::fs::symlink_metadata(&link).is_err(), "the link stays behind");
}

#[test]
fn a_file_where_the_link_would_be_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("arm");
    std::fs::write(&link, "precious").unwrap();
    let options = LineOptions { link: Some(link.clone()), ..LineOptions::default() };
    let error = Emulator::start(options, Box::new(BareMotors::new(true, 20.0))).unwrap_err();
    let text = format!("{} exists and is no link: choose another --link, or move it away", link.display());
    assert_eq!(error.to_string(), TerminalError::Occupied(link.clone()).to_string());
    assert_eq!(error.to_string(), text);
    assert_eq!(std::fs::read_to_string(&link).unwrap(), "precious");
}
