//! What a traced value holds: items, keys and variants, each traced at its own position.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, MapAccess, SeqAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use super::reading::{Refusal, SPANNED};
use super::spanned_parts::SpannedParts;
use super::trace::Tracer;
use crate::Span;

type Read<T> = Result<T, Refusal>;

/// What every item of a list, and every entry of a map of names, is called in a path.
const EACH: &str = "*";

fn below<'a>(tracer: &Tracer<'a>, key: &str) -> Tracer<'a> {
    Tracer { trace: tracer.trace, path: format!("{}/{key}", tracer.path) }
}

/// The items of a list, which are all alike.
pub(super) struct OneItem<'a> {
    list: Tracer<'a>,
    left: usize,
}

impl<'a> OneItem<'a> {
    pub(super) fn new(list: Tracer<'a>, length: usize) -> Self {
        Self { list, left: length }
    }
}

impl<'de> SeqAccess<'de> for OneItem<'_> {
    type Error = Refusal;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Read<Option<T::Value>> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        seed.deserialize(below(&self.list, EACH)).map(Some)
    }
}

/// The keys of a struct.
pub(super) struct TracedKeys<'a> {
    map: Tracer<'a>,
    keys: std::vec::IntoIter<&'static str>,
    key: &'static str,
}

impl<'a> TracedKeys<'a> {
    pub(super) fn new(map: Tracer<'a>, keys: Vec<&'static str>) -> Self {
        Self { map, keys: keys.into_iter(), key: "" }
    }
}

impl<'de> MapAccess<'de> for TracedKeys<'_> {
    type Error = Refusal;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Read<Option<K::Value>> {
        let Some(key) = self.keys.next() else { return Ok(None) };
        self.key = key;
        seed.deserialize(Name(key)).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Read<V::Value> {
        seed.deserialize(below(&self.map, self.key))
    }
}

/// One entry of a map of names.
pub(super) struct TracedEntry<'a> {
    map: Tracer<'a>,
    is_given: bool,
}

impl<'a> TracedEntry<'a> {
    pub(super) fn new(map: Tracer<'a>) -> Self {
        Self { map, is_given: false }
    }
}

impl<'de> MapAccess<'de> for TracedEntry<'_> {
    type Error = Refusal;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Read<Option<K::Value>> {
        if std::mem::replace(&mut self.is_given, true) {
            return Ok(None);
        }
        seed.deserialize(Name("name")).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Read<V::Value> {
        seed.deserialize(below(&self.map, EACH))
    }
}

/// A key, with its position for who asks for that.
struct Name(&'static str);

impl<'de> Deserializer<'de> for Name {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_str(self.0)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        match name == SPANNED {
            true => visitor.visit_seq(SpannedParts::new(Span::NONE, self)),
            false => visitor.visit_newtype_struct(self),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct seq tuple tuple_struct map
        struct enum identifier ignored_any
    }
}

/// One variant of an enum.
pub(super) struct TracedVariant<'a> {
    whole: Tracer<'a>,
    name: &'static str,
}

impl<'a> TracedVariant<'a> {
    pub(super) fn new(whole: Tracer<'a>, name: &'static str) -> Self {
        Self { whole, name }
    }

    fn content(&self) -> Tracer<'a> {
        self.whole.trace.learn_variant(&self.whole.path, self.name, true);
        below(&self.whole, self.name)
    }
}

impl<'de> EnumAccess<'de> for TracedVariant<'_> {
    type Error = Refusal;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Read<(V::Value, Self)> {
        let name: StrDeserializer<'_, Refusal> = self.name.into_deserializer();
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'de> VariantAccess<'de> for TracedVariant<'_> {
    type Error = Refusal;

    fn unit_variant(self) -> Read<()> {
        self.whole.trace.learn_variant(&self.whole.path, self.name, false);
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Read<T::Value> {
        seed.deserialize(self.content())
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Read<V::Value> {
        self.content().deserialize_tuple(length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, fields: &'static [&'static str], visitor: V) -> Read<V::Value> {
        self.content().deserialize_struct("", fields, visitor)
    }
}
