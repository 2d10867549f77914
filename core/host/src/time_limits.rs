//! Every time limit of a host and of what is asked of it, in one place. The table in `core/README.md` gives users the same numbers.

use std::time::Duration;

/// A host's start: the process, its library, its streams, and `create` of its plugin.
pub(crate) const READY_WITHIN: Duration = Duration::from_secs(15);

/// How often orchestrator and host signal each other that they run.
pub(crate) const BEAT: Duration = Duration::from_millis(250);

/// How long a host may be silent before it is taken as frozen and killed. A machine with ten times more work than processors delays a thread by
/// tenths of a second; this is far above that, and below the time limit of a call.
pub(crate) const HOST_SILENT: Duration = Duration::from_secs(5);

/// How long the orchestrator may be silent while a robot moves before the robot's host stops it. As for [`HOST_SILENT`], but an arm that moves with
/// nobody in charge is the graver matter, and a stop that was not needed does no harm.
pub(crate) const ORCHESTRATOR_SILENT: Duration = Duration::from_secs(2);

/// A request that moves nothing: describe, state, read joints, lines, configure, arm.
pub(crate) const SHORT: Duration = Duration::from_secs(5);

/// A request that prepares a device: switching motors on, looking for a reference.
pub(crate) const PREPARATION: Duration = Duration::from_secs(60);

/// A controller that sets its zeros: one that drives each joint through its range takes minutes.
pub(crate) const CALIBRATION: Duration = Duration::from_secs(900);

/// What a host does unasked: a poll of its inputs, a stop, its end.
pub(crate) const UNASKED: Duration = Duration::from_secs(5);

/// How long after its time limit a call may still run before the host ends itself.
pub(crate) const WATCHDOG_GRACE: Duration = Duration::from_secs(1);

/// How long a host whose orchestrator is gone has to bring its robot to rest.
pub(crate) const LAST_STOP: Duration = Duration::from_secs(3);

/// How long a host that is dropped may take to put its device away.
pub(crate) const FINISH_WITHIN: Duration = Duration::from_secs(6);

/// How long a host that has said its last word, or was killed, may take to be gone.
pub(crate) const ENDING: Duration = Duration::from_secs(3);

/// The time limit of every request when a debugger may hold the host or the orchestrator.
pub(crate) const UNDER_DEBUGGER: Duration = Duration::from_secs(24 * 3600);

/// How many silent beats make up a time of silence. Silence is counted in beats and not read from a clock: a process that was itself frozen
/// counts none meanwhile, and finds what came in the meantime before it counts the next.
pub(crate) const fn beats(silence: Duration) -> u32 {
    (silence.as_millis() / BEAT.as_millis()) as u32
}
