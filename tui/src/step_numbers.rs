//! How steps are counted wherever they are shown: those that do something, not those that only hold others.

use plumb_document::counted;

/// The number of each step of a plan, from 1, by how deep it is; none for a `call` or a `repeat` that holds the deeper ones after it.
pub(crate) fn step_numbers(depths: &[u32]) -> Vec<Option<usize>> {
    let holds = |index: usize| depths.get(index + 1) > depths.get(index);
    let mut number = 0;
    (0..depths.len())
        .map(|index| {
            (!holds(index)).then(|| {
                number += 1;
                number
            })
        })
        .collect()
}

/// How many steps of a plan do something.
pub(crate) fn step_count(depths: &[u32]) -> usize {
    step_numbers(depths).iter().flatten().count()
}

/// The same in words: `1 step`, `7 steps`.
pub(crate) fn steps_in_words(depths: &[u32]) -> String {
    counted(step_count(depths), "step", "steps")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_only_hold_others_have_no_number() {
        let depths = [0, 0, 1, 1, 0, 1, 2, 0];
        let numbers = step_numbers(&depths);
        assert_eq!(numbers, [Some(1), None, Some(2), Some(3), None, None, Some(4), Some(5)]);
        assert_eq!(steps_in_words(&depths), "5 steps");
        assert_eq!((steps_in_words(&[0]), steps_in_words(&[])), ("1 step".to_owned(), "0 steps".to_owned()));
        assert_eq!(step_count(&depths), 5);
        assert_eq!(step_count(&[]), 0);
        assert_eq!(step_numbers(&[0, 1]), [None, Some(1)], "the last step holds nothing");
    }
}
