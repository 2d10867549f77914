//! How much of what a model leaves could be explained, on one table, and how long it takes to ask:
//! `cargo run --release -p plumb-diagnosis --example explainable -- MODEL CSV HOLDOUT [EFFECT,EFFECT ...]`

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::explainable_sentence;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [model, table, holdout, free @ ..] => match ask(model, table, holdout, free) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        },
        _ => {
            eprintln!("explainable MODEL CSV HOLDOUT [EFFECT ...]");
            ExitCode::from(2)
        }
    }
}

fn ask(model: &str, table: &str, holdout: &str, free: &[String]) -> Result<(), LaboratoryError> {
    let holdout: Holdout = holdout.parse()?;
    let free = (!free.is_empty()).then(|| free.to_vec());
    let laboratory = Laboratory::open(
        Path::new(model),
        Path::new(table),
        Options { free, holdout, ..Options::default() },
    )?;
    let watch = Progress::unwatched();
    let errors = laboratory.compare(&watch)?.error_mm;
    println!("{errors:?}");
    let start = Instant::now();
    let explainable = laboratory.explainable(&watch)?;
    let seconds = start.elapsed().as_secs_f64();
    match explainable {
        Some(explainable) => println!("{explainable:#?}\n{}", explainable_sentence(&explainable)),
        None => println!("too few poses"),
    }
    println!("{seconds:.2} s, the fit included");
    Ok(())
}
