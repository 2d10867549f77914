//! The tree of what is installed, as it lies under a prefix such as `/usr`.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::PackageError;
use crate::files::{copy, copy_tree, sorted, write};
use crate::run::output;
use crate::written_against;

/// The source, and what was built of it.
pub(crate) struct Built<'a> {
    pub(crate) root: &'a Path,
    /// `target/release`, or another folder of cargo's.
    pub(crate) folder: &'a Path,
}

/// Files of the source that are installed as they are.
const FILES: [(&str, &str); 8] = [
    ("README.md", "share/doc/plumb/README.md"),
    ("CONTRIBUTING.md", "share/doc/plumb/CONTRIBUTING.md"),
    ("CHANGELOG.md", "share/doc/plumb/CHANGELOG.md"),
    ("LICENSE-MIT", "share/doc/plumb/LICENSE-MIT"),
    ("LICENSE-APACHE", "share/doc/plumb/LICENSE-APACHE"),
    ("xtask/files/INSTALL.md", "share/doc/plumb/INSTALL.md"),
    ("xtask/files/INSTALL.md", "share/doc/plumb/xtask/files/INSTALL.md"),
    ("xtask/files/70-plumb-serial.rules", "lib/udev/rules.d/70-plumb-serial.rules"),
];

/// Folders whose pages and pictures are installed beside README.md under the same paths, so that its links lead somewhere.
const DOCUMENTED: [&str; 4] = ["core", "plugins", "tui/pictures", "workcells"];

/// How the names of pages and pictures end.
const PAGES: [&str; 3] = ["md", "png", "svg"];

/// Where each shell looks for completions.
const COMPLETIONS: [(&str, &str); 3] = [
    ("bash", "share/bash-completion/completions/plumb"),
    ("zsh", "share/zsh/vendor-completions/_plumb"),
    ("fish", "share/fish/vendor_completions.d/plumb.fish"),
];

/// The library that runs drivers of other languages.
const BRIDGE: &str = "libplumb_bridge.so";

/// The kinds of files that `plumb schema` knows.
const SCHEMAS: [&str; 11] =
    ["cell", "procedure", "answers", "model", "world", "arm", "rig", "scene", "manifest", "study", "events"];

/// Lays everything out under `tree`; the version of the C library that it needs.
pub(crate) fn stage(built: &Built<'_>, tree: &Path, third_party: &str) -> Result<String, PackageError> {
    let program = tree.join("bin/plumb");
    copy(&there(built.folder.join("plumb"))?, &program)?;
    let mut binaries = vec![program.clone()];
    binaries.extend(plugins(built, tree)?);
    for binary in &binaries {
        output(Command::new("strip").arg("--strip-unneeded").arg(binary))?;
    }
    copy_tree(&built.root.join("workcells"), &tree.join("share/plumb/workcells"))?;
    written_against::crates(built.root, tree)?;
    for (from, to) in FILES {
        copy(&built.root.join(from), &tree.join(to))?;
    }
    for folder in DOCUMENTED {
        copy_pages(&built.root.join(folder), &tree.join("share/doc/plumb").join(folder))?;
    }
    write(&tree.join("share/doc/plumb/THIRD-PARTY-LICENSES"), third_party.as_bytes())?;
    rights(tree, &binaries)?;
    // From here on the program itself says what it has: it runs where it will lie.
    let message = |arguments: &[&str]| output(Command::new(&program).args(arguments).current_dir("/"));
    for kind in SCHEMAS {
        write(&tree.join(format!("share/plumb/schemas/{kind}.schema.json")), &message(&["schema", kind])?)?;
    }
    for (shell, to) in COMPLETIONS {
        write(&tree.join(to), &message(&["completions", shell])?)?;
    }
    let pages = tree.join("share/man/man1");
    message(&["man", "-o", &pages.to_string_lossy()])?;
    message(&["plugins", "verify"])?;
    rights(tree, &binaries)?;
    newest_glibc(&binaries)
}

/// Each plugin's manifest and library in a folder of its own; the libraries.
fn plugins(built: &Built<'_>, tree: &Path) -> Result<Vec<PathBuf>, PackageError> {
    let mut libraries = Vec::new();
    for folder in sorted(&built.root.join("plugins"))? {
        let manifest = folder.join("plugin.yaml");
        if !manifest.is_file() {
            continue;
        }
        let text = fs::read_to_string(&manifest).map_err(PackageError::io(&manifest))?;
        let key = |name: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
            line.map(|value| value.trim().to_owned()).ok_or_else(|| PackageError::Unexpected {
                path: manifest.clone(),
                what: format!("it has no line `{name}: ...`"),
            })
        };
        let (id, library) = (key("id")?, key("library")?);
        let to = tree.join("lib/plumb/plugins").join(id);
        copy(&manifest, &to.join("plugin.yaml"))?;
        copy(&newest(built, &library)?, &to.join(&library))?;
        libraries.push(to.join(&library));
    }
    // What runs drivers of other languages: no plugin of its own, so it has no folder.
    let bridge = tree.join("lib/plumb/plugins").join(BRIDGE);
    copy(&newest(built, BRIDGE)?, &bridge)?;
    libraries.push(bridge);
    Ok(libraries)
}

/// A library where cargo built it last: `cargo test` brings only those in `deps` up to date.
fn newest(built: &Built<'_>, library: &str) -> Result<PathBuf, PackageError> {
    let candidates = [built.folder.join("deps").join(library), built.folder.join(library)];
    let newest = candidates.into_iter().filter(|path| path.is_file()).max_by_key(|path| modified(path));
    newest.ok_or_else(|| PackageError::NotBuilt(built.folder.join(library)))
}

fn modified(path: &Path) -> Option<std::time::SystemTime> {
    fs::metadata(path).ok()?.modified().ok()
}

fn there(path: PathBuf) -> Result<PathBuf, PackageError> {
    if path.is_file() { Ok(path) } else { Err(PackageError::NotBuilt(path)) }
}

/// Copies the pages and pictures of a folder, and of those in it but tests.
fn copy_pages(from: &Path, to: &Path) -> Result<(), PackageError> {
    for path in sorted(from)? {
        let name = path.file_name().unwrap_or_default();
        let is_page = path.extension().is_some_and(|ending| PAGES.iter().any(|page| ending == *page));
        if path.is_dir() && name != "tests" {
            copy_pages(&path, &to.join(name))?;
        } else if is_page && path.is_file() {
            copy(&path, &to.join(name))?;
        }
    }
    Ok(())
}

/// Everybody may read; programs and libraries may be run; nobody but their owner may change them, or plumb would refuse to load them.
fn rights(path: &Path, binaries: &[PathBuf]) -> Result<(), PackageError> {
    let is_program = binaries.iter().any(|binary| binary == path);
    let mode = if path.is_dir() || is_program { 0o755 } else { 0o644 };
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).map_err(PackageError::io(path))?;
    if path.is_dir() {
        for path in sorted(path)? {
            rights(&path, binaries)?;
        }
    }
    Ok(())
}

/// The newest version of the C library whose symbols these use, as `2.34`: their tables of names hold `GLIBC_2.34`.
fn newest_glibc(binaries: &[PathBuf]) -> Result<String, PackageError> {
    const MARK: &[u8] = b"GLIBC_2.";
    let mut newest = 0;
    for binary in binaries {
        let bytes = fs::read(binary).map_err(PackageError::io(binary))?;
        for at in
            bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK).map(|(at, _)| at)
        {
            let digits = bytes.iter().skip(at + MARK.len()).take_while(|byte| byte.is_ascii_digit());
            let number = digits
                .fold(0_u32, |sum, digit| sum.saturating_mul(10).saturating_add(u32::from(digit - b'0')));
            newest = newest.max(number);
        }
    }
    Ok(format!("2.{newest}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_symbol_version_counts_as_a_number() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("library");
        fs::write(&file, b"\0GLIBC_2.4\0GLIBC_2.34\0GLIBC_2.5\0GLIBC_PRIVATE\0").unwrap();
        assert_eq!(newest_glibc(&[file]).unwrap(), "2.34");
    }
}
