//! What `plumb run` takes.

use std::io::IsTerminal as _;
use std::path::PathBuf;

use super::json_events::Requested;

/// Run a procedure of a cell. In a terminal the screens open; without one, or with --headless, it runs by itself with answers from a file.
#[derive(Default, clap::Args)]
pub(crate) struct Arguments {
    /// The cell file. With --resume it may be left out.
    #[arg(required_unless_present = "resume")]
    pub(super) cell: Option<PathBuf>,
    /// Which of the cell's procedures, by name or file; the first if left out.
    pub(super) procedure: Option<String>,
    /// Without screens; prompts are answered from a file.
    #[arg(long)]
    pub(super) headless: bool,
    /// The file of answers; the cell's own if left out.
    #[arg(long, value_name = "FILE")]
    pub(super) answers: Option<PathBuf>,
    /// Set a parameter of the procedure; can be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    pub(super) set: Vec<(String, f64)>,
    /// Print every event as a line of JSON; implies --headless. The first, `run_started`, has the `version` of the form.
    #[arg(long)]
    pub(super) json: bool,
    /// With --json: only these events, as in step_finished,run_ended; or all but some, as in no:joints,no:clearance.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "json")]
    events: Vec<Requested>,
    /// Go on with a run that was interrupted: the newest of the cell, or the one of this number.
    #[arg(long, value_name = "RUN", num_args = 0..=1)]
    #[expect(clippy::option_option, reason = "given, given with a number, or not given")]
    pub(super) resume: Option<Option<i64>>,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    pub(super) record: Option<PathBuf>,
    /// How the time of a simulated cell goes; without screens it is fast if left out.
    #[arg(long, value_enum)]
    pub(super) pace: Option<PaceArgument>,
    /// Who runs it, for the record; your login name if left out.
    #[arg(long, value_name = "NAME")]
    pub(super) operator: Option<String>,
    /// Without screens, but with somebody there: prompts wait for `plumb answer` from another terminal. Implies --headless.
    #[arg(long, conflicts_with = "answers")]
    pub(super) attended: bool,
    /// Print what the run would do, about how long it would take and what it would move within what limits. Nothing is started.
    #[arg(long, conflicts_with = "resume")]
    pub(super) dry_run: bool,
    /// Another port for a device than the cell file's, as in arm=/dev/ttyUSB1; can be given several times.
    #[arg(long, value_name = "DEVICE=PORT", value_parser = device_port)]
    pub(super) port: Vec<(String, String)>,
    /// Something to be remembered with the run; can be given several times.
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Vec<String>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    pub(super) plugins: Vec<PathBuf>,
    /// Run plugins whose files have changed since this cell ran with them last; asked at the start when somebody is there, refused when nobody is.
    #[arg(long)]
    pub(super) accept_plugins: bool,
    /// Let a debugger hold this program or a device's process: robots are not stopped because this program is silent, and nothing that a device is
    /// asked is too late.
    #[arg(long, visible_alias = "no-watchdog")]
    pub(super) debugger: bool,
    /// The entry of the record's queue that a new run carries out.
    #[arg(skip)]
    pub(super) queue_entry: Option<i64>,
}

/// How the time of a simulated world goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum PaceArgument {
    /// As on the wall.
    Real,
    /// As fast as can be.
    Fast,
}

/// What a run of the queue takes; the rest is as `plumb run --headless` has it.
pub(crate) struct OfQueue {
    /// The cell file.
    pub(crate) cell: PathBuf,
    /// Which of its procedures; the first if left out.
    pub(crate) procedure: Option<String>,
    /// Parameters other than their defaults.
    pub(crate) set: Vec<(String, f64)>,
    /// The file of answers; the cell's own if left out.
    pub(crate) answers: Option<PathBuf>,
    /// The entry it carries out.
    pub(crate) entry: Option<i64>,
    /// The run to go on with, instead of a new one.
    pub(crate) resume: Option<i64>,
    /// Where the record lies.
    pub(crate) record: PathBuf,
    /// Who runs it.
    pub(crate) operator: String,
    /// How the time of a simulated cell goes.
    pub(crate) pace: Option<PaceArgument>,
    /// Look for plugins here too.
    pub(crate) plugins: Vec<PathBuf>,
    /// Run plugins whose files have changed.
    pub(crate) accept_plugins: bool,
    /// Print every event as a line of JSON.
    pub(crate) json: bool,
}

impl From<OfQueue> for Arguments {
    fn from(queue: OfQueue) -> Self {
        Self {
            cell: Some(queue.cell),
            procedure: queue.procedure,
            headless: true,
            answers: queue.answers,
            set: queue.set,
            json: queue.json,
            resume: queue.resume.map(Some),
            record: Some(queue.record),
            pace: queue.pace,
            operator: Some(queue.operator),
            plugins: queue.plugins,
            accept_plugins: queue.accept_plugins,
            queue_entry: queue.entry,
            ..Self::default()
        }
    }
}

impl Arguments {
    /// Which events are printed as JSON; none where lines are printed for people.
    pub(super) fn json_events(&self) -> Option<Vec<Requested>> {
        self.json.then(|| self.events.clone())
    }

    /// There are no screens.
    pub(super) fn is_headless(&self) -> bool {
        self.headless || self.json || self.attended || !std::io::stdout().is_terminal()
    }

    /// Nobody is there to answer.
    pub(super) fn is_unattended(&self) -> bool {
        self.is_headless() && !self.attended
    }
}

/// Reads `DEVICE=PORT`.
fn device_port(text: &str) -> Result<(String, String), String> {
    let named = text.split_once('=').filter(|(device, port)| !device.is_empty() && !port.is_empty());
    let (device, port) = named.ok_or("write DEVICE=PORT, as in arm=/dev/ttyUSB1")?;
    Ok((device.to_owned(), port.to_owned()))
}

/// Reads `NAME=VALUE`.
pub fn parameter(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, as in Br_deg=5")?;
    let value = value.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    let value = value.ok_or("the value is a number; its unit is the end of the parameter's name")?;
    Ok((name.trim().to_owned(), value))
}
