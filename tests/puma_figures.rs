//! The figures of the PUMA's page of the manual, made by running its cell over simulated worlds:
//!
//! ```text
//! cargo bench -p plumb --profile dev --bench puma -- zeros 200 1001     how well the zeros are found, in 200 worlds from seed 1001
//! cargo bench -p plumb --profile dev --bench puma -- tilted 6           what a tilted mount leaves, with 1, 2, 4 and 8 readings
//! cargo bench -p plumb --profile dev --bench puma -- hidden 4 21        worlds that hide something behind their zeros, 4 of each kind
//! cargo bench -p plumb --profile dev --bench puma -- every 100 6001     100 worlds over every effect in turn, with the tracker
//! ```
//!
//! The numbers are how many worlds and the first seed.

#![allow(clippy::unwrap_used, dead_code, reason = "shared with the tests of the cell")]

#[path = "puma/cells.rs"]
mod cells;
#[path = "puma/every.rs"]
mod every;
#[path = "puma/hidden.rs"]
mod hidden;
#[path = "puma/poses.rs"]
mod poses;
#[path = "puma/zeros.rs"]
mod zeros;

use std::process::ExitCode;

use hidden::{FLOOR_MM, Hidden};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let number = |index: usize, default: u64| {
        arguments.get(index).and_then(|argument| argument.parse().ok()).unwrap_or(default)
    };
    match arguments.first().map(String::as_str) {
        Some("zeros") => zeros_found(number(1, 200), number(2, 1001)),
        Some("tilted") => tilted(number(1, 6), number(2, 1)),
        Some("hidden") => hidden_behind_zeros(number(1, 2), number(2, 21)),
        Some("every") => every_effect(number(1, 100), number(2, 6001)),
        _ => {
            eprintln!(
                "say which figures: zeros, tilted, hidden or every, then how many worlds and the first seed"
            );
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

fn zeros_found(count: u64, first: u64) {
    let figures = zeros::recovered(first..=first + count - 1, |seed| eprint!("\rworld {seed} "));
    eprintln!();
    println!("{count} worlds from seed {first}:\n\n{figures}");
}

fn tilted(count: u64, first: u64) {
    println!("Root mean square of {count} worlds from seed {first}, deg:\n");
    println!("| readings | waist, deg | joint 2 | joint 3 | joint 4 |\n|---|---|---|---|---|");
    for waist in [30, 120] {
        let [third, fourth] = zeros::from_one_reading(first..=first + count - 1, waist);
        println!("| 1 | {waist} | - | {third:.3} | {fourth:.3} |");
        for (quadrants, readings) in [(1, 2), (2, 4), (4, 8)] {
            let [second, third, fourth] =
                zeros::tilted(first..=first + count - 1, quadrants, waist).of_the_arm();
            println!("| {readings} | {waist} | {second:.3} | {third:.3} | {fourth:.3} |");
        }
    }
}

fn hidden_behind_zeros(count: u64, first: u64) {
    println!(
        "Tip error over 30 fresh poses, root mean square, mm; lefty and righty of one point apart, root mean square and most, mm."
    );
    println!("The floor is {FLOOR_MM} mm.\n\n{}", hidden::HEADING);
    for hidden in Hidden::ALL {
        for seed in first..first + count {
            let story = hidden::run_story(hidden.of_seed(seed), seed, true);
            println!("{story}");
            eprintln!("    with the tracker: {:?}", story.with_tracker.verdicts);
            eprintln!("    with the ruler:   {:?}", story.by_hand.map(|found| found.verdicts));
        }
    }
}

fn every_effect(count: u64, first: u64) {
    let figures = every::live_through(count, first, |story, verdict| {
        println!("{story} {verdict}");
        eprintln!("    {:?}", story.with_tracker.verdicts);
    });
    println!("\n{count} worlds from seed {first}:\n\n{figures}");
}
