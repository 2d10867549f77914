//! The operator of a simulated cell: what procedures ask of a person's hands and eyes there, said to the world.

use std::path::Path;

use plumb_cell::yaml::did_you_mean;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{Instrument, Say, Verb};

/// What procedures may ask for under `simulated:`, with its numbers.
const ACTS: [(&str, &[&str]); 6] = [
    ("rest_on_gauge", &["height_mm"]),
    ("trim_to_fire", &[]),
    ("place_hand", &["x_mm", "y_mm", "z_mm"]),
    ("read_level", &[]),
    ("read_ruler", &[]),
    ("read_point", &["axis", "ahead_mm"]),
];

/// Does an act in the world that listens there; what an instrument reads.
pub(super) fn operate(socket: &Path, act: &str, values: &[(String, f64)]) -> Result<Option<f64>, String> {
    let verb = verb_of(act, values)?;
    let mut world = WorldClient::connect(socket, "operator").map_err(|error| error.to_string())?;
    match world.call(verb, || false, |_| ()) {
        Ok(Say::Measured { value, .. }) => Ok(Some(value)),
        Ok(_) => Ok(None),
        Err(error) => Err(format!("the simulated operator cannot do `{act}`: {error}")),
    }
}

fn verb_of(act: &str, values: &[(String, f64)]) -> Result<Verb, String> {
    let Some((_, names)) = ACTS.iter().find(|(known, _)| *known == act) else {
        let help = did_you_mean(act, ACTS.iter().map(|(known, _)| *known));
        return Err(format!("the simulated operator does not know `{act}`: {help}"));
    };
    if let Some((name, _)) = values.iter().find(|(name, _)| !names.contains(&name.as_str())) {
        return Err(format!(
            "`{act}` of the simulated operator takes no `{name}`: {}",
            did_you_mean(name, names.iter().copied())
        ));
    }
    let number = |name: &str| {
        let found = values.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
        found.ok_or_else(|| format!("`{act}` of the simulated operator needs `{name}`"))
    };
    Ok(match act {
        "rest_on_gauge" => Verb::RestOnGauge { height_mm: number("height_mm")? },
        "trim_to_fire" => Verb::TrimToFire {},
        "place_hand" => {
            Verb::PlaceHand { x_mm: number("x_mm")?, y_mm: number("y_mm")?, z_mm: number("z_mm")? }
        }
        "read_point" => {
            let axis = number("axis")?;
            let known = [0_u8, 1, 2].into_iter().find(|known| f64::from(*known) == axis);
            let axis = known.ok_or_else(|| "`axis` of `read_point` is 0, 1 or 2: x, y or z".to_owned())?;
            Verb::ReadPoint { axis, ahead_mm: number("ahead_mm")? }
        }
        "read_level" => Verb::Measure { with: Instrument::Level, at: None, turned: false },
        _ => Verb::Measure { with: Instrument::Ruler, at: None, turned: false },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_act_that_is_not_known_or_lacks_a_number_is_told_with_what_would_be_right() {
        let unknown = verb_of("rest_on_guage", &[]).unwrap_err();
        assert!(unknown.contains("did you mean `rest_on_gauge`?"), "{unknown}");
        let lacking = verb_of("rest_on_gauge", &[]).unwrap_err();
        assert_eq!(lacking, "`rest_on_gauge` of the simulated operator needs `height_mm`");
        let surplus = verb_of("trim_to_fire", &[("by".to_owned(), 1.0)]).unwrap_err();
        assert!(surplus.contains("takes no `by`"), "{surplus}");
    }
}
