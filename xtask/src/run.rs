//! Other programs, called and listened to.

use std::process::{Command, Stdio};

use crate::error::PackageError;

/// Runs a program; what it wrote to standard output.
pub(crate) fn output(command: &mut Command) -> Result<Vec<u8>, PackageError> {
    let words: Vec<String> = std::iter::once(command.get_program())
        .chain(command.get_args())
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    let program = words.first().cloned().unwrap_or_default();
    let ran = command.stdin(Stdio::null()).output();
    let ran =
        ran.map_err(|source| PackageError::NoProgram { help: brought_by(&program), program, source })?;
    if !ran.status.success() {
        return Err(PackageError::Failed {
            command: words.join(" "),
            status: ran.status.to_string(),
            message: String::from_utf8_lossy(&ran.stderr).trim().to_owned(),
        });
    }
    Ok(ran.stdout)
}

/// What brings a program that is missing.
fn brought_by(program: &str) -> &'static str {
    match program {
        "strip" => "it comes with binutils, which a C compiler needs too",
        "tar" => "install GNU tar",
        "dpkg-deb" => "every Debian has it; elsewhere install `dpkg`, or give --archive-only",
        _ => "see whether it is installed",
    }
}
