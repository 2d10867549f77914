//! "Did you mean" for messages of one line.

use plumb_document::did_you_mean;

/// `; did you mean ...?` for the known name closest to a mistyped one, or the list of what there is.
pub(crate) fn suggestion<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let mut known = known.into_iter().peekable();
    match known.peek() {
        // Where there is nothing, nothing can be meant.
        None => String::new(),
        Some(_) => format!("; {}", did_you_mean(typed, known)),
    }
}

#[cfg(test)]
mod tests {
    use super::suggestion;

    #[test]
    fn the_closest_name_is_offered_and_else_all_are_listed() {
        assert_eq!(suggestion("sholder", ["waist", "shoulder"]), "; did you mean `shoulder`?");
        assert_eq!(suggestion("xyzzy", ["waist", "shoulder"]), "; there are `waist`, `shoulder`");
        assert_eq!(suggestion("xyzzy", []), "");
    }
}
