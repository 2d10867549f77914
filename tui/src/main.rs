//! The `plumb` program; all of it is in the library of the same name, from which the studies under `tests/studies` take parts.

use std::process::ExitCode;

fn main() -> ExitCode {
    plumb::program()
}
