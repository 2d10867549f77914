//! How often the steps of a repetition are done.

use crate::expression::Expression;

/// How often a repetition's steps are done.
#[derive(Debug, Clone)]
pub(crate) enum Turns {
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
    fn a_table_is_read_by_its_names_and_a_slip_is_reported_with_its_line() {
        let read = Rows::parse("q1_deg, load_kg\n10,0\n\n-20.5, 1.5\n").expect("a table");
        assert_eq!(read.columns, ["q1_deg", "load_kg"]);
        assert_eq!(read.rows, [[10.0, 0.0], [-20.5, 1.5]]);
        assert_eq!(Rows::parse("a,b\n1,x\n").unwrap_err(), "line 2: `x` under `b` is no number");
        assert_eq!(Rows::parse("a,b\n1,2\n3\n").unwrap_err(), "line 3 has 1 numbers for 2 names");
        assert_eq!(Rows::parse("a,b\n").unwrap_err(), "there is no row under its names");
    }
}
