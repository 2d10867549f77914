//! Numbers and texts as people write them in a YAML file.

/// A number with as many digits as it takes to read it back well, and no more.
pub(super) fn number(value: f64) -> String {
    // Ten digits: more would show how degrees and radians round on the way there and back.
    let rounded = format!("{value:.9e}").parse::<f64>().unwrap_or(value);
    if rounded == 0.0 { "0".to_owned() } else { format!("{rounded}") }
}

/// A text as a YAML value: bare where that is safe, else quoted.
pub(super) fn text(value: &str) -> String {
    let safe = |c: char| c.is_alphanumeric() || "_- ./()*".contains(c);
    let bare = value.chars().all(safe)
        && value.starts_with(|c: char| c.is_alphabetic())
        && !["true", "false", "yes", "no", "null", "on", "off", "y", "n"]
            .contains(&value.to_lowercase().as_str());
    if bare { value.to_owned() } else { format!("{value:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_written_with_the_digits_that_it_has() {
        assert_eq!([0.1 + 0.2, -0.0, 1e-7, 123_456.789].map(number), ["0.3", "0", "0.0000001", "123456.789"]);
        assert_eq!(number(1.0 / 3.0), "0.3333333333");
    }

    #[test]
    fn a_text_is_bare_only_where_yaml_takes_it_for_a_text() {
        for bare in ["elbow", "joint_zero(elbow)", "two words", "a-b.c/d*", "Yesterday"] {
            assert_eq!(text(bare), bare);
        }
        for quoted in ["true", "No", "y", "1st", "-x", "", "a: b", "a#b", "[a]"] {
            assert_eq!(text(quoted), format!("{quoted:?}"));
        }
    }
}
