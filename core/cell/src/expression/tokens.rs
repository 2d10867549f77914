//! The words of an expression, as far as finding its names needs them.

/// One word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token<'t> {
    pub(super) kind: TokenKind<'t>,
    /// Byte offset in the text.
    pub(super) offset: usize,
}

/// What a word is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TokenKind<'t> {
    /// A name or keyword.
    Name(&'t str),
    /// A number or string.
    Literal,
    /// Anything else, one character at a time.
    Mark(char),
}

/// Cuts a text into words; comments and blanks are left out.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut found = Vec::new();
    let mut offset = 0;
    while let Some(rest) = text.get(offset..).filter(|rest| !rest.is_empty()) {
        let (kind, length) = next(rest);
        if let Some(kind) = kind {
            found.push(Token { kind, offset });
        }
        offset += length;
    }
    found
}

/// The dotted paths that words follow from a name, each once.
pub(super) fn paths_below(tokens: &[Token<'_>], name: &str) -> Vec<String> {
    let mut paths: Vec<String> = Vec::new();
    for (index, token) in tokens.iter().enumerate() {
        let follows_a_dot =
            index > 0 && tokens.get(index - 1).is_some_and(|before| before.kind == TokenKind::Mark('.'));
        if token.kind != TokenKind::Name(name) || follows_a_dot {
            continue;
        }
        let mut path = name.to_owned();
        let mut rest = tokens.get(index + 1..).unwrap_or_default();
        while let [
            Token { kind: TokenKind::Mark('.'), .. },
            Token { kind: TokenKind::Name(part), .. },
            more @ ..,
        ] = rest
        {
            path = format!("{path}.{part}");
            rest = more;
        }
        if !paths.contains(&path) {
            paths.push(path);
        }
    }
    paths
}

/// The word a text begins with (none for blanks and comments) and its length in bytes, at least 1.
fn next(rest: &str) -> (Option<TokenKind<'_>>, usize) {
    let Some(first) = rest.chars().next() else { return (None, 1) };
    if first.is_whitespace() {
        return (None, first.len_utf8());
    }
    if rest.starts_with("//") {
        return (None, rest.find('\n').unwrap_or(rest.len()));
    }
    if rest.starts_with("/*") {
        return (None, rest.find("*/").map_or(rest.len(), |end| end + 2));
    }
    if first == '"' || first == '\'' || first == '`' {
        return (Some(TokenKind::Literal), string_length(rest, first));
    }
    if first.is_ascii_digit() {
        return (Some(TokenKind::Literal), number_length(rest));
    }
    if first.is_alphabetic() || first == '_' {
        let length = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        return (rest.get(..length).map(TokenKind::Name), length);
    }
    (Some(TokenKind::Mark(first)), first.len_utf8())
}

fn string_length(rest: &str, quote: char) -> usize {
    let mut escaped = false;
    for (offset, character) in rest.char_indices().skip(1) {
        match character {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if character == quote => return offset + character.len_utf8(),
            _ => {}
        }
    }
    rest.len()
}

/// `12`, `1.5`, `1e-3`; not the dots of `0..10`.
fn number_length(rest: &str) -> usize {
    let bytes = rest.as_bytes();
    let byte = |index: usize| bytes.get(index).copied().unwrap_or(b' ');
    let mut length = 1;
    loop {
        let here = byte(length);
        let part_of_number = here.is_ascii_alphanumeric()
            || here == b'_'
            || (here == b'.' && byte(length + 1).is_ascii_digit())
            || ((here == b'-' || here == b'+') && matches!(byte(length - 1), b'e' | b'E'));
        if !part_of_number {
            return length;
        }
        length += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinguished_from_numbers_strings_and_comments() {
        let names: Vec<&str> = tokens("a.b_deg*1e-3 + \"no \\\" c\" // d\n + sin(e) - 2.5 /* f */ + g2")
            .iter()
            .filter_map(|token| match token.kind {
                TokenKind::Name(name) => Some(name),
                _ => None,
            })
            .collect();
        assert_eq!(names, ["a", "b_deg", "sin", "e", "g2"]);
    }

    #[test]
    fn paths_below_a_name_are_followed_and_members_of_that_name_are_not() {
        let text = "tolerances.spot_mm / 2 + tolerances.target_mm * tolerances.spot_mm + other.tolerances.x + tolerances";
        assert_eq!(
            paths_below(&tokens(text), "tolerances"),
            ["tolerances.spot_mm", "tolerances.target_mm", "tolerances"]
        );
        let text = "instruments.level.uncertainty_deg / sqrt(2)";
        assert_eq!(paths_below(&tokens(text), "instruments"), ["instruments.level.uncertainty_deg"]);
    }

    #[test]
    fn any_text_is_cut_to_its_end() {
        for text in ["", "\"", "'", "/*", "1.", "0..cycles", "é + ß", "\u{1F600}"] {
            tokens(text);
        }
    }
}
