//! `cargo xtask package`: builds plumb and writes what is installed of it.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_xtask::package::{Options, package};

const USAGE: &str = "\
cargo xtask package [-o DIR] [--built DIR] [--archive-only]

Builds the program and its plugins (cargo build --release --locked) and writes plumb-VERSION-MACHINE-linux.tar.gz and
plumb_VERSION_ARCHITECTURE.deb.

  -o DIR           where to; `target/package` if left out
  --built DIR      take what is built there already, such as target/release, and build nothing
  --archive-only   no Debian package, which needs dpkg-deb
";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    match arguments.next().as_deref() {
        Some("package") => {}
        Some("-h" | "--help") => {
            let _reader_gone = std::io::stdout().write_all(USAGE.as_bytes());
            return ExitCode::SUCCESS;
        }
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(2);
        }
    }
    let done = options(arguments).and_then(|options| package(&options).map_err(|error| error.to_string()));
    match done {
        Ok(files) => {
            for file in files {
                let _reader_gone = writeln!(std::io::stdout(), "{}", file.display());
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("cargo xtask package: {error}");
            ExitCode::from(2)
        }
    }
}

/// Reads the options after `package`.
fn options(mut arguments: impl Iterator<Item = String>) -> Result<Options, String> {
    let mut options = Options { output: None, built: None, archive_only: false };
    while let Some(argument) = arguments.next() {
        let mut folder = || {
            arguments.next().map(PathBuf::from).ok_or_else(|| format!("{argument} needs a folder after it"))
        };
        match argument.as_str() {
            "-o" | "--output" => options.output = Some(folder()?),
            "--built" => options.built = Some(folder()?),
            "--archive-only" => options.archive_only = true,
            other => return Err(format!("there is no option {other}\n\n{USAGE}")),
        }
    }
    Ok(options)
}
