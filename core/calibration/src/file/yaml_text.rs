//! Numbers and texts as people write them in a YAML file.

/// A number with as many digits as it takes to read it back well, and no more.
pub(super) fn number(value: f64) -> String {
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
