//! `plumb host`: the process around one plugin. Started by plumb itself, never by hand.

use std::process::ExitCode;

use plumb_host::{MoveGuard, NoGuard};

use crate::failure::CommandResult;

/// Serves the device whose description comes from the program that started this one.
pub(crate) fn run() -> CommandResult {
    let code: ExitCode = plumb_host::serve(|guard, _robot| {
        if guard.is_null() {
            Ok(Box::new(NoGuard) as Box<dyn MoveGuard>)
        } else {
            Err("this program knows no check of moves of that kind".to_owned())
        }
    });
    Ok(code)
}
