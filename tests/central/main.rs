//! Many cells, one database: records are shipped to a real PostgreSQL server by the program as a lab starts it, and everything
//! that can be killed is killed.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "a test that cannot go on fails; the copy of a cell is shared with the tests of whole runs"
)]

mod alerts;
mod both_sides;
mod browser;
mod certificates;
mod cycle;
mod fleet;
mod fleet_alerts;
mod fleet_screen;
mod http;
#[path = "../run/lab.rs"]
mod lab;
mod network;
mod page;
mod protected;
mod receiver;
mod server;
mod soak;
#[path = "../screens/terminal.rs"]
mod terminal;
mod wait;

use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use both_sides::both_sides;
use cycle::cycle_ratio;
use lab::{Lab, kill};
use plumb_record::{NewRun, Record};
use server::Server;
use soak::{Figures, MOST_LAG_S, Plan, soak};
use wait::wait_until;

/// A fleet's page may be this far behind its cells, s (issue: lag under 2 s).
const LAG: Duration = Duration::from_secs(2);

/// A shipper that goes on in the background.
struct Shipper(Child);

impl Shipper {
    fn start(lab: &Lab, address: &str) -> Self {
        let mut command = lab.command(&["ship", "--to", address]);
        Self(command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap())
    }

    /// Kills it with -9; what it had complained of.
    fn kill(mut self) -> String {
        kill(self.0.id());
        self.complaints()
    }

    /// Ends it as systemd does; what it had complained of.
    fn end(&mut self) -> String {
        let process = i32::try_from(self.0.id()).unwrap();
        nix::sys::signal::kill(nix::unistd::Pid::from_raw(process), nix::sys::signal::Signal::SIGTERM)
            .unwrap();
        self.complaints()
    }

    fn complaints(&mut self) -> String {
        let mut text = String::new();
        std::io::Read::read_to_string(&mut self.0.stderr.take().unwrap(), &mut text).unwrap();
        self.0.wait().unwrap();
        text
    }
}

impl Drop for Shipper {
    fn drop(&mut self) {
        let _over = self.0.kill();
        let _over = self.0.wait();
    }
}

/// Writes a run with so many lines of its log.
fn write_run(state: &Path, lines: usize) {
    let mut record = Record::open(state).unwrap();
    let run = record.start_run(&NewRun { cell: "bench".into(), ..NewRun::default() }).unwrap();
    for line in 0..lines {
        record.note_log(run, "info", "test", None, &format!("line {line}")).unwrap();
    }
}

#[test]
fn a_run_is_shipped_row_by_row_and_the_fleet_shows_it() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let passed = lab.plumb(&["run", "cell.yaml", "--headless", "--pace", "fast"]);
    assert_eq!(passed.code(), 0, "{}", passed.all());
    let shipped = lab.plumb(&["ship", "--to", &address, "--once"]);
    assert_eq!(shipped.code(), 0, "{}", shipped.all());
    let (here, there) = both_sides(&lab, &server);
    assert!(here.lines().count() > 50 && here == there, "{} rows here", here.lines().count());

    let fleet = lab.plumb(&["fleet", "--from", &address]);
    assert!(fleet.out().contains("teachmover") && fleet.out().contains("passed"), "{}", fleet.all());
    assert!(fleet.out().contains("1 cell; 0 wait for an answer, 0 are silent"), "{}", fleet.out());
    let trend = lab.plumb(&["fleet", "--from", &address, "--trend", "arm.waist"]);
    assert!(trend.out().contains("1.7000"), "{}", trend.all());
    assert!(trend.out().contains("no control limits: they need 8 values"), "{}", trend.out());
    assert_eq!(server.ask("SELECT state FROM runs"), "passed");

    // Nothing is left: the second time sends nothing, and doubles nothing.
    let again = lab.plumb(&["ship", "--to", &address, "--once"]);
    assert!(again.out().contains(": 0 rows sent"), "{}", again.out());
    assert_eq!(both_sides(&lab, &server).1, here);
}

#[test]
fn a_prompt_that_waits_is_on_the_fleets_page_within_two_seconds() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let _shipper = Shipper::start(&lab, &address);
    let mut running = lab.start(&["run", "cell.yaml", "--attended", "--pace", "fast"]);
    running.until(|event| event["event"] == "prompt_asked");
    let lag = wait_until("the prompt is reported", Duration::from_secs(30), || {
        lab.plumb(&["fleet", "--from", &address]).out().contains("Lay the target")
    });
    assert!(lag < LAG, "{lag:?}");
    let page = lab.plumb(&["fleet", "--from", &address]).out();
    assert!(page.contains("WAITS for") && page.contains("1 waits for an answer"), "{page}");
    running.signal(nix::sys::signal::Signal::SIGTERM);
    running.end();
}

#[test]
fn a_shipper_and_a_server_killed_at_any_moment_lose_and_double_nothing() {
    let Some(mut server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    write_run(&lab.state(), 4_000);
    let rows_there = |server: &Server| server.ask("SELECT count(*) FROM outbox").parse::<usize>().unwrap();
    // Killed ever later, so that it is caught while it connects, makes tables, sends, and waits.
    for wait_ms in [20, 60, 110, 170, 240, 320] {
        let shipper = Shipper::start(&lab, &address);
        std::thread::sleep(Duration::from_millis(wait_ms));
        shipper.kill();
    }
    let shipper = Shipper::start(&lab, &address);
    server.kill();
    write_run(&lab.state(), 500);
    server.start();
    let all = Record::open(&lab.state()).unwrap().outbox_after(0, u32::MAX).unwrap().len();
    wait_until("everything is there", Duration::from_secs(60), || rows_there(&server) == all);
    let (here, there) = both_sides(&lab, &server);
    assert!(here == there, "the same rows, each once");
    let output = shipper.kill();
    assert!(output.contains("trying again every 2 s, nothing is lost"), "{output}");
}

#[test]
fn a_record_that_was_copied_and_went_on_is_reported_and_may_become_one_of_its_own() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    write_run(&lab.state(), 3);
    let copy = lab.path("copy");
    std::fs::create_dir(&copy).unwrap();
    Record::open(&lab.state()).unwrap().back_up(&copy.join("plumb.sqlite3")).unwrap();
    write_run(&lab.state(), 5);
    assert_eq!(lab.plumb(&["ship", "--to", &address, "--once"]).code(), 0);
    let before = server.ask("SELECT count(*) FROM outbox");

    write_run(&copy, 7);
    let copy = copy.to_str().unwrap();
    let refused = lab.plumb(&["ship", "--to", &address, "--once", "--record", copy]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert!(refused.err().contains("is a copy of another one"), "{}", refused.err());
    assert_eq!(server.ask("SELECT count(*) FROM outbox"), before, "nothing was sent");
    let own = lab.plumb(&["ship", "--to", &address, "--once", "--record", copy, "--new-identity"]);
    assert_eq!(own.code(), 0, "{}", own.all());
    assert_eq!(server.ask("SELECT count(DISTINCT record) FROM outbox"), "2");
}

#[test]
fn what_cannot_be_shipped_says_why() {
    let lab = Lab::new();
    let none = lab.plumb(&["ship", "--to", "postgres://localhost/plumb", "--once"]);
    assert_eq!(none.code(), 2);
    assert!(
        none.err().contains("there is no record in") && none.err().contains("plumb run"),
        "{}",
        none.err()
    );
    write_run(&lab.state(), 1);
    for (address, expected) in [
        ("lab-server", "an address looks like postgres://USER@HOST/DATABASE"),
        ("postgres://lab.example/plumb?sslmode=disable", "would send rows to lab.example unprotected"),
        // A port of this machine on which nothing listens: the discard service's.
        ("postgres://localhost:9/plumb", "does not answer"),
    ] {
        let printed = lab.plumb(&["ship", "--to", address, "--once"]);
        assert_eq!(printed.code(), 2, "{}", printed.all());
        assert!(printed.err().contains(expected), "{address}: {}", printed.err());
    }
    let trend = lab.plumb(&["fleet", "--from", "postgres://localhost:9/plumb", "--trend", "waist"]);
    assert_eq!(trend.code(), 2);
    assert!(trend.err().contains("`waist` is no correction: write DEVICE.JOINT"), "{}", trend.err());
}

/// The soak in short; `tests/cells_soak.rs` is the long one.
#[test]
fn cells_at_work_lose_and_double_nothing_while_everything_around_them_fails() {
    let time = Duration::from_secs(60);
    let plan =
        Plan { cells: 3, time, every: Duration::ZERO, between_failures: Duration::from_secs(3), seed: 7 };
    let Some(figures) = soak(plan) else { return };
    assert!(figures.wrong.is_empty() && figures.not_passed.is_empty(), "\n{figures}");
    assert!(figures.rows > 1_000 && !figures.failures.is_empty(), "\n{figures}");
    assert!(figures.most_lag_s().is_none_or(|lag| lag < MOST_LAG_S), "\n{figures}");
    // How a run's time compares is for a quiet machine and the long soak; here that both ways of running it work.
    let ratio = cycle_ratio(2).unwrap();
    for ratio_of in [ratio.wall, ratio.processor] {
        assert!(ratio_of.median.is_finite() && ratio_of.median > 0.0, "\n{ratio}");
    }
}

#[test]
fn a_soak_too_short_to_look_at_the_lag_says_so_and_is_not_sound() {
    let short = Figures::default();
    let message = short.to_string();
    assert!(message.contains("lag: not measured") && !message.contains("NaN"), "{message}");
    assert!(!short.is_sound(), "what was not measured is not good");
    let looked = Figures { lags_s: vec![0.2, 0.5], ..Figures::default() };
    assert!(looked.is_sound() && looked.to_string().contains("2 looks: median 0.20 s"), "{looked}");
    assert!(!Figures { lags_s: vec![0.2, 2.5], ..Figures::default() }.is_sound());
}
