//! The operator of a simulated cell: what procedures ask of a person's hands and eyes there, said to the world.

use std::path::Path;

use plumb_cell::device::Act;
use plumb_document::did_you_mean;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{Axis, Instrument, Response, WorldCommand};

/// What procedures may ask for under `simulated:`, with its numbers and its words.
const ACTS: [(&str, &[&str], &[&str]); 14] = [
    ("rest_on_gauge", &["height_mm"], &[]),
    ("trim_to_fire", &[], &[]),
    ("place_hand", &["x_mm", "y_mm", "z_mm"], &[]),
    ("read_level", &[], &["at", "turned"]),
    ("read_ruler", &[], &["at"]),
    ("read_tracker", &[], &["at", "axis"]),
    ("read_board", &[], &["axis"]),
    ("read_board_turn", &[], &["axis"]),
    ("read_probe", &[], &["at"]),
    ("read_profile", &["point"], &["at", "axis"]),
    ("drive_to_level", &[], &["joint", "at", "turned", "from"]),
    ("hang", &["mass_kg"], &[]),
    ("read_point", &["ahead_mm"], &["axis"]),
    ("shine", &[], &["laser", "filter"]),
];

/// Does an act in the world that listens there; what an instrument reads.
pub(super) fn operate(socket: &Path, act: &Act) -> Result<Option<f64>, String> {
    let command = command_of(act)?;
    let mut world = WorldClient::connect(socket, "operator").map_err(|error| error.to_string())?;
    match world.call(command, || false, |_| ()) {
        // As one writes it down: no instrument is read to more than a millionth.
        Ok(Response::Measured { value, .. }) => Ok(Some((value * 1e6).round() / 1e6)),
        Ok(_) => Ok(None),
        Err(error) => Err(format!("the simulated operator cannot do `{}`: {error}", act.name)),
    }
}

/// An act that is not known, or that takes no such argument.
fn check_arguments(act: &Act) -> Result<(), String> {
    let name = act.name.as_str();
    let Some((_, numbers, words)) = ACTS.iter().find(|(known, ..)| *known == name) else {
        let help = did_you_mean(name, ACTS.iter().map(|(known, ..)| *known));
        return Err(format!("the simulated operator does not know `{name}`: {help}"));
    };
    let given = act.numbers.iter().map(|(key, _)| key).chain(act.words.iter().map(|(key, _)| key));
    let known: Vec<&str> = numbers.iter().chain(*words).copied().collect();
    for key in given {
        if !known.contains(&key.as_str()) {
            let help = did_you_mean(key, known.iter().copied());
            return Err(format!("`{name}` of the simulated operator takes no `{key}`: {help}"));
        }
    }
    Ok(())
}

fn command_of(act: &Act) -> Result<WorldCommand, String> {
    check_arguments(act)?;
    let name = act.name.as_str();
    let needs = |key: &str| format!("`{name}` of the simulated operator needs `{key}`");
    let number = |key: &str| {
        let found = act.numbers.iter().find(|(known, _)| known == key).map(|(_, value)| *value);
        found.ok_or_else(|| needs(key))
    };
    let word = |key: &str| act.words.iter().find(|(known, _)| known == key).map(|(_, word)| word.clone());
    let turned = match word("turned").as_deref() {
        Some("true") => true,
        Some("false") | None => false,
        Some(other) => return Err(format!("`turned` of `{name}` is `{other}`; it is true or false")),
    };
    let axis = || match word("axis").as_deref() {
        Some("x") => Ok(Axis::X),
        Some("y") => Ok(Axis::Y),
        Some("z") => Ok(Axis::Z),
        Some(other) => Err(format!("`axis` of `{name}` is `{other}`; it is x, y or z")),
        None => Err(needs("axis")),
    };
    let read = |with: Instrument, axis| WorldCommand::Measure { with, at: word("at"), turned, axis };
    let one_of = |key: &str, yes: &str, no: &str| match word(key).as_deref() {
        Some(word) if word == yes => Ok(Some(true)),
        Some(word) if word == no => Ok(Some(false)),
        Some(other) => Err(format!("`{key}` of `{name}` is `{other}`; it is {yes} or {no}")),
        None => Ok(None),
    };
    Ok(match name {
        "shine" => WorldCommand::Shine {
            laser: one_of("laser", "on", "off")?,
            filter: one_of("filter", "in", "out")?,
        },
        "rest_on_gauge" => WorldCommand::RestOnGauge { height_mm: number("height_mm")? },
        "trim_to_fire" => WorldCommand::TrimToFire {},
        "place_hand" => {
            WorldCommand::PlaceHand { x_mm: number("x_mm")?, y_mm: number("y_mm")?, z_mm: number("z_mm")? }
        }
        "read_level" => read(Instrument::Level, None),
        "read_probe" => read(Instrument::Probe, None),
        "read_tracker" => read(Instrument::Tracker, Some(axis()?)),
        "read_board" => read_axis(Instrument::Board, axis()?),
        "read_board_turn" => read_axis(Instrument::BoardTurn, axis()?),
        "read_profile" => WorldCommand::ReadProfile {
            of: word("at").ok_or_else(|| needs("at"))?,
            point: number("point").map(|point| point as u32)?,
            axis: axis()?,
        },
        "drive_to_level" => WorldCommand::Level {
            joint: word("joint").ok_or_else(|| needs("joint"))?,
            at: word("at").ok_or_else(|| needs("at"))?,
            turned,
            rising: one_of("from", "below", "above")?,
        },
        "hang" => WorldCommand::Hang { mass_kg: number("mass_kg")? },
        "read_point" => WorldCommand::ReadPoint { axis: number_of(axis()?), ahead_mm: number("ahead_mm")? },
        _ => read(Instrument::Ruler, None),
    })
}

/// 0 of x, 1 of y, 2 of z.
fn number_of(axis: Axis) -> u8 {
    match axis {
        Axis::X => 0,
        Axis::Y => 1,
        Axis::Z => 2,
    }
}

/// One number of what an instrument reads that lies nowhere else.
fn read_axis(with: Instrument, axis: Axis) -> WorldCommand {
    WorldCommand::Measure { with, at: None, turned: false, axis: Some(axis) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn act(name: &str, numbers: &[(&str, f64)], words: &[(&str, &str)]) -> Act {
        Act {
            name: name.to_owned(),
            numbers: numbers.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect(),
            words: words.iter().map(|(key, word)| ((*key).to_owned(), (*word).to_owned())).collect(),
        }
    }

    #[test]
    fn an_act_that_is_not_known_or_lacks_something_is_reported_with_what_would_be_right() {
        let unknown = command_of(&act("rest_on_guage", &[], &[])).unwrap_err();
        assert!(unknown.contains("did you mean `rest_on_gauge`?"), "{unknown}");
        let lacking = command_of(&act("rest_on_gauge", &[], &[])).unwrap_err();
        assert_eq!(lacking, "`rest_on_gauge` of the simulated operator needs `height_mm`");
        let surplus = command_of(&act("trim_to_fire", &[("by", 1.0)], &[])).unwrap_err();
        assert!(surplus.contains("takes no `by`"), "{surplus}");
        let astray = command_of(&act("read_tracker", &[], &[("at", "tip"), ("axis", "w")])).unwrap_err();
        assert!(astray.contains("it is x, y or z"), "{astray}");
    }

    #[test]
    fn a_level_is_read_where_it_lies_and_the_way_it_lies() {
        let command =
            command_of(&act("read_level", &[], &[("at", "cage_back"), ("turned", "true")])).unwrap();
        let at = Some("cage_back".to_owned());
        assert_eq!(command, WorldCommand::Measure { with: Instrument::Level, at, turned: true, axis: None });
    }
}
