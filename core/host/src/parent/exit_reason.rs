//! How a host process ended.

use std::fmt;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

use nix::sys::signal::Signal;

use crate::channel::exit_code;

/// How a host process ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExitReason {
    /// Its exit code, when it ended by itself.
    pub code: Option<i32>,
    /// The name of the signal that ended it, such as `SIGSEGV`.
    pub signal: Option<String>,
    /// Why the orchestrator killed it, when it did.
    pub killed_because: Option<String>,
    /// The last lines it wrote to its output, oldest first.
    pub last_output: Vec<String>,
}

impl ExitReason {
    pub(super) fn new(status: ExitStatus, killed_because: Option<String>, last_output: Vec<String>) -> Self {
        let signal = status.signal().map(|number| {
            Signal::try_from(number)
                .map_or_else(|_| format!("signal {number}"), |signal| signal.as_str().to_owned())
        });
        Self { code: status.code(), signal, killed_because, last_output }
    }

    /// Whether it ended because its device could not be made ready, which it reported to its orchestrator in words.
    pub fn is_reported(&self) -> bool {
        self.code == Some(i32::from(exit_code::FAILED))
    }

    /// What it wrote when it died because the system gave it no more memory: Rust's own words for that.
    fn refused_memory(&self) -> Option<&str> {
        let is_refusal =
            |line: &&String| line.starts_with("memory allocation of ") && line.ends_with(" failed");
        let line = self.last_output.iter().find(is_refusal)?;
        (self.signal.as_deref() == Some("SIGABRT")).then_some(line)
    }

    /// Whether it ended in good order.
    pub fn is_orderly(&self) -> bool {
        self.code == Some(0)
    }
}

impl fmt::Display for ExitReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.killed_because, &self.signal, self.code) {
            (Some(why), _, _) => write!(formatter, "was killed: {why}")?,
            (None, Some(signal), _) => write!(formatter, "was ended by {signal}")?,
            (None, None, Some(0)) => write!(formatter, "ended in good order")?,
            (None, None, Some(code)) => match u8::try_from(code) {
                Ok(exit_code::WATCHDOG) => write!(formatter, "ended itself: its plugin hung in a call")?,
                Ok(exit_code::ORPHANED) => write!(
                    formatter,
                    "ended itself: it was asked to end, or nobody was connected to it any more"
                )?,
                Ok(exit_code::BUS) => write!(formatter, "ended itself: its shared memory failed")?,
                Ok(exit_code::MEMORY) => write!(
                    formatter,
                    "ended itself: it took more memory than it may (`memory_limit_mb:` in the cell file)"
                )?,
                _ => write!(formatter, "ended with code {code}")?,
            },
            (None, None, None) => write!(formatter, "ended")?,
        }
        if let Some(refusal) = self.refused_memory() {
            return write!(formatter, "; {refusal} (the cell file may give it more with `memory_limit_mb:`)");
        }
        match self.last_output.last() {
            Some(line) if !self.is_orderly() => write!(formatter, "; the last it wrote: {line}"),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(code: Option<i32>, signal: Option<&str>, last: &[&str]) -> ExitReason {
        ExitReason {
            code,
            signal: signal.map(str::to_owned),
            killed_because: None,
            last_output: last.iter().map(|line| (*line).to_owned()).collect(),
        }
    }

    #[test]
    fn every_end_is_reported_in_words() {
        let reported = |code: u8| ended(Some(code.into()), None, &[]).to_string();
        assert_eq!(reported(0), "ended in good order");
        assert_eq!(reported(exit_code::WATCHDOG), "ended itself: its plugin hung in a call");
        assert!(reported(exit_code::ORPHANED).starts_with("ended itself: it was asked to end, or nobody"));
        assert_eq!(reported(exit_code::BUS), "ended itself: its shared memory failed");
        assert!(reported(exit_code::MEMORY).contains("`memory_limit_mb:`"));
        assert_eq!(reported(77), "ended with code 77");
        assert_eq!(ended(None, Some("SIGSEGV"), &[]).to_string(), "was ended by SIGSEGV");
        assert_eq!(ended(None, None, &[]).to_string(), "ended");
        let killed =
            ExitReason { killed_because: Some("late".into()), ..ended(Some(1), Some("SIGKILL"), &[]) };
        assert_eq!(killed.to_string(), "was killed: late");
        assert!(ended(Some(exit_code::FAILED.into()), None, &[]).is_reported());
        assert!(!ended(Some(0), None, &[]).is_reported() && !ended(None, None, &[]).is_orderly());
    }

    #[test]
    fn the_last_it_wrote_is_reported_unless_it_ended_well_and_refused_memory_above_all() {
        assert_eq!(ended(Some(0), None, &["bye"]).to_string(), "ended in good order");
        assert_eq!(
            ended(Some(9), None, &["a", "oops"]).to_string(),
            "ended with code 9; the last it wrote: oops"
        );
        let refusal = "memory allocation of 4096 bytes failed";
        let message = ended(None, Some("SIGABRT"), &[refusal, "more"]).to_string();
        assert!(message.contains(&format!("; {refusal} (the cell file may give it more")), "{message}");
        assert!(!ended(None, Some("SIGSEGV"), &[refusal]).to_string().contains("may give it more"));
        for other in ["memory allocation of 4096 bytes went well", "the allocation of 4096 bytes failed"] {
            assert!(!ended(None, Some("SIGABRT"), &[other]).to_string().contains("may give it more"));
        }
    }
}
