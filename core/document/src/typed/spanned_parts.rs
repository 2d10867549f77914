//! What a [`super::Spanned`] is made of.

use serde::de::{DeserializeSeed, Deserializer, IntoDeserializer, SeqAccess};

use super::reading::{Reading, Refusal};
use crate::Span;

/// Value, line, column and length of a [`super::Spanned`], in this order: only when the value is read is it known whether it holds a
/// stand-in.
pub(super) struct SpannedParts<'a, D> {
    value: Option<D>,
    span: Span,
    /// The reading, with how many values it had refused before this one.
    refused: Option<(&'a Reading, usize)>,
    numbers: Option<std::array::IntoIter<usize, 3>>,
}

impl<'a, D> SpannedParts<'a, D> {
    pub(super) fn new(span: Span, value: D) -> Self {
        Self { value: Some(value), span, refused: None, numbers: None }
    }

    /// Of a value whose reading may refuse it.
    pub(super) fn watched(span: Span, value: D, reading: &'a Reading) -> Self {
        Self { value: Some(value), span, refused: Some((reading, reading.refused.get())), numbers: None }
    }
}

impl<'de, D: Deserializer<'de, Error = Refusal>> SeqAccess<'de> for SpannedParts<'_, D> {
    type Error = Refusal;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Refusal> {
        if let Some(value) = self.value.take() {
            return seed.deserialize(value).map(Some);
        }
        let broken = self.refused.is_some_and(|(reading, before)| reading.refused.get() > before);
        let Span { line, column, length } = if broken { Span::NONE } else { self.span };
        let numbers = self.numbers.get_or_insert_with(|| [line, column, length].into_iter());
        numbers.next().map(|number| seed.deserialize(number.into_deserializer())).transpose()
    }
}
