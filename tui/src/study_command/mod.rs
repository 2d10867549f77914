//! `plumb study`: Yang & Siegel's table and figures, computed anew.

mod curves;
mod figure;

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use thiserror::Error;

use crate::failure::CommandResult;

/// Table 2-1, figures 5 to 10 and 12, and the single numbers of Yang & Siegel 1987, computed from plumb's own kinematics.
#[derive(Args)]
pub(crate) struct StudyArguments {
    /// Write each figure there as SVG and CSV.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Why a study could not be written.
#[derive(Debug, Error)]
pub(crate) enum StudyError {
    /// A figure could not be written.
    #[error("cannot write {path}: {cause}; name a folder you may write to with --output")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A figure could not be drawn.
    #[error("cannot draw {figure}: {cause}")]
    Draw {
        /// The figure.
        figure: &'static str,
        /// What the drawing library said.
        cause: String,
    },
}

/// Prints the study and, where asked, writes its figures.
///
/// # Errors
/// The folder cannot be written.
pub(crate) fn run(arguments: &StudyArguments) -> CommandResult {
    let mut output = io::stdout().lock();
    output.write_all(report().as_bytes())?;
    if let Some(folder) = &arguments.output {
        for figure in curves::figures() {
            write(folder, &figure)?;
        }
        writeln!(output, "\nfigures written to {}", folder.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn report() -> String {
    let mut text = String::from(
        "Yang & Siegel 1987, computed from plumb's kinematics (L1 = L2 = 177.8, H = 195.0, L3 = 109 mm)\n\n\
         Table 2-1: vertical error of the initialization, micron (Bi = 290, Br = 5 deg, K = 140, D = 117 mm)\n\
         further cycles            error\n",
    );
    for (cycle, error) in curves::table_2_1().iter().enumerate() {
        text.push_str(&format!("{cycle:>14} {:>16}\n", six_digits(*error)));
    }
    text.push('\n');
    for statement in curves::statements() {
        text.push_str(&format!(
            "{}\n    paper {:<14} here {}\n",
            statement.what, statement.paper, statement.ours
        ));
    }
    text
}

/// Six digits that count, in plain notation while that stays readable.
fn six_digits(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if magnitude < -3.0 {
        format!("{value:.5e}")
    } else {
        format!("{value:.*}", (5.0 - magnitude).max(0.0) as usize)
    }
}

fn write(folder: &Path, figure: &curves::Figure) -> Result<(), StudyError> {
    let drawing =
        figure::svg(figure).map_err(|cause| StudyError::Draw { figure: figure.file_name, cause })?;
    for (ending, content) in [("svg", drawing), ("csv", figure::csv(figure))] {
        let path = folder.join(figure.file_name).with_extension(ending);
        fs::create_dir_all(folder)
            .and_then(|()| fs::write(&path, content))
            .map_err(|cause| StudyError::Write { path, cause })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_holds_the_papers_digits() {
        let report = report();
        for expected in ["-10138.6", "178.245", "-5.63521", "0.176579", "17 deg 15.2 min", "0.0909 deg"] {
            assert!(report.contains(expected), "{expected} is missing in:\n{report}");
        }
    }

    #[test]
    fn every_figure_is_drawn_and_tabled() {
        let folder = tempfile::tempdir().unwrap();
        run(&StudyArguments { output: Some(folder.path().to_owned()) }).unwrap();
        for number in ["05", "06", "07", "08", "09", "10", "12"] {
            let names: Vec<_> = fs::read_dir(folder.path())
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .filter(|name| name.starts_with(&format!("figure-{number}")))
                .collect();
            assert_eq!(names.len(), 2, "figure {number}: {names:?}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = run(&StudyArguments { output: Some(file.path().join("below")) }).unwrap_err();
        assert!(error.to_string().contains("--output"), "{error}");
    }
}
