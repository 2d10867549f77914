//! Which kind of file a document is: each says it by a key.

use std::path::Path;

use crate::suggestion::nearest;
use crate::{FileProblems, Key, Node, NodeValue, Problems, parse};

/// The kinds of files that people write for plumb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DocumentKind {
    /// A study of a cell: the cell's runs with numbers changed from line to line.
    Study,
    /// A workcell.
    Cell,
    /// A procedure.
    Procedure,
    /// Answers for runs without an operator.
    Answers,
    /// A simulated world.
    World,
    /// A plugin's manifest.
    Manifest,
    /// Camera, light plane and hand of a light stripe.
    Rig,
    /// A model of an arm.
    Model,
    /// Surfaces that a scan is compared with.
    Scene,
}

/// By what a kind is known.
struct Mark {
    kind: DocumentKind,
    /// With its article.
    name: &'static str,
    /// The key every file of the kind has.
    key: &'static str,
    /// Keys of kinds that may hold `key` too: a file with one of them is of such a kind, with its own key misspelled.
    not_with: &'static [&'static str],
}

const fn mark(
    kind: DocumentKind,
    name: &'static str,
    key: &'static str,
    not_with: &'static [&'static str],
) -> Mark {
    Mark { kind, name, key, not_with }
}

const OF_A_STUDY: &[&str] = &["runs", "lines", "figures"];

const MARKS: [Mark; 9] = [
    mark(DocumentKind::Cell, "a cell", "cell", OF_A_STUDY),
    mark(DocumentKind::Procedure, "a procedure", "procedure", OF_A_STUDY),
    mark(DocumentKind::Answers, "an answers file", "answers", &["devices", "procedures"]),
    mark(DocumentKind::Model, "a model", "arm", &["table", "target", "instruments", "cage", "seed"]),
    mark(DocumentKind::World, "a world", "world", &["devices", "procedures", "runs", "lines", "figures"]),
    mark(DocumentKind::Rig, "a rig", "rig", &[]),
    mark(DocumentKind::Scene, "a scene", "surfaces", &["joints", "convention"]),
    mark(DocumentKind::Manifest, "a plugin's manifest", "contract", &[]),
    mark(DocumentKind::Study, "a study", "study", &[]),
];

/// Kinds whose key others hold beside their own come first.
const PRECEDENCE: [DocumentKind; 9] = [
    DocumentKind::Study,
    DocumentKind::Cell,
    DocumentKind::Procedure,
    DocumentKind::Answers,
    DocumentKind::World,
    DocumentKind::Manifest,
    DocumentKind::Rig,
    DocumentKind::Model,
    DocumentKind::Scene,
];

impl DocumentKind {
    /// With its article: "a cell".
    #[must_use]
    pub fn name(self) -> &'static str {
        self.mark().map_or("a file", |mark| mark.name)
    }

    fn mark(self) -> Option<&'static Mark> {
        MARKS.iter().find(|mark| mark.kind == self)
    }

    fn identifying_key(self, keys: &[(Key, Node)]) -> Option<&Key> {
        let mark = self.mark()?;
        let has = |name: &str| keys.iter().find(|(key, _)| key.name == name).map(|(key, _)| key);
        match mark.not_with.iter().any(|other| has(other).is_some()) {
            true => None,
            false => has(mark.key),
        }
    }
}

fn keys(root: &Node) -> &[(Key, Node)] {
    match &root.value {
        NodeValue::Map(entries) => entries,
        _ => &[],
    }
}

/// What kind of file a document is, with the key that says so.
fn declared_kind(root: &Node) -> Option<(DocumentKind, &Key)> {
    let keys = keys(root);
    PRECEDENCE.iter().find_map(|kind| kind.identifying_key(keys).map(|key| (*kind, key)))
}

/// What kind of file this text is.
///
/// # Errors
/// [`FileProblems`] with the kinds there are when it is none of them, or is no YAML.
pub fn kind_of(file: &Path, text: &str) -> Result<DocumentKind, FileProblems> {
    let root = parse(file, text, &Problems::default())?;
    if let Some((kind, _)) = declared_kind(&root) {
        return Ok(kind);
    }
    let problems = Problems::default();
    let marks = MARKS.map(|mark| mark.key);
    let near = keys(&root).iter().find_map(|(key, _)| Some((key, nearest(&key.name, &marks)?)));
    let message = "this is none of the files that plumb knows";
    match near {
        Some((key, meant)) => {
            problems.add(key.span, message, format!("did you mean `{meant}`?"));
        }
        None => problems.add(root.span, message, kinds_there_are()),
    }
    match problems.into_result(file, text) {
        Err(problems) => Err(problems),
        Ok(()) => Err(FileProblems::whole_file(file, message, kinds_there_are())),
    }
}

fn kinds_there_are() -> String {
    let kinds = MARKS.iter().map(|mark| format!("`{}:` {}", mark.key, mark.name));
    format!("a key at its beginning says what it is: {}", kinds.collect::<Vec<_>>().join(", "))
}

/// Reads a text into a tree as [`parse`] does, where it is to be of one kind.
///
/// # Errors
/// [`FileProblems`] as of [`parse`], or that the file is of another kind.
pub fn parse_as(
    kind: DocumentKind,
    file: &Path,
    text: &str,
    problems: &Problems,
) -> Result<Node, FileProblems> {
    let root = parse(file, text, problems)?;
    let own = kind.mark().map_or("", |mark| mark.key);
    let Some((other, key)) = declared_kind(&root).filter(|(other, _)| *other != kind) else {
        return Ok(root);
    };
    if keys(&root).iter().any(|(key, _)| key.name == own) {
        return Ok(root);
    }
    let wrong = Problems::default();
    wrong.add(
        key.span,
        format!("this is {}, not {}", other.name(), kind.name()),
        "see whether this is the right file",
    );
    wrong.into_result(file, text).map(|()| root)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(text: &str) -> Result<DocumentKind, String> {
        kind_of(Path::new("f.yaml"), text).map_err(|problems| problems.to_string())
    }

    #[test]
    fn each_kind_is_recognised_by_its_key_also_beside_those_of_others() {
        for (text, right) in [
            ("world: w\narm: {}\n", DocumentKind::World),
            ("cell: c\nworld: {file: w}\nanswers: a\n", DocumentKind::Cell),
            ("study: s\ncell: c\nprocedure: p\nworld: {}\n", DocumentKind::Study),
            ("arm: a\nsurfaces: {}\njoints: []\n", DocumentKind::Model),
            ("surfaces: {}\n", DocumentKind::Scene),
            ("id: a\ncontract: [1, 0]\n", DocumentKind::Manifest),
            ("rig: r\ncamera: {}\n", DocumentKind::Rig),
            ("answers: {}\n", DocumentKind::Answers),
            ("procedure: p\nsteps: []\n", DocumentKind::Procedure),
        ] {
            assert_eq!(kind(text), Ok(right), "{text}");
        }
    }

    #[test]
    fn a_misspelled_key_makes_no_other_kind_of_the_file() {
        for (text, meant) in [
            ("cel: c\ndevices: {}\nworld: {file: w}\nanswers: a\n", "`cell`"),
            ("stduy: s\ncell: c\nruns: 3\n", "`study`"),
            ("amr: a\njoints: []\nsurfaces: {}\n", "`arm`"),
            ("wrold: w\narm: {}\ntable: {}\n", "`world`"),
        ] {
            let refused = kind(text).expect_err("a slip");
            assert!(refused.contains(&format!("did you mean {meant}")), "{refused}");
        }
        let refused = kind("- 1\n").expect_err("a list");
        assert!(refused.contains("`cell:` a cell") && refused.contains("`study:` a study"), "{refused}");
    }

    #[test]
    fn a_file_of_another_kind_is_named_as_what_it_is() {
        let problems = Problems::default();
        let refused = parse_as(DocumentKind::Model, Path::new("f.yaml"), "cell: c\ndevices: {}\n", &problems);
        let refused = refused.expect_err("a cell").to_string();
        assert!(refused.starts_with("f.yaml:1:1: this is a cell, not a model\n"), "{refused}");
        assert!(parse_as(DocumentKind::Model, Path::new("f.yaml"), "arm: c\n", &problems).is_ok());
        assert!(parse_as(DocumentKind::Model, Path::new("f.yaml"), "armm: c\n", &problems).is_ok());
    }
}
