//! Words that users were once shown and did not understand, and where any is still found: in string literals of the program (doc comments, tests and
//! messages of assertions left out) and in the YAML of the cells that are shipped (titles, prompts, descriptions; comments left out).

use std::fs;
use std::path::Path;

use crate::source::{Source, Token, root};

/// A word or phrase that no user is shown, and what is written in its place.
pub(crate) const RETIRED: &[(&str, &str)] = &[
    ("never went off", "stayed ON"),
    ("is on already where", "is already ON at the start"),
    ("step in hand", "current step"),
    ("target lies", "target is in place"),
    ("stands where it should", "is in position"),
    ("stands there: go on", "is there: continue"),
    ("put the zeros right", "correct the zeros"),
    ("zero right", "correct the zero"),
    ("put them in force", "apply"),
    ("put these corrections in force", "apply these corrections"),
    ("leave everything as it is", "discard"),
    ("go on a little", "lower further"),
    ("back by their", "back off"),
    ("begins again", "restarts"),
    ("locked away", "held out"),
    ("locked rows", "held-out rows"),
    ("left-out regions", "cross-validation"),
    ("how often", "frequency, or repetitions"),
    ("floors", "times the noise"),
    ("by lot", "at random"),
    ("right verdicts", "accepted verdicts"),
    ("pull as hard", "no outlier down-weighting"),
    ("stands for its newest", "means its newest"),
    ("takes for granted", "assumes"),
    ("drawl", "reply delay"),
    ("complaint", "controller error"),
    ("would stand", "would be"),
    ("stands so", "is there"),
    ("stands elsewhere", "is elsewhere"),
    ("where it stands", "where it is"),
    ("the arm stands", "the arm is"),
    ("the bubble stands", "the bubble is"),
    ("stands there already", "is there already"),
    ("stands in line", "is in line"),
    ("two camps", "two groups"),
    ("called wild", "counted as outliers"),
    ("whoever", "who, or the device that"),
    ("told otherwise", "another is named"),
    ("than it is told", "than commanded"),
    ("told apart", "distinguished"),
    ("tells the rest", "says more"),
    ("tells more", "says more"),
    ("goes with the pose", "depends on the pose"),
    ("nobody knows how large", "is not known"),
];

/// Files whose strings still hold a retired word, as `file: word`. This list may only shrink.
pub(crate) const STILL: &[&str] = &[];

/// Where a retired word is found, as `file: word`.
pub(crate) fn found(sources: &[Source]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for source in sources {
        let shown = shown_to_users(&source.tokens);
        found.extend(retired_in(&shown).map(|word| format!("{}: {word}", source.path)));
    }
    for file in yaml_files(&root().join("workcells")) {
        let text = fs::read_to_string(&file).unwrap();
        let lines: Vec<&str> = text.lines().map(without_comment).collect();
        let path = file.strip_prefix(root()).unwrap_or(&file).display().to_string();
        found.extend(retired_in(&lines.join("\n")).map(|word| format!("{path}: {word}")));
    }
    found
}

/// The retired words of a text, whatever their case.
fn retired_in(text: &str) -> impl Iterator<Item = &'static str> {
    let words: Vec<String> = text.split_whitespace().map(str::to_lowercase).collect();
    let text = format!(" {} ", words.join(" "));
    RETIRED.iter().map(|(word, _)| *word).filter(move |word| holds(&text, word))
}

/// Whether a phrase is in a text as whole words.
fn holds(text: &str, phrase: &str) -> bool {
    text.match_indices(phrase).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + phrase.len()..].chars().next();
        !before.is_some_and(char::is_alphanumeric) && !after.is_some_and(char::is_alphanumeric)
    })
}

/// The string literals of a file but its doc comments (which are attributes by now).
fn shown_to_users(tokens: &[Token]) -> String {
    let is_doc = |at: usize| {
        let before =
            |back: usize| at.checked_sub(back).and_then(|at| tokens.get(at)).map(|token| token.text.as_str());
        before(1) == Some("=") && before(2) == Some("doc")
    };
    let strings = tokens
        .iter()
        .enumerate()
        .filter(|(at, token)| token.text.ends_with(['"', '#']) && token.text.len() > 1 && !is_doc(*at));
    // A backslash at a line's end joins two lines.
    let texts: Vec<String> =
        strings.map(|(_, token)| token.text.replace("\\\n", " ").replace("\\n", " ")).collect();
    texts.join("\n")
}

fn without_comment(line: &str) -> &str {
    match line.trim_start().starts_with('#') {
        true => "",
        false => line.split(" #").next().unwrap_or(line),
    }
}

fn yaml_files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(yaml_files(&path));
        } else if path.extension().is_some_and(|ending| ending == "yaml") {
            files.push(path);
        }
    }
    files.sort();
    files
}
