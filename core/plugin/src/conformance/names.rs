//! Which names a procedure can write.

/// Whether an expression can name it, as `out.joints.NAME_deg` or `reading.NAME_mm`.
pub(super) fn can_be_written(name: &str) -> bool {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    name.starts_with(|first: char| first.is_ascii_alphabetic()) && name.chars().all(is_word)
}

/// What would be right of a name that cannot be written.
pub(super) const WRITABLE: &str = "use letters, digits and '_', a letter first";

#[cfg(test)]
mod tests {
    use super::can_be_written;

    #[test]
    fn a_name_is_a_word_that_begins_with_a_letter() {
        for good in ["x", "wrist1", "shoulder_pan", "J2"] {
            assert!(can_be_written(good), "{good}");
        }
        for bad in ["", "joint-1", "my waist", "1", "_x", "gr\u{f6}\u{df}e", "a.b"] {
            assert!(!can_be_written(bad), "{bad}");
        }
    }
}
