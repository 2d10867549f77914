//! What people are to know of all cells of a central database.

use std::error::Error;
use std::thread::sleep;
use std::time::{Duration, Instant};

use plumb_central::{BadEnd, CellState, Central, CentralError, OpenStep, Reader};
use tokio::runtime::Runtime;

use super::sender::Sender;
use super::trouble::{Kind, Limits, RECENT_DAYS, Trouble, ended_text, late_text, minutes, waiting_text};
use crate::failure::with_causes;

/// How often the database is looked at. Its questions go over all cells, and a person who is called does not come within less.
const LOOK: Duration = Duration::from_secs(5);

/// How long the database may take for one look. On a network that was cut the system itself would wait for a quarter of an hour.
const ANSWER_WITHIN: Duration = Duration::from_secs(20);

/// How long after its start a database may not have heard of cells that are well, s: a shipper asks again every 2 s, but may wait 10 s each for a connection and for an answer.
const SHIPPERS_COME_BACK_S: f64 = 30.0;

/// A cell that was not heard of for longer was taken out of use, s.
const OUT_OF_USE_S: f64 = 31.0 * 86_400.0;

/// Looks at the database, and sends what is to be reported.
pub(super) struct Watch {
    reader: Reader,
    limits: Limits,
    /// How long a cell, or the database, may be silent.
    silent: Duration,
    sender: Sender,
    runtime: Runtime,
}

impl Watch {
    pub(super) fn new(
        from: &str,
        limits: Limits,
        silent: Duration,
        sender: Sender,
    ) -> Result<Self, std::io::Error> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        Ok(Self { reader: Reader::new(from, ANSWER_WITHIN), limits, silent, sender, runtime })
    }

    /// One look; whether everything has arrived.
    pub(super) fn once(&mut self) -> Result<bool, Box<dyn Error>> {
        let seen = self.look()?;
        self.report(&seen)
    }

    /// Where the database has only just started, silent cells may come back at once: they are not reported yet, and what was reported stays so.
    fn report(&mut self, seen: &Seen) -> Result<bool, Box<dyn Error>> {
        let found = seen.troubles(&self.limits, self.silent);
        if seen.up_s >= SHIPPERS_COME_BACK_S {
            return self.sender.report_all(&found);
        }
        let known: Vec<Trouble> = found.into_iter().filter(|trouble| trouble.kind != Kind::Silent).collect();
        self.sender.report_also(&known)
    }

    /// Look after look. Ends where the database can never be read: a wrong address, a wrong password.
    pub(super) fn forever(&mut self) -> Result<(), Box<dyn Error>> {
        let mut last_error = String::new();
        let mut silence: Option<(Instant, String)> = None;
        loop {
            let sent = match self.look() {
                Ok(seen) => {
                    silence = None;
                    self.report(&seen)
                }
                Err(error) if !error.may_pass() => return Err(error.into()),
                Err(error) => {
                    let (begin, since) =
                        silence.get_or_insert_with(|| (Instant::now(), plumb_record::timestamp()));
                    let silent = begin.elapsed();
                    let reported = if silent >= self.silent {
                        self.sender.report_also(&[database_silent(silent, since, &error)]).map(drop)
                    } else {
                        Ok(())
                    };
                    reported.and(Err(error.into()))
                }
            };
            // Said once, not at every look; the next may go better.
            let text = sent.err().map(|error| with_causes(error.as_ref())).unwrap_or_default();
            if !text.is_empty() && text != last_error {
                eprintln!("plumb alert: {text}; trying again every {} s", LOOK.as_secs());
            }
            last_error = text;
            sleep(LOOK);
        }
    }

    fn look(&mut self) -> Result<Seen, CentralError> {
        let ended = self.limits.ended;
        self.runtime.block_on(self.reader.ask(async |central| read(central, ended).await))
    }
}

/// What the database says.
struct Seen {
    cells: Vec<CellState>,
    steps: Vec<OpenStep>,
    ends: Vec<BadEnd>,
    /// For how long the server is up, s.
    up_s: f64,
}

async fn read(central: &mut Central, ended: bool) -> Result<Seen, CentralError> {
    let cells = central.cells().await?;
    let steps = central.open_steps().await?;
    let ends = if ended { central.bad_ends(RECENT_DAYS).await? } else { Vec::new() };
    Ok(Seen { cells, steps, ends, up_s: central.up_s().await? })
}

impl Seen {
    fn troubles(&self, limits: &Limits, silent: Duration) -> Vec<Trouble> {
        let mut found: Vec<Trouble> =
            self.cells.iter().filter_map(|cell| waiting(cell, limits.prompt)).collect();
        // Of a cell that is silent nobody knows whether the step still goes on: its silence is what is reported.
        let heard = |step: &&OpenStep| {
            !self.cells.iter().any(|cell| cell.record == step.record && is_silent(cell, silent))
        };
        found.extend(self.steps.iter().filter(heard).filter_map(|step| late(step, limits.step)));
        found.extend(self.ends.iter().map(ended));
        // Cells of one record have one shipper, and fall silent together.
        let mut silent: Vec<&CellState> = self.cells.iter().filter(|cell| is_silent(cell, silent)).collect();
        silent.sort_by(|one, other| (&one.record, &one.cell).cmp(&(&other.record, &other.cell)));
        found.extend(silent.chunk_by(|one, other| one.record == other.record).filter_map(nothing_heard));
        found
    }
}

/// A shipper that ended in good order while no run was open was switched off, and nobody is called.
fn is_silent(cell: &CellState, limit: Duration) -> bool {
    let off = cell.signed_off.is_some() && cell.state != "running";
    !off && (limit.as_secs_f64()..OUT_OF_USE_S).contains(&cell.silent_s)
}

fn waiting(cell: &CellState, limit: Duration) -> Option<Trouble> {
    let (waits_s, since) = (cell.waits_s?, cell.waits_since.as_deref()?);
    let title = cell.waits_for.as_deref().or(cell.step.as_deref()).unwrap_or("a prompt");
    let trouble = Trouble {
        key: format!("{} prompt {} {since}", cell.record, cell.run),
        kind: Kind::PromptWaits,
        cell: cell.cell.clone(),
        run: Some(cell.run),
        since: since.to_owned(),
        text: format!("{}: {}", cell.cell, waiting_text(title, waits_s, cell.run)),
    };
    (waits_s >= limit.as_secs_f64()).then_some(trouble)
}

fn late(step: &OpenStep, limit: Duration) -> Option<Trouble> {
    let late_s = step.open_s - step.planned_s.unwrap_or(0.0).max(0.0);
    let trouble = Trouble {
        key: format!("{} step {}", step.record, step.row),
        kind: Kind::StepLate,
        cell: step.cell.clone(),
        run: Some(step.run),
        since: step.started.clone(),
        text: format!("{}: {}", step.cell, late_text(&step.step, step.run, late_s)),
    };
    (late_s > limit.as_secs_f64()).then_some(trouble)
}

fn ended(end: &BadEnd) -> Trouble {
    Trouble {
        // A run that was resumed may end again.
        key: format!("{} ended {} {}", end.record, end.run, end.ended),
        kind: Kind::Ended,
        cell: end.cell.clone(),
        run: Some(end.run),
        since: end.ended.clone(),
        text: format!("{}: {}", end.cell, ended_text(end.run, &end.state, end.message.as_deref())),
    }
}

/// Of the cells of one record.
fn nothing_heard(cells: &[&CellState]) -> Option<Trouble> {
    let first = cells.first()?;
    let names: Vec<&str> = cells.iter().map(|cell| cell.cell.as_str()).collect();
    let open = cells.iter().find(|cell| cell.state == "running");
    let doing = match open {
        Some(cell) => {
            let at = cell.step.as_ref().map(|step| format!(", at {step}")).unwrap_or_default();
            format!("when last heard of, run {} was open{at}", cell.run)
        }
        None => "no run was open".to_owned(),
    };
    Some(Trouble {
        key: format!("{} silent {}", first.record, first.last_seen),
        kind: Kind::Silent,
        cell: names.join(", "),
        run: open.map(|cell| cell.run),
        since: first.last_seen.clone(),
        text: format!(
            "{}: the database has heard nothing for {} ({doing}): is the machine {} on, does its network work, does `plumb ship` run there?",
            names.join(", "),
            minutes(first.silent_s),
            first.host
        ),
    })
}

fn database_silent(silent: Duration, since: &str, error: &CentralError) -> Trouble {
    Trouble {
        // One at a time: it is forgotten when the database answers again.
        key: "database".to_owned(),
        kind: Kind::DatabaseSilent,
        cell: String::new(),
        run: None,
        since: since.to_owned(),
        text: format!(
            "the central database has not answered for {}, so no cell can be seen: {}",
            minutes(silent.as_secs_f64()),
            with_causes(error)
        ),
    }
}
