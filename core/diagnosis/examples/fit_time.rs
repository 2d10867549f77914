//! Fits a model to a table again and again, once for every line on standard input, from scratch each time, and prints for
//! each fit the seconds it took, the root mean square of the 3-D residual it reached (mm), and how many parameters were
//! free and how many of them the table determines. Plain least squares on two rows in three.
//!
//! `tests/bench/fit.py` runs it in turns with its peers.

use std::error::Error;
use std::io::{self, BufRead as _, Write as _};
use std::path::Path;
use std::time::Instant;

use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect;
use plumb_calibration::fit::{FitOptions, ResidualModel};
use plumb_calibration::measurement::Observations;
use plumb_calibration::table::Table;
use plumb_diagnosis::split::{Holdout, Split};
use plumb_estimation::Progress;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, model, table] = arguments.as_slice() else {
        return Err("usage: fit_time MODEL TABLE, such as fit_time ur5.yaml ur5-grid.csv".into());
    };
    let model = Model::read(Path::new(model))?;
    let table = Table::read(Path::new(table))?;
    let observations = Observations::new(&model, &table)?;
    let split = Split::new(&table, Holdout::Random { fraction: 0.3, seed: 1 })?;
    let mut effects = Vec::new();
    for pattern in &model.free {
        effects.extend(
            effect::expand(pattern, &model)?.into_iter().map(|id| AddedEffect { id, values: Vec::new() }),
        );
    }
    // The rows that are fitted, for the peers.
    println!("{}", split.fit_rows().iter().map(ToString::to_string).collect::<Vec<_>>().join(" "));
    let options = FitOptions { robust: false, ..FitOptions::default() };
    for line in io::stdin().lock().lines() {
        line?;
        let start = Instant::now();
        let problem = ResidualModel::new(&model, &table, &observations, &effects)?;
        let fit = problem.fit(&problem.start(), &split.fit, options, &Progress::unwatched())?;
        let seconds = start.elapsed().as_secs_f64();
        let squares: f64 = fit
            .rows
            .iter()
            .flat_map(|row| fit.residuals.get(observations.range(*row)).unwrap_or(&[]))
            .map(|residual| residual * residual)
            .sum();
        let rms = (squares / fit.rows.len() as f64).sqrt();
        println!("{seconds} {rms} {} {}", problem.free_parameters().len(), fit.rank());
        io::stdout().flush()?;
    }
    Ok(())
}
