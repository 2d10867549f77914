//! The options of `plumb report`, and how its files are opened.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use plumb_calibration::arm_model::Model;
use plumb_calibration::revision::Family;
use plumb_calibration::table::{Naming, Rename, Table};
use serde::Serialize;

use crate::commands::model::arguments::naming;

/// What all reports share.
#[derive(Debug, Args)]
pub(crate) struct TableArguments {
    /// The measurement table.
    pub(crate) table: PathBuf,
    /// A calibrated model of the machine, for an uncertainty budget by effect after the GUM (JCGM 100). model.yaml means its newest revision.
    #[arg(long, value_name = "MODEL")]
    pub(crate) model: Option<PathBuf>,
    /// Read a column by another name, as in X=q1_mm,laser=p1_x_mm; OLD= leaves the column out.
    #[arg(long, value_name = "OLD=NEW", value_delimiter = ',')]
    columns: Vec<Rename>,
    /// Decimals of lengths and angles.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(0..=9))]
    pub(crate) digits: u8,
    /// Write a page (HTML with its drawing inside) to this file.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options of `iso230`.
#[derive(Debug, Args)]
pub(crate) struct Iso230Arguments {
    #[command(flatten)]
    pub(crate) table: TableArguments,
    /// The axis, where several joints move: q1, or its name in the model.
    #[arg(long, value_name = "JOINT")]
    pub(crate) axis: Option<String>,
    /// The reading that is the axis's position, where several follow it: p1_x, distance, height, tilt_x.
    #[arg(long, value_name = "READING")]
    pub(crate) reading: Option<String>,
}

/// Options of `iso9283`.
#[derive(Debug, Args)]
pub(crate) struct Iso9283Arguments {
    #[command(flatten)]
    pub(crate) table: TableArguments,
    /// The target whose position is looked at, where several were read: p1.
    #[arg(long, value_name = "TARGET")]
    pub(crate) target: Option<String>,
}

/// What a page cannot be written for.
#[derive(Debug, thiserror::Error)]
#[error("{} cannot be written", path.display())]
pub(super) struct NotWritten {
    path: PathBuf,
    source: std::io::Error,
}

impl TableArguments {
    /// Reads the table, and the model if one is given.
    pub(super) fn open(&self) -> Result<(Table, Option<Model>), Box<dyn Error>> {
        let model =
            self.model.as_deref().map(|path| Family::resolve(path).map(|entry| entry.model)).transpose()?;
        let naming = match &model {
            Some(model) => naming(model, &self.columns),
            None => Naming { joints: Vec::new(), renamed: self.columns.clone() },
        };
        Ok((Table::read_named(&self.table, &naming)?, model))
    }

    /// The report in the form that was asked for: a page where one was named, JSON or text to print.
    pub(super) fn give(
        &self,
        report: &impl Serialize,
        text: String,
        page: impl FnOnce() -> Result<String, String>,
    ) -> Result<String, Box<dyn Error>> {
        let written = self.output.as_deref().map(|path| write(path, page)).transpose()?;
        if self.json {
            return Ok(serde_json::to_string_pretty(report)? + "\n");
        }
        Ok(written.map_or(text.clone(), |()| {
            let path = self.output.as_deref().unwrap_or(Path::new(""));
            format!("{text}\nWritten to {}.\n", path.display())
        }))
    }
}

fn write(path: &Path, page: impl FnOnce() -> Result<String, String>) -> Result<(), Box<dyn Error>> {
    let text = page()?;
    Ok(std::fs::write(path, text).map_err(|source| NotWritten { path: path.to_owned(), source })?)
}
