//! What this process itself logs, the bus and the libraries below it, passed on to the orchestrator as the plugin's lines are.

use std::fmt::{self, Write as _};

use plumb_plugin::LogLevel;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};

use crate::context::Context;

/// Passes on every event of plumb's own crates down to debug, and of other libraries down to warnings. It keeps no spans: the orchestrator
/// puts each line into the span of the call that was being served.
pub(super) struct OwnLog(pub(super) &'static Context);

/// Passes on what this process logs from here on.
pub(super) fn pass_on(context: &'static Context) {
    // Only a second call could fail, and there is one for each process.
    let _set_before = tracing::subscriber::set_global_default(OwnLog(context));
}

fn is_ours(target: &str) -> bool {
    target.starts_with("plumb")
}

impl Subscriber for OwnLog {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        if self.enabled(metadata) { Interest::always() } else { Interest::never() }
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        let least = if is_ours(metadata.target()) { Level::DEBUG } else { Level::WARN };
        metadata.is_event() && *metadata.level() <= least
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let metadata = event.metadata();
        let mut text = Text(format!("{}: ", metadata.target()));
        event.record(&mut text);
        let level = match *metadata.level() {
            // What a library below warns of is for authors; an operator is shown what plumb makes of it.
            _ if !is_ours(metadata.target()) => LogLevel::Debug,
            Level::ERROR => LogLevel::Error,
            Level::WARN => LogLevel::Warn,
            Level::INFO => LogLevel::Info,
            _ => LogLevel::Debug,
        };
        self.0.report(level, &text.0);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// An event's message, and its fields after it.
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        // Writing to a String cannot fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, " {name}={value:?}"),
        };
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, BufReader};
    use std::os::unix::net::UnixStream;

    use super::*;
    use crate::channel::FromHost;
    use crate::context::{Clock, Lines};

    /// A context, and what its orchestrator gets of the log.
    fn context() -> (&'static Context, impl FnMut() -> (LogLevel, String)) {
        let (ours, theirs) = UnixStream::pair().unwrap();
        let context: &'static Context =
            Box::leak(Box::new(Context::new(Lines::start(ours), "arm", Clock::default())));
        let mut lines = BufReader::new(theirs).lines();
        let next = move || loop {
            match serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap() {
                FromHost::Log { level, text, .. } => return (level, text),
                FromHost::Alive => {}
                other => panic!("{other:?}"),
            }
        };
        (context, next)
    }

    #[test]
    fn what_a_host_logs_reaches_the_orchestrator_and_chatter_of_libraries_does_not() {
        let (context, mut next) = context();
        tracing::subscriber::with_default(OwnLog(context), || {
            tracing::info!(target: "iceoryx2", "chatter");
            tracing::warn!(target: "iceoryx2", "old piece");
            tracing::debug!(target: "plumb_bus::domain", piece = 7, "removed");
        });
        context.flush();
        assert_eq!(next(), (LogLevel::Debug, "iceoryx2: old piece".to_owned()));
        assert_eq!(next(), (LogLevel::Debug, "plumb_bus::domain: removed piece=7".to_owned()));
    }

    #[test]
    fn what_plumb_itself_logs_keeps_its_level_and_its_finest_level_is_left_out() {
        let (context, mut next) = context();
        tracing::subscriber::with_default(OwnLog(context), || {
            tracing::trace!(target: "plumb_bus", "too fine");
            tracing::error!(target: "plumb_bus", "lost");
            tracing::warn!(target: "plumb_bus", "late");
            tracing::info!(target: "plumb_bus", "made");
            tracing::debug!(target: "plumb_bus", "seen");
            tracing::error!(target: "iceoryx2", "no memory");
            assert!(tracing::info_span!(target: "plumb_bus", "call").is_disabled(), "no spans are kept");
        });
        context.flush();
        let levels = [
            (LogLevel::Error, "plumb_bus: lost"),
            (LogLevel::Warn, "plumb_bus: late"),
            (LogLevel::Info, "plumb_bus: made"),
            (LogLevel::Debug, "plumb_bus: seen"),
            (LogLevel::Debug, "iceoryx2: no memory"),
        ];
        for (level, text) in levels {
            assert_eq!(next(), (level, text.to_owned()));
        }
    }
}
