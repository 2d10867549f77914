//! The whole way: build, lay out, pack.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::error::PackageError;
use crate::run::output;
use crate::stage::{Built, stage};
use crate::{debian, licences};

/// What is wanted.
pub struct Options {
    /// Where to write to; `target/package` if left out.
    pub output: Option<PathBuf>,
    /// Where the program and its plugins are built already; they are built if left out.
    pub built: Option<PathBuf>,
    /// No Debian package.
    pub archive_only: bool,
}

/// The root of the source.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Builds plumb where that is asked for, and writes the packages; their files.
///
/// # Errors
/// What `PackageError` lists. What was written until then is left.
pub fn package(options: &Options) -> Result<Vec<PathBuf>, PackageError> {
    let root = fs::canonicalize(ROOT).map_err(PackageError::io(Path::new(ROOT)))?;
    let metadata = metadata(&root)?;
    let target = PathBuf::from(metadata["target_directory"].as_str().unwrap_or("target"));
    let built = match &options.built {
        Some(folder) => folder.clone(),
        None => {
            build(&root)?;
            target.join("release")
        }
    };
    let output_folder = options.output.clone().unwrap_or_else(|| target.join("package"));
    let version = env!("CARGO_PKG_VERSION");
    let name = format!("plumb-{version}-{}-linux", env::consts::ARCH);
    let tree = output_folder.join(&name);
    if tree.exists() {
        fs::remove_dir_all(&tree).map_err(PackageError::io(&tree))?;
    }
    fs::create_dir_all(&tree).map_err(PackageError::io(&tree))?;
    let tree = fs::canonicalize(&tree).map_err(PackageError::io(&tree))?;
    let glibc = stage(&Built { root: &root, folder: &built }, &tree, &licences::third_party(&metadata))?;

    let mut written = vec![archive(&root, &output_folder, &name)?];
    if !options.archive_only {
        written.push(debian::package(&tree, &output_folder, version, &glibc)?);
    }
    fs::remove_dir_all(&tree).map_err(PackageError::io(&tree))?;
    Ok(written)
}

fn cargo(root: &Path) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}

/// Builds the default members of the workspace: the program and its plugins.
fn build(root: &Path) -> Result<(), PackageError> {
    eprintln!("building; the first time takes several minutes");
    output(cargo(root).args(["build", "--release", "--locked"])).map(drop)
}

/// What cargo knows of the crates that are built in, for this machine.
fn metadata(root: &Path) -> Result<Value, PackageError> {
    let machine = format!("{}-unknown-linux-gnu", env::consts::ARCH);
    let text = output(cargo(root).args([
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--filter-platform",
        &machine,
    ]))?;
    serde_json::from_slice(&text).map_err(|error| PackageError::Unexpected {
        path: root.join("Cargo.toml"),
        what: format!("cargo metadata cannot be read: {error}"),
    })
}

/// Writes the archive. The same files give the same bytes: names in order, nobody's name, the time of the last commit.
fn archive(root: &Path, folder: &Path, name: &str) -> Result<PathBuf, PackageError> {
    let archive = folder.join(format!("{name}.tar.gz"));
    let mut tar = Command::new("tar");
    tar.args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner"]);
    if let Some(time) = time_of_the_source(root) {
        tar.arg(format!("--mtime=@{time}"));
    }
    output(tar.arg("-C").arg(folder).arg("-czf").arg(&archive).arg(name))?;
    Ok(archive)
}

/// `SOURCE_DATE_EPOCH`, else the time of the last commit; none where neither is known.
fn time_of_the_source(root: &Path) -> Option<String> {
    let message = env::var("SOURCE_DATE_EPOCH").ok().or_else(|| {
        let time = output(Command::new("git").args(["log", "-1", "--format=%ct"]).current_dir(root)).ok()?;
        String::from_utf8(time).ok()
    });
    message.map(|time| time.trim().to_owned()).filter(|time| time.parse::<u64>().is_ok())
}
