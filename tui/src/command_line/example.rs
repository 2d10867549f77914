//! An example of a command.

/// A line to type, and what it is for.
pub(super) struct Example {
    pub(super) line: &'static str,
    pub(super) what: &'static str,
}

pub(super) const fn example(line: &'static str, what: &'static str) -> Example {
    Example { line, what }
}

/// The examples of a command, by the words after `plumb`.
pub(super) type Entry = (&'static str, &'static [Example]);
