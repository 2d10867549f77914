//! One thing the doctor has looked at.

use serde::Serialize;

/// How it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Mark {
    /// As it should be.
    Good,
    /// Not wrong, but worth knowing.
    Note,
    /// Something will not work until it is mended.
    Wrong,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    /// Which part of the machine.
    pub(super) topic: &'static str,
    pub(super) mark: Mark,
    /// What was seen.
    pub(super) text: String,
    /// How to mend it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mend: Option<String>,
}

impl Finding {
    pub(super) fn good(topic: &'static str, text: impl Into<String>) -> Self {
        Self { topic, mark: Mark::Good, text: text.into(), mend: None }
    }

    pub(super) fn note(topic: &'static str, text: impl Into<String>) -> Self {
        Self { mark: Mark::Note, ..Self::good(topic, text) }
    }

    pub(super) fn wrong(topic: &'static str, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { mark: Mark::Wrong, ..Self::good(topic, text) }.mend(mend)
    }

    /// What was seen, as a line.
    pub(super) fn line(&self) -> String {
        let mark = match self.mark {
            Mark::Good => "good",
            Mark::Note => "note",
            Mark::Wrong => "WRONG",
        };
        format!("{:<14} {mark:<5}  {}", self.topic, self.text)
    }

    pub(super) fn mend(mut self, how: impl Into<String>) -> Self {
        self.mend = Some(how.into());
        self
    }
}

/// Bytes, for people.
pub(super) fn size(bytes: u64) -> String {
    const MEGABYTE: f64 = 1e6;
    let bytes = bytes as f64;
    match bytes {
        0.0..1e3 => format!("{bytes:.0} bytes"),
        1e3..1e6 => format!("{:.0} kB", bytes / 1e3),
        1e6..1e9 => format!("{:.0} MB", bytes / MEGABYTE),
        _ => format!("{:.1} GB", bytes / 1e9),
    }
}

/// How much is free where a path lies, and how much there is, bytes.
pub(super) fn space_at(path: &std::path::Path) -> Result<(u64, u64), nix::Error> {
    let space = nix::sys::statvfs::statvfs(path)?;
    Ok((space.blocks_available() * space.fragment_size(), space.blocks() * space.fragment_size()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_begins_with_its_part_and_how_it_is() {
        let finding = Finding::wrong("terminal", "60 columns, 20 rows", "make it larger");
        assert_eq!(finding.line(), "terminal       WRONG  60 columns, 20 rows");
        assert_eq!(Finding::note("cells", "waits").line(), "cells          note   waits");
    }

    #[test]
    fn sizes_are_written_for_people() {
        let sizes: Vec<String> = [12, 4_400, 67_108_864, 25_000_000_000].map(size).into();
        assert_eq!(sizes, ["12 bytes", "4 kB", "67 MB", "25.0 GB"]);
    }
}
