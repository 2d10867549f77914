//! The table of faults: what is done to a running cell, what is promised, and what happened. Every row is done for real, with the program as a
//! user has it and a simulated cell.
//!
//! ```text
//! cargo test -p plumb --test faults                  every row once
//! cargo test -p plumb --test faults -- world         rows whose name has `world` in it
//! cargo test -p plumb --test faults -- 20           twenty rounds
//! ```
//!
//! Rows that need root (small file systems of their own) say so where they are passed over. The clock of the machine is never touched.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    dead_code,
    reason = "a row that cannot go on has failed; some of what is shared with the tests of whole runs is not used here"
)]

#[path = "../run/lab.rs"]
mod lab;

#[allow(unused_imports, reason = "its tests are none here")]
#[path = "../run/hosts.rs"]
mod run_hosts;

#[allow(unused_imports, reason = "its tests are none here")]
#[path = "../run/python_drivers.rs"]
mod run_python;

mod drivers;
mod files;
mod hosts;
mod machine;
mod moments;
mod outside;
mod plugins;
mod worlds;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// A fault made on purpose.
pub(crate) struct Row {
    /// For choosing rows.
    pub(crate) name: &'static str,
    /// What is done.
    pub(crate) done: &'static str,
    /// What is promised.
    pub(crate) promise: &'static str,
    /// Does it, and says what happened; panics where the promise is not kept.
    pub(crate) happens: fn() -> Happened,
}

/// What came of a row.
pub(crate) enum Happened {
    /// The promise was kept; what the user saw, in few words.
    Kept(String),
    /// It cannot be done on this machine, and why.
    PassedOver(String),
}

/// Rows at once: they mostly wait.
const AT_ONCE: usize = 3;

fn main() -> ExitCode {
    if let Some(code) = files::measured() {
        return ExitCode::from(u8::try_from(code).unwrap_or(255));
    }
    let arguments: Vec<String> = std::env::args().skip(1).filter(|text| !text.starts_with('-')).collect();
    let rounds = arguments.iter().find_map(|text| text.parse().ok()).unwrap_or(1);
    let expected: Vec<&String> = arguments.iter().filter(|text| text.parse::<usize>().is_err()).collect();
    let all =
        [hosts::ROWS, plugins::ROWS, drivers::ROWS, worlds::ROWS, outside::ROWS, machine::ROWS, files::ROWS]
            .concat();
    if std::env::args().any(|text| text == "--list") {
        all.iter().for_each(|row| println!("{}: test", row.name));
        return ExitCode::SUCCESS;
    }
    let chosen = |row: &&&Row| expected.is_empty() || expected.iter().any(|text| row.name.contains(*text));
    let rows: Vec<&Row> = all.iter().filter(chosen).copied().collect();
    // What a row panics with is given in its line of the table.
    std::panic::set_hook(Box::new(|_| ()));
    let mut failed = 0;
    for _ in 0..rounds {
        failed += round(&rows);
    }
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Does every row once and prints the table; how many promises were not kept.
fn round(rows: &[&Row]) -> usize {
    let next = AtomicUsize::new(0);
    let lines: Mutex<Vec<(usize, String)>> = Mutex::new(Vec::new());
    let (kept, failed, passed_over) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
    thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                while let Some((index, row)) = take(rows, &next) {
                    let begin = Instant::now();
                    let (count, what) = match catch_unwind(AssertUnwindSafe(row.happens)) {
                        Ok(Happened::Kept(what)) => (&kept, what),
                        Ok(Happened::PassedOver(why)) => (&passed_over, format!("PASSED OVER: {why}")),
                        Err(panic) => (&failed, format!("NOT KEPT: {}", words(panic.as_ref()))),
                    };
                    count.fetch_add(1, Ordering::Relaxed);
                    let seconds = begin.elapsed().as_secs_f64();
                    // At once as well: a row that takes the whole program with it is known by the lines that came before.
                    eprintln!("{}: {what}", row.name);
                    let line = format!(
                        "| {} | {} | {} | {what} ({seconds:.1} s) |",
                        row.name, row.done, row.promise
                    );
                    lines.lock().unwrap().push((index, line));
                }
            });
        }
    });
    let mut lines = lines.into_inner().unwrap();
    lines.sort();
    println!("| row | what was done | promise | what happened |\n|---|---|---|---|");
    lines.iter().for_each(|(_, line)| println!("{line}"));
    let count = |of: &AtomicUsize| of.load(Ordering::Relaxed);
    let result = if count(&failed) == 0 { "ok" } else { "FAILED" };
    println!(
        "\ntest result: {result}. {} passed; {} failed; {} ignored; 0 measured; 0 filtered out",
        count(&kept),
        count(&failed),
        count(&passed_over)
    );
    count(&failed)
}

fn take<'r>(rows: &[&'r Row], next: &AtomicUsize) -> Option<(usize, &'r Row)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    rows.get(index).map(|row| (index, *row))
}

fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
    text.unwrap_or_else(|| "it panicked".to_owned()).replace('\n', " / ")
}

/// The first of these lines that has `word` in it, for the table.
pub(crate) fn line_with(text: &str, word: &str) -> String {
    let line =
        text.lines().find(|line| line.contains(word)).unwrap_or_else(|| panic!("no `{word}` in: {text}"));
    line.trim().chars().take(240).collect()
}
