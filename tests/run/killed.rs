//! The kill campaign in short; `tests/kill_campaign.rs` is the long one.

use crate::campaign::{Victim, campaign};

#[test]
fn killed_at_any_moment_a_run_loses_no_answer_and_can_be_taken_up_again() {
    let figures = campaign(Victim::Orchestrator, 8, 1, |_| ());
    assert!(figures.wrong.is_empty(), "\n{figures}");
    assert_eq!(figures.resumed + figures.before_the_record + figures.after_the_end, 8, "\n{figures}");
}

#[test]
fn with_a_host_killed_at_any_moment_a_run_loses_no_answer_and_can_be_taken_up_again() {
    let figures = campaign(Victim::Host, 8, 2, |_| ());
    assert!(figures.wrong.is_empty(), "\n{figures}");
    assert_eq!(figures.resumed + figures.before_the_record + figures.after_the_end, 8, "\n{figures}");
}
