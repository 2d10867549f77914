//! The example cells that plumb is installed with: where they lie, what they are called, and what they need.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::InitError;

/// An example: a folder with a cell, or with models of arms.
pub(super) struct Shipped {
    /// Its folder's name.
    pub(super) name: String,
    /// What it is, for people.
    pub(super) title: String,
    pub(super) folder: PathBuf,
    /// The examples whose files its own files name.
    pub(super) needs: BTreeSet<String>,
}

/// Where an installed program has its example cells, from the folder it lies in.
const INSTALLED: &str = "../share/plumb/workcells";

/// Those of the source this was built from.
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../workcells");

/// The examples: of the folder that is named, else of the installed program, else of the source it was built from.
///
/// # Errors
/// [`InitError::NotInstalled`] where none of these holds an example.
pub(super) fn shipped_cells(named: Option<&Path>) -> Result<Vec<Shipped>, InitError> {
    let folders = match named {
        Some(folder) => vec![folder.to_owned()],
        None => {
            let program = env::current_exe().ok();
            let beside = program.as_deref().and_then(Path::parent).map(|folder| folder.join(INSTALLED));
            beside.into_iter().chain([PathBuf::from(SOURCE)]).collect()
        }
    };
    let found = folders.iter().map(|folder| examples_in(folder)).find(|examples| !examples.is_empty());
    found.ok_or(InitError::NotInstalled { looked_in: folders })
}

/// The folders in a folder that hold a cell or models, in order of name.
fn examples_in(parent: &Path) -> Vec<Shipped> {
    let Ok(entries) = fs::read_dir(parent) else { return Vec::new() };
    let mut folders: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    folders.retain(|folder| folder.join("cell.yaml").is_file() || folder.join("README.md").is_file());
    folders.sort();
    folders.iter().filter_map(|folder| example(folder)).collect()
}

fn example(folder: &Path) -> Option<Shipped> {
    let name = folder.file_name()?.to_str()?.to_owned();
    let title = title_of_cell(&folder.join("cell.yaml")).or_else(|| heading(&folder.join("README.md")));
    Some(Shipped {
        title: title.unwrap_or_default(),
        needs: needs(folder, &name),
        folder: folder.to_owned(),
        name,
    })
}

/// What a cell file says after `title:`.
fn title_of_cell(file: &Path) -> Option<String> {
    let text = fs::read_to_string(file).ok()?;
    let title = text.lines().find_map(|line| line.strip_prefix("title:"))?;
    Some(title.trim().trim_matches('"').to_owned())
}

/// The first heading of a page.
fn heading(file: &Path) -> Option<String> {
    let text = fs::read_to_string(file).ok()?;
    text.lines().find_map(|line| line.strip_prefix("# ")).map(|title| title.trim().to_owned())
}

/// The folders beside this one that its YAML files name, as in `../puma/lab.yaml`.
fn needs(folder: &Path, name: &str) -> BTreeSet<String> {
    let beside = |other: &str| folder.parent().is_some_and(|parent| parent.join(other).is_dir());
    let mut found = BTreeSet::new();
    for text in yaml_texts(folder) {
        let named = text.split("../").skip(1).filter_map(|rest| rest.split_once('/')).map(|(other, _)| other);
        found.extend(named.filter(|other| *other != name && beside(other)).map(str::to_owned));
    }
    found
}

fn yaml_texts(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut texts = Vec::new();
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            texts.extend(yaml_texts(&path));
        } else if path.extension().is_some_and(|extension| extension == "yaml") {
            texts.extend(fs::read_to_string(&path));
        }
    }
    texts
}
