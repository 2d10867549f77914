//! What a plugin's calls to its host come to: messages out and in, and what is said of them.

use std::io::{BufRead as _, BufReader, Lines as ReadLines};
use std::os::unix::net::UnixStream;

use plumb_bus::{Bus, Domain};
use plumb_plugin::{JointState, JointVector, StreamDescription};

use super::*;

/// A context with the stream `joints`, and the other end of its lines.
pub(crate) struct Bench {
    pub(crate) context: Context,
    lines: ReadLines<BufReader<UnixStream>>,
    bus: Bus,
    pub(crate) domain: Domain,
    /// Dropped after everything above, which still uses the domain.
    _left: Left,
    _folder: tempfile::TempDir,
}

/// What is left of a domain once nobody uses it, removed.
struct Left(Domain);

impl Drop for Left {
    fn drop(&mut self) {
        // What a failed test leaves is not worth a second failure.
        let _ = self.0.remove();
    }
}

impl Bench {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::of_cell(&folder.path().join("cell.yaml")).unwrap();
        let bus = Bus::open(&domain, "test").unwrap();
        let (ours, theirs) = UnixStream::pair().unwrap();
        let context = Context::new(Lines::start(ours), "arm", Clock::default());
        context.add_stream("joints", bus.publisher("arm", &joints()).unwrap());
        let lines = BufReader::new(theirs).lines();
        let left = Left(domain.clone());
        Self { context, lines, bus, domain, _left: left, _folder: folder }
    }

    pub(crate) fn bus(&self) -> &Bus {
        &self.bus
    }

    /// The next line but the signs of life.
    fn next(&mut self) -> FromHost {
        self.context.flush();
        loop {
            match serde_json::from_str(&self.lines.next().unwrap().unwrap()).unwrap() {
                FromHost::Alive => {}
                line => return line,
            }
        }
    }

    /// The next line of the log.
    fn message(&mut self) -> (LogLevel, String, u64) {
        match self.next() {
            FromHost::Log { level, text, span } => (level, text, span),
            other => panic!("{other:?}"),
        }
    }
}

fn joints() -> StreamDescription {
    StreamDescription::of::<JointState>("joints")
}

/// A state that is dated so much later than now, s.
fn state(context: &Context, later_s: i64) -> JointState {
    let time_ns = context.clock.now_ns().saturating_add_signed(later_s * 1_000_000_000);
    JointState::new(time_ns, JointVector::zeros(6), false)
}

#[test]
fn messages_up_to_512_bytes_are_kept_as_the_last_of_their_stream() {
    let bench = Bench::new();
    let kept = |stream: &str| locked(&bench.context.last).get(stream).map(Vec::len);
    bench.context.remember("short", &[1; 512]);
    bench.context.remember("long", &[1; 513]);
    assert_eq!((kept("short"), kept("long")), (Some(512), None));
    bench.context.remember("short", &[2; 16]);
    assert_eq!(kept("short"), Some(16), "the newest takes the place of the one before");
}

#[test]
fn what_was_emitted_last_is_known_by_its_layout() {
    let bench = Bench::new();
    assert_eq!(bench.context.last_emitted::<JointState>("joints"), None);
    let sent = state(&bench.context, 0);
    assert_eq!(bench.context.emit("joints", bytemuck::bytes_of(&sent)), Status::OK);
    let last = bench.context.last_emitted::<JointState>("joints").unwrap();
    assert_eq!(last.time_ns, sent.time_ns);
    assert_eq!(bench.context.last_emitted::<plumb_plugin::Health>("joints"), None, "another layout");
    assert_eq!(bench.context.emit("joints", &[0; 8]), Status::REFUSED, "too short for its layout");
    assert_eq!(bench.context.last_emitted::<JointState>("joints").unwrap().time_ns, sent.time_ns);
}

#[test]
fn a_message_of_another_clock_is_refused_and_the_next_call_fails_with_the_first_such() {
    let mut bench = Bench::new();
    for later_s in [5, 7] {
        let wrong = state(&bench.context, later_s);
        assert_eq!(bench.context.emit("joints", bytemuck::bytes_of(&wrong)), Status::REFUSED);
        let (level, text, _) = bench.message();
        assert_eq!(level, LogLevel::Error);
        assert!(text.starts_with("the clock of arm is ") && text.contains("a message on `joints`"), "{text}");
    }
    let why = bench.context.take_misdated().unwrap();
    assert!(why.contains("is 5.0 s ahead of the clock of the cell"), "{why}");
    assert_eq!(bench.context.take_misdated(), None, "it is reported once");
    assert_eq!(bench.context.last_emitted::<JointState>("joints"), None);
    assert_eq!(bench.context.check_time("its state", bench.context.clock.now_ns()), Ok(()));
    assert!(bench.context.check_time("its state", 1).unwrap_err().contains("its state"));
}

#[test]
fn a_stream_or_input_the_plugin_does_not_have_is_refused_with_those_it_has() {
    let mut bench = Bench::new();
    bench.context.add_stream(
        "spare",
        bench.bus().publisher("arm", &StreamDescription::of::<JointState>("spare")).unwrap(),
    );
    let sent = state(&bench.context, 0);
    assert_eq!(bench.context.emit("joint", bytemuck::bytes_of(&sent)), Status::REFUSED);
    assert_eq!(bench.message().1, "the plugin uses stream 'joint'; it has joints, spare");
    assert_eq!(bench.context.loan("joint", size_of::<JointState>()), Err(Status::REFUSED));
    assert_eq!(bench.message().1, "the plugin uses stream 'joint'; it has joints, spare");
    assert_eq!(bench.context.receive("line", &mut [0; 8]), Err(Status::REFUSED));
    assert!(bench.message().1.starts_with("the plugin uses input 'line'; it has"));
}

#[test]
fn an_input_gives_its_messages_whole_or_says_how_long_they_are() {
    let mut bench = Bench::new();
    bench.context.add_input("from", bench.bus().subscriber("leg", &joints()).unwrap());
    let mut sender = bench.bus().publisher("leg", &joints()).unwrap();
    let length = size_of::<JointState>();
    let mut target = vec![0; length + 8];
    assert_eq!(bench.context.receive("from", &mut target), Err(Status::EMPTY));
    let sent = state(&bench.context, 0);
    sender.emit(bytemuck::bytes_of(&sent)).unwrap();
    assert_eq!(bench.context.receive("from", &mut target), Ok(length));
    assert_eq!(bytemuck::pod_read_unaligned::<JointState>(&target[..length]).time_ns, sent.time_ns);
    sender.emit(bytemuck::bytes_of(&sent)).unwrap();
    assert_eq!(bench.context.receive("from", &mut target[..length]), Ok(length), "just room enough");
    sender.emit(bytemuck::bytes_of(&sent)).unwrap();
    assert_eq!(bench.context.receive("from", &mut target[..8]), Err(Status::REFUSED));
    assert_eq!(
        bench.message().1,
        format!("a message of input 'from' has {length} bytes; the plugin takes 8")
    );
}

#[test]
fn a_message_is_built_in_what_was_lent_and_sent_once() {
    let mut bench = Bench::new();
    let mut receiver = bench.bus().subscriber("arm", &joints()).unwrap();
    let length = size_of::<JointState>();
    let lent = bench.context.loan("joints", length).unwrap();
    assert_eq!(bench.context.loan("joints", length), Err(Status::REFUSED), "one at a time");
    assert!(bench.message().1.starts_with("the plugin asks for a second message"));
    // A message of time 0 is of no clock of the cell's: nothing is sent.
    assert_eq!(bench.context.publish(lent, true), Status::REFUSED);
    bench.message();
    let lent = bench.context.loan("joints", length).unwrap();
    assert_eq!(bench.context.publish(lent, false), Status::OK, "taken back");
    assert_eq!(receiver.receive::<JointState>(), Ok(None));
    let lent = bench.context.loan("joints", length).unwrap();
    assert_eq!(bench.context.publish(lent.wrapping_add(8), true), Status::REFUSED);
    assert!(bench.message().1.starts_with("the plugin publishes another message than"));
    assert_eq!(bench.context.publish(lent, true), Status::REFUSED);
    assert_eq!(bench.message().1, "the plugin publishes a message it was not lent");
    assert!(bench.context.loan("joints", length + 8).is_err(), "a length that is not the layout's");
}

#[test]
fn what_is_said_names_the_call_it_served_and_progress_stays_between_0_and_1() {
    let mut bench = Bench::new();
    bench.context.report(LogLevel::Info, "one");
    bench.context.serve_under(7);
    bench.context.announce(LogLevel::Warn, "two");
    assert_eq!(bench.message(), (LogLevel::Info, "one".to_owned(), 0));
    assert_eq!(bench.message(), (LogLevel::Warn, "two".to_owned(), 7));
    for (given, shown) in [(0.25, 0.25), (1.5, 1.0), (-0.5, 0.0), (f64::NAN, 0.0), (f64::INFINITY, 0.0)] {
        bench.context.progress(given, "on");
        let FromHost::Progress { fraction, text, span } = bench.next() else { panic!("{given}") };
        assert_eq!((fraction, text.as_str(), span), (shown, "on", 7), "{given}");
    }
}

#[test]
fn a_failure_and_the_reason_of_an_end_are_kept_and_a_motion_is_known_while_it_lasts() {
    let bench = Bench::new();
    assert_eq!(bench.context.take_failure(), None);
    bench.context.fail("no light");
    assert_eq!(bench.context.take_failure().as_deref(), Some("no light"));
    assert_eq!(bench.context.take_failure(), None);
    assert_eq!(bench.context.ends_because(), None);
    bench.context.end_because("memory");
    assert_eq!(bench.context.ends_because().as_deref(), Some("memory"));
    assert_eq!(bench.context.ends_because().as_deref(), Some("memory"), "it stays");
    assert!(!bench.context.is_in_motion());
    assert!(bench.context.while_moving(|| bench.context.is_in_motion()));
    assert!(!bench.context.is_in_motion());
}
