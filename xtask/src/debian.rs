//! The Debian package: the tree under `usr/`, and what Debian wants besides.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::PackageError;
use crate::files::{copy, copy_tree, sorted, write};
use crate::run::output;

/// Writes `plumb_VERSION_ARCHITECTURE.deb` from the tree.
pub(crate) fn package(
    tree: &Path,
    output_folder: &Path,
    version: &str,
    glibc: &str,
) -> Result<PathBuf, PackageError> {
    let root = output_folder.join("debian");
    if root.exists() {
        fs::remove_dir_all(&root).map_err(PackageError::io(&root))?;
    }
    let usr = root.join("usr");
    copy_tree(tree, &usr)?;
    for folder in sorted(tree)? {
        copy_rights(&folder, &usr.join(folder.file_name().unwrap_or_default()))?;
    }
    let documents = usr.join("share/doc/plumb");
    copyright(&documents)?;
    for page in sorted(&usr.join("share/man/man1"))? {
        output(Command::new("gzip").args(["-9", "-n"]).arg(&page))?;
    }
    let bytes = size(&usr)?;
    let architecture = architecture();
    write(&root.join("DEBIAN/md5sums"), checksums(&root)?.as_bytes())?;
    write(&root.join("DEBIAN/control"), control(version, architecture, glibc, bytes).as_bytes())?;
    let package = output_folder.join(format!("plumb_{version}_{architecture}.deb"));
    output(Command::new("dpkg-deb").args(["--root-owner-group", "--build"]).arg(&root).arg(&package))?;
    fs::remove_dir_all(&root).map_err(PackageError::io(&root))?;
    Ok(package)
}

/// Debian's name of this machine.
fn architecture() -> &'static str {
    match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    }
}

/// The file `control`. udev and man-db notice new files by themselves, so that no script is run at installation or removal.
fn control(version: &str, architecture: &str, glibc: &str, bytes: u64) -> String {
    format!(
        "Package: plumb\n\
         Version: {version}\n\
         Architecture: {architecture}\n\
         Maintainer: plumb\n\
         Installed-Size: {}\n\
         Depends: libc6 (>= {glibc}), libgcc-s1\n\
         Section: science\n\
         Priority: optional\n\
         Description: calibration of lab robots\n \
         plumb loads robots and sensors as plugins, leads an operator through\n \
         calibration procedures or runs them alone, and shows where the model of\n \
         a machine disagrees with what was measured and which physical effect is\n \
         missing.\n \
         .\n \
         `plumb init lab` puts a simulated example cell into the folder lab.\n",
        bytes.div_ceil(1024)
    )
}

/// Debian's file of licences, from those that are there already.
fn copyright(documents: &Path) -> Result<(), PackageError> {
    let mut text = String::from(
        "plumb is licensed under the MIT licence or the Apache License 2.0, as you choose. The licences of the libraries\n\
         built into it stand in THIRD-PARTY-LICENSES beside this file.\n\n",
    );
    for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let path = documents.join(name);
        text.push_str(&fs::read_to_string(&path).map_err(PackageError::io(&path))?);
        text.push('\n');
    }
    write(&documents.join("copyright"), text.as_bytes())?;
    copy(&documents.join("CHANGELOG.md"), &documents.join("changelog"))?;
    output(Command::new("gzip").args(["-9", "-n"]).arg(documents.join("changelog"))).map(drop)
}

fn copy_rights(from: &Path, to: &Path) -> Result<(), PackageError> {
    let rights = fs::metadata(from).map_err(PackageError::io(from))?.permissions();
    fs::set_permissions(to, rights).map_err(PackageError::io(to))?;
    if from.is_dir() {
        for path in sorted(from)? {
            copy_rights(&path, &to.join(path.file_name().unwrap_or_default()))?;
        }
    }
    Ok(())
}

/// Bytes of all files.
fn size(folder: &Path) -> Result<u64, PackageError> {
    let mut bytes = 0;
    for path in sorted(folder)? {
        bytes += match path.is_dir() {
            true => size(&path)?,
            false => fs::metadata(&path).map_err(PackageError::io(&path))?.len(),
        };
    }
    Ok(bytes)
}

/// What `dpkg --verify` compares with: a line a file.
fn checksums(root: &Path) -> Result<String, PackageError> {
    let mut files = Vec::new();
    collect(&root.join("usr"), &mut files)?;
    let relative: Vec<&Path> = files.iter().filter_map(|file| file.strip_prefix(root).ok()).collect();
    let text = output(Command::new("md5sum").args(relative).current_dir(root))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), PackageError> {
    for path in sorted(folder)? {
        if path.is_dir() { collect(&path, files)? } else { files.push(path) }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_control_file_names_the_c_library_and_rounds_the_size_up() {
        let text = control("1.2.3", "amd64", "2.34", 2049);
        assert!(text.contains("\nDepends: libc6 (>= 2.34), libgcc-s1\n"), "{text}");
        assert!(text.contains("\nInstalled-Size: 3\n"), "{text}");
        let description = text.split_once("Description: ").unwrap().1;
        assert!(description.lines().skip(1).all(|line| line.starts_with(' ')), "{text}");
    }
}
