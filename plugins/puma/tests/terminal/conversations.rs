//! Conversations over lines that lose, double, garble and delay characters.

use std::ops::RangeInclusive;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use plumb_plugin::Robot;
use plumb_simulated::emulate::val2::{Dialect, EmulatorOptions, Event, LineOptions};
use plumb_simulated::protocol::Pace;
use serde_json::json;

use super::Cell;

/// One character in so many is damaged.
const DAMAGED: [f64; 3] = [0.0005, 0.002, 0.01];

/// Poses a conversation.
const POSES: usize = 4;

/// A pose that was taken is reported, and made, to this, deg.
const TAKEN_WITHIN: f64 = 0.06;

/// A driver and its controller serve so many conversations, then there are new ones.
const A_CELL: u64 = 50;

/// What came of them.
#[derive(Debug, Default)]
pub(crate) struct Held {
    pub(crate) conversations: u64,
    pub(crate) poses: u64,
    pub(crate) errors: u64,
    /// What must never be: with its seed.
    pub(crate) wrong: Vec<String>,
}

/// Holds them, several at a time.
pub(crate) fn hold(seeds: RangeInclusive<u64>, at_a_time: usize, progress: impl Fn() + Sync) -> Held {
    let (held, next, last) = (Mutex::new(Held::default()), AtomicU64::new(*seeds.start()), *seeds.end());
    std::thread::scope(|scope| {
        for _ in 0..at_a_time {
            scope.spawn(|| {
                loop {
                    let first = next.fetch_add(A_CELL, Ordering::Relaxed);
                    if first > last {
                        return;
                    }
                    hold_some(first..=last.min(first + A_CELL - 1), &held, &progress);
                }
            });
        }
    });
    held.into_inner().unwrap()
}

fn hold_some(seeds: RangeInclusive<u64>, held: &Mutex<Held>, progress: &(impl Fn() + Sync)) {
    let mut cells: Vec<Cell> = Vec::new();
    for (_, dialect) in Dialect::ALL {
        let line = LineOptions { seed: *seeds.start(), ..LineOptions::default() };
        let options = EmulatorOptions { dialect, line, ..EmulatorOptions::default() };
        cells.push(Cell::of(options, Pace::Fast, &json!({"echo_within_ms": 60, "reply_within_ms": 300})));
    }
    for seed in seeds {
        let cell = &mut cells[(seed % 3) as usize];
        let result = hold_one(cell, seed);
        let mut held = held.lock().unwrap();
        held.conversations += 1;
        held.poses += POSES as u64;
        match result {
            Ok(errors) => held.errors += errors,
            Err(wrong) => held.wrong.push(format!("seed {seed}: {wrong}")),
        }
        drop(held);
        progress();
    }
}

/// How many errors were reported, each of which left the arm where it was, and was recovered from; else what was wrong.
fn hold_one(cell: &mut Cell, seed: u64) -> Result<u64, String> {
    let mut errors = 0;
    let damage = DAMAGED[(seed / 3 % 3) as usize];
    cell.emulator.inject(Event::DamageAtRandom(damage));
    for turn in 0..POSES {
        let by = (seed % 17) as f64 + turn as f64 * 7.0;
        let pose = [by - 20.0, -80.0 - by / 3.0, 95.0, 0.5 * by, 10.0, -15.0 + by];
        match cell.go(pose) {
            Ok(state) => {
                let made = cell.world.joints();
                for (index, (made, sent)) in made.iter().zip(pose).enumerate() {
                    let missing = || format!("joint {} is not reported", index + 1);
                    let reported = state.joints.get(index).ok_or_else(missing)?.to_degrees();
                    if !((reported - made).abs() < TAKEN_WITHIN && (sent - made).abs() < TAKEN_WITHIN) {
                        return Err(format!(
                            "joint {}: sent to {sent}, reported {reported}, made {made}",
                            index + 1
                        ));
                    }
                }
            }
            Err(error) => {
                errors += 1;
                if error.text().len() < 10 {
                    return Err(format!("an error without words: {error:?}"));
                }
                let stopped = cell.world.joints();
                let _ = cell.arm.read_joints();
                cell.emulator.inject(Event::DamageAtRandom(0.0));
                let recovered = cell.arm.activate().or_else(|_| cell.arm.activate());
                if let Err(lost) = recovered {
                    return Err(format!("not recovered from `{error}`: {lost}"));
                }
                if cell.world.joints() != stopped {
                    return Err(format!("it moved after `{error}`"));
                }
                cell.emulator.inject(Event::DamageAtRandom(damage));
            }
        }
    }
    cell.emulator.inject(Event::DamageAtRandom(0.0));
    cell.arm.activate().map_err(|error| format!("no clean end: {error}"))?;
    Ok(errors)
}
