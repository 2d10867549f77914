//! The Run screen: the steps with their progress, the prompt, live values, what was found and what it corrects.

mod convergence;
mod found;
mod instrument_view;
mod large;
mod level_view;
mod prompt;
mod prompt_view;
mod state;
mod steps;
mod update;
mod view;
mod words;

pub(crate) use prompt::OpenPrompt;
pub(crate) use state::{Phase, RunState};
pub(crate) use update::{PAGE, choose_at, keep_the_arm, obey, pass_time, scroll, write};
pub(crate) use view::{outcome_look, view};
pub(crate) use words::outcome_word;
