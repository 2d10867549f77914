//! Numbers as people and spreadsheets write them.

/// Whether a comma inside a number means the decimal point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecimalMark {
    Point,
    Comma,
}

/// Reads a finite number.
///
/// # Errors
/// The reason, in words, when the text is not one.
pub(super) fn parse(text: &str, mark: DecimalMark) -> Result<f64, String> {
    let text = text.trim();
    let normal = match mark {
        DecimalMark::Point => text.to_owned(),
        DecimalMark::Comma => text.replace(',', "."),
    };
    match normal.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => {
            Err(format!("`{text}` is not a finite number; leave the cell empty if nothing was measured"))
        }
        Err(_) if mark == DecimalMark::Point && text.contains(',') => Err(format!(
            "`{text}` has a comma for the decimal point; separate the columns by semicolons, or write points"
        )),
        Err(_) => Err(format!("`{text}` is not a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_commas_are_read_where_the_table_uses_them() {
        assert_eq!(parse(" -1,5e-3 ", DecimalMark::Comma), Ok(-1.5e-3));
        assert!(parse("1,5", DecimalMark::Point).unwrap_err().contains("comma for the decimal point"));
    }

    #[test]
    fn infinities_and_nan_are_refused() {
        for text in ["NaN", "inf", "-inf", "1e999"] {
            assert!(parse(text, DecimalMark::Point).unwrap_err().contains("not a finite number"), "{text}");
        }
    }
}
