//! The one place where an error becomes text on standard error and an exit code.

use std::error::Error;
use std::io;
use std::process::ExitCode;

/// What a command gives back: its exit code, or the error that ended it.
pub type CommandResult = Result<ExitCode, Box<dyn Error>>;

/// Exit code of a command that could not do what it was asked.
const ERROR: u8 = 2;

/// The program's exit code; prints the error and its causes. A reader that went away (`plumb ... | head`) is no error.
pub fn exit_code(result: CommandResult) -> ExitCode {
    match result {
        Ok(code) => code,
        Err(error) if is_broken_pipe(error.as_ref()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("plumb: {}", with_causes(error.as_ref()));
            ExitCode::from(ERROR)
        }
    }
}

/// The error's message, followed by those of its causes that it does not already repeat.
pub fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let message = error.to_string();
        if !text.contains(&message) {
            text.push_str(": ");
            text.push_str(&message);
        }
        cause = error.source();
    }
    text
}

fn is_broken_pipe(error: &(dyn Error + 'static)) -> bool {
    let mut cause = Some(error);
    while let Some(error) = cause {
        if error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe) {
            return true;
        }
        cause = error.source();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("cannot read the table")]
    struct Outer(#[source] io::Error);

    #[test]
    fn causes_follow_the_message_once() {
        let error = Outer(io::Error::other("the disk is on fire"));
        assert_eq!(with_causes(&error), "cannot read the table: the disk is on fire");
    }

    #[test]
    fn a_reader_that_went_away_is_found_below_other_errors() {
        assert!(is_broken_pipe(&Outer(io::ErrorKind::BrokenPipe.into())));
        assert!(!is_broken_pipe(&Outer(io::ErrorKind::NotFound.into())));
    }
}
