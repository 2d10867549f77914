//! What a host reports besides its answers: log lines, progress, output, its end.

use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Instant;

use nix::poll::{PollFd, PollFlags, poll};
use plumb_plugin::LogLevel;

use super::event::HostEvent;
use super::shared::Shared;
use crate::channel::FromHost;
use crate::flood::{Allowance, Flood, LONGEST_ANSWER, LONGEST_TEXT, REPORT_EVERY};
use crate::time_limits::{BEAT, HOST_SILENT, beats};

/// Reads a host's output until it ends. It is always taken in, however much there is: a plugin that prints must not wait for a reader. What is
/// more than the log takes is left out and counted.
pub(super) fn read_output(output: impl Read + AsFd, shared: &Shared) {
    OutputReader {
        output: BufReader::with_capacity(OUTPUT_BUFFER, output),
        shared,
        flood: Flood::new(Allowance::OUTPUT, Instant::now()),
        reported: Instant::now(),
    }
    .read_all();
}

/// A pipe holds this much; reading all of it at once keeps a plugin that prints running.
const OUTPUT_BUFFER: usize = 64 * 1024;

struct OutputReader<'a, R> {
    output: BufReader<R>,
    shared: &'a Shared,
    flood: Flood,
    /// When it was last reported that lines were left out.
    reported: Instant,
}

impl<R: Read + AsFd> OutputReader<'_, R> {
    fn read_all(mut self) {
        let mut line = Vec::new();
        loop {
            // What waits longer than a beat is shown, whether its line has ended or not.
            let waits = !line.is_empty() || self.flood.has_left_out();
            if waits && self.output.buffer().is_empty() && self.is_silent() {
                self.take(&mut line);
                self.report_left_out();
            }
            let Ok(piece) = self.output.fill_buf() else { break };
            if piece.is_empty() {
                break;
            }
            let room = piece.len().min(LONGEST_TEXT - line.len());
            let (taken, ends) = match piece.iter().take(room).position(|byte| *byte == b'\n') {
                Some(end) => (end + 1, true),
                None => (room, false),
            };
            line.extend_from_slice(piece.get(..taken).unwrap_or_default());
            self.output.consume(taken);
            if ends || line.len() >= LONGEST_TEXT {
                self.take(&mut line);
            }
        }
        self.take(&mut line);
        self.report_left_out();
    }

    /// Whether nothing comes for a beat.
    fn is_silent(&self) -> bool {
        let mut ready = [PollFd::new(self.output.get_ref().as_fd(), PollFlags::POLLIN)];
        matches!(poll(&mut ready, BEAT.as_millis() as u16), Ok(0))
    }

    fn take(&mut self, line: &mut Vec<u8>) {
        let now = Instant::now();
        let text = String::from_utf8_lossy(line.trim_ascii_end()).into_owned();
        line.clear();
        if text.is_empty() || !self.flood.lets_through(text.len(), now) {
            return;
        }
        if self.reported.elapsed() >= REPORT_EVERY {
            self.report_left_out();
        }
        self.shared.tail.push(text.clone());
        self.shared.report(self.shared.spans.under_way(), &HostEvent::Output { text });
    }

    fn report_left_out(&mut self) {
        let left_out = self.flood.take_left_out();
        if !left_out.is_none() {
            self.reported = Instant::now();
            self.shared.report(self.shared.spans.under_way(), &HostEvent::Output { text: left_out.line() });
        }
    }
}

/// Reads a host's lines until the connection ends; the first line that says how it started goes to `started`. With `minds_silence` a host that
/// has sent a line and then sends nothing for [`HOST_SILENT`] is killed: it does not run.
pub(super) fn read_lines(
    connection: UnixStream,
    shared: &Arc<Shared>,
    started: &Sender<FromHost>,
    minds_silence: bool,
) {
    // Where the system sets no time limit, a frozen host is noticed by the time limit of what it is asked.
    let _ = connection.set_read_timeout(Some(BEAT));
    let mut connection = BufReader::new(connection);
    let (mut line, mut silent_beats, mut has_spoken) = (Vec::new(), 0, false);
    loop {
        match connection.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(0) => return,
            Ok(_) => {
                (silent_beats, has_spoken) = (0, true);
                if line.ends_with(b"\n") {
                    handle_line(&line, shared, started);
                    line.clear();
                } else if line.len() as u64 >= LONGEST_LINE {
                    line.clear();
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                silent_beats += 1;
                if has_spoken && minds_silence && silent_beats >= beats(HOST_SILENT) {
                    shared.kill(&format!(
                        "its process did not run for {HOST_SILENT:?} (frozen by a signal, held by a debugger, or without computing time)"
                    ));
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return,
        }
    }
}

/// The longest line of a host: its description, with room.
const LONGEST_LINE: u64 = 4 * LONGEST_ANSWER as u64;

fn handle_line(line: &[u8], shared: &Arc<Shared>, started: &Sender<FromHost>) {
    match serde_json::from_slice(line) {
        Ok(FromHost::Alive) => {}
        Ok(FromHost::Log { level, text, span }) => shared.report(span, &HostEvent::Log { level, text }),
        Ok(FromHost::Progress { fraction, text, span }) => {
            shared.report(span, &HostEvent::Progress { fraction, text });
        }
        // A second line on how it started is not waited for.
        Ok(line) => drop(started.send(line)),
        Err(error) => {
            let text = format!("a line of the host of {} cannot be understood: {error}", shared.device);
            shared.report(0, &HostEvent::Log { level: LogLevel::Warn, text });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::io::{Write as _, pipe};
    use std::process::Command;
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, channel};

    use plumb_plugin::Manifest;

    use super::*;
    use crate::context::tests::Bench;
    use crate::{HostArguments, Plugin};

    /// What is shared of a host that has ended at once, and what is reported of it.
    fn host(bench: &Bench) -> (Arc<Shared>, Receiver<HostEvent>) {
        let manifest =
            "id: arm\ntitle: An arm\nversion: 0.1.0\ncontract: [1, 0]\nkind: robot\nlibrary: libarm.so\n";
        let plugin = Plugin {
            manifest: Manifest::parse(manifest, "plugin.yaml").unwrap(),
            manifest_path: "plugin.yaml".into(),
            library_path: "libarm.so".into(),
        };
        let mut child = Command::new("true").spawn().unwrap();
        child.wait().unwrap();
        let (events, reported) = channel();
        let events = Mutex::new(events);
        let listener = move |_: &str, event: &HostEvent| events.lock().unwrap().send(event.clone()).unwrap();
        let arguments = HostArguments::new("arm", &bench.domain, &plugin);
        (Shared::new(&arguments, bench.bus().clone(), &child, Box::new(listener)), reported)
    }

    /// The lines that are reported of an output.
    fn lines_of(output: impl Read + AsFd) -> Vec<String> {
        let bench = Bench::new();
        let (shared, reported) = host(&bench);
        read_output(output, &shared);
        let text = |event| match event {
            HostEvent::Output { text } => text,
            other => panic!("{other:?}"),
        };
        let lines: Vec<String> = reported.try_iter().map(text).collect();
        assert!(lines.ends_with(&shared.tail.lines()), "the last are kept: {lines:?}");
        lines
    }

    #[test]
    fn an_output_is_reported_line_by_line_without_empty_ones_and_with_an_end_that_no_line_ends() {
        let (output, mut writer) = pipe().unwrap();
        writer.write_all(b"one\n\n  two \t\r\n \nthree").unwrap();
        drop(writer);
        assert_eq!(lines_of(output), ["one", "  two", "three"]);
        let (nothing, writer) = pipe().unwrap();
        drop(writer);
        assert_eq!(lines_of(nothing), [] as [&str; 0]);
    }

    #[test]
    fn a_long_line_of_an_output_is_parted_also_where_it_is_read_in_two_pieces() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("output");
        // What is read at once ends in the long line.
        let text = "\n".repeat(OUTPUT_BUFFER - 1000) + &"x".repeat(LONGEST_TEXT + 900) + "\nend\n";
        fs::write(&file, text).unwrap();
        let lines = lines_of(File::open(&file).unwrap());
        assert_eq!(lines, ["x".repeat(LONGEST_TEXT), "x".repeat(900), "end".to_owned()]);
    }

    #[test]
    fn lines_that_come_too_fast_are_counted_where_they_are_left_out() {
        let bench = Bench::new();
        let (shared, reported) = host(&bench);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("output");
        fs::write(&file, "line\n".repeat(5000)).unwrap();
        read_output(File::open(&file).unwrap(), &shared);
        let texts = reported.try_iter().filter_map(|event| match event {
            HostEvent::Output { text } => Some(text),
            _ => None,
        });
        let (shown, counts): (Vec<String>, Vec<String>) = texts.partition(|text| text == "line");
        let left_out = counts.iter().map(|text| text.split(' ').next().unwrap().parse::<usize>().unwrap());
        assert_eq!(shown.len() + left_out.sum::<usize>(), 5000);
        assert!(shown.len() >= 200 && counts.iter().all(|text| text.contains("left out here")), "{counts:?}");
    }

    #[test]
    fn lines_of_a_host_are_reported_and_how_it_started_is_passed_on() {
        let bench = Bench::new();
        let (shared, reported) = host(&bench);
        let (started, how) = channel();
        let (connection, mut theirs) = UnixStream::pair().unwrap();
        let failed = FromHost::Failed { text: "no cable".to_owned() };
        let log = FromHost::Log { level: LogLevel::Info, text: "hello".to_owned(), span: 0 };
        let progress = FromHost::Progress { fraction: 0.5, text: "half of it".to_owned(), span: 0 };
        for line in [&FromHost::Alive, &log, &progress, &failed] {
            writeln!(theirs, "{}", serde_json::to_string(line).unwrap()).unwrap();
        }
        writeln!(theirs, "nonsense").unwrap();
        drop(theirs);
        read_lines(connection, &shared, &started, true);
        assert_eq!(how.try_iter().collect::<Vec<_>>(), [failed]);
        let events: Vec<HostEvent> = reported.try_iter().collect();
        assert_eq!(events.len(), 3, "{events:?}");
        assert_eq!(events[0], HostEvent::Log { level: LogLevel::Info, text: "hello".to_owned() });
        assert_eq!(events[1], HostEvent::Progress { fraction: 0.5, text: "half of it".to_owned() });
        let HostEvent::Log { level: LogLevel::Warn, text } = &events[2] else { panic!("{:?}", events[2]) };
        assert!(text.starts_with("a line of the host of arm cannot be understood: "), "{text}");
    }
}
