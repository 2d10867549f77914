//! Where among the rows something was re-set.

use crate::phrase::listed;
use plumb_diagnosis::Jump;

/// One jump: its rows, the line of the file and the time, where it is logged.
fn location(jump: &Jump) -> String {
    let [before, after] = jump.between_rows;
    let [_, line] = jump.between_lines;
    let time = jump.at_s.map_or_else(String::new, |at| format!(", {at:.0} s"));
    format!("between rows {before} and {after} (line {line}{time})")
}

/// Where something was re-set, as a sentence with a blank after it; nothing where nothing was.
pub(super) fn jumps_in_words(jumps: &[Jump]) -> String {
    match jumps {
        [] => String::new(),
        some => {
            format!("Something jumped {}. ", listed(&some.iter().map(location).collect::<Vec<_>>(), "and"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_is_reported_by_its_rows_its_line_and_its_time_where_it_is_logged() {
        let jump = |row: usize, at_s| Jump {
            between_rows: [row, row + 1],
            between_lines: [row as u32 + 1, row as u32 + 2],
            at_s,
        };
        assert_eq!(
            jumps_in_words(&[jump(60, None), jump(150, Some(571.6))]),
            "Something jumped between rows 60 and 61 (line 62) and between rows 150 and 151 (line 152, 572 s). "
        );
        assert_eq!(jumps_in_words(&[]), "");
    }
}
