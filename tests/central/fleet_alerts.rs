//! People are informed of all cells from the central database: of a cell that has gone without a word, which cannot report itself, and of the database.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::lab::{CommandOutput, Lab, kill};
use crate::network::Network;
use crate::receiver::{Behaviour, Receiver};
use crate::server::Server;
use crate::{Shipper, wait_until, write_run};

/// How long a database that has just started may not have heard of its cells, and a little.
const STARTED: Duration = Duration::from_secs(60);

/// Whether shippers had the time after a restart that they are given to come back (`SHIPPERS_COME_BACK_S`).
const UP_FOR_SHIPPERS: &str = "SELECT now() - pg_postmaster_start_time() > interval '29.9 s'";

fn once(lab: &Lab, from: &str, receiver: &Receiver, more: &[&str]) -> CommandOutput {
    lab.plumb(&[&["alert", "--from", from, "--once", "--webhook", &receiver.address()], more].concat())
}

fn texts(receiver: &Receiver) -> Vec<String> {
    receiver.messages().iter().map(|message| message["text"].as_str().unwrap().to_owned()).collect()
}

fn is_up(server: &Server) -> bool {
    server.ask("SELECT now() - pg_postmaster_start_time() > interval '31 s'") == "t"
}

/// `plumb alert --from` that goes on.
struct Alert {
    child: Child,
    complaints: Arc<Mutex<String>>,
}

impl Alert {
    fn start(lab: &Lab, from: &str, receiver: &Receiver, more: &[&str]) -> Self {
        let address = receiver.address();
        let mut command = lab.command(&[&["alert", "--from", from, "--webhook", &address], more].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let complaints = Arc::new(Mutex::new(String::new()));
        let (lines, kept) = (BufReader::new(child.stderr.take().unwrap()).lines(), Arc::clone(&complaints));
        std::thread::spawn(move || {
            lines.map_while(Result::ok).for_each(|line| kept.lock().unwrap().push_str(&format!("{line}\n")));
        });
        Self { child, complaints }
    }

    fn complaints(&self) -> String {
        self.complaints.lock().unwrap().clone()
    }
}

impl Drop for Alert {
    fn drop(&mut self) {
        kill(self.child.id());
        let _over = self.child.wait();
    }
}

#[test]
fn a_cell_that_has_gone_without_a_word_is_reported_once_and_again_when_it_goes_again() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let receiver = Receiver::new(Behaviour::Answers(204));
    // The cell's machine dies in the middle of a step: nobody there can report it.
    let mut running = lab.start(&["run", "cell.yaml", "--headless"]);
    running.until(|event| event["event"] == "step_started" && event["step"] == "waist.lower");
    running.signal(Signal::SIGSTOP);
    let shipper = Shipper::start(&lab, &address);
    wait_until("the step is in the database", Duration::from_secs(20), || {
        server.asked("SELECT step FROM cells").is_some_and(|step| step == "waist.lower")
    });
    // From a machine that has no cell of its own.
    let office = Lab::new();
    let look = |more: &[&str]| {
        let output = once(&office, &address, &receiver, more);
        assert_eq!(output.code(), 0, "{}", output.all());
        texts(&receiver)
    };
    assert_eq!(look(&[]), Vec::<String>::new(), "a cell at work");
    shipper.kill();
    kill(running.process());
    running.end();

    wait_until("the database is up for long enough", STARTED, || is_up(&server));
    server.ask("UPDATE records SET last_seen = now() - interval '14 minutes'");
    assert_eq!(look(&[]), Vec::<String>::new(), "a quarter of an hour is what it may be silent");
    server.ask("UPDATE records SET last_seen = now() - interval '20 minutes'");
    let texts_sent = look(&[]);
    assert!(
        texts_sent.len() == 1
            && texts_sent[0].starts_with("teachmover: the database has heard nothing for 20 min")
            && texts_sent[0].contains("run 1 was open, at waist.lower")
            && texts_sent[0].contains("does `plumb ship` run there?"),
        "{texts_sent:?}"
    );
    let message = &receiver.messages()[0];
    assert_eq!((&message["kind"], &message["run"]), (&"silent".into(), &1.into()));
    assert_eq!(look(&["--step-after", "0s"]).len(), 1, "once; and whether its step goes on nobody knows");

    // It is back, and goes again.
    assert_eq!(lab.plumb(&["ship", "--once", "--to", &address]).code(), 0);
    assert_eq!(look(&[]).len(), 1);
    server.ask("UPDATE records SET last_seen = now() - interval '1 hour'");
    assert_eq!(look(&[]).len(), 2);
    // One that was taken out of use long ago is no news.
    server.ask("UPDATE records SET last_seen = now() - interval '60 days'");
    assert_eq!(look(&[]).len(), 2);
}

#[test]
fn a_cell_that_is_switched_off_in_good_order_is_off_and_nobody_is_called() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let receiver = Receiver::new(Behaviour::Answers(204));
    write_bad_end(&lab.state());
    let mut shipper = Shipper::start(&lab, &address);
    wait_until("the run is in the database", Duration::from_secs(20), || {
        server.asked("SELECT count(*) FROM runs").as_deref() == Some("1")
    });
    // What was written in the last moment is still sent.
    begin_run(&lab.state(), "bench-2");
    assert_eq!(shipper.end(), "", "it has nothing to complain of");
    let newest = plumb_record::Record::open(&lab.state()).unwrap().newest_outbox_row().unwrap();
    assert_eq!(server.ask("SELECT max(sequence) FROM outbox"), newest.to_string());
    wait_until("the database is up for long enough", STARTED, || is_up(&server));
    server.ask("UPDATE records SET last_seen = now() - interval '9 hours'");
    // Two cells of this record: the run of one is over, that of the other was open.
    assert_eq!(once(&lab, &address, &receiver, &[]).code(), 0);
    let messages = texts(&receiver);
    assert!(
        messages.len() == 1 && messages[0].starts_with("bench-2: the database has heard nothing"),
        "{messages:?}"
    );
    let fleet = lab.plumb(&["fleet", "--from", &address]).out();
    assert!(fleet.contains("(off for 9 h)") && fleet.contains("1 is silent, 1 is off"), "{fleet}");

    // On again, and gone without a word.
    let shipper = Shipper::start(&lab, &address);
    wait_until("it is back", Duration::from_secs(20), || {
        server.asked("SELECT signed_off IS NULL FROM records").as_deref() == Some("t")
    });
    shipper.kill();
    server.ask("UPDATE records SET last_seen = now() - interval '9 hours'");
    assert_eq!(once(&lab, &address, &receiver, &[]).code(), 0);
    assert!(texts(&receiver).iter().any(|text| text.starts_with("bench, bench-2")), "{:?}", texts(&receiver));
}

#[test]
fn a_shipper_that_ends_while_the_database_is_gone_says_that_its_cells_will_count_as_silent() {
    let Some(mut server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    write_bad_end(&lab.state());
    let mut shipper = Shipper::start(&lab, &address);
    wait_until("the run is in the database", Duration::from_secs(20), || {
        server.asked("SELECT count(*) FROM runs").as_deref() == Some("1")
    });
    server.kill();
    let error = shipper.end();
    assert!(error.contains("its cells will count as silent"), "{error}");
}

#[test]
fn prompts_late_steps_and_bad_ends_of_all_cells_are_reported_from_the_database() {
    let Some(server) = Server::new() else { return };
    let (lab, other, address) = (Lab::new(), Lab::new(), server.address());
    let receiver = Receiver::new(Behaviour::Answers(204));
    other.edit("cell.yaml", "cell: teachmover", "cell: bench-2");
    let _shippers = (Shipper::start(&lab, &address), Shipper::start(&other, &address));
    let mut asking = lab.start(&["run", "cell.yaml", "--attended", "--pace", "fast"]);
    asking.until(|event| event["event"] == "prompt_asked");
    let mut hanging = other.start(&["run", "cell.yaml", "--headless"]);
    hanging.until(|event| event["event"] == "step_started" && event["step"] == "waist.lower");
    hanging.signal(Signal::SIGSTOP);
    wait_until("both are in the database", Duration::from_secs(20), || {
        server
            .asked("SELECT count(*) FROM cells WHERE waits_for IS NOT NULL OR step = 'waist.lower'")
            .as_deref()
            == Some("2")
    });
    let messages_with = |more: &[&str]| {
        let output = once(&lab, &address, &receiver, more);
        assert_eq!(output.code(), 0, "{}", output.all());
        texts(&receiver)
    };
    assert_eq!(messages_with(&[]), Vec::<String>::new(), "neither has lasted for long");
    let prompt = messages_with(&["--prompt-after", "0s"]);
    assert!(
        prompt.len() == 1
            && prompt[0].starts_with("teachmover: `Lay the target` has waited for an answer for "),
        "{prompt:?}"
    );
    wait_until("the step is late", Duration::from_secs(60), || {
        messages_with(&["--prompt-after", "0s", "--step-after", "2s"]).len() == 2
    });
    let step = &texts(&receiver)[1];
    assert!(step.starts_with("bench-2: step waist.lower of run 1 has taken"), "{step}");
    hanging.signal(Signal::SIGCONT);
    hanging.signal(Signal::SIGTERM);
    asking.signal(Signal::SIGTERM);
    hanging.end();
    asking.end();
    write_bad_end(&other.state());
    wait_until("the end is in the database", Duration::from_secs(20), || {
        server.ask("SELECT count(*) FROM runs WHERE state = 'failed'") == "1"
    });
    assert_eq!(messages_with(&[]).len(), 2, "how runs end is reported where that is asked for");
    let ended = messages_with(&["--ended"]);
    assert!(
        ended.iter().any(|text| text == "bench: run 2 has ended: failed, line A was not found"),
        "{ended:?}"
    );
}

/// A run that goes on.
fn begin_run(state: &Path, cell: &str) {
    let mut record = plumb_record::Record::open(state).unwrap();
    let new = plumb_record::NewRun { cell: cell.into(), ..plumb_record::NewRun::default() };
    record.start_run(&new).unwrap();
}

/// A run that failed.
fn write_bad_end(state: &Path) {
    let mut record = plumb_record::Record::open(state).unwrap();
    let new = plumb_record::NewRun { cell: "bench".into(), ..plumb_record::NewRun::default() };
    let run = record.start_run(&new).unwrap();
    record.end_run(run, plumb_record::RunEnd::Failed, "line A was not found").unwrap();
}

#[test]
fn a_database_that_is_gone_is_reported_and_when_it_is_back_nobody_is_called_for_its_silence() {
    let Some(mut server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let receiver = Receiver::new(Behaviour::Answers(204));
    write_run(&lab.state(), 3);
    assert_eq!(lab.plumb(&["ship", "--once", "--to", &address]).code(), 0);
    wait_until("the database is up for long enough", STARTED, || is_up(&server));
    server.ask("UPDATE records SET last_seen = now() - interval '1 hour'");
    let alert = Alert::start(&lab, &address, &receiver, &["--silent-after", "3s"]);
    wait_until("the silent cell is reported", Duration::from_secs(20), || texts(&receiver).len() == 1);
    server.kill();
    wait_until("the database is reported", Duration::from_secs(40), || texts(&receiver).len() == 2);
    let message = &texts(&receiver)[1];
    assert!(
        message.starts_with("the central database has not answered for ")
            && message.contains("so no cell can be seen"),
        "{message}"
    );
    assert_eq!(receiver.messages()[1]["kind"], "database_silent");
    assert!(alert.complaints().contains("; trying again every 5 s"), "{}", alert.complaints());
    server.start();
    // Another cell, heard of before the database went: its shipper has not come back yet.
    server.ask("INSERT INTO records (record, host, directory, last_seen) SELECT 'b', 'bench-2', '/', now() - interval '1 minute'");
    server.ask("INSERT INTO outbox SELECT 'b', sequence, kind, number, made, body, sha256 FROM outbox");
    wait_until("it has not come back", STARTED, || texts(&receiver).len() > 2);
    assert_eq!(server.ask(UP_FOR_SHIPPERS), "t", "shippers had time to come back: {:?}", texts(&receiver));
    // A third falls silent: by the look that reports it, whatever was to be reported again of the others had been reported.
    server.ask("INSERT INTO records (record, host, directory, last_seen) SELECT 'c', 'bench-3', '/', now() - interval '1 minute'");
    server.ask("INSERT INTO outbox SELECT 'c', sequence, kind, number, made, body, sha256 FROM outbox WHERE record = 'b'");
    wait_until("the third is reported", STARTED, || {
        texts(&receiver).iter().any(|text| text.contains("bench-3"))
    });
    let all = texts(&receiver);
    assert!(all.len() == 4 && all[2].contains("bench-2"), "the first is not reported again: {all:?}");
}

#[test]
fn what_cannot_be_watched_says_why() {
    let lab = Lab::new();
    for (arguments, expected) in [
        (&["--from", "lab-server"][..], "an address looks like postgres://USER@HOST/DATABASE"),
        (&["--from", "postgres://localhost:9/plumb", "--once"], "does not answer"),
        (&["--silent-after", "5min"], "--from"),
        (&["--from", "postgres://localhost/plumb", "--silent-after", "5"], "write a time with its unit"),
        (&["--from", "postgres://localhost/plumb", "--record", "x"], "cannot be used with"),
        (&["--from", "postgres://lab.example/plumb?sslmode=disable"], "unprotected"),
    ] {
        let output = lab.plumb(&[&["alert", "--mail", "ada"], arguments].concat());
        assert!(output.code() == 2 && output.err().contains(expected), "{arguments:?}: {}", output.all());
    }
    assert!(!lab.state().join("fleet-alerts.json").exists());
}

#[test]
fn who_reaches_a_server_that_could_be_another_is_warned() {
    let Ok(network) = Network::new() else {
        eprintln!("skipped: a network of its own needs root");
        return;
    };
    let Some(server) = Server::listening_at(network.server_address()) else { return };
    let lab = Lab::new();
    write_run(&lab.state(), 3);
    let address = format!("postgres://plumb@{}:{}/postgres", network.server_address(), server.port());
    let warning = "encrypted, but nobody checks whether it is the right server: give sslmode=verify-full";
    for arguments in [&["ship", "--once", "--to"][..], &["fleet", "--from"]] {
        let output = lab.plumb(&[arguments, &[&address]].concat());
        assert!(output.code() == 0 && output.err().contains(warning), "{arguments:?}: {}", output.all());
    }
    let here = lab.plumb(&["ship", "--once", "--to", &server.address()]);
    assert!(here.code() == 0 && here.err().is_empty(), "nothing crosses a network: {}", here.err());
    let strict = lab.plumb(&["ship", "--once", "--to", &format!("{address}?sslmode=verify-full")]);
    assert!(strict.code() == 2 && strict.err().contains("UnknownIssuer"), "{}", strict.all());
}
