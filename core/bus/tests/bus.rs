//! Streams, requests and signals between real processes.
//!
//! The second process is this test program again: a test marked `child` does its part when the environment names it, and else nothing.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::env;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use plumb_bus::{
    AsyncListener, Bus, Call, CallError, Domain, EmitError, IncomingRequest, ReceiveError, wait_any,
};
use plumb_plugin::{
    DigitalInputs, JointState, JointVector, Message, PluginError, Reply, Request, StreamDescription,
};
use tempfile::TempDir;

const LONG: Duration = Duration::from_secs(20);

struct TestFolder {
    domain: Domain,
    directory: TempDir,
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        // What a failed test leaves is not worth a second failure.
        let _ = self.domain.remove();
    }
}

/// A domain nobody else has.
fn folder() -> TestFolder {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let directory = tempfile::Builder::new().prefix("pb").tempdir_in("/dev/shm").unwrap();
    let prefix = format!("plumbtest_{}_{}_", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    TestFolder { domain: Domain::new(&prefix, &directory.path().join("r")).unwrap(), directory }
}

fn joints() -> StreamDescription {
    StreamDescription::of::<JointState>("joints")
}

fn state(time_ns: u64) -> JointState {
    JointState::new(time_ns, JointVector::zeros(6), false)
}

fn bytes<M: Message>(message: &M) -> &[u8] {
    bytemuck::bytes_of(message)
}

/// Starts this test program again to do the part of one child.
fn spawn_child(name: &str, folder: &TestFolder) -> Child {
    Command::new(env::current_exe().unwrap())
        .args(["--exact", name, "--nocapture", "--include-ignored"])
        .env("PLUMB_TEST_CHILD", name)
        .env("PLUMB_TEST_PREFIX", folder.domain.prefix())
        .env("PLUMB_TEST_ROOT", folder.domain.root())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The bus of the parent, in a child that plays the part `name`; `None` in an ordinary run of the test program.
fn child_bus(name: &str) -> Option<Bus> {
    if env::var("PLUMB_TEST_CHILD").ok()? != name {
        return None;
    }
    let domain =
        Domain::new(&env::var("PLUMB_TEST_PREFIX").unwrap(), env::var("PLUMB_TEST_ROOT").unwrap().as_ref());
    Some(Bus::open(&domain.unwrap(), name).unwrap())
}

fn wait_for_line(child: &mut Child, line: &str) {
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.any(|got| got.unwrap().contains(line)), "the child ended before it said '{line}'");
    // The rest of its output is taken in so that it never blocks on it.
    thread::spawn(move || lines.for_each(drop));
}

fn until<T>(mut condition: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + LONG;
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(Instant::now() < end, "the condition did not come true in {LONG:?}");
        thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn messages_arrive_in_order_and_numbered() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut receiver = bus.subscriber("arm", &joints()).unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    for time_ns in 0..100 {
        sender.emit(bytes(&state(time_ns))).unwrap();
    }
    for expected in 0..100 {
        let message: JointState = receiver.receive().unwrap().unwrap();
        assert_eq!((message.time_ns, message.sequence), (expected, expected));
    }
    assert_eq!(receiver.receive::<JointState>(), Ok(None));
}

#[test]
fn a_receiver_that_comes_late_gets_the_last_message() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    sender.emit(bytes(&state(1))).unwrap();
    sender.emit(bytes(&state(2))).unwrap();
    let mut receiver = bus.subscriber("arm", &joints()).unwrap();
    sender.emit(bytes(&state(3))).unwrap();
    let times: Vec<u64> =
        std::iter::from_fn(|| receiver.receive::<JointState>().unwrap()).map(|state| state.time_ns).collect();
    assert_eq!(times, [2, 3]);
}

#[test]
fn lost_messages_are_counted_and_reported_once() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let stream = StreamDescription { depth: Some(4), ..joints() };
    let mut receiver = bus.subscriber("arm", &stream).unwrap();
    let mut sender = bus.publisher("arm", &stream).unwrap();
    sender.emit(bytes(&state(0))).unwrap();
    assert!(receiver.receive::<JointState>().unwrap().is_some());
    for time_ns in 1..=10 {
        sender.emit(bytes(&state(time_ns))).unwrap();
    }
    let error = receiver.receive::<JointState>().unwrap_err();
    assert_eq!(error, ReceiveError::Lost { stream: "arm/joints".to_owned(), count: 6 });
    assert_eq!(error.to_string(), "6 messages of stream arm/joints were lost: it was not read fast enough");
    let times: Vec<u64> =
        std::iter::from_fn(|| receiver.receive::<JointState>().unwrap()).map(|state| state.time_ns).collect();
    assert_eq!(times, [7, 8, 9, 10]);
}

#[test]
fn messages_lost_from_a_sender_that_took_over_are_counted_from_its_first() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let stream = StreamDescription { depth: Some(4), ..joints() };
    let mut receiver = bus.subscriber("arm", &stream).unwrap();
    let mut first = bus.publisher("arm", &stream).unwrap();
    first.emit(bytes(&state(100))).unwrap();
    assert!(receiver.receive::<JointState>().unwrap().is_some());
    drop(first);
    let mut second = bus.publisher("arm", &stream).unwrap();
    for time_ns in 0..10 {
        second.emit(bytes(&state(time_ns))).unwrap();
    }
    // None of the second sender's messages was seen before, and its numbers begin at 0: the first six are gone.
    let error = receiver.receive::<JointState>().unwrap_err();
    assert_eq!(error, ReceiveError::Lost { stream: "arm/joints".to_owned(), count: 6 });
    let times: Vec<u64> =
        std::iter::from_fn(|| receiver.receive::<JointState>().unwrap()).map(|state| state.time_ns).collect();
    assert_eq!(times, [6, 7, 8, 9]);
}

#[test]
fn a_message_of_the_wrong_length_is_refused() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    let error = sender.emit(&[0; 24]).unwrap_err();
    assert!(matches!(error, EmitError::Length { length: 24, .. }));
    assert_eq!(error.to_string(), "a message of 24 bytes cannot go on stream arm/joints: its layout has 96");
}

#[test]
fn a_stream_of_another_layout_is_refused() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let _sender = bus.publisher("arm", &joints()).unwrap();
    let other = StreamDescription::of::<DigitalInputs>("joints");
    let message = bus.subscriber("arm", &other).unwrap_err().to_string();
    assert!(
        message.starts_with("stream arm/joints of digital-inputs/1 messages cannot be opened"),
        "{message}"
    );
}

#[test]
fn a_large_message_is_built_in_shared_memory() {
    const LENGTH: usize = 1_300_000;
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let frames = StreamDescription {
        name: "frames".to_owned(),
        message: "frame/1".to_owned(),
        max_bytes: Some(LENGTH),
        depth: None,
        fields: Vec::new(),
    };
    let mut receiver = bus.subscriber("camera", &frames).unwrap();
    let mut sender = bus.publisher("camera", &frames).unwrap();
    for round in 0..3_u8 {
        let mut frame = sender.loan(LENGTH).unwrap();
        frame.bytes_mut()[16..].fill(round);
        sender.send(frame).unwrap();
        let last = receiver.receive_with(|frame| (frame.len(), frame[LENGTH - 1])).unwrap();
        assert_eq!(last, Some((LENGTH, round)));
    }
}

#[test]
fn a_stream_crosses_processes_and_wakes_its_receiver() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut receiver = bus.subscriber("arm", &joints()).unwrap();
    let listener = bus.stream_listener("arm", &joints()).unwrap();
    let mut child = spawn_child("child_that_sends_a_thousand_states", &folder);
    let mut next = 0;
    while next < 1000 {
        wait_any(&[&listener], LONG).unwrap();
        listener.drain().unwrap();
        while let Some(state) = receiver.receive::<JointState>().unwrap() {
            assert_eq!(state.time_ns, next);
            next += 1;
        }
    }
    drop(child.stdin.take());
    assert!(child.wait().unwrap().success());
}

#[test]
#[ignore = "the second process of another test"]
fn child_that_sends_a_thousand_states() {
    let Some(bus) = child_bus("child_that_sends_a_thousand_states") else { return };
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    for time_ns in 0..1000 {
        sender.emit(bytes(&state(time_ns))).unwrap();
    }
    // What a sender leaves unread goes with it: stay until everything has arrived.
    assert_eq!(std::io::stdin().read_line(&mut String::new()).unwrap(), 0);
}

#[test]
fn a_request_crosses_processes_and_its_answer_comes_back() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut child = spawn_child("child_that_serves_requests", &folder);
    wait_for_line(&mut child, "serving");
    let client = bus.client("arm").unwrap();
    // Often enough for an answer to come at every point of the wait for it.
    for _ in 0..20_000 {
        let reply = client.call(&Request::ReadJoints, Call::within(LONG)).unwrap();
        assert_eq!(reply, Reply::Joints(state(7)));
    }
    let error = client.call(&Request::ReadInputs, Call::within(LONG)).unwrap_err();
    assert!(
        matches!(error, CallError::Refused(error) if error == PluginError::unsupported("read its input lines"))
    );
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_request_nobody_answers_in_time_is_an_error_with_the_limit() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let server = bus.server("arm").unwrap();
    let client = bus.client("arm").unwrap();
    let error = client.call(&Request::ReadJoints, Call::within(Duration::from_millis(30))).unwrap_err();
    assert_eq!(error.to_string(), "arm did not answer 'read joints' within 30ms");
    // The asker has given up: the device must not do it now.
    assert!(server.receive().unwrap().is_none());
}

#[test]
fn a_request_to_a_device_without_a_host_fails_at_once() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let client = bus.client("arm").unwrap();
    let error = client.call(&Request::Describe, Call::within(LONG)).unwrap_err();
    assert_eq!(error.to_string(), "arm is not served: its host does not run");
}

#[test]
#[ignore = "the second process of other tests"]
fn child_that_serves_requests() {
    let Some(bus) = child_bus("child_that_serves_requests") else { return };
    let server = bus.server("arm").unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    sender.emit(bytes(&state(1))).unwrap();
    println!("serving");
    loop {
        server.listener().wait(LONG).unwrap();
        while let Some(IncomingRequest { request, answer, .. }) = server.receive().unwrap() {
            let result = match request.unwrap() {
                Request::ReadJoints => Ok(Reply::Joints(state(7))),
                _ => Err(PluginError::unsupported("read its input lines")),
            };
            server.answer(answer, &result).unwrap();
        }
    }
}

#[test]
fn a_killed_server_is_replaced_at_once() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let client = bus.client("arm").unwrap();
    let mut receiver = bus.subscriber("arm", &joints()).unwrap();
    for round in 0..3 {
        let mut child = spawn_child("child_that_serves_requests", &folder);
        wait_for_line(&mut child, "serving");
        let reply = client.call(&Request::ReadJoints, Call::within(LONG)).unwrap();
        assert_eq!(reply, Reply::Joints(state(7)), "round {round}");
        assert_eq!(receiver.receive::<JointState>().unwrap().unwrap().time_ns, 1);
        child.kill().unwrap();
        child.wait().unwrap();
        bus.clean_after_the_dead();
        let error = client.call(&Request::ReadJoints, Call::within(LONG)).unwrap_err();
        assert!(matches!(error, CallError::NoHost { device } if device == "arm"), "round {round}");
    }
}

#[test]
fn nothing_is_left_after_a_kill_and_a_removal() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let client = bus.client("arm").unwrap();
    let mut child = spawn_child("child_that_serves_requests", &folder);
    wait_for_line(&mut child, "serving");
    client.call(&Request::ReadJoints, Call::within(LONG)).unwrap();
    assert!(!folder.domain.shared_memory().is_empty());
    child.kill().unwrap();
    child.wait().unwrap();
    drop(client);
    drop(bus);
    folder.domain.remove().unwrap();
    assert_eq!(folder.domain.shared_memory(), Vec::<std::path::PathBuf>::new());
    assert!(!folder.domain.root().exists());
    assert_eq!(std::fs::read_dir(folder.directory.path()).unwrap().count(), 0);
}

#[test]
fn what_a_domain_holds_is_its_owners_alone_and_a_directory_of_somebody_else_is_refused() {
    use std::os::unix::fs::PermissionsExt as _;

    let folder = folder();
    std::fs::create_dir_all(folder.domain.root()).unwrap();
    std::fs::set_permissions(folder.domain.root(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    let _receiver = bus.subscriber("arm", &joints()).unwrap();
    sender.emit(bytes(&state(1))).unwrap();
    let mut paths = folder.domain.shared_memory();
    assert!(paths.len() > 2, "{paths:?}");
    paths.push(folder.domain.root().to_owned());
    for path in paths {
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{} has {mode:o}", path.display());
    }
    let foreign = Domain::new("plumbtest_foreign_", "/proc/1".as_ref()).unwrap();
    assert!(Bus::open(&foreign, "test").is_err());
}

#[test]
fn a_domain_in_use_is_not_removed() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "orchestrator").unwrap();
    let message = folder.domain.remove().unwrap_err().to_string();
    let process = std::process::id();
    assert_eq!(message, format!("the cell's shared memory is in use by orchestrator (process {process})"));
    drop(bus);
    folder.domain.remove().unwrap();
}

#[test]
fn two_domains_do_not_meet() {
    let (one, other) = (folder(), folder());
    let (one, other) = (Bus::open(&one.domain, "one").unwrap(), Bus::open(&other.domain, "other").unwrap());
    let _server = one.server("arm").unwrap();
    let client = other.client("arm").unwrap();
    let error = client.call(&Request::Describe, Call::within(LONG)).unwrap_err();
    assert!(matches!(error, CallError::NoHost { device } if device == "arm"));
}

#[test]
fn a_signal_rung_twice_is_heard_and_then_silent() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let listener = bus.listener("stop/arm").unwrap();
    let signal = bus.signal("stop/arm").unwrap();
    signal.notify().unwrap();
    signal.notify().unwrap();
    assert!(listener.wait(LONG).unwrap() > 0);
    assert_eq!(listener.wait(Duration::ZERO).unwrap(), 0);
}

#[test]
fn a_signal_wakes_a_task() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let mut receiver = bus.subscriber("arm", &joints()).unwrap();
    let listener = bus.stream_listener("arm", &joints()).unwrap();
    let mut sender = bus.publisher("arm", &joints()).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let listener = AsyncListener::new(listener).unwrap();
        for time_ns in 0..100 {
            sender.emit(bytes(&state(time_ns))).unwrap();
            tokio::time::timeout(LONG, listener.notified()).await.unwrap().unwrap();
            assert_eq!(receiver.receive::<JointState>().unwrap().unwrap().time_ns, time_ns);
        }
    });
}

#[test]
fn a_task_that_waits_for_a_signal_goes_on_only_once_it_is_sent() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let (listener, signal) = (bus.listener("stop/arm").unwrap(), bus.signal("stop/arm").unwrap());
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let listener = AsyncListener::new(listener).unwrap();
        let soon = Duration::from_millis(50);
        assert!(tokio::time::timeout(soon, listener.notified()).await.is_err(), "nobody has sent it");
        signal.notify().unwrap();
        let count = tokio::time::timeout(LONG, listener.notified()).await.unwrap().unwrap();
        assert!(count > 0);
        assert!(tokio::time::timeout(soon, listener.notified()).await.is_err(), "it was taken");
        assert_eq!(format!("{listener:?}"), "AsyncListener(Listener(\"stop/arm\"))");
    });
}

#[test]
fn anyone_who_waits_for_signals_waits_as_long_as_was_said_or_until_one_is_sent() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let (one, other) = (bus.listener("one").unwrap(), bus.listener("other").unwrap());
    let limit = Duration::from_millis(120);
    let begun = Instant::now();
    wait_any(&[&one, &other], limit).unwrap();
    assert!(begun.elapsed() >= limit, "{:?}", begun.elapsed());
    bus.signal("other").unwrap().notify().unwrap();
    let begun = Instant::now();
    wait_any(&[&one, &other], LONG).unwrap();
    assert!(begun.elapsed() < LONG / 2);
    assert_eq!(one.drain().unwrap(), 0);
    assert!(other.drain().unwrap() > 0, "it stays to be drained");
}

#[test]
fn ports_and_the_bus_name_themselves() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let (sender, receiver) =
        (bus.publisher("arm", &joints()).unwrap(), bus.subscriber("arm", &joints()).unwrap());
    let (server, client) = (bus.server("arm").unwrap(), bus.client("arm").unwrap());
    assert_eq!((sender.stream(), receiver.stream(), client.device()), ("arm/joints", "arm/joints", "arm"));
    assert!(format!("{sender:?} {receiver:?}").matches("\"arm/joints\"").count() == 2);
    assert!(format!("{server:?} {client:?}").matches("\"arm\"").count() == 2);
    assert_eq!(format!("{:?}", bus.signal("stop/arm").unwrap()), "Signal(\"stop/arm\")");
    assert!(format!("{bus:?}").contains(folder.domain.prefix()));
    assert_eq!(Bus::stream_service("arm", &joints()), "stream/arm/joints");
    let users: Vec<String> = Bus::users(&folder.domain).iter().map(ToString::to_string).collect();
    assert_eq!(users.len(), 1, "{users:?}");
    assert!(users[0].contains("test") && users[0].contains(&std::process::id().to_string()), "{users:?}");
}

#[test]
fn a_third_sender_of_a_stream_waits_a_second_for_a_slot_and_is_refused_until_one_is_free() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let first = bus.publisher("arm", &joints()).unwrap();
    let _second = bus.publisher("arm", &joints()).unwrap();
    let begun = Instant::now();
    let error = bus.publisher("arm", &joints()).unwrap_err().to_string();
    let refused = begun.elapsed();
    assert!(refused >= Duration::from_secs(1), "{refused:?}");
    assert!(error.contains("the sending end of stream arm/joints"), "{error}");
    drop(first);
    bus.publisher("arm", &joints()).expect("a place that has become free is taken");
}

/// Settings whose JSON has so many bytes.
fn settings_of(bytes: usize) -> Request {
    Request::Configure("x".repeat(bytes - 2).into())
}

#[test]
fn a_request_and_an_answer_may_be_as_long_as_their_limit_and_no_longer() {
    let folder = folder();
    let bus = Bus::open(&folder.domain, "test").unwrap();
    let (server, client) = (bus.server("arm").unwrap(), bus.client("arm").unwrap());
    let limit = 64 * 1024;
    let error = client.call(&settings_of(limit + 1), Call::within(LONG)).unwrap_err();
    let CallError::TooLong { length, limit: allowed, .. } = error else { panic!("{error}") };
    assert_eq!((length, allowed), (limit + 1, limit));
    let answered = |text: usize| {
        thread::scope(|scope| {
            scope.spawn(|| {
                let incoming = until(|| server.receive().unwrap());
                assert_eq!(incoming.request.unwrap(), settings_of(limit));
                let answer = Err(PluginError::Failed("x".repeat(text)));
                server.answer(incoming.answer, &answer).unwrap();
            });
            match client.call(&settings_of(limit), Call::within(LONG)).unwrap_err() {
                CallError::Refused(error) => error.text().to_owned(),
                other => panic!("{other}"),
            }
        })
    };
    assert_eq!(answered(limit), "x".repeat(limit));
    assert_eq!(
        answered(limit + 1),
        format!("the answer has {} bytes; an answer may have {limit}", limit + 1)
    );
}

#[test]
fn the_bus_writes_nothing_to_the_terminal() {
    let folder = folder();
    let output = Command::new(env::current_exe().unwrap())
        .args(["--exact", "child_that_opens_and_closes", "--nocapture", "--include-ignored"])
        .env("PLUMB_TEST_CHILD", "child_that_opens_and_closes")
        .env("PLUMB_TEST_PREFIX", folder.domain.prefix())
        .env("PLUMB_TEST_ROOT", folder.domain.root())
        .current_dir(folder.directory.path())
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert!(!String::from_utf8_lossy(&output.stdout).contains("iceoryx"));
}

#[test]
#[ignore = "the second process of another test"]
fn child_that_opens_and_closes() {
    let Some(bus) = child_bus("child_that_opens_and_closes") else { return };
    let client = bus.client("arm").unwrap();
    assert!(client.call(&Request::Describe, Call::within(LONG)).is_err());
    until(|| bus.listener("stop/arm").ok());
}
