//! The words of the commands in one table, with what is known of each.
//!
//! The ten words and their arguments are those of programs that drive real arms. Where no such program shows a form, the form is marked
//! as remembered: this table is the one place to change when an arm says otherwise.

/// One command word.
#[derive(Debug)]
pub(super) struct Word {
    /// The word after the recognition character.
    pub(super) text: &'static str,
    /// Whether a program that drives a real arm shows the form used here; otherwise it is from memory.
    pub(super) seen_on_an_arm: bool,
}

/// Moves all six motors by signed half-steps: `@STEP speed,j1,j2,j3,j4,j5,j6[,outputs]`.
pub(super) const STEP: Word = Word { text: "STEP", seen_on_an_arm: true };
/// Reports registers, inputs and the last pendant key: `@READ`.
pub(super) const READ: Word = Word { text: "READ", seen_on_an_arm: true };
/// Closes the gripper until its switch trips: `@CLOSE`. A speed as argument is remembered, not seen, and not used.
pub(super) const CLOSE: Word = Word { text: "CLOSE", seen_on_an_arm: true };
/// Hands the arm to the pendant: `@SET`. That the reply comes when the operator leaves it is remembered, not seen.
pub(super) const SET: Word = Word { text: "SET", seen_on_an_arm: false };
/// Sets the registers to zero and switches the motor current off: `@RESET`.
pub(super) const RESET: Word = Word { text: "RESET", seen_on_an_arm: true };
/// Runs the taught program: `@RUN`.
pub(super) const RUN: Word = Word { text: "RUN", seen_on_an_arm: true };
/// Reports the taught program, eight numbers a line: `@QDUMP`.
pub(super) const QDUMP: Word = Word { text: "QDUMP", seen_on_an_arm: true };
/// Writes one line of a taught program: `@QWRITE w1,...,w8`.
pub(super) const QWRITE: Word = Word { text: "QWRITE", seen_on_an_arm: true };
/// Changes the recognition character: `@ARM c`.
pub(super) const ARM: Word = Word { text: "ARM", seen_on_an_arm: false };
/// Waits between the characters of replies: `@DELAY n`. Unit and range of `n` are not known.
pub(super) const DELAY: Word = Word { text: "DELAY", seen_on_an_arm: false };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_ten_words_of_the_controller() {
        let table = [&STEP, &READ, &CLOSE, &SET, &RESET, &RUN, &QDUMP, &QWRITE, &ARM, &DELAY];
        assert!(table.iter().all(|word| word.text.bytes().all(|letter| letter.is_ascii_uppercase())));
        assert_eq!(table.iter().filter(|word| word.seen_on_an_arm).count(), 7);
    }
}
