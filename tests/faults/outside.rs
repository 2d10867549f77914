//! What befalls the record: locked by another program, damaged, without room.

use std::fs;
use std::os::unix::fs::FileExt as _;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::lab::{CommandOutput, Lab};
use crate::moments::assert_sound;
use crate::{Happened, Row};

pub(crate) const ROWS: &[&Row] = &[
    &Row {
        name: "record_locked",
        done: "the record locked by another program while a run begins: for 2 s, and for good",
        promise: "it is waited for and the run passes; locked for good, the run ends with 2 within 30 s and says who holds it",
        happens: record_locked,
    },
    &Row {
        name: "record_damaged",
        done: "a page of the record overwritten",
        promise: "`record check` ends with 1 and names the damage; a run that meets it says so",
        happens: record_damaged,
    },
    &Row {
        name: "disk_full",
        done: "no room where the record lies, from the middle of a run on",
        promise: "the run ends with words; with room again it is resumed and passes",
        happens: disk_full,
    },
    &Row {
        name: "shared_memory_full",
        done: "shared memory of 200 kB",
        promise: "`run` ends with 2 and says what is full; `doctor` says it too",
        happens: shared_memory_full,
    },
];

fn record_file(lab: &Lab) -> std::path::PathBuf {
    let shown = lab.plumb(&["record", "check"]).out();
    let folder = shown.split(": sound").next().unwrap_or_default().trim().to_owned();
    std::path::Path::new(&folder).join("plumb.sqlite3")
}

fn record_locked() -> Happened {
    let lab = Lab::new();
    let file = record_file(&lab);
    let lock = |file: &std::path::Path| {
        let connection = rusqlite::Connection::open(file).unwrap();
        connection.execute_batch("BEGIN EXCLUSIVE").unwrap();
        connection
    };
    let held = lock(&file);
    let holder = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(2));
        drop(held);
    });
    let waited = lab.plumb(&["run", "cell.yaml"]);
    holder.join().unwrap();
    assert_eq!(waited.code(), 0, "{}", waited.all());
    let held = lock(&file);
    let begin = Instant::now();
    let refused = lab.plumb(&["run", "cell.yaml"]);
    let took = begin.elapsed().as_secs_f64();
    drop(held);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert!(took < 30.0, "it took {took} s");
    assert_sound(&lab);
    Happened::Kept(format!(
        "after {took:.1} s: {}",
        crate::line_with(&refused.all(), "is locked by another program")
    ))
}

fn record_damaged() -> Happened {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 0);
    let file = fs::OpenOptions::new().write(true).open(record_file(&lab)).unwrap();
    // Behind the tables of tables, so that it opens.
    for page in 12..200 {
        let _past_the_end = file.write_at(&[0x5a; 300], page * 4096 + 8);
    }
    drop(file);
    let check = lab.plumb(&["record", "check"]);
    assert_eq!(check.code(), 1, "{}", check.all());
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert!(run.code() != 101 && (run.code() == 0 || run.all().contains("malformed")), "{}", run.all());
    Happened::Kept(format!("{} / {}", first_line(&check), first_line(&run)))
}

fn first_line(output: &CommandOutput) -> String {
    output.all().lines().next().unwrap_or_default().chars().take(160).collect()
}

/// Whether small file systems can be made for one process alone.
fn can_mount() -> bool {
    let tried = Command::new("unshare").args(["-m", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

const NEEDS_ROOT: &str = "only root may make a small file system";

/// Runs a script in a view of the file systems of its own, with the program as `$PLUMB`.
fn in_own_view(lab: &Lab, script: &str) -> CommandOutput {
    let mut command = lab.command(&[]);
    let program = command.get_program().to_owned();
    let variables: Vec<_> =
        command.get_envs().filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned()))).collect();
    command = Command::new("unshare");
    command.args(["-m", "sh", "-c", script]).envs(variables).env("PLUMB", program).current_dir(lab.path("."));
    CommandOutput::of(command.output().unwrap())
}

fn disk_full() -> Happened {
    if !can_mount() {
        return Happened::PassedOver(NEEDS_ROOT.to_owned());
    }
    let lab = Lab::new();
    // Room for the tables and the beginning of a run.
    let script = "mkdir -p \"$XDG_STATE_HOME\" && mount -t tmpfs -o size=600k tmpfs \"$XDG_STATE_HOME\"\n\
        timeout 100 \"$PLUMB\" run cell.yaml --headless; echo \"first $?\"\n\
        mount -o remount,size=64m \"$XDG_STATE_HOME\"\n\
        timeout 100 \"$PLUMB\" run --resume 1 --headless; echo \"second $?\"\n\
        timeout 100 \"$PLUMB\" record check; echo \"third $?\"";
    let output = in_own_view(&lab, script);
    assert!(output.out().contains("first 2"), "{}", output.all());
    assert!(output.out().contains("second 0") && output.out().contains("third 0"), "{}", output.all());
    Happened::Kept(crate::line_with(&output.all(), "make room on the disk"))
}

fn shared_memory_full() -> Happened {
    if !can_mount() {
        return Happened::PassedOver(NEEDS_ROOT.to_owned());
    }
    let lab = Lab::new();
    let script = "mount -t tmpfs -o size=200k tmpfs /dev/shm\n\
        timeout 100 \"$PLUMB\" run cell.yaml --headless; echo \"run $?\"\n\
        timeout 100 \"$PLUMB\" doctor cell.yaml; echo \"doctor $?\"";
    let output = in_own_view(&lab, script);
    assert!(output.out().contains("run 2") && output.out().contains("doctor 1"), "{}", output.all());
    assert_sound(&lab);
    Happened::Kept(crate::line_with(&output.all(), "shared memory is full"))
}
