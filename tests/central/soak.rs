//! Many cells at work for long, while shippers, pages, the database and the network fail at random: no row may be lost or doubled, and what is
//! written has to be in the database within two seconds wherever nothing is broken.

use std::collections::BTreeMap;
use std::fmt;
use std::process::{Child, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use plumb_record::{Record, seconds_since};

use crate::lab::{Lab, kill};
use crate::network::Network;
use crate::server::Server;

/// How far behind the database may be, s, where nothing is broken.
pub(crate) const MOST_LAG_S: f64 = 2.0;

/// How long after something was mended it counts as whole: a shipper asks again every 2 s, gives up a dead connection after 10 s, and the server lets
/// go of it after 15 s.
const RECOVERY: Duration = Duration::from_secs(20);

/// How long the lag is looked at between failures, at least.
const MEASURED: Duration = Duration::from_secs(5);

/// How long something stays broken, at least.
const BROKEN: Duration = Duration::from_secs(3);

/// The failure that may last long.
const CUT: &str = "network cut";

/// How long until everything that was written has arrived at the end.
const PATIENCE: Duration = Duration::from_secs(120);

/// How large it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// Cells.
    pub(crate) cells: usize,
    /// For how long they work.
    pub(crate) time: Duration,
    /// How long from the start of a run of a cell to that of its next; with zero one follows the other.
    pub(crate) every: Duration,
    /// How long from one failure to the next.
    pub(crate) between_failures: Duration,
    /// Where chance begins.
    pub(crate) seed: u64,
}

/// What came of it.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    pub(crate) cells: usize,
    pub(crate) time: Duration,
    pub(crate) every: Duration,
    pub(crate) runs: usize,
    /// Runs that did not pass.
    pub(crate) not_passed: Vec<String>,
    pub(crate) rows: usize,
    /// Failures by kind.
    pub(crate) failures: BTreeMap<&'static str, usize>,
    /// How far the database was behind, s, at looks where nothing was broken; sorted.
    pub(crate) lags_s: Vec<f64>,
    /// Records of which the two sides differ at the end.
    pub(crate) wrong: Vec<String>,
    /// Why the network was not cut, where it was not.
    pub(crate) no_network: Option<String>,
}

impl Figures {
    /// The largest lag, s. None where it was never looked at.
    pub(crate) fn most_lag_s(&self) -> Option<f64> {
        self.lags_s.last().copied()
    }

    /// What was asked for: nothing lost or doubled, every run passed, and a lag that was looked at and small enough.
    pub(crate) fn is_sound(&self) -> bool {
        self.wrong.is_empty()
            && self.not_passed.is_empty()
            && self.most_lag_s().is_some_and(|lag| lag < MOST_LAG_S)
    }

    fn lag(&self) -> String {
        let Some(most) = self.most_lag_s() else {
            return format!(
                "lag: not measured; it is looked at from {} s after something was mended, and nothing was whole for so long: give it more time",
                RECOVERY.as_secs()
            );
        };
        // There is one lag at least, so the last index is 0 or more.
        let quantile = |part: f64| self.lags_s[((self.lags_s.len() - 1) as f64 * part) as usize];
        format!(
            "lag from {} s after something was mended, {} looks: median {:.2} s, 99 % {:.2} s, most {most:.2} s",
            RECOVERY.as_secs(),
            self.lags_s.len(),
            quantile(0.5),
            quantile(0.99)
        )
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pace = match self.every.as_secs_f64() {
            0.0 => "one run after the other".to_owned(),
            every => format!("a run every {every} s each"),
        };
        writeln!(
            formatter,
            "  {} cells for {} s, {pace}: {} runs, {} rows",
            self.cells,
            self.time.as_secs(),
            self.runs,
            self.rows
        )?;
        let failures: Vec<String> =
            self.failures.iter().map(|(what, count)| format!("{what} {count}")).collect();
        writeln!(formatter, "  failures: {}", failures.join(", "))?;
        if let Some(reason) = &self.no_network {
            writeln!(formatter, "  the network was not cut: {reason}")?;
        }
        writeln!(formatter, "  {}", self.lag())?;
        writeln!(formatter, "  runs that did not pass: {}", list(&self.not_passed))?;
        write!(formatter, "  rows lost or doubled: {}", list(&self.wrong))
    }
}

fn list(texts: &[String]) -> String {
    if texts.is_empty() { "none".to_owned() } else { texts.join("\n    ") }
}

/// One cell with what is beside it.
struct Cell {
    lab: Lab,
    shipper: Mutex<Option<Child>>,
    page: Mutex<Option<Child>>,
}

/// What all threads share.
struct Soak {
    cells: Vec<Cell>,
    server: Mutex<Server>,
    network: Result<Network, String>,
    over: AtomicBool,
    runs: AtomicUsize,
    not_passed: Mutex<Vec<String>>,
    /// When the last failure was mended; none while one lasts.
    whole_since: Mutex<Option<Instant>>,
}

/// Does it. None where PostgreSQL is not installed.
pub(crate) fn soak(plan: Plan) -> Option<Figures> {
    let network = Network::new();
    let server = match &network {
        Ok(network) => Server::listening_at(network.server_address())?,
        Err(_) => Server::new()?,
    };
    let cells =
        (0..plan.cells).map(|_| Cell { lab: Lab::new(), shipper: Mutex::new(None), page: Mutex::new(None) });
    let soak = Soak {
        cells: cells.collect(),
        server: Mutex::new(server),
        network,
        over: AtomicBool::new(false),
        runs: AtomicUsize::new(0),
        not_passed: Mutex::new(Vec::new()),
        whole_since: Mutex::new(Some(Instant::now())),
    };
    for cell in &soak.cells {
        soak.start_shipper(cell);
    }
    if let Some(first) = soak.cells.first() {
        start_page(first);
    }
    let (failures, mut lags_s) = std::thread::scope(|scope| {
        for (number, cell) in soak.cells.iter().enumerate() {
            let soak = &soak;
            scope.spawn(move || soak.work(number, cell, plan));
        }
        let watched = scope.spawn(|| soak.watch_lag());
        let failures = soak.fail(plan);
        soak.over.store(true, Ordering::Relaxed);
        (failures, watched.join().unwrap())
    });
    lags_s.sort_by(f64::total_cmp);
    let mut figures = Figures {
        cells: plan.cells,
        time: plan.time,
        every: plan.every,
        runs: soak.runs.load(Ordering::Relaxed),
        not_passed: soak.not_passed.lock().unwrap().clone(),
        failures,
        lags_s,
        no_network: soak.network.as_ref().err().cloned(),
        ..Figures::default()
    };
    soak.compare(&mut figures);
    Some(figures)
}

impl Soak {
    /// The program beside a cell, in the cell's own network where there is one.
    fn start_shipper(&self, cell: &Cell) {
        let server = self.server.lock().unwrap();
        let (address, plumb) = match &self.network {
            Ok(network) => {
                let address = format!(
                    "postgres://plumb@{}:{}/postgres?sslmode=require",
                    network.server_address(),
                    server.port()
                );
                (address, Some(network))
            }
            Err(_) => (server.address(), None),
        };
        let plain = cell.lab.command(&["ship", "--to", &address]);
        let mut command = match plumb {
            None => plain,
            Some(network) => network.inside(&plain),
        };
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        *cell.shipper.lock().unwrap() = Some(child);
    }

    /// Run after run until it is over.
    fn work(&self, number: usize, cell: &Cell, plan: Plan) {
        // Not all at the same moment.
        let apart = match plan.every {
            Duration::ZERO => Duration::from_millis(150),
            every => every / plan.cells as u32,
        };
        let mut start = Instant::now() + apart * number as u32;
        loop {
            while Instant::now() < start && !self.is_over() {
                std::thread::sleep(Duration::from_millis(50));
            }
            if self.is_over() {
                return;
            }
            start = Instant::now().max(start + plan.every);
            let output = cell.lab.plumb(&["run", "cell.yaml", "--headless", "--pace", "fast"]);
            self.runs.fetch_add(1, Ordering::Relaxed);
            if output.code() != 0 {
                let last = output.all().lines().last().unwrap_or_default().to_owned();
                self.not_passed.lock().unwrap().push(format!("cell {number}: {last}"));
            }
        }
    }

    fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// How old the oldest row of any cell is that the database does not have, s, at each look where nothing is broken.
    fn watch_lag(&self) -> Vec<f64> {
        let mut lags = Vec::new();
        let records: Vec<Record> =
            self.cells.iter().map(|cell| Record::open(&cell.lab.state()).unwrap()).collect();
        let identities: Vec<String> = records.iter().map(|record| record.identity().unwrap()).collect();
        while !self.is_over() {
            std::thread::sleep(Duration::from_millis(500));
            let is_whole =
                || self.whole_since.lock().unwrap().is_some_and(|since| since.elapsed() > RECOVERY);
            if !is_whole() {
                continue;
            }
            let question = "SELECT string_agg(r.record || ' ' || coalesce((SELECT max(sequence) FROM outbox o WHERE o.record = r.record), 0), ',') FROM records r";
            let Some(there) = self.server.lock().unwrap().asked(question) else { continue };
            let there: BTreeMap<&str, i64> = there
                .split(',')
                .filter_map(|pair| pair.split_once(' '))
                .map(|(record, last)| (record, last.parse().unwrap()))
                .collect();
            let lag = records.iter().zip(&identities).map(|(record, identity)| {
                let last = there.get(identity.as_str()).copied().unwrap_or(0);
                let first_missing = record.outbox_row(last + 1).unwrap();
                first_missing.and_then(|row| seconds_since(&row.made)).unwrap_or(0.0)
            });
            let lag = lag.fold(0.0, f64::max);
            // Something may have broken meanwhile.
            if is_whole() {
                lags.push(lag);
            }
        }
        lags
    }

    /// Breaks one thing after the other until the time is over; how often each.
    fn fail(&self, plan: Plan) -> BTreeMap<&'static str, usize> {
        let begin = Instant::now();
        let mut chance = Chance(plan.seed);
        let mut failures = BTreeMap::new();
        while begin.elapsed() + plan.between_failures < plan.time {
            // Half the time nothing follows for long enough to measure the lag.
            let calm = if chance.below(2) == 0 { RECOVERY + MEASURED } else { Duration::ZERO };
            std::thread::sleep(
                plan.between_failures + calm.min(plan.time.saturating_sub(begin.elapsed()) / 2),
            );
            *self.whole_since.lock().unwrap() = None;
            // The first cut is a long one: two minutes of an hour.
            let cut = if failures.contains_key(CUT) { BROKEN } else { BROKEN.max(plan.time / 30) };
            let what = self.break_something(&mut chance, cut);
            *failures.entry(what).or_default() += 1;
            *self.whole_since.lock().unwrap() = Some(Instant::now());
            eprintln!(
                "  after {} s: {what}; {} runs so far",
                begin.elapsed().as_secs(),
                self.runs.load(Ordering::Relaxed)
            );
        }
        std::thread::sleep(plan.time.saturating_sub(begin.elapsed()));
        failures
    }

    fn break_something(&self, chance: &mut Chance, cut: Duration) -> &'static str {
        let cell = &self.cells[chance.below(self.cells.len())];
        match chance.below(4) {
            0 => {
                // Every shipper, or one.
                let all = chance.below(3) == 0;
                let victims: Vec<&Cell> = if all { self.cells.iter().collect() } else { vec![cell] };
                victims.iter().for_each(|cell| end(&cell.shipper));
                std::thread::sleep(Duration::from_millis(chance.below(2_000) as u64));
                victims.iter().for_each(|cell| self.start_shipper(cell));
                "shippers killed"
            }
            1 => {
                let mut server = self.server.lock().unwrap();
                server.kill();
                std::thread::sleep(Duration::from_millis(chance.below(2_000) as u64));
                server.start();
                "database killed"
            }
            2 => {
                if let Some(first) = self.cells.first() {
                    end(&first.page);
                    start_page(first);
                }
                "page killed"
            }
            _ => {
                let Ok(network) = &self.network else { return "nothing" };
                network.cut();
                std::thread::sleep(cut + Duration::from_millis(chance.below(15_000) as u64));
                network.mend();
                CUT
            }
        }
    }

    /// Waits until everything has arrived, and compares both sides row by row.
    fn compare(&self, figures: &mut Figures) {
        let server = self.server.lock().unwrap();
        for (number, cell) in self.cells.iter().enumerate() {
            let record = Record::open(&cell.lab.state()).unwrap();
            let (identity, newest) = (record.identity().unwrap(), record.newest_outbox_row().unwrap());
            let begin = Instant::now();
            let last = || {
                server.ask(&format!(
                    "SELECT coalesce(max(sequence), 0) FROM outbox WHERE record = '{identity}'"
                ))
            };
            while last() != newest.to_string() && begin.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(200));
            }
            let (here, there) = crate::both_sides(&cell.lab, &server);
            figures.rows += here.lines().count();
            if here != there {
                let (own, other) = (here.lines().count(), there.lines().count());
                figures.wrong.push(format!("cell {number}: {own} rows here, {other} there"));
            }
        }
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        end(&self.shipper);
        end(&self.page);
    }
}

fn start_page(cell: &Cell) {
    let mut command = cell.lab.command(&["serve", "--listen", "127.0.0.1:0"]);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    *cell.page.lock().unwrap() = Some(child);
}

fn end(child: &Mutex<Option<Child>>) {
    if let Some(mut child) = child.lock().unwrap().take() {
        kill(child.id());
        child.wait().unwrap();
    }
}

/// Random numbers that are the same each time (Steele, Lea and Flood's splitmix64).
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }
}
