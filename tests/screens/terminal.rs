//! A program in a pseudo-terminal: keys go in, the drawn screen comes out. Waits are for conditions, with a deadline no
//! healthy program comes near.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::io::{Read as _, Write};
use std::num::NonZeroU16;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, ExitStatus, MasterPty, PtySize, native_pty_system};

/// How long a condition may take to come true before the test fails.
const DEADLINE: Duration = Duration::from_secs(60);

/// A running program and the terminal it draws on.
pub(crate) struct Session {
    shared: Arc<Shared>,
    keys: Box<dyn Write + Send>,
    child: Box<dyn Child + Send + Sync>,
    master: Box<dyn MasterPty + Send>,
    settings_before: String,
}

struct Shared {
    parser: Mutex<vt100::Parser>,
    changed: Condvar,
}

impl Session {
    /// Starts `program` in a terminal of this size. `TERM` is set and `NO_COLOR` is not, whatever the surroundings say.
    pub(crate) fn start(program: &Path, arguments: &[&str], columns: u16, rows: u16) -> Self {
        Self::start_with(program, arguments, &[], columns, rows)
    }

    /// Starts `program` with these variables in its environment.
    pub(crate) fn start_with(
        program: &Path,
        arguments: &[&str],
        variables: &[(&str, &str)],
        columns: u16,
        rows: u16,
    ) -> Self {
        let size = PtySize { rows, cols: columns, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).expect("a pseudo-terminal opens");
        let settings_before = settings(pair.master.as_ref());
        let mut command = CommandBuilder::new(program);
        command.args(arguments);
        command.cwd(std::env::current_dir().expect("there is a working directory"));
        command.env("TERM", "xterm-256color");
        command.env_remove("NO_COLOR");
        for (name, value) in variables {
            command.env(name, value);
        }
        let child = pair.slave.spawn_command(command).expect("the program starts");
        // Dropped, so that reading ends when the program does.
        drop(pair.slave);
        let mut output = pair.master.try_clone_reader().expect("the terminal can be read");
        let keys = pair.master.take_writer().expect("the terminal can be typed at");
        let (rows, columns) = (at_least_one(rows), at_least_one(columns));
        let parser = Mutex::new(vt100::Parser::new(rows, columns, 0));
        let shared = Arc::new(Shared { parser, changed: Condvar::new() });
        let reader = Arc::clone(&shared);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            let mut held = Vec::new();
            while let Ok(count @ 1..) = output.read(&mut bytes) {
                held.extend_from_slice(&bytes[..count]);
                let whole: Vec<u8> = held.drain(..whole_frames(&held)).collect();
                reader.parser.lock().unwrap_or_else(PoisonError::into_inner).process(&whole);
                reader.changed.notify_all();
            }
            reader.parser.lock().unwrap_or_else(PoisonError::into_inner).process(&held);
            reader.changed.notify_all();
        });
        Self { shared, keys, child, master: pair.master, settings_before }
    }

    /// Types `keys` as they are.
    pub(crate) fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("the terminal takes keys");
        self.keys.flush().expect("the terminal takes keys");
    }

    /// Clicks with the left button on the first position where `text` is.
    #[track_caller]
    pub(crate) fn click_on(&mut self, text: &str) {
        let page = self.wait_for(text);
        let position = page.lines().enumerate().find_map(|(row, line)| {
            let (before, _) = line.split_once(text)?;
            Some((before.chars().count() + 1, row + 1))
        });
        let (column, row) = position.expect("the text is on one line");
        // As a terminal reports it: SGR mouse mode, counted from 1.
        self.press(&format!("\x1b[<0;{column};{row}M\x1b[<0;{column};{row}m"));
    }

    /// Waits until the screen holds `text`, and gives the whole screen.
    #[track_caller]
    pub(crate) fn wait_for(&self, text: &str) -> String {
        self.wait_until(&format!("\u{201c}{text}\u{201d} on the screen"), |screen| {
            screen.contents().contains(text)
        });
        self.text()
    }

    /// Waits until the screen does not hold `text`.
    #[track_caller]
    pub(crate) fn wait_until_gone(&self, text: &str) {
        self.wait_until(&format!("\u{201c}{text}\u{201d} gone"), |screen| !screen.contents().contains(text));
    }

    /// Waits until `holds` is true of the screen.
    #[track_caller]
    pub(crate) fn wait_until(&self, what: &str, holds: impl Fn(&vt100::Screen) -> bool) {
        let began = Instant::now();
        let mut parser = self.shared.parser.lock().unwrap_or_else(PoisonError::into_inner);
        while !holds(parser.screen()) {
            let left = DEADLINE.saturating_sub(began.elapsed());
            assert!(
                !left.is_zero(),
                "waited in vain for {what}; the screen holds:\n{}",
                parser.screen().contents()
            );
            parser = self.shared.changed.wait_timeout(parser, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The screen as text.
    pub(crate) fn text(&self) -> String {
        self.with_screen(vt100::Screen::contents)
    }

    /// Looks at the screen.
    pub(crate) fn with_screen<T>(&self, look: impl FnOnce(&vt100::Screen) -> T) -> T {
        look(self.shared.parser.lock().unwrap_or_else(PoisonError::into_inner).screen())
    }

    /// Gives the terminal another size.
    pub(crate) fn resize(&self, columns: u16, rows: u16) {
        let size = PtySize { rows, cols: columns, pixel_width: 0, pixel_height: 0 };
        let mut parser = self.shared.parser.lock().unwrap_or_else(PoisonError::into_inner);
        parser.set_size(at_least_one(rows), at_least_one(columns));
        self.master.resize(size).expect("the terminal takes another size");
    }

    /// The program's process.
    pub(crate) fn process(&self) -> i32 {
        self.child.process_id().and_then(|id| i32::try_from(id).ok()).expect("the program runs")
    }

    /// Whether the terminal's settings are what they were before the program started.
    pub(crate) fn is_as_before(&self) -> bool {
        settings(self.master.as_ref()) == self.settings_before
    }

    /// Waits until the program ends.
    #[track_caller]
    pub(crate) fn wait_for_end(&mut self) -> ExitStatus {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("the program can be waited for") {
                return status;
            }
            assert!(
                began.elapsed() < DEADLINE,
                "the program did not end; the screen holds:\n{}",
                self.text()
            );
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        // A test that failed leaves no program behind; one that ended needs nothing.
        let _ended = self.child.kill();
        let _ended = self.child.wait();
    }
}

fn at_least_one(size: u16) -> NonZeroU16 {
    NonZeroU16::new(size).unwrap_or(NonZeroU16::MIN)
}

/// The settings (echo, lines, ...) of a terminal, to be compared.
fn settings(terminal: &dyn MasterPty) -> String {
    format!("{:?}", terminal.get_termios().expect("a terminal has settings"))
}

/// What begins and ends a frame (synchronized output, private mode 2026).
const FRAME: [&[u8]; 2] = [b"\x1b[?2026h", b"\x1b[?2026l"];

/// How much of the output can be shown so that no frame is seen half drawn.
fn whole_frames(output: &[u8]) -> usize {
    let last = |mark: &[u8]| output.windows(mark.len()).rposition(|window| window == mark);
    let begun = match (last(FRAME[0]), last(FRAME[1])) {
        (Some(begun), Some(ended)) if begun > ended => Some(begun),
        (Some(begun), None) => Some(begun),
        _ => None,
    };
    // A mark may have come in part.
    let cut = (1..FRAME[0].len()).rev().find(|length| output.ends_with(&FRAME[0][..*length]));
    begun.unwrap_or_else(|| output.len() - cut.unwrap_or(0))
}

/// Holds the terminal to be as it was before the program took it over.
#[track_caller]
pub(crate) fn is_given_back(session: &Session) {
    session.wait_until("the terminal given back", |screen| {
        !screen.alternate_screen()
            && !screen.hide_cursor()
            && screen.mouse_protocol_mode() == vt100::MouseProtocolMode::None
    });
    assert!(session.is_as_before(), "the terminal keeps settings of the program");
}
