//! Epochs: stretches of a table between which something may have been re-set.

use crate::table::Table;

/// Where one epoch ends and the next begins.
#[derive(Debug, Clone, PartialEq)]
pub enum Epochs {
    /// The first row of each epoch but the first; rows count from 1 in the order of the table.
    Rows(Vec<usize>),
    /// The first time of each epoch but the first, s as in the table.
    Times(Vec<f64>),
    /// One epoch for each of these names in the column `session`.
    Sessions(Vec<String>),
}

impl Epochs {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Rows(starts) => starts.len() + 1,
            Self::Times(starts) => starts.len() + 1,
            Self::Sessions(names) => names.len(),
        }
    }

    /// The epoch of a row, from 0; the first for a row without time or of an unknown session.
    pub fn of_row(&self, table: &Table, row: usize) -> usize {
        match self {
            Self::Rows(starts) => starts.iter().filter(|start| row + 1 >= **start).count(),
            Self::Times(starts) => {
                let time = table.time.as_ref().and_then(|times| times.get(row)).copied().unwrap_or(f64::NAN);
                // What is not a number is after no start: the first epoch.
                starts.iter().filter(|start| time >= **start).count()
            }
            Self::Sessions(names) => {
                let session = table.session.name(row);
                session.and_then(|session| names.iter().position(|name| name == session)).unwrap_or(0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_times_and_sessions_give_each_row_its_epoch() {
        let text = "q1_deg,p1_x_mm,time_s,session\n0,0,10,a\n0,0,20,b\n0,0,30,a\n0,0,40,c\n";
        let table = Table::parse("table.csv", text).unwrap();
        let of = |epochs: &Epochs| (0..4).map(|row| epochs.of_row(&table, row)).collect::<Vec<_>>();
        let rows = Epochs::Rows(vec![2, 4]);
        assert_eq!((rows.count(), of(&rows)), (3, vec![0, 1, 1, 2]));
        let times = Epochs::Times(vec![30.0]);
        assert_eq!((times.count(), of(&times)), (2, vec![0, 0, 1, 1]));
        let sessions = Epochs::Sessions(vec!["a".to_owned(), "b".to_owned()]);
        assert_eq!((sessions.count(), of(&sessions)), (2, vec![0, 1, 0, 0]));
    }
}
