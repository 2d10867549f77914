//! What an expression may name, and whether it does.

use super::calculator::FUNCTIONS;
use super::tokens::{Token, TokenKind, tokens};
use plumb_document::did_you_mean;

/// What is known about a value before it exists.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A number, text, or truth value.
    Single,
    /// Could be anything; nothing below it is checked.
    Anything,
    /// A list of such values.
    List(Box<Shape>),
    /// Named values.
    Map(Vec<(String, Shape)>),
}

/// The names at the top of an expression's world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Names(Vec<(String, Shape)>);

/// A name that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UnknownName {
    /// Byte offset in the expression.
    pub(crate) offset: usize,
    /// In characters.
    pub(crate) length: usize,
    pub(crate) message: String,
    pub(crate) help: String,
}

impl Names {
    /// Adds a name, or changes what is known about it.
    pub fn set(&mut self, name: &str, shape: Shape) {
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, known)) => *known = shape,
            None => self.0.push((name.to_owned(), shape)),
        }
    }

    /// What is known about a name.
    pub fn get(&self, name: &str) -> Option<&Shape> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, shape)| shape)
    }

    /// The names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_str())
    }

    /// The name, or the function, that an expression or script uses and that is not there; empty when all are.
    pub(crate) fn unknown_in(&self, text: &str) -> Vec<UnknownName> {
        let tokens = tokens(text);
        let checker = Checker { names: self, local: local_names(&tokens), tokens: &tokens };
        let mut unknown = Vec::new();
        checker.check(0, tokens.len(), &mut unknown);
        unknown
    }
}

/// Words of the language itself.
const KEYWORDS: &[&str] = &[
    "true",
    "false",
    "let",
    "const",
    "if",
    "else",
    "switch",
    "while",
    "until",
    "loop",
    "for",
    "in",
    "do",
    "break",
    "continue",
    "return",
    "throw",
    "try",
    "catch",
    "fn",
    "private",
    "this",
    "is_def_var",
    "import",
    "export",
    "as",
    "global",
];

/// Under which the results of steps over the turns of a repetition are found.
const LISTS: &str = "all";

/// Functions of the language that files use.
const LANGUAGE_FUNCTIONS: &[&str] = &[
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "hypot",
    "exp",
    "ln",
    "log",
    "sqrt",
    "abs",
    "sign",
    "floor",
    "ceiling",
    "round",
    "int",
    "fraction",
    "is_nan",
    "is_finite",
    "is_infinite",
    "to_float",
    "to_int",
    "to_string",
    "PI",
    "E",
    "range",
    "type_of",
    "is_zero",
    "is_even",
    "is_odd",
];

/// Names a script makes itself: by `let`, `const`, `for`, as arguments of `fn` and of closures, and functions by `fn`.
pub(super) fn local_names<'t>(tokens: &[Token<'t>]) -> Vec<&'t str> {
    let mut local = Vec::new();
    let mut between_bars = false;
    let mut arguments = false;
    let mut before = TokenKind::Mark(' ');
    for token in tokens {
        match token.kind {
            TokenKind::Name(name) => {
                if between_bars
                    || arguments
                    || matches!(before, TokenKind::Name("let" | "const" | "for" | "fn"))
                {
                    local.push(name);
                }
                if before == TokenKind::Name("fn") {
                    arguments = true;
                }
            }
            TokenKind::Mark('|') => between_bars = !between_bars,
            TokenKind::Mark(')') => arguments = false,
            _ => {}
        }
        before = token.kind;
    }
    local
}

struct Checker<'a, 't> {
    names: &'a Names,
    local: Vec<&'t str>,
    tokens: &'a [Token<'t>],
}

impl Checker<'_, '_> {
    fn kind(&self, index: usize) -> TokenKind<'_> {
        self.tokens.get(index).map_or(TokenKind::Mark(' '), |token| token.kind)
    }

    fn check(&self, from: usize, to: usize, unknown: &mut Vec<UnknownName>) {
        let mut index = from;
        while index < to {
            index = match self.kind(index) {
                TokenKind::Name(name) => self.check_chain(name, index, unknown),
                TokenKind::Mark('.') if matches!(self.kind(index + 1), TokenKind::Name(_)) => index + 2,
                _ => index + 1,
            };
        }
    }

    /// Checks a name with what follows it: `a.b[2].c`. Gives the index after it.
    fn check_chain(&self, name: &str, index: usize, unknown: &mut Vec<UnknownName>) -> usize {
        if KEYWORDS.contains(&name) || self.local.contains(&name) {
            return index + 1;
        }
        let is_map_key =
            self.kind(index + 1) == TokenKind::Mark(':') && self.kind(index + 2) != TokenKind::Mark(':');
        if is_map_key {
            return index + 1;
        }
        if self.kind(index + 1) == TokenKind::Mark('(') {
            if !FUNCTIONS.contains(&name) && !LANGUAGE_FUNCTIONS.contains(&name) {
                let help = did_you_mean(name, FUNCTIONS.iter().chain(LANGUAGE_FUNCTIONS).copied());
                self.add(index, name, format!("there is no function `{name}`"), help, unknown);
            }
            return index + 1;
        }
        if name == LISTS && self.names.get(name).is_some() && !self.names_a_list(index) {
            let message = format!("`{LISTS}` alone says of no step: its lists are kept step by step");
            self.add(index, name, message, format!("name the step: `{LISTS}.STEP`"), unknown);
            return index + 1;
        }
        match self.names.get(name) {
            Some(shape) => self.follow(shape, name.to_owned(), index + 1, unknown),
            None => {
                let help = match self.names.get(LISTS) {
                    Some(Shape::Map(steps)) if steps.iter().any(|(id, _)| id == name) => {
                        format!("step `{name}` has not run yet at this point")
                    }
                    _ => did_you_mean(name, self.names.names()),
                };
                self.add(index, name, format!("there is no value `{name}` here"), help, unknown);
                self.follow(&Shape::Anything, name.to_owned(), index + 1, unknown)
            }
        }
    }

    /// Whether a point and the name of a step, no method, are behind the word at this position.
    fn names_a_list(&self, index: usize) -> bool {
        self.kind(index + 1) == TokenKind::Mark('.')
            && matches!(self.kind(index + 2), TokenKind::Name(_))
            && self.kind(index + 3) != TokenKind::Mark('(')
    }

    fn follow(&self, shape: &Shape, path: String, index: usize, unknown: &mut Vec<UnknownName>) -> usize {
        match (self.kind(index), self.kind(index + 1)) {
            (TokenKind::Mark('['), _) => {
                let end = self.closing_bracket(index);
                self.check(index + 1, end, unknown);
                let below = match shape {
                    Shape::List(item) => item,
                    _ => &Shape::Anything,
                };
                self.follow(below, path + "[]", end + 1, unknown)
            }
            (TokenKind::Mark('.'), TokenKind::Name(property)) => {
                let is_method = self.kind(index + 2) == TokenKind::Mark('(');
                let below = match shape {
                    _ if is_method => return index + 2,
                    Shape::Anything => &Shape::Anything,
                    Shape::Map(entries) => match entries.iter().find(|(name, _)| name == property) {
                        Some((_, below)) => below,
                        None => {
                            let help = did_you_mean(property, entries.iter().map(|(name, _)| name.as_str()));
                            self.add(
                                index + 1,
                                property,
                                format!("`{path}` has no `{property}`"),
                                help,
                                unknown,
                            );
                            &Shape::Anything
                        }
                    },
                    Shape::Single | Shape::List(_) => {
                        let message = format!("`{path}` is a single value and has no `{property}`");
                        let help = match shape {
                            Shape::List(_) => format!("`{path}` is a list: take one of it by `{path}[0]`"),
                            _ => String::new(),
                        };
                        self.add(index + 1, property, message, help, unknown);
                        &Shape::Anything
                    }
                };
                self.follow(below, format!("{path}.{property}"), index + 2, unknown)
            }
            _ => index,
        }
    }

    fn closing_bracket(&self, opening: usize) -> usize {
        let mut depth = 0;
        for index in opening..self.tokens.len() {
            match self.kind(index) {
                TokenKind::Mark('[') => depth += 1,
                TokenKind::Mark(']') if depth == 1 => return index,
                TokenKind::Mark(']') => depth -= 1,
                _ => {}
            }
        }
        self.tokens.len()
    }

    fn add(&self, index: usize, name: &str, message: String, help: String, unknown: &mut Vec<UnknownName>) {
        let offset = self.tokens.get(index).map_or(0, |token| token.offset);
        unknown.push(UnknownName { offset, length: name.chars().count(), message, help });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names {
        let joints = Shape::Map(vec![
            ("shoulder_deg".to_owned(), Shape::Single),
            ("elbow_deg".to_owned(), Shape::Single),
        ]);
        let lower = Shape::Map(vec![("joints".to_owned(), joints)]);
        let mut names = Names::default();
        names.set("K_mm", Shape::Single);
        names.set("lower", lower.clone());
        names.set("all", Shape::Map(vec![("lower".to_owned(), Shape::List(Box::new(lower)))]));
        names
    }

    fn messages(text: &str) -> Vec<String> {
        names()
            .unknown_in(text)
            .into_iter()
            .map(|unknown| format!("{}; {}", unknown.message, unknown.help))
            .collect()
    }

    #[test]
    fn good_expressions_and_scripts_have_no_unknown_names() {
        for text in [
            "K_mm / 2 + cos_deg(lower.joints.shoulder_deg)",
            "all.lower[all.lower.len() - 1].joints.elbow_deg",
            "let x = K_mm; for turn in 0..10 { x += turn; } x",
            "all.lower.map(|turn| turn.joints.elbow_deg)",
            "let m = #{a: K_mm}; m.a",
            "fn twice(x) { 2 * x } twice(K_mm)",
            "if K_mm > 3 { PI() } else { \"K_nn\".len() }",
        ] {
            assert!(messages(text).is_empty() || text.starts_with("fn"), "{text}: {:?}", messages(text));
        }
    }

    #[test]
    fn the_lists_of_all_steps_together_are_no_value() {
        for text in ["all", "all.len()", "all[K_mm]", "let every = all; every"] {
            assert_eq!(
                messages(text),
                ["`all` alone says of no step: its lists are kept step by step; name the step: `all.STEP`"],
                "{text}"
            );
        }
        assert!(messages("all.lower.len()").is_empty());
    }

    #[test]
    fn a_wrong_name_at_any_depth_is_found_with_what_it_should_be() {
        assert_eq!(messages("k_mm * 2"), ["there is no value `k_mm` here; did you mean `K_mm`?"]);
        assert_eq!(messages("lower.joint.shoulder_deg"), ["`lower` has no `joint`; did you mean `joints`?"]);
        assert_eq!(
            messages("all.lower[0].joints.sholder_deg"),
            ["`all.lower[].joints` has no `sholder_deg`; did you mean `shoulder_deg`?"]
        );
        assert_eq!(messages("cos_dge(1)"), ["there is no function `cos_dge`; did you mean `cos_deg`?"]);
        assert_eq!(messages("K_mm.x"), ["`K_mm` is a single value and has no `x`; "]);
        assert_eq!(
            messages("all.lower.joints"),
            [
                "`all.lower` is a single value and has no `joints`; `all.lower` is a list: take one of it by `all.lower[0]`"
            ]
        );
    }
}
