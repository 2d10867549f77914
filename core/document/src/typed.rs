//! From a tree of nodes to a Rust type that derives `Deserialize`, with every mistake in place of the first.
//!
//! serde gives up at the first error. Here a value that does not fit is reported and replaced by a stand-in, so that the rest is read too.
//! What cannot be replaced at once (a missing key, a value that a type's own reader refuses) is remembered, and the tree is read again with
//! a stand-in there; each reading remembers one more, so that it ends. A stand-in for a number is NaN and its [`Span`] is [`Span::NONE`], of
//! which [`Problems::add`] keeps no error: what depends on a broken value is not accused.

mod reader;
mod reading;
mod schema;
mod schema_words;
mod spanned_parts;
mod stand_in;
mod trace;
mod traced_parts;

use std::fmt;

use serde::de::{self, Deserialize, DeserializeOwned, Deserializer, SeqAccess, Visitor};

use crate::{Node, Problems, Span};
use reader::Reader;
pub use reading::OtherKeys;
use reading::{Reading, Refusal, SPANNED};
pub use schema::schema_of;
pub use schema_words::with_words;

/// Readings of one tree; each after the first counts as one mistake, and nobody mends more at once.
const MOST_READINGS: usize = 200;

/// Reads a tree into a type, in which keys that it does not know are mistakes; see [`typed_with`].
pub fn typed<T: DeserializeOwned>(node: &Node, what: &str, problems: &Problems) -> Option<T> {
    typed_with(node, what, OtherKeys::Refused, problems)
}

/// Reads a tree into a type; `what` names it in messages ("a rig"). None when a mistake leaves no value; all mistakes are among `problems`.
///
/// A value may come back although there were mistakes: it holds stand-ins then, and is good only for looking for further mistakes.
pub fn typed_with<T: DeserializeOwned>(
    node: &Node,
    what: &str,
    other_keys: OtherKeys,
    problems: &Problems,
) -> Option<T> {
    let reading = Reading::with(other_keys);
    let mut value = None;
    for _ in 0..MOST_READINGS {
        match T::deserialize(Reader::of_root(node, what, &reading)) {
            Ok(read) => {
                value = Some(read);
                break;
            }
            Err(Refusal::Again) => {}
            Err(other) => {
                if reading.is_clean() {
                    reading.report(node.span, other.to_string(), String::new());
                }
                break;
            }
        }
    }
    reading.into_found().into_iter().for_each(|problem| problems.push(problem));
    value
}

/// A value with its position in the file, for types that derive `Deserialize` and are read by [`typed`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spanned<T> {
    /// Where it is; [`Span::NONE`] for a stand-in, and for what holds one.
    pub span: Span,
    /// What it is.
    pub value: T,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(SPANNED, SpannedVisitor(std::marker::PhantomData))
    }
}

struct SpannedVisitor<T>(std::marker::PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for SpannedVisitor<T> {
    type Value = Spanned<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a value with its place")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<Spanned<T>, A::Error> {
        let Some(value) = parts.next_element()? else { return Err(de::Error::custom("there is no value")) };
        let mut number = || -> Result<usize, A::Error> { Ok(parts.next_element()?.unwrap_or(0)) };
        Ok(Spanned { span: Span { line: number()?, column: number()?, length: number()? }, value })
    }
}

#[cfg(test)]
mod tests;
