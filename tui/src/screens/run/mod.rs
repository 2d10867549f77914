//! The Run screen: the steps with their progress, the prompt, live values, what was found and what it corrects.

mod convergence;
mod found;
mod large;
mod level_view;
mod prompt;
mod prompt_view;
mod state;
mod steps;
mod view;

pub(crate) use prompt::OpenPrompt;
pub(crate) use state::{Phase, RunState};
pub(crate) use view::{outcome_look, outcome_word, sentence_case, view};
