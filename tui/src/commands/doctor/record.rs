//! The record: can it be written, is there room, is it sound.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use plumb_document::counted;
use plumb_record::Record;

use super::finding::{Finding, size, space_at};
use crate::record_directory::record_directory;

const TOPIC: &str = "record";

/// A run writes about a hundred kilobytes; less than this much room is too little for a day.
const ENOUGH: u64 = 100_000_000;

pub(super) fn look(given: Option<&PathBuf>) -> Vec<Finding> {
    let directory = match record_directory(given) {
        Ok(directory) => directory,
        Err(error) => return vec![Finding::wrong(TOPIC, error.to_string(), "give one with --record DIR")],
    };
    let shown = directory.display();
    let Some(existing) = directory.ancestors().find(|path| path.is_dir()) else {
        return vec![Finding::wrong(
            TOPIC,
            format!("{shown} cannot be made"),
            "give another with --record DIR",
        )];
    };
    let mut findings = Vec::new();
    if let Err(error) = try_to_write(existing) {
        let mend = format!("make it yours: sudo chown -R $USER {}", existing.display());
        findings.push(Finding::wrong(
            TOPIC,
            format!("{} cannot be written: {error}", existing.display()),
            mend,
        ));
    }
    match space_at(existing) {
        Ok((free, _)) if free < ENOUGH => {
            let mend = "make room on that disk, or keep the record elsewhere with --record DIR";
            findings.push(Finding::wrong(TOPIC, format!("{shown}: only {} free", size(free)), mend));
        }
        Ok((free, _)) => findings.push(Finding::good(TOPIC, format!("{shown}, {} free", size(free)))),
        Err(error) => {
            findings.push(Finding::note(TOPIC, format!("{shown}: the room there is not known: {error}")))
        }
    }
    if Record::file_in(&directory).exists() {
        findings.extend(readable_by_others(&directory));
        findings.push(soundness(&directory));
    }
    findings
}

/// A record holds names, comments and photographs: who shares it should know that they do.
fn readable_by_others(directory: &Path) -> Option<Finding> {
    let mode = |path: &Path| fs::metadata(path).map_or(0, |found| found.permissions().mode());
    let open = mode(directory) & mode(&Record::file_in(directory)) & 0o077;
    let text = format!("{}: other users of this machine can read it", directory.display());
    (open != 0).then(|| {
        Finding::note(TOPIC, text).mend(format!("if they should not: chmod -R go= {}", directory.display()))
    })
}

fn soundness(directory: &Path) -> Finding {
    let mend = "keep the damaged file, and go on with the last copy that `plumb record backup` made";
    match Record::open(directory).and_then(|record| Ok((record.damage()?, record.number_of_runs()?))) {
        Ok((damage, runs)) if damage.is_empty() => {
            Finding::good(TOPIC, format!("sound; {}", counted(runs, "run", "runs")))
        }
        Ok((damage, _)) => Finding::wrong(TOPIC, format!("damaged: {}", damage.join("; ")), mend),
        Err(error) => Finding::wrong(TOPIC, error.to_string(), mend),
    }
}

fn try_to_write(directory: &Path) -> std::io::Result<()> {
    let probe = directory.join(format!(".plumb-doctor-{}", std::process::id()));
    fs::write(&probe, b"a try")?;
    fs::remove_file(&probe)
}
