//! What happened: runs, steps, answers, trigger poses, corrections and model revisions.
//!
//! One SQLite file, `plumb.sqlite3`, in a directory of its own. Every write is with the system before it returns (write-ahead log), so that
//! a program killed at any moment loses nothing it was given; answers, corrections and the end of a run are on the disk as well. Nothing is overwritten that was found by a
//! run: a correction that is put in force, or taken back, is a new revision.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let directory = tempfile::tempdir()?;
//! use plumb_record::{NewRun, Record, RunEnd};
//!
//! let mut record = Record::open(directory.path())?;
//! let run = record.start_run(&NewRun { cell: "teachmover".into(), procedure: "initialize".into(), ..NewRun::default() })?;
//! record.end_run(run, RunEnd::Passed, "all steps passed")?;
//! assert_eq!(record.history(10)?.len(), 1);
//! # Ok(())
//! # }
//! ```

mod backup;
mod budget;
mod cell_lock;
mod correction;
mod error;
mod history;
mod instrument;
mod interruption;
mod loaded;
mod location;
mod lock_holders;
mod model_revision;
mod note;
mod offer;
mod outbox;
mod outbox_triggers;
mod owner_only;
mod prompt;
mod quantity;
mod queue;
mod queue_start;
mod reading;
mod record;
mod revision;
mod run;
mod run_id;
mod schema;
mod step;
mod trigger;
mod zero_loss;

pub use budget::{Budget, Component};
pub use cell_lock::{CellLock, LockHolder};
pub use correction::{AppliedCorrection, CorrectionKey, NewCorrection, StoredCorrection};
pub use error::RecordError;
pub use history::{RunFilter, TrendPoint};
pub use instrument::{Instrument, is_day, today};
pub use interruption::{Interruption, StoredInterruption, StoredLogLine};
pub use loaded::{ChangedLibrary, LoadedFile, sha256_hex};
pub use location::{default_directory, record_option};
pub use model_revision::StoredModelRevision;
pub use note::StoredNote;
pub use offer::Offer;
pub use outbox::OutboxRow;
pub use owner_only::create_owner_only_directory;
pub use prompt::{StoredAnswer, StoredPrompt};
pub use quantity::{CONTROLLER_ZERO, JOINT_ZERO, SENSOR_PARAMETER};
pub use queue::{NewQueueEntry, QueueEntry, QueuePosition};
pub use reading::{Reading, StoredReading};
pub use record::{LONGEST_WAIT, Record, seconds_since, timestamp};
pub use revision::{Revision, RolledBack};
pub use run::{NewRun, RunEnd, RunState, RunSummary, StoredPose};
pub use run_id::RunId;
pub use step::{OpenStep, PlannedRow, StepEnd, StoredStep};
pub use trigger::{StoredTrigger, Trigger};
pub use zero_loss::{LastPose, StoredZeroLoss};
