//! `plumb schema`: what may be in the files people write, for editors; and in what a run writes, for programs.

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_calibration::file::model_schema;
use plumb_cell::schema::{events_schema, schema};
use plumb_diagnosis::stripe::scene_schema;
use plumb_document::DocumentKind;
use plumb_host::Catalogue;
use plumb_light_stripe::geometry::rig_schema;
use plumb_plugin::Manifest;
use plumb_simulated::file_schemas::{arm_schema, world_schema};
use serde_json::Value;

use crate::commands::study::study_schema;
use crate::failure::CommandResult;
use crate::print_line::print_line;

/// Print the JSON Schema of a kind of file, for an editor that completes and checks, or of the events of `plumb run --json`.
///
/// That of cells holds what each installed plugin may be given. An editor that speaks the YAML language server completes and checks with it:
/// begin the file with `# yaml-language-server: $schema=cell.schema.json`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Of what.
    #[arg(value_enum, default_value = "cell")]
    kind: Kind,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Of what.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// Cells.
    Cell,
    /// Procedures.
    Procedure,
    /// Answers for unattended runs.
    Answers,
    /// Models of arms.
    Model,
    /// Simulated worlds.
    World,
    /// Arms of simulated worlds.
    Arm,
    /// Rigs of light stripes.
    Rig,
    /// What light stripes scan.
    Scene,
    /// Plugins' manifests, plugin.yaml.
    Manifest,
    /// Studies.
    Study,
    /// Lines of `plumb run --json`.
    Events,
}

/// Prints it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let schema = match arguments.kind {
        Kind::Cell => of_cell_files(DocumentKind::Cell, arguments)?,
        Kind::Procedure => of_cell_files(DocumentKind::Procedure, arguments)?,
        Kind::Answers => of_cell_files(DocumentKind::Answers, arguments)?,
        Kind::Model => model_schema(),
        Kind::World => world_schema(),
        Kind::Arm => arm_schema(),
        Kind::Rig => rig_schema(),
        Kind::Scene => scene_schema(),
        Kind::Manifest => Manifest::schema(),
        Kind::Study => study_schema(),
        Kind::Events => events_schema()?,
    };
    print_line!("{}", serde_json::to_string_pretty(&schema)?)?;
    Ok(ExitCode::SUCCESS)
}

/// Of the files whose schema depends on the plugins there are.
fn of_cell_files(kind: DocumentKind, arguments: &Arguments) -> Result<Value, serde_json::Error> {
    let catalogue = Catalogue::search(&arguments.plugins);
    let manifests: Vec<_> =
        catalogue.rows().iter().filter_map(|row| Some(row.plugin.as_ref().ok()?.manifest.clone())).collect();
    Ok(schema(kind, &manifests)?.unwrap_or_default())
}
