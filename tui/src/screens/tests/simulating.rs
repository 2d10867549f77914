//! What the screens offer in a simulated cell, where nobody's hands or eyes are needed.

use plumb_cell::command::Command as RunCommand;
use plumb_cell::event::Event;
use plumb_cell::prompt::{Answer, PromptKind};
use ratatui::crossterm::event::KeyCode;

use super::fixtures::{begun, deliver, jog_asked, number_asked, page, press};
use crate::screens::message::Action;

#[test]
fn in_a_simulated_cell_a_prompt_says_that_nothing_is_to_be_done_by_hand() {
    let acknowledge = PromptKind::Acknowledge { label: "It lies there".to_owned() };
    for (kind, sentence) in [
        (Some(acknowledge), "Simulated: done already, Enter goes on."),
        (None, "Simulated: Enter drives it there where you do not jog it."),
    ] {
        for simulated in [true, false] {
            let mut state = begun();
            let Event::PromptAsked { mut prompt } = jog_asked() else { panic!("a prompt") };
            prompt.simulated = simulated;
            prompt.kind = kind.clone().unwrap_or(prompt.kind);
            deliver(&mut state, Event::PromptAsked { prompt });
            let shown = page(&state, 120, 40);
            assert_eq!(shown.contains(sentence), simulated, "{shown}");
            assert_eq!(shown.contains("s leaves this and all like it to the program."), simulated);
        }
    }
}

#[test]
fn readings_of_simulated_instruments_are_left_to_the_program_by_one_key() {
    for simulated in [true, false] {
        let mut state = begun();
        let Event::PromptAsked { mut prompt } = number_asked() else { panic!("a prompt") };
        (prompt.simulated, prompt.help) = (simulated, None);
        deliver(&mut state, Event::PromptAsked { prompt: prompt.clone() });
        let shown = page(&state, 80, 24);
        assert_eq!(shown.contains("Simulated: read already, Enter takes it."), simulated, "{shown}");
        assert_eq!(shown.contains("s simulate the rest"), simulated, "{shown}");
        let left = RunCommand::Answer { prompt: prompt.id, answer: Answer::Simulated, by: "ada".to_owned() };
        let actions = press(&mut state, KeyCode::Char('s'));
        assert_eq!(actions == [Action::Send(left)], simulated, "{actions:?}");
    }
}

#[test]
fn in_the_smallest_terminal_the_question_begins_to_be_read_before_the_keys_are_named_twice() {
    let mut state = begun();
    let Event::PromptAsked { mut prompt } = number_asked() else { panic!("a prompt") };
    let text = "Lay the spirit level on the hand, read it, turn it end for end and read it once more.";
    (prompt.simulated, prompt.text) = (true, text.to_owned());
    deliver(&mut state, Event::PromptAsked { prompt });
    let shown = page(&state, 40, 12);
    assert!(shown.contains("Lay the spirit") && shown.contains("PgDn reads on"), "{shown}");
    let title = shown.lines().nth(1).unwrap_or_default();
    assert!(title.contains(" steps") && !title.contains("left"), "{shown}");
}
