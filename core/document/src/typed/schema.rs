//! The JSON Schema of a type that derives `Deserialize` and is read by [`super::typed`], found by reading it: serde asks for each key, item and
//! variant in turn, and a type that knows only how to be read thereby says what it is made of. So an editor's schema cannot forget a key.
//!
//! A type is read many times over, each time with another variant where it has some, and with one key left out: if it is then refused, the key
//! is required. A type whose own reader refuses an empty text or a 0 cannot be found out this way. Where a type takes anything (`deserialize_any`), so does its schema; anyone who knows better replaces that part.

use serde::de::{DeserializeOwned, Deserializer, Visitor};
use serde_json::{Value, json};

use super::reading::{Refusal, SPANNED};
use super::spanned_parts::SpannedParts;
use super::trace::{Shape, Trace, Tracer};
use super::traced_parts::{OneItem, TracedEntry, TracedKeys, TracedVariant};
use crate::Span;

/// Readings of one type: one for each key and variant suffices, and the longest file there is has some 300.
const MOST_READINGS: usize = 20_000;

/// The schema of a type's files: a draft 7 JSON Schema without a title.
pub fn schema_of<T: DeserializeOwned>() -> Value {
    let trace = Trace::default();
    for _ in 0..MOST_READINGS {
        let read = T::deserialize(Tracer { trace: &trace, path: String::new() });
        trace.learn(read.err());
        if trace.is_complete() {
            break;
        }
    }
    trace.schema("")
}

type Read<T> = Result<T, Refusal>;

/// A text is taken as it is typed, a number among them.
fn text() -> Value {
    json!({"type": ["string", "number", "boolean"]})
}

macro_rules! plain {
    ($($method:ident => $visit:ident $value:expr, $schema:expr);* $(;)?) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
            self.trace.note(&self.path, || Shape::Plain($schema));
            visitor.$visit($value)
        }
    )*};
}

impl<'de> Deserializer<'de> for Tracer<'_> {
    type Error = Refusal;

    plain!(
        deserialize_bool => visit_bool false, json!({"type": "boolean"});
        deserialize_i8 => visit_i8 0, json!({"type": "integer"});
        deserialize_i16 => visit_i16 0, json!({"type": "integer"});
        deserialize_i32 => visit_i32 0, json!({"type": "integer"});
        deserialize_i64 => visit_i64 0, json!({"type": "integer"});
        deserialize_u8 => visit_u8 0, json!({"type": "integer", "minimum": 0, "maximum": 255});
        deserialize_u16 => visit_u16 0, json!({"type": "integer", "minimum": 0, "maximum": 65535});
        deserialize_u32 => visit_u32 0, json!({"type": "integer", "minimum": 0});
        deserialize_u64 => visit_u64 0, json!({"type": "integer", "minimum": 0});
        deserialize_f32 => visit_f32 0.0, json!({"type": "number"});
        deserialize_f64 => visit_f64 0.0, json!({"type": "number"});
        deserialize_char => visit_char ' ', text();
        deserialize_str => visit_str "", text();
        deserialize_string => visit_str "", text();
        deserialize_identifier => visit_str "", text();
        deserialize_bytes => visit_bytes &[], json!({});
        deserialize_byte_buf => visit_bytes &[], json!({});
    );

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Plain(json!({})));
        self.trace.anything.borrow_mut().clone_from(&self.path);
        let word = self.trace.words.borrow().get(&self.path).copied().unwrap_or_default();
        visitor.visit_str(word)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_some(self)
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Plain(json!({"type": "null"})));
        visitor.visit_unit()
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Plain(json!({})));
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Read<V::Value> {
        self.deserialize_unit(visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        match name == SPANNED {
            true => visitor.visit_seq(SpannedParts::new(Span::NONE, self)),
            false => visitor.visit_newtype_struct(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Items(None));
        visitor.visit_seq(OneItem::new(self, 1))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Items(Some(length)));
        visitor.visit_seq(OneItem::new(self, length))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Read<V::Value> {
        self.deserialize_tuple(length, visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.trace.note(&self.path, || Shape::Names);
        visitor.visit_map(TracedEntry::new(self))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        let keys = self.trace.keys(&self.path, fields);
        visitor.visit_map(TracedKeys::new(self, keys))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        let name = self.trace.variant(&self.path, variants);
        visitor.visit_enum(TracedVariant::new(self, name))
    }
}
