//! `plumb schema`: what may stand in the files people write, for editors.

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_cell::schema::schema;
use plumb_document::DocumentKind;
use plumb_host::Catalogue;

use crate::failure::CommandResult;
use crate::say::say;

/// Print the JSON Schema of cell, procedure or answers files, with what each installed plugin may be told. An editor that speaks the YAML
/// language server completes and checks with it: begin the file with `# yaml-language-server: $schema=cell.schema.json`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Of which files.
    #[arg(value_enum, default_value = "cell")]
    kind: Kind,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
}

/// Which files.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    /// Cells.
    Cell,
    /// Procedures.
    Procedure,
    /// Answers for unattended runs.
    Answers,
}

/// Prints it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let kind = match arguments.kind {
        Kind::Cell => DocumentKind::Cell,
        Kind::Procedure => DocumentKind::Procedure,
        Kind::Answers => DocumentKind::Answers,
    };
    let catalogue = Catalogue::search(&arguments.plugins);
    let manifests: Vec<_> =
        catalogue.rows().iter().filter_map(|row| Some(row.plugin.as_ref().ok()?.manifest.clone())).collect();
    if let Some(schema) = schema(kind, &manifests)? {
        say!("{}", serde_json::to_string_pretty(&schema)?)?;
    }
    Ok(ExitCode::SUCCESS)
}
