//! A cell file with other values, everything else as a person wrote it.

/// The text with the value of its only `key:` replaced; none where the key is not there, or more than once.
pub(crate) fn with_value(text: &str, key: &str, value: &str) -> Option<String> {
    let requested = format!("{key}:");
    let is_alone = |at: &usize| {
        let before = text.get(..*at).and_then(|before| before.chars().next_back());
        before.is_none_or(|letter| letter.is_whitespace() || letter == '{' || letter == ',')
    };
    let in_words = |at: &usize| {
        let line = text.get(..*at).and_then(|before| before.rsplit('\n').next()).unwrap_or_default();
        !line.contains('#')
    };
    let mut offsets = text.match_indices(&requested).map(|(at, _)| at).filter(is_alone).filter(in_words);
    let at = offsets.next()?;
    if offsets.next().is_some() {
        return None;
    }
    let (before, rest) = text.split_at(at + requested.len());
    let rest = rest.trim_start_matches(' ');
    let end = rest.find([',', '}', '\n', '#']).unwrap_or(rest.len());
    Some(format!("{before} {value}{}", rest.get(end..).unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::with_value;

    #[test]
    fn one_value_changes_and_nothing_else() {
        let cell = "cell: x # rig: no\ndevices:\n  s: {config: {rig: rig.yaml, threshold: 3}}\n";
        let changed = with_value(cell, "rig", "other.yaml").unwrap();
        assert_eq!(changed, cell.replace("rig.yaml", "other.yaml"));
        assert_eq!(with_value("model: a\nmodel: b\n", "model", "c"), None);
        assert_eq!(with_value("my_model: a\n", "model", "c"), None);
        assert_eq!(with_value("  model: a/b.yaml\n", "model", "c").unwrap(), "  model: c\n");
    }
}
