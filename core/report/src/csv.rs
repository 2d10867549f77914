//! Tables for spreadsheets (RFC 4180).

/// A field of a CSV file (RFC 4180), in quotation marks where it needs them.
pub fn csv_field(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_commas_and_quotation_marks_survive_a_spreadsheet() {
        assert_eq!(csv_field("all steps passed"), "all steps passed");
        assert_eq!(csv_field("step `a`: \"no\", said the arm"), "\"step `a`: \"\"no\"\", said the arm\"");
    }
}
