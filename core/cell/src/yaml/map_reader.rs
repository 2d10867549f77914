//! Takes known keys from a map; what is left over is a mistake.

use super::suggestion::nearest;
use super::{Key, Node, NodeValue, Place, Problems, one_of};

/// Reads one map. Every key it is asked for becomes known; [`MapReader::finish`] reports the others.
pub struct MapReader<'n> {
    what: &'static str,
    place: Place,
    entries: &'n [(Key, Node)],
    known: Vec<&'static str>,
    problems: &'n Problems,
}

impl<'n> MapReader<'n> {
    /// Begins to read `node`; `what` names it in messages ("a device"). None, with a message, when it is no map.
    pub fn new(node: &'n Node, what: &'static str, problems: &'n Problems) -> Option<Self> {
        match &node.value {
            NodeValue::Map(entries) => {
                Some(Self { what, place: node.place, entries, known: Vec::new(), problems })
            }
            other => {
                let message = format!("{what} is a map of keys and values; this is {}", other.kind());
                problems.add(node.place, message, "");
                None
            }
        }
    }

    /// Where the map begins.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The value of a key that may be left out. An empty value is as good as none.
    pub fn optional(&mut self, key: &'static str) -> Option<&'n Node> {
        self.known.push(key);
        let found = self.entries.iter().find(|(name, _)| name.name == key).map(|(_, node)| node);
        found.filter(|node| node.value != NodeValue::Null)
    }

    /// The value of a key that has to be there; its absence is a mistake.
    pub fn required(&mut self, key: &'static str) -> Option<&'n Node> {
        let found = self.optional(key);
        if found.is_none() && !self.slipped_key(key) {
            self.problems.add(self.place, format!("{} needs the key `{key}`", self.what), "");
        }
        found
    }

    /// Whether a key is there that will be reported as a misspelling of `key`, so that its absence need not be.
    fn slipped_key(&self, key: &'static str) -> bool {
        self.entries.iter().any(|(name, _)| name.name != key && correction(&name.name, &[key]).is_some())
    }

    /// Reports every key that nobody asked for.
    pub fn finish(self) {
        for (key, _) in self.entries {
            if self.known.contains(&key.name.as_str()) {
                continue;
            }
            let help = correction(&key.name, &self.known).unwrap_or_else(|| match self.known.is_empty() {
                true => format!("{} takes no keys here", self.what),
                false => format!("{}: {}", self.what, one_of(self.known.iter().copied())),
            });
            self.problems.add(key.place, format!("unknown key `{}` in {}", key.name, self.what), help);
        }
    }
}

/// What a key should have been: with its unit, with another unit, or without a slip.
fn correction(typed: &str, known: &[&'static str]) -> Option<String> {
    let stem = |name: &str| name.rsplit_once('_').map(|(stem, _)| stem.to_owned());
    if let Some(right) = known.iter().find(|name| stem(name).as_deref() == Some(typed)) {
        return Some(format!("a key carries its unit: write `{right}`"));
    }
    if let (Some(typed_stem), Some(unit)) = (stem(typed), typed.rsplit('_').next())
        && super::value::UNITS.contains(&unit)
        && let Some(right) = known.iter().find(|name| stem(name).as_deref() == Some(typed_stem.as_str()))
    {
        return Some(format!("this is not read in `{unit}`: write `{right}`"));
    }
    nearest(typed, known).map(|right| format!("did you mean `{right}`?"))
}
