//! Takes known keys from a map; what is left over is a mistake.

use crate::suggestion::nearest;
use crate::{Key, Node, NodeValue, Problems, Span, one_of};

/// Reads one map. Every key it is asked for becomes known; [`MapReader::finish`] reports the others.
pub struct MapReader<'n> {
    what: &'static str,
    span: Span,
    entries: &'n [(Key, Node)],
    known: Vec<&'static str>,
    problems: &'n Problems,
}

impl<'n> MapReader<'n> {
    /// Begins to read `node`; `what` names it in messages ("a device"). None, with a message, when it is no map.
    pub fn new(node: &'n Node, what: &'static str, problems: &'n Problems) -> Option<Self> {
        match &node.value {
            NodeValue::Map(entries) => {
                Some(Self { what, span: node.span, entries, known: Vec::new(), problems })
            }
            other => {
                let message = format!("{what} is a map of keys and values; this is {}", other.kind());
                problems.add(node.span, message, "");
                None
            }
        }
    }

    /// Where the map begins.
    pub fn span(&self) -> Span {
        self.span
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
            self.problems.add(self.span, format!("{} needs the key `{key}`", self.what), "");
        }
        found
    }

    /// The entries of a map under a key that may be left out; None when what is there cannot be read, or is under a misspelled key, so
    /// that nothing is known of it.
    pub fn known_entries(&mut self, key: &'static str) -> Option<&'n [(Key, Node)]> {
        match self.optional(key) {
            Some(node) => node.entries(&format!("`{key}`"), self.problems),
            None if self.slipped_key(key) => None,
            None => Some(&[]),
        }
    }

    /// Whether a key is there that will be reported as a misspelling of `key`, so that its absence need not be.
    fn slipped_key(&self, key: &'static str) -> bool {
        self.entries.iter().any(|(name, _)| name.name != key && is_misspelling(&name.name, key))
    }

    /// Reports every key that nobody asked for.
    pub fn finish(self) {
        for (key, _) in self.entries.iter().filter(|(key, _)| !self.known.contains(&key.name.as_str())) {
            let message = format!("unknown key `{}` in {}", key.name, self.what);
            self.problems.add(key.span, message, unknown_key_help(&key.name, &self.known, self.what));
        }
    }
}

/// What a key should have been, or, where none is near, the keys there are.
pub(crate) fn unknown_key_help(typed: &str, known: &[&'static str], what: &str) -> String {
    correction(typed, known).unwrap_or_else(|| match known.is_empty() {
        true => format!("{what} takes no keys here"),
        false => format!("{what}: {}", one_of(known.iter().copied())),
    })
}

/// Whether `typed` is reported as a misspelling of `key`.
pub(crate) fn is_misspelling(typed: &str, key: &'static str) -> bool {
    correction(typed, &[key]).is_some()
}

/// What a key should have been: with its unit, with another unit, or without a slip.
fn correction(typed: &str, known: &[&'static str]) -> Option<String> {
    let stem = |name: &str| name.rsplit_once('_').map(|(stem, _)| stem.to_owned());
    if let Some(right) = known.iter().find(|name| stem(name).as_deref() == Some(typed)) {
        return Some(format!("a key carries its unit: write `{right}`"));
    }
    if let (Some(typed_stem), Some(unit)) = (stem(typed), typed.rsplit('_').next())
        && crate::value::UNITS.contains(&unit)
        && let Some(right) = known.iter().find(|name| stem(name).as_deref() == Some(typed_stem.as_str()))
    {
        return Some(format!("this is not read in `{unit}`: write `{right}`"));
    }
    nearest(typed, known).map(|right| format!("did you mean `{right}`?"))
}
