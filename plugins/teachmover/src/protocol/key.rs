//! The keys of the teach pendant.

use std::fmt;

/// A key of the teach pendant, by the number the controller reports for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PendantKey(pub u8);

impl PendantKey {
    /// No key since the controller was switched on.
    pub const NONE: Self = Self(0);
    /// The key that stops every motion.
    pub const STOP: Self = Self(7);

    /// What is printed on the key, or `None` for a number no key has.
    pub fn name(self) -> Option<&'static str> {
        const NAMES: [&str; 15] = [
            "none", "TRAIN", "PAUSE", "GRIP", "OUT", "FREE", "MOVE", "STOP", "STEP", "POINT", "JUMP",
            "CLEAR", "ZERO", "SPEED", "RUN",
        ];
        NAMES.get(usize::from(self.0)).copied()
    }
}

impl fmt::Display for PendantKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => formatter.write_str(name),
            None => write!(formatter, "key {}", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_a_name_to_print() {
        assert_eq!(PendantKey::STOP.to_string(), "STOP");
        assert_eq!(PendantKey(14).to_string(), "RUN");
        assert_eq!(PendantKey(15).to_string(), "key 15");
    }
}
