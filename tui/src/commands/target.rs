//! `plumb target`: the T target of a cell, to be printed at its own size.

mod page;
mod pdf;
mod svg;

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;

use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Draw the T target of a cell, to be printed at its own size, with a ruler to check the print.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The cell file, which describes the target under `target:`.
    #[arg(value_name = "CELL")]
    cell: PathBuf,
    /// Where to write it; the name ends in `.pdf` or `.svg`.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The paper.
    #[arg(long, value_enum, default_value = "a4")]
    paper: Paper,
}

/// Sheets of paper.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Paper {
    /// 210 x 297 mm.
    A4,
    /// 297 x 420 mm.
    A3,
    /// 216 x 279 mm.
    Letter,
}

impl Paper {
    /// Width and height, mm.
    fn size(self) -> [f64; 2] {
        match self {
            Self::A4 => [210.0, 297.0],
            Self::A3 => [297.0, 420.0],
            Self::Letter => [215.9, 279.4],
        }
    }
}

/// Why there is no drawing.
#[derive(Debug, thiserror::Error)]
enum TargetError {
    #[error("{0}: the name of a drawing ends in `.pdf` or `.svg`")]
    Ending(String),
    #[error(
        "{0} describes no target: add one, as in `target: {{t: {{line_a_deg: 0, line_b: {{distance_mm: 140, offset_deg: 8}}}}}}`"
    )]
    NoTarget(String),
    #[error("{file} cannot be written: {cause}")]
    Write { file: String, cause: std::io::Error },
    #[error(transparent)]
    Page(#[from] page::PageError),
}

/// Writes the drawing.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let file = arguments.output.display().to_string();
    let render = match arguments.output.extension().and_then(|ending| ending.to_str()) {
        Some("pdf") => pdf::document,
        Some("svg") => svg::document,
        _ => return Err(TargetError::Ending(file).into()),
    };
    let cell = match load_workcell(&arguments.cell, &Calculator::new()) {
        Ok(cell) => cell,
        Err(problems) => {
            problems.iter().for_each(|problems| eprintln!("{problems}"));
            return Ok(ExitCode::from(2));
        }
    };
    let target = cell.target.ok_or_else(|| TargetError::NoTarget(arguments.cell.display().to_string()))?;
    let page = page::Page::of(&cell.name, &target, arguments.paper.size()).map_err(TargetError::from)?;
    std::fs::write(&arguments.output, render(&page))
        .map_err(|cause| TargetError::Write { file: file.clone(), cause })?;
    print_line!("{file}: print it at 100 % (not fitted to the page), then measure its rulers: 100 mm each")?;
    Ok(ExitCode::SUCCESS)
}
