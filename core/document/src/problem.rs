//! Mistakes in a file, and how they are shown.

use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt;
use std::path::{Path, PathBuf};

/// A piece of one line of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Span {
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// How many characters are meant; at least 1 is shown.
    pub length: usize,
}

impl Span {
    /// Where what takes the place of a broken value is: nowhere. [`Problems::add`] keeps no mistake there, since the broken value is reported.
    pub const NONE: Self = Self { line: 0, column: 0, length: 0 };
}

/// One mistake: what is wrong, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Where; none when the file as a whole is meant.
    pub span: Option<Span>,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

/// Collects the mistakes of one file while it is read.
#[derive(Debug, Default)]
pub struct Problems(RefCell<Vec<Problem>>);

impl Problems {
    /// Adds a mistake; none at [`Span::NONE`]. No `help` is an empty one.
    pub fn add(&self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        if span == Span::NONE {
            return;
        }
        let help = Some(help.into()).filter(|help| !help.is_empty());
        self.0.borrow_mut().push(Problem { span: Some(span), message: message.into(), help });
    }

    /// Adds a mistake that was found elsewhere.
    pub fn push(&self, problem: Problem) {
        self.0.borrow_mut().push(problem);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.borrow().len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ends the collection: the mistakes in the order of the file, with the file's text to show them in.
    ///
    /// # Errors
    /// [`FileProblems`] when there are any.
    pub fn into_result(self, file: &Path, text: &str) -> Result<(), FileProblems> {
        let mut problems = self.0.into_inner();
        if problems.is_empty() {
            return Ok(());
        }
        problems.sort_by_key(|problem| problem.span);
        problems.dedup();
        Err(FileProblems { file: file.to_owned(), text: text.to_owned(), problems })
    }
}

/// All mistakes of one file. Shown as text, each has the file, line and column, what is wrong, the line with a mark under it, and what
/// would be right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileProblems {
    /// The file, as it was named.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// At least one, in the order of the file.
    pub problems: Vec<Problem>,
}

impl FileProblems {
    /// A file with one mistake that has no position: it cannot be read at all.
    pub fn whole_file(file: &Path, message: impl Into<String>, help: impl Into<String>) -> Self {
        let help = Some(help.into()).filter(|help| !help.is_empty());
        let problem = Problem { span: None, message: message.into(), help };
        Self { file: file.to_owned(), text: String::new(), problems: vec![problem] }
    }

    /// Adds what was found in another look at the same file.
    pub fn add(&mut self, more: FileProblems) {
        self.problems.extend(more.problems);
        self.problems.sort_by_key(|problem| problem.span);
        self.problems.dedup();
    }
}

impl std::error::Error for FileProblems {}

impl fmt::Display for FileProblems {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().take(SHOWN_PROBLEMS).enumerate() {
            if index > 0 {
                writeln!(formatter)?;
            }
            self.show(problem, formatter)?;
        }
        match self.problems.len().checked_sub(SHOWN_PROBLEMS) {
            None | Some(0) => Ok(()),
            Some(more) => writeln!(formatter, "\n{}: and {more} more", self.file.display()),
        }
    }
}

/// The most mistakes of one file that are shown: who has mended so many looks again.
const SHOWN_PROBLEMS: usize = 50;

/// Longer lines are cut around the mistake.
const SHOWN_COLUMNS: usize = 100;

impl FileProblems {
    fn show(&self, problem: &Problem, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match problem.span {
            None => writeln!(formatter, "{file}: {}", clipped(&problem.message))?,
            Some(span) => {
                let message = clipped(&problem.message);
                writeln!(formatter, "{file}:{}:{}: {message}", span.line, span.column)?;
                if let Some(line) = self.text.lines().nth(span.line.saturating_sub(1)) {
                    show_line(line, span, formatter)?;
                }
            }
        }
        match &problem.help {
            Some(help) if !help.is_empty() => writeln!(formatter, "  = {}", clipped(help)),
            _ => Ok(()),
        }
    }
}

/// Longer messages quote something that is no name; what they say of it is at their end.
const SHOWN_MESSAGE: usize = 600;

/// A message of a length people read: its beginning and its end.
fn clipped(message: &str) -> Cow<'_, str> {
    let length = message.chars().count();
    if length <= SHOWN_MESSAGE {
        return Cow::Borrowed(message);
    }
    let part = |skip: usize| message.chars().skip(skip).take(SHOWN_MESSAGE / 2).collect::<String>();
    Cow::Owned(format!("{} ... {}", part(0), part(length - SHOWN_MESSAGE / 2)))
}

fn show_line(line: &str, span: Span, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
    let first = span.column.saturating_sub(1);
    let start = if first < SHOWN_COLUMNS { 0 } else { first - SHOWN_COLUMNS / 2 };
    let shown: String =
        line.chars().skip(start).take(SHOWN_COLUMNS).map(|c| if c == '\t' { ' ' } else { c }).collect();
    let room = shown.chars().count().saturating_sub(first - start).max(1);
    let mark = "^".repeat(span.length.clamp(1, room));
    writeln!(formatter, "{:>5} | {}", span.line, shown.trim_end())?;
    writeln!(formatter, "      | {}{mark}", " ".repeat(first - start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_is_shown_with_its_line_and_a_mark_under_it() {
        let text = "cell: a\nworld: {fiel: w.yaml}\n";
        let problems = Problems::default();
        problems.add(Span { line: 2, column: 9, length: 4 }, "unknown key `fiel`", "did you mean `file`?");
        let shown = problems.into_result(Path::new("c.yaml"), text).expect_err("a mistake").to_string();
        assert_eq!(
            shown,
            "c.yaml:2:9: unknown key `fiel`\n    2 | world: {fiel: w.yaml}\n      |         ^^^^\n  = did you mean `file`?\n"
        );
    }

    #[test]
    fn a_name_without_end_is_quoted_by_its_beginning() {
        let problems = Problems::default();
        let name = "n".repeat(100_000);
        problems.add(Span { line: 1, column: 1, length: 1 }, format!("`{name}` is no name"), "");
        let shown = problems.into_result(Path::new("c.yaml"), "n").expect_err("a mistake").to_string();
        assert!(shown.len() < 1000 && shown.contains("nnn` is no name"), "{shown}");
    }

    #[test]
    fn a_very_long_line_is_cut_around_the_mistake() {
        let text = format!("{}wrong{}", "x".repeat(5000), "y".repeat(5000));
        let problems = Problems::default();
        problems.add(Span { line: 1, column: 5001, length: 5 }, "no", "");
        let shown = problems.into_result(Path::new("c.yaml"), &text).expect_err("a mistake").to_string();
        assert!(shown.lines().all(|line| line.chars().count() < 120), "{shown}");
        let marked: usize = shown.lines().nth(2).and_then(|line| line.find('^')).expect("a mark");
        assert_eq!(shown.lines().nth(1).map(|line| &line[marked..marked + 5]), Some("wrong"));
    }
}
