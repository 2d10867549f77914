//! What the controller complains of: 128 alarms, a bit each, by "Dobot Magician ALARM Description" V1.0.0 (2018-12-07).

use crate::joints::JOINTS;

/// The bytes of GetAlarmsState.
pub(crate) const STATE_LENGTH: usize = 16;

/// A group of alarms: what they are about, and whether they say nothing against the arm's own account of where it is.
struct Group {
    codes: std::ops::RangeInclusive<u8>,
    is_of_reach: bool,
    says: &'static str,
    remedy: &'static str,
}

const GROUPS: [Group; 7] = [
    Group {
        codes: 0x00..=0x00,
        is_of_reach: true,
        says: "it has been switched on or reset",
        remedy: "home it (hold its Key button for some seconds), or its base angle is not known",
    },
    Group {
        codes: 0x01..=0x0f,
        is_of_reach: false,
        says: "its controller has a fault",
        remedy: "switch it off and on, and home it",
    },
    Group {
        codes: 0x10..=0x2f,
        is_of_reach: true,
        says: "it cannot go to that place, or not on that way",
        remedy: "choose another target",
    },
    Group {
        codes: 0x30..=0x3f,
        is_of_reach: false,
        says: "a joint went too fast",
        remedy: "lower full_speed_deg_per_s, and home it",
    },
    Group {
        codes: 0x40..=0x4f,
        is_of_reach: true,
        says: "a joint is at its end",
        remedy: "move it back from there",
    },
    Group {
        codes: 0x50..=0x5f,
        is_of_reach: false,
        says: "a joint lost steps: the arm's position is not known any more",
        remedy: "free the arm, switch it off and on, and home it (hold its Key button for some seconds)",
    },
    Group {
        codes: 0x60..=0x7f,
        is_of_reach: false,
        says: "a motor's driver complains",
        remedy: "switch it off and on, and home it",
    },
];

/// The joint of an alarm, by its index in its group.
fn joint_of(code: u8) -> Option<&'static str> {
    let name = |index: u8| JOINTS.get(usize::from(index)).map(|(name, _)| *name);
    match code {
        0x30..=0x33 => name(code - 0x30),
        // Both ends of one joint come after each other.
        0x40..=0x47 => name((code - 0x40) / 2),
        0x48 | 0x49 => Some("rear_arm against forearm"),
        0x50..=0x53 => name(code - 0x50),
        0x60..=0x6b => name((code - 0x60) / 3),
        _ => None,
    }
}

/// The alarms that are on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Alarms {
    codes: Vec<u8>,
}

impl Alarms {
    /// Those whose bits are set.
    pub(crate) fn of_state(state: &[u8]) -> Self {
        let is_on =
            |code: &u8| state.get(usize::from(code / 8)).is_some_and(|byte| byte & (1 << (code % 8)) != 0);
        Self { codes: (0..=0x7f).filter(is_on).collect() }
    }

    pub(crate) fn are_none(&self) -> bool {
        self.codes.is_empty()
    }

    /// Whether all of them say only that the arm could not go somewhere: those the driver may clear by itself.
    pub(crate) fn are_of_reach(&self) -> bool {
        self.codes.iter().all(|code| group_of(*code).is_some_and(|group| group.is_of_reach))
    }

    /// What they say and what to do, for the operator.
    pub(crate) fn in_words(&self) -> String {
        let one = |code: &u8| {
            let joint = joint_of(*code).map_or(String::new(), |joint| format!(" ({joint})"));
            let group = group_of(*code);
            let says = group.map_or("an alarm that is in no table", |group| group.says);
            let remedy = group.map_or("look it up in the maker's list", |group| group.remedy);
            format!("alarm 0x{code:02x}: {says}{joint}; {remedy}")
        };
        self.codes.iter().map(one).collect::<Vec<_>>().join(". ")
    }
}

fn group_of(code: u8) -> Option<&'static Group> {
    GROUPS.iter().find(|group| group.codes.contains(&code))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What an owner read off his arm while it would not move (github hadefuwa/rpi-dobot): bits 34 and 69.
    #[test]
    fn an_owners_alarms_are_read_as_what_they_were() {
        let state = [0, 0, 0, 0, 4, 0, 0, 0, 0x20, 0, 0, 0, 0, 0, 0, 0];
        let alarms = Alarms::of_state(&state);
        assert_eq!(alarms.codes, [0x22, 0x45]);
        assert!(alarms.are_of_reach());
        assert_eq!(
            alarms.in_words(),
            "alarm 0x22: it cannot go to that place, or not on that way; choose another target. alarm 0x45: a joint is at its end (forearm); move it back from there"
        );
    }

    #[test]
    fn every_code_has_words_and_lost_steps_are_not_of_reach() {
        for code in 0..=0x7f_u8 {
            let mut state = [0; STATE_LENGTH];
            state[usize::from(code / 8)] = 1 << (code % 8);
            let alarms = Alarms::of_state(&state);
            assert_eq!(alarms.codes, [code]);
            assert!(!alarms.in_words().contains("in no table"), "{code:02x}");
            assert_eq!(alarms.are_of_reach(), matches!(code, 0 | 0x10..=0x2f | 0x40..=0x4f), "{code:02x}");
        }
        assert!(Alarms::of_state(&[]).are_none());
    }
}
