//! A deserializer over one node, and the walk through lists, maps and variants.

use std::slice::Iter;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, MapAccess, SeqAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use super::reading::{OtherKeys, Reading, Refusal, SPANNED};
use super::spanned_parts::SpannedParts;
use super::stand_in::StandIn;
use crate::map_reader::{is_misspelling, unknown_key_help};
use crate::suggestion::{did_you_mean, one_of};
use crate::{Key, Node, NodeValue};

/// Reads one node; what does not fit is reported, and a stand-in takes its place.
#[derive(Clone, Copy)]
pub(super) struct Reader<'a> {
    pub(super) node: &'a Node,
    /// The key whose value this is, or what the caller calls the whole.
    pub(super) name: &'a str,
    /// Whether `name` is a key.
    pub(super) keyed: bool,
    pub(super) reading: &'a Reading,
}

type Read<T> = Result<T, Refusal>;

impl<'a> Reader<'a> {
    pub(super) fn of_root(node: &'a Node, what: &'a str, reading: &'a Reading) -> Self {
        Self { node, name: what, keyed: false, reading }
    }

    /// What it is called in messages.
    pub(super) fn what(&self) -> String {
        if self.keyed { format!("`{}`", self.name) } else { self.name.to_owned() }
    }

    pub(super) fn report(&self, message: String, help: String) {
        self.reading.report(self.node.span, message, help);
    }

    /// Reads it, unless an earlier reading found it broken. A refusal of the type itself is reported here, where its value is.
    fn whole<'de, V: Visitor<'de>>(
        self,
        visitor: V,
        read: impl FnOnce(V) -> Read<V::Value>,
        stand_in: impl FnOnce(V) -> Read<V::Value>,
    ) -> Read<V::Value> {
        if self.is_broken() {
            self.reading.refused.set(self.reading.refused.get() + 1);
            // What has no stand-in breaks what holds it, without a word: the cause is reported.
            return stand_in(visitor).map_err(|_| Refusal::Words(String::new()));
        }
        read(visitor).map_err(|refusal| self.remember(refusal))
    }

    /// Reports what a type refuses, and remembers it for the next reading.
    pub(super) fn remember(&self, refusal: Refusal) -> Refusal {
        match refusal {
            Refusal::Again => return Refusal::Again,
            _ if self.is_broken() => return Refusal::Words(String::new()),
            Refusal::Missing(key) if matches!(self.node.value, NodeValue::Map(_)) => {
                self.reading.missing.borrow_mut().push((self.node.span, key));
                return Refusal::Again;
            }
            Refusal::Key(key, known) => {
                let entries = match &self.node.value {
                    NodeValue::Map(entries) => entries.as_slice(),
                    _ => &[],
                };
                let found = entries.iter().find(|(name, _)| name.name == key);
                let span = found.map_or(self.node.span, |(name, _)| name.span);
                let help = unknown_key_help(&key, known, &self.what());
                self.reading.report(span, format!("unknown key `{key}` in {}", self.what()), help);
            }
            Refusal::Word(word, known) => {
                let help = did_you_mean(&word, known.iter().copied());
                self.report(format!("{} is `{word}`, which is not known", self.what()), help);
            }
            Refusal::Expected(right) => self.mismatch(&right, ""),
            Refusal::Words(words) if words.is_empty() => {}
            Refusal::Words(words) => self.report(format!("{}: {words}", self.what()), String::new()),
            Refusal::Missing(key) => {
                self.report(format!("{} needs the key `{key}`", self.what()), String::new())
            }
        }
        self.reading.broken.borrow_mut().push(self.node.span);
        Refusal::Again
    }

    fn is_broken(&self) -> bool {
        self.reading.broken.borrow().contains(&self.node.span)
    }

    /// Reports what it is in place of what is right.
    fn mismatch(&self, right: &str, help: &str) {
        let found = match &self.node.value {
            NodeValue::Text(text) if text.chars().count() <= 40 => format!("the text `{text}`"),
            other => other.kind().to_owned(),
        };
        self.report(format!("{} is {right}; this is {found}", self.what()), help.to_owned());
    }

    fn number<'de, V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match &self.node.value {
            NodeValue::Number(number) if number.is_finite() => visitor.visit_f64(*number),
            NodeValue::Text(text) => {
                self.mismatch("a number", &crate::value::number_help(text));
                StandIn.deserialize_f64(visitor)
            }
            _ => {
                self.mismatch("a finite number", "");
                StandIn.deserialize_f64(visitor)
            }
        }
    }

    /// A whole number between two bounds.
    fn whole_number<'de, V: Visitor<'de>>(self, visitor: V, least: i128, most: i128) -> Read<V::Value> {
        let NodeValue::Number(number) = &self.node.value else {
            let help = match &self.node.value {
                NodeValue::Text(text) => crate::value::number_help(text),
                _ => String::new(),
            };
            self.mismatch("a whole number", &help);
            return StandIn.deserialize_u64(visitor);
        };
        // As it was typed, since a 64-bit float does not hold every seed.
        let typed = self.node.written.as_deref().and_then(|text| text.parse::<i128>().ok());
        let whole = typed.or_else(|| (number.fract() == 0.0).then_some(*number as i128));
        match whole.filter(|whole| (least..=most).contains(whole)) {
            Some(whole) => match (u64::try_from(whole), i64::try_from(whole)) {
                (Ok(whole), _) => visitor.visit_u64(whole),
                (_, Ok(whole)) => visitor.visit_i64(whole),
                _ => StandIn.deserialize_u64(visitor),
            },
            None => {
                let help = match (least, most > i128::from(u16::MAX)) {
                    (0, true) => "it is a whole number, 0 or more".to_owned(),
                    _ => format!("it is a whole number from {least} to {most}"),
                };
                self.report(format!("{} is {number}", self.what()), help);
                StandIn.deserialize_u64(visitor)
            }
        }
    }

    fn text<'de, V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match (&self.node.value, &self.node.written) {
            (NodeValue::Text(text), _) => visitor.visit_str(text),
            // A number or a word for true may be meant as text: it is taken as it was typed.
            (NodeValue::Number(_) | NodeValue::Bool(_), Some(written)) => visitor.visit_str(written),
            _ => {
                self.mismatch("a text", "");
                StandIn.deserialize_str(visitor)
            }
        }
    }

    fn list<'de, V: Visitor<'de>>(self, length: Option<usize>, visitor: V) -> Read<V::Value> {
        match (&self.node.value, length) {
            (NodeValue::List(items), None) => visitor.visit_seq(Items::new(self, items)),
            (NodeValue::List(items), Some(length)) if items.len() == length => {
                visitor.visit_seq(Items::new(self, items))
            }
            (NodeValue::List(items), Some(length)) => {
                self.report(
                    format!("{} has {} entries", self.what(), items.len()),
                    format!("it has {length}"),
                );
                StandIn.deserialize_tuple(length, visitor)
            }
            (_, None) => {
                self.mismatch("a list", "");
                StandIn.deserialize_seq(visitor)
            }
            (_, Some(length)) => {
                self.mismatch(&format!("a list of {length}"), "");
                StandIn.deserialize_tuple(length, visitor)
            }
        }
    }

    fn variant<'de, V: Visitor<'de>>(self, known: &'static [&'static str], visitor: V) -> Read<V::Value> {
        match &self.node.value {
            NodeValue::Map(entries) => match entries.as_slice() {
                [(key, content)] => {
                    if known.contains(&key.name.as_str()) {
                        let content = Reader { node: content, name: &key.name, keyed: true, ..self };
                        return visitor.visit_enum(OneVariant { name: &key.name, content: Some(content) });
                    }
                    let help = did_you_mean(&key.name, known.iter().copied());
                    let message = format!("unknown key `{}` in {}", key.name, self.what());
                    self.reading.report(key.span, message, help);
                }
                entries => {
                    let message = format!("{} has one key; this has {}", self.what(), entries.len());
                    self.report(message, one_of(known.iter().copied()));
                }
            },
            NodeValue::Text(word) if known.contains(&word.as_str()) => {
                return visitor.visit_enum(OneVariant { name: word, content: None });
            }
            NodeValue::Text(word) => {
                let help = did_you_mean(word, known.iter().copied());
                self.report(format!("{} is `{word}`, which is not known", self.what()), help);
            }
            NodeValue::Bool(word) if known.contains(&word.to_string().as_str()) => {
                return visitor.visit_enum(OneVariant { name: &word.to_string(), content: None });
            }
            _ => self.mismatch("a word", &one_of(known.iter().copied())),
        }
        StandIn.deserialize_enum("", known, visitor)
    }
}

/// The least and most of a kind of whole numbers.
macro_rules! whole_numbers {
    ($($method:ident $kind:ty),*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
            let read = |visitor| self.whole_number(visitor, i128::from(<$kind>::MIN), i128::from(<$kind>::MAX));
            self.whole(visitor, read, |visitor| StandIn.$method(visitor))
        }
    )*};
}

impl<'de> Deserializer<'de> for Reader<'_> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        let read = |visitor: V| match &self.node.value {
            NodeValue::Null => visitor.visit_unit(),
            NodeValue::Bool(value) => visitor.visit_bool(*value),
            NodeValue::Number(number) if number.fract() == 0.0 && number.abs() < 9e15 => {
                visitor.visit_i64(*number as i64)
            }
            NodeValue::Number(number) => visitor.visit_f64(*number),
            NodeValue::Text(text) => visitor.visit_str(text),
            NodeValue::List(items) => visitor.visit_seq(Items::new(self, items)),
            NodeValue::Map(entries) => visitor.visit_map(Entries::new(self, entries, None)),
        };
        self.whole(visitor, read, |visitor| StandIn.deserialize_any(visitor))
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        let read = |visitor: V| match &self.node.value {
            NodeValue::Bool(value) => visitor.visit_bool(*value),
            _ => {
                self.mismatch("`true` or `false`", "");
                StandIn.deserialize_bool(visitor)
            }
        };
        self.whole(visitor, read, |visitor| StandIn.deserialize_bool(visitor))
    }

    whole_numbers!(
        deserialize_i8 i8, deserialize_i16 i16, deserialize_i32 i32, deserialize_i64 i64,
        deserialize_u8 u8, deserialize_u16 u16, deserialize_u32 u32, deserialize_u64 u64
    );

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.whole(visitor, |visitor| self.number(visitor), |visitor| StandIn.deserialize_f64(visitor))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.whole(visitor, |visitor| self.number(visitor), |visitor| StandIn.deserialize_f64(visitor))
    }

    fn deserialize_char<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_str(visitor)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.whole(visitor, |visitor| self.text(visitor), |visitor| StandIn.deserialize_str(visitor))
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_str(visitor)
    }

    fn deserialize_bytes<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_any(visitor)
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_any(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match self.node.value {
            NodeValue::Null => visitor.visit_none(),
            _ if self.is_broken() => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        if self.node.value != NodeValue::Null {
            self.mismatch("left empty", "");
        }
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Read<V::Value> {
        self.deserialize_unit(visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        if name != SPANNED {
            return visitor.visit_newtype_struct(self);
        }
        visitor.visit_seq(SpannedParts::watched(self.node.span, self, self.reading))
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.whole(visitor, |visitor| self.list(None, visitor), |visitor| StandIn.deserialize_seq(visitor))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Read<V::Value> {
        let read = |visitor| self.list(Some(length), visitor);
        self.whole(visitor, read, |visitor| StandIn.deserialize_tuple(length, visitor))
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
        let read = |visitor: V| match &self.node.value {
            NodeValue::Map(entries) => visitor.visit_map(Entries::new(self, entries, None)),
            NodeValue::Null => StandIn.deserialize_map(visitor),
            _ => {
                self.mismatch("a map of keys and values", "");
                StandIn.deserialize_map(visitor)
            }
        };
        self.whole(visitor, read, |visitor| StandIn.deserialize_map(visitor))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        let read = |visitor: V| match &self.node.value {
            NodeValue::Map(entries) => visitor.visit_map(Entries::new(self, entries, Some(fields))),
            _ => {
                self.mismatch("a map of keys and values", &one_of(fields.iter().copied()));
                StandIn.deserialize_struct(name, fields, visitor)
            }
        };
        self.whole(visitor, read, |visitor| StandIn.deserialize_struct(name, fields, visitor))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        let read = |visitor| self.variant(variants, visitor);
        self.whole(visitor, read, |visitor| StandIn.deserialize_enum("", variants, visitor))
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        self.deserialize_str(visitor)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_unit()
    }
}

/// The items of a list; each is called as the list is.
pub(super) struct Items<'a> {
    list: Reader<'a>,
    name: String,
    items: Iter<'a, Node>,
}

impl<'a> Items<'a> {
    pub(super) fn new(list: Reader<'a>, items: &'a [Node]) -> Self {
        let name = match items {
            [] | [_] => list.what(),
            _ => format!("an entry of {}", list.what()),
        };
        Self { list, name, items: items.iter() }
    }
}

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = Refusal;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Read<Option<T::Value>> {
        let Some(node) = self.items.next() else { return Ok(None) };
        let item = Reader { node, name: &self.name, keyed: false, ..self.list };
        seed.deserialize(item).map(Some).map_err(|refusal| item.remember(refusal))
    }
}

/// The keys of a map; of a struct, those it does not know are reported and left out, and those an earlier reading missed are replaced.
pub(super) struct Entries<'a> {
    map: Reader<'a>,
    entries: Iter<'a, (Key, Node)>,
    fields: Option<&'static [&'static str]>,
    missing: Vec<&'static str>,
    /// The value of the key that was given last; none of one that is missing.
    value: Option<&'a (Key, Node)>,
}

impl<'a> Entries<'a> {
    pub(super) fn new(
        map: Reader<'a>,
        entries: &'a [(Key, Node)],
        fields: Option<&'static [&'static str]>,
    ) -> Self {
        let missing = map.reading.missing.borrow();
        let missing: Vec<&str> =
            missing.iter().filter(|(span, _)| *span == map.node.span).map(|(_, key)| *key).collect();
        let strict = map.reading.other_keys == OtherKeys::Refused;
        let is_slip = |key: &&&'static str| strict && slipped(entries, fields.unwrap_or_default(), key);
        for key in missing.iter().filter(|key| !is_slip(key)) {
            map.report(format!("{} needs the key `{key}`", map.what()), String::new());
        }
        Self { map, entries: entries.iter(), fields, missing, value: None }
    }

    fn unknown(&self, key: &Key, fields: &[&'static str]) {
        let what = self.map.what();
        let message = format!("unknown key `{}` in {what}", key.name);
        self.map.reading.report(key.span, message, unknown_key_help(&key.name, fields, &what));
    }
}

/// Whether a key is there that is reported as a misspelling of this one.
fn slipped(entries: &[(Key, Node)], fields: &[&'static str], key: &&'static str) -> bool {
    let unknown = entries.iter().filter(|(name, _)| !fields.contains(&name.name.as_str()));
    unknown.into_iter().any(|(name, _)| is_misspelling(&name.name, key))
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = Refusal;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Read<Option<K::Value>> {
        while let Some(entry) = self.entries.next() {
            let (key, value) = entry;
            if let Some(fields) = self.fields {
                if !fields.contains(&key.name.as_str()) {
                    if self.map.reading.other_keys == OtherKeys::Refused {
                        self.unknown(key, fields);
                    }
                    continue;
                }
                // An empty value is as good as none.
                if value.value == NodeValue::Null {
                    continue;
                }
            }
            self.value = Some(entry);
            return seed.deserialize(KeyReader(key)).map(Some);
        }
        self.value = None;
        let Some(missing) = self.missing.pop() else { return Ok(None) };
        let key: StrDeserializer<'_, Refusal> = missing.into_deserializer();
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Read<V::Value> {
        match self.value {
            Some((key, node)) => {
                let value = Reader { node, name: &key.name, keyed: true, ..self.map };
                seed.deserialize(value).map_err(|refusal| value.remember(refusal))
            }
            // A type without a stand-in breaks what holds it: that the key is missing is reported.
            None => seed.deserialize(StandIn).map_err(|_| Refusal::Words(String::new())),
        }
    }
}

/// A key, with its position where that is asked for.
struct KeyReader<'a>(&'a Key);

impl<'de> Deserializer<'de> for KeyReader<'_> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_str(&self.0.name)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        let key: StrDeserializer<'_, Refusal> = self.0.name.as_str().into_deserializer();
        match name == SPANNED {
            true => visitor.visit_seq(SpannedParts::new(self.0.span, key)),
            false => visitor.visit_newtype_struct(key),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// A variant by its name, with what is given under it.
pub(super) struct OneVariant<'a> {
    pub(super) name: &'a str,
    pub(super) content: Option<Reader<'a>>,
}

impl<'de, 'a> EnumAccess<'de> for OneVariant<'a> {
    type Error = Refusal;
    type Variant = Content<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Read<(V::Value, Content<'a>)> {
        let name: StrDeserializer<'_, Refusal> = self.name.into_deserializer();
        Ok((seed.deserialize(name)?, Content { content: self.content, name: self.name.to_owned() }))
    }
}

/// What is given under a variant's name.
pub(super) struct Content<'a> {
    content: Option<Reader<'a>>,
    name: String,
}

impl Content<'_> {
    fn given(self) -> Read<Self> {
        match self.content {
            Some(_) => Ok(self),
            None => Err(Refusal::Words(format!(
                "`{0}` has keys of its own: write `{0}:` with them under it",
                self.name
            ))),
        }
    }
}

impl<'de> VariantAccess<'de> for Content<'_> {
    type Error = Refusal;

    fn unit_variant(self) -> Read<()> {
        match self.content {
            None => Ok(()),
            Some(content) => Deserializer::deserialize_unit(content, serde::de::IgnoredAny).map(drop),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Read<T::Value> {
        match self.given()?.content {
            Some(content) => seed.deserialize(content),
            None => seed.deserialize(StandIn),
        }
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Read<V::Value> {
        match self.given()?.content {
            Some(content) => content.deserialize_tuple(length, visitor),
            None => StandIn.deserialize_tuple(length, visitor),
        }
    }

    fn struct_variant<V: Visitor<'de>>(self, fields: &'static [&'static str], visitor: V) -> Read<V::Value> {
        match self.given()?.content {
            Some(content) => content.deserialize_struct("", fields, visitor),
            None => StandIn.deserialize_struct("", fields, visitor),
        }
    }
}
