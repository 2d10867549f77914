//! What a shipper costs the run beside it: runs in turn, with a shipper at work on their record and with none.

use std::fmt;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeVal;

use plumb_estimation::median;
use plumb_record::Record;

use crate::lab::{Lab, kill};
use crate::server::Server;
use crate::wait::wait_until;

/// What a run took.
#[derive(Debug, Clone, Copy)]
struct Cost {
    /// By the clock, s.
    wall_s: f64,
    /// Of the processors, by the program and the processes it has started, s. Other programs on the machine lengthen it far less than the time by the clock.
    processor_s: f64,
}

/// A run beside a shipper over one without.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ratio {
    /// Median of the ratios of neighbouring runs.
    pub(crate) median: f64,
    /// Its standard error, from the median absolute deviation of the ratios.
    pub(crate) error: f64,
    /// Median of the runs without, s.
    pub(crate) without_s: f64,
}

impl Ratio {
    /// Of pairs: beside, without.
    fn of(pairs: &[(f64, f64)]) -> Self {
        let ratios: Vec<f64> = pairs.iter().map(|(beside, without)| beside / without).collect();
        let middle = median(&ratios);
        let apart: Vec<f64> = ratios.iter().map(|ratio| (ratio - middle).abs()).collect();
        // 1.4826: a normal spread's standard deviation in its median absolute deviations; 1.2533: error of a median over that of a mean.
        let error = 1.2533 * 1.4826 * median(&apart) / (pairs.len() as f64).sqrt();
        let without: Vec<f64> = pairs.iter().map(|(_, without)| *without).collect();
        Self { median: middle, error, without_s: median(&without) }
    }
}

/// Both ways to look at it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CycleRatio {
    /// Time by the clock.
    pub(crate) wall: Ratio,
    /// Processor time.
    pub(crate) processor: Ratio,
    /// How many pairs.
    pub(crate) pairs: usize,
}

impl fmt::Display for CycleRatio {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "  a run beside a shipper over one without, {} pairs in turn:", self.pairs)?;
        for (what, ratio) in [("time by the clock", self.wall), ("processor time", self.processor)] {
            writeln!(
                formatter,
                "    {what}: {:.4} +- {:.4} ({:.3} s a run without)",
                ratio.median, ratio.error, ratio.without_s
            )?;
        }
        Ok(())
    }
}

/// How long a shipper may take to connect and to send what was written while there was none.
const CONNECTED_WITHIN: Duration = Duration::from_secs(30);

/// How long it has to send the end of a run before the next is timed: it looks three times a second.
const CAUGHT_UP: Duration = Duration::from_millis(500);

/// After so many pairs the shipper goes to the other record.
const PAIRS_A_SHIPPER: usize = 10;

/// A shipper at work on one of the records.
struct Shipper(Child);

impl Shipper {
    /// At work: the database has heard of it, and has all rows of the record.
    fn start(lab: &Lab, server: &Server) -> Self {
        let record = Record::open(&lab.state()).unwrap();
        let begin = server.ask("SELECT now()");
        let child = lab.command(&["ship", "--to", &server.address()]).stdout(Stdio::null()).spawn().unwrap();
        let shipper = Self(child);
        wait_until("the shipper is at work", CONNECTED_WITHIN, || has_all(&record, server, &begin));
        shipper
    }
}

/// Whether a shipper was heard of since `begin`, by the database's clock, and has sent all rows.
fn has_all(record: &Record, server: &Server, begin: &str) -> bool {
    if server.ask("SELECT to_regclass('outbox') IS NULL OR to_regclass('records') IS NULL") == "t" {
        return false;
    }
    let own = record.identity().unwrap();
    let heard = format!("SELECT count(*) FROM records WHERE record = '{own}' AND last_seen > '{begin}'");
    let newest = format!("SELECT coalesce(max(sequence), 0) FROM outbox WHERE record = '{own}'");
    server.ask(&heard) == "1"
        && record.outbox_after(server.ask(&newest).parse().unwrap(), 1).unwrap().is_empty()
}

impl Drop for Shipper {
    fn drop(&mut self) {
        kill(self.0.id());
        let _over = self.0.wait();
    }
}

/// Runs in turn on two records, one with a shipper at work and one without; which comes first changes from pair to pair, and after some pairs the records
/// change places. (A shipper that was only held still would keep its place in the record's log, and so hold up those beside it.)
pub(crate) fn cycle_ratio(pairs: usize) -> Option<CycleRatio> {
    let server = Server::new()?;
    let labs = [Lab::new(), Lab::new()];
    // Files are read, and tables made, before anything is timed.
    for lab in &labs {
        let _shipper = Shipper::start(lab, &server);
        timed(lab);
    }
    // Who is the last to close a record folds its log into the file. A shipper spares a run that; so somebody holds both records open, as a page or alerts do.
    let _held: Vec<Record> = labs.iter().map(|lab| Record::open(&lab.state()).unwrap()).collect();
    let (mut wall, mut processor) = (Vec::new(), Vec::new());
    for (block, first) in (0..pairs).step_by(PAIRS_A_SHIPPER).enumerate() {
        let (beside, without) = (&labs[block % 2], &labs[1 - block % 2]);
        let _shipper = Shipper::start(beside, &server);
        for pair in first..pairs.min(first + PAIRS_A_SHIPPER) {
            let (one, other) = if pair.is_multiple_of(2) {
                let one = timed(beside);
                (one, timed(without))
            } else {
                let other = timed(without);
                (timed(beside), other)
            };
            wall.push((one.wall_s, other.wall_s));
            processor.push((one.processor_s, other.processor_s));
        }
    }
    Some(CycleRatio { wall: Ratio::of(&wall), processor: Ratio::of(&processor), pairs })
}

fn timed(lab: &Lab) -> Cost {
    let (begin, before_s) = (Instant::now(), processor_time_of_children_s());
    let output = lab.plumb(&["run", "cell.yaml", "--headless", "--pace", "fast"]);
    let wall_s = begin.elapsed().as_secs_f64();
    let processor_s = processor_time_of_children_s() - before_s;
    assert_eq!(output.code(), 0, "{}", output.all());
    std::thread::sleep(CAUGHT_UP);
    Cost { wall_s, processor_s }
}

/// Of children that have ended, and of theirs: a shipper that is at work is not among them.
fn processor_time_of_children_s() -> f64 {
    let used = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap();
    let seconds = |time: TimeVal| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6;
    seconds(used.user_time()) + seconds(used.system_time())
}
