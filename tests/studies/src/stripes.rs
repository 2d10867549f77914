//! `plumb-studies stripes`: sealed worlds, several at once, each measured as a user measures them: by runs of the cell, and by the lab.

mod figure;
mod outcome;
mod sealed_world;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use outcome::{HEADER, Outcome, line, summary, table};
use plumb::commands::stripe::study_world::Hidden;
use plumb::failure::CommandResult;
use plumb::interrupt::Interrupt;
use plumb::print_line;
use sealed_world::SealedWorld;

/// Options of `plumb-studies stripes`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Cells with a light stripe: each has procedures `direction-error` and `gather`, and a `scene.yaml` beside it. `cell-serial.yaml` has the arm driven
    /// through its terminal line.
    #[arg(default_values = ["workcells/light-stripe/cell.yaml", "workcells/light-stripe/modern.yaml"])]
    cells: Vec<PathBuf>,
    /// What is hidden, one after the other; each of them if left out.
    #[arg(long, value_enum)]
    hidden: Vec<Hidden>,
    /// So many worlds each.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The first world's seed.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// So many worlds at once; as many as there are processors if left out.
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=64))]
    jobs: Option<u64>,
}

/// Why a study is not whole.
#[derive(Debug, thiserror::Error)]
enum StudyEnd {
    #[error("name the folder for worlds, runs and results with --output DIR")]
    NoFolder,
    #[error("{}: {cause}", path.display())]
    File { path: PathBuf, cause: io::Error },
    #[error("the picture cannot be drawn: {0}")]
    Picture(String),
    #[error("nobody reads what it prints: {0}")]
    Output(#[from] io::Error),
    #[error("{failures} worlds could not be studied, as reported above; the same command studies these again and keeps what lies in {}", output.display())]
    Missing { failures: u32, output: PathBuf },
    #[error("interrupted; the same command goes on with what lies in {}", output.display())]
    Interrupted { output: PathBuf },
}

/// Studies the worlds and reports.
///
/// Worlds, runs and results go into the folder. Worlds whose result lies there already are not studied again, and the tables there are brought up to date with
/// every world.
///
/// # Errors
/// No folder was named, or a world could not be studied.
pub(crate) fn run(arguments: &Arguments, folder: Option<&Path>) -> CommandResult {
    let output = folder.ok_or(StudyEnd::NoFolder)?;
    fs::create_dir_all(output)?;
    let worlds = worlds(arguments, output);
    let interrupt = Interrupt::listen()?;
    print_line!("{HEADER}")?;
    let mut study = StripeStudy::new(&worlds, output)?;
    study.write()?;
    let missing: Vec<usize> = (0..worlds.len()).filter(|index| !study.has(*index)).collect();
    study.missing = missing.len();
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.map_or(cores, |jobs| jobs as usize).min(missing.len());
    let (study, next) = (Mutex::new(study), AtomicUsize::new(0));
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(index) = missing.get(next.fetch_add(1, Ordering::Relaxed)).copied() {
                    let Some(world) = worlds.get(index).filter(|_| !interrupt.is_asked()) else { return };
                    let studied = world.studied();
                    // What an interrupt ended is no failure.
                    if !interrupt.is_asked() || studied.is_ok() {
                        lock(&study).take(index, world, studied);
                    }
                }
            });
        }
    });
    let study = study.into_inner().unwrap_or_else(PoisonError::into_inner);
    study.end(interrupt.is_asked())
}

/// All worlds in the order they are studied: the first of each kind first, so that what is there before the end covers all kinds alike.
fn worlds<'a>(arguments: &'a Arguments, output: &'a Path) -> Vec<SealedWorld<'a>> {
    let hidden = if arguments.hidden.is_empty() { Hidden::ALL.to_vec() } else { arguments.hidden.clone() };
    let mut worlds = Vec::new();
    for seed in arguments.seed..arguments.seed + arguments.worlds {
        for hidden in hidden.iter().copied() {
            for cell in &arguments.cells {
                worlds.push(SealedWorld { cell, hidden, seed, output });
            }
        }
    }
    worlds
}

fn lock<'t, 'a>(study: &'t Mutex<StripeStudy<'a>>) -> MutexGuard<'t, StripeStudy<'a>> {
    study.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What has come out so far.
struct StripeStudy<'a> {
    output: &'a Path,
    /// Of each world, where it is known.
    outcomes: Vec<Option<Outcome>>,
    began: Instant,
    /// Worlds that were not known when it began.
    missing: usize,
    studied: usize,
    failures: u32,
    /// What could not be printed or written.
    trouble: Option<StudyEnd>,
}

impl<'a> StripeStudy<'a> {
    /// What lies there already.
    fn new(worlds: &[SealedWorld<'_>], output: &'a Path) -> io::Result<Self> {
        let outcomes: Vec<Option<Outcome>> = worlds.iter().map(SealedWorld::known).collect();
        for known in outcomes.iter().flatten() {
            print_line!("{}", line(known))?;
        }
        let began = Instant::now();
        Ok(Self { output, outcomes, began, missing: 0, studied: 0, failures: 0, trouble: None })
    }

    fn has(&self, index: usize) -> bool {
        self.outcomes.get(index).is_some_and(Option::is_some)
    }

    /// Takes in what became of a world, reports it, and brings the tables up to date.
    fn take(
        &mut self,
        index: usize,
        world: &SealedWorld<'_>,
        studied: Result<Outcome, sealed_world::StudyError>,
    ) {
        self.studied += 1;
        match studied {
            Ok(outcome) => {
                let printed = print_line!("{}", line(&outcome)).map_err(StudyEnd::from);
                if let Some(known) = self.outcomes.get_mut(index) {
                    *known = Some(outcome);
                }
                if let Err(trouble) = printed.and_then(|()| self.write()) {
                    self.trouble.get_or_insert(trouble);
                }
            }
            // The other worlds are studied nevertheless; it is reported at the end that some are missing.
            Err(error) => {
                self.failures += 1;
                eprintln!(
                    "{} with seed {} in {}: {error}",
                    world.hidden.name(),
                    world.seed,
                    world.cell.display()
                );
            }
        }
        let left = self.missing.saturating_sub(self.studied);
        let minutes = self.began.elapsed().as_secs_f64() / 60.0 / self.studied as f64 * left as f64;
        eprintln!("{} of {} worlds studied, about {minutes:.0} min left", self.studied, self.missing);
    }

    /// Those that are known, one kind after the other.
    fn in_order(&self) -> Vec<Outcome> {
        let mut known: Vec<Outcome> = self.outcomes.iter().flatten().cloned().collect();
        let kind = |one: &Outcome| Hidden::ALL.iter().position(|hidden| *hidden == one.hidden);
        known.sort_by(|a, b| (kind(a), &a.rig, a.seed).cmp(&(kind(b), &b.rig, b.seed)));
        known
    }

    /// Writes table, summary and picture of what is known.
    fn write(&self) -> Result<(), StudyEnd> {
        let known = self.in_order();
        let write = |name: &str, text: &str| {
            let path = self.output.join(name);
            fs::write(&path, text).map_err(|cause| StudyEnd::File { path, cause })
        };
        write("direction-error.csv", &table(&known))?;
        write("direction-error.md", &summary(&known))?;
        write("direction-error.svg", &figure::svg(&known).map_err(StudyEnd::Picture)?)
    }

    fn end(self, is_interrupted: bool) -> CommandResult {
        if let Some(trouble) = self.trouble {
            return Err(trouble.into());
        }
        print_line!("\n{}", summary(&self.in_order()).trim_end())?;
        let output = self.output.to_owned();
        if is_interrupted && self.studied < self.missing {
            return Err(StudyEnd::Interrupted { output }.into());
        }
        if self.failures > 0 {
            return Err(StudyEnd::Missing { failures: self.failures, output }.into());
        }
        Ok(ExitCode::SUCCESS)
    }
}
