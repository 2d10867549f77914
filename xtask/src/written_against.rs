//! The crates that a plugin in Rust is written against, installed as source: a workspace of their own, which `plumb plugins new` names where plumb's
//! own source is not there. Their dependencies come from the registry.

use std::fs;
use std::path::Path;

use crate::error::PackageError;
use crate::files::{copy, copy_tree, write};

/// Their folders, in the source and under [`SOURCE_FOLDER`] alike.
const CRATES: [&str; 3] = ["core/abi", "core/document", "core/plugin"];

/// What of each is installed, where it is there.
const PARTS: [&str; 3] = ["src", "include", "examples"];

/// Where they lie in the tree.
const SOURCE_FOLDER: &str = "share/plumb/source";

/// Copies them.
pub(crate) fn crates(root: &Path, tree: &Path) -> Result<(), PackageError> {
    let destination = tree.join(SOURCE_FOLDER);
    for folder in CRATES {
        let (from, to) = (root.join(folder), destination.join(folder));
        for part in PARTS.iter().filter(|part| from.join(part).is_dir()) {
            copy_tree(&from.join(part), &to.join(part))?;
        }
        for file in ["Cargo.toml", "README.md"].iter().filter(|file| from.join(file).is_file()) {
            copy(&from.join(file), &to.join(file))?;
        }
    }
    copy(&root.join("Cargo.lock"), &destination.join("Cargo.lock"))?;
    let manifest = root.join("Cargo.toml");
    let text = fs::read_to_string(&manifest).map_err(PackageError::io(&manifest))?;
    let own = workspace_of(&text).ok_or_else(|| PackageError::Unexpected {
        path: manifest,
        what: "it has no section [workspace.package] behind its members".to_owned(),
    })?;
    write(&destination.join("Cargo.toml"), own.as_bytes())
}

/// The workspace's manifest with these crates as its members: versions, lints and editions stay as they are.
fn workspace_of(text: &str) -> Option<String> {
    let rest = text.get(text.find("[workspace.package]")?..)?;
    let members: Vec<String> = CRATES.iter().map(|folder| format!("{folder:?}")).collect();
    Some(format!("[workspace]\nresolver = \"3\"\nmembers = [{}]\n\n{rest}", members.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::workspace_of;

    #[test]
    fn the_workspace_has_these_crates_alone_and_keeps_its_versions() {
        let text = "[workspace]\nresolver = \"3\"\nmembers = [\"tui\"]\n\n[workspace.package]\nversion = \"0.1.0\"\n";
        let own = workspace_of(text).unwrap();
        assert!(own.contains("members = [\"core/abi\", \"core/document\", \"core/plugin\"]"), "{own}");
        assert!(own.ends_with("[workspace.package]\nversion = \"0.1.0\"\n") && !own.contains("tui"), "{own}");
        assert_eq!(workspace_of("[package]\n"), None);
    }
}
