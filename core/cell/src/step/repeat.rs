//! `repeat`: steps done several times, or once for each row of a table.

use plumb_document::{FileKind, read_text};

use super::{Step, check_name, read_steps};
use crate::expression::Expression;
use crate::read_context::ReadContext;
use crate::yaml::{MapReader, Node};

/// A declared repetition.
#[derive(Debug, Clone)]
pub struct RepeatStep {
    /// How often.
    pub turns: Turns,
    /// Ends the repetition after a turn in which it holds.
    pub until: Option<Expression>,
    /// What is done each time.
    pub steps: Vec<Step>,
}

/// How often a repetition's steps are done.
#[derive(Debug, Clone)]
pub enum Turns {
    /// So many times, at most; known before the run starts.
    Times(Expression),
    /// Once for each row of a table.
    Over(Rows),
}

/// A table of numbers beside a procedure's file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Its columns, as expressions name them.
    pub columns: Vec<String>,
    /// A number for each column.
    pub rows: Vec<Vec<f64>>,
}

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<RepeatStep> {
    let mut map = MapReader::new(node, "a repetition", context.problems)?;
    let over = map.optional("over");
    let turns = match over {
        Some(node) => read_over(node, context).map(Turns::Over),
        None => map.required("times").and_then(|node| context.expression(node, "`times`")).map(Turns::Times),
    };
    if over.is_some() && map.optional("times").is_some() {
        let help = "keep `times`, or `over` with a table";
        context.problems.add(map.place(), "a repetition is done so often, or over the rows of a table", help);
    }
    let until = map.optional("until").and_then(|node| context.expression(node, "`until`"));
    let steps = map.required("steps").and_then(|node| read_steps(node, context));
    map.finish();
    Some(RepeatStep { turns: turns?, until, steps: steps? })
}

fn read_over(node: &Node, context: &ReadContext<'_>) -> Option<Rows> {
    let name = node.text("`over`", context.problems)?;
    let path = context.folder.join(name);
    let wrong = |reason: String, help: &str| context.problems.add(node.place, reason, help);
    let text = match read_text(&path, FileKind::POSES) {
        Ok(text) => text,
        Err(error) => {
            wrong(format!("{}: {error}", path.display()), "the name is relative to this file");
            return None;
        }
    };
    match Rows::parse(&text) {
        Ok(rows) => {
            for column in &rows.columns {
                check_name(column, node.place, "the name of a column", context);
            }
            Some(rows)
        }
        Err(reason) => {
            wrong(
                format!("{}: {reason}", path.display()),
                "a line of names, then a line of as many numbers for each turn",
            );
            None
        }
    }
}

impl Rows {
    /// Reads names and numbers between commas; empty lines are passed over.
    ///
    /// # Errors
    /// A sentence that names the line.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let cells = |line: &str| line.split(',').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let Some((_, header)) = lines.next() else { return Err("it is empty".to_owned()) };
        let columns = cells(header.trim_start_matches('\u{feff}'));
        let mut rows = Vec::new();
        for (index, line) in lines {
            let number = index + 1;
            let numbers = cells(line).into_iter().zip(&columns).map(|(cell, column)| {
                let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
                value.ok_or_else(|| format!("line {number}: `{cell}` under `{column}` is no number"))
            });
            let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
            if numbers.len() != columns.len() || cells(line).len() != columns.len() {
                let found = cells(line).len();
                return Err(format!("line {number} has {found} numbers for {} names", columns.len()));
            }
            rows.push(numbers);
        }
        if rows.is_empty() {
            return Err("there is no row under its names".to_owned());
        }
        Ok(Self { columns, rows })
    }
}

#[cfg(test)]
mod tests {
    use super::Rows;

    #[test]
    fn a_table_is_read_by_its_names_and_a_slip_is_told_with_its_line() {
        let read = Rows::parse("q1_deg, load_kg\n10,0\n\n-20.5, 1.5\n").expect("a table");
        assert_eq!(read.columns, ["q1_deg", "load_kg"]);
        assert_eq!(read.rows, [[10.0, 0.0], [-20.5, 1.5]]);
        assert_eq!(Rows::parse("a,b\n1,x\n").unwrap_err(), "line 2: `x` under `b` is no number");
        assert_eq!(Rows::parse("a,b\n1,2\n3\n").unwrap_err(), "line 3 has 1 numbers for 2 names");
        assert_eq!(Rows::parse("a,b\n").unwrap_err(), "there is no row under its names");
    }
}
