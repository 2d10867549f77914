//! What is found of a type by reading it over and over: see [`super::schema`].

use std::cell::RefCell;
use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::reading::Refusal;

/// Whether a key may be left out.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    Unknown,
    Required,
    Optional,
}

/// What was found at one position.
pub(super) enum Shape {
    /// A value that holds no others.
    Plain(Value),
    /// A map whose keys are known.
    Keys(Vec<(&'static str, Need)>),
    /// A map whose keys are names.
    Names,
    /// A list, of so many items where that is fixed.
    Items(Option<usize>),
    /// One of several, each with whether it holds something; and how often it was read.
    Variants(Vec<(&'static str, Option<bool>)>, usize),
}

/// What was found so far, by the path of keys from the root.
#[derive(Default)]
pub(super) struct Trace {
    shapes: RefCell<BTreeMap<String, Shape>>,
    /// The key that this reading leaves out.
    left_out: RefCell<Option<(String, &'static str)>>,
    /// The last position that takes anything, and the words that such positions have asked for.
    pub(super) anything: RefCell<String>,
    pub(super) words: RefCell<BTreeMap<String, &'static str>>,
}

/// Represents a value at one position: gives every type what it asks for, and remembers it.
#[derive(Clone)]
pub(super) struct Tracer<'a> {
    pub(super) trace: &'a Trace,
    pub(super) path: String,
}

impl Trace {
    pub(super) fn note(&self, path: &str, shape: impl FnOnce() -> Shape) {
        self.shapes.borrow_mut().entry(path.to_owned()).or_insert_with(shape);
    }

    /// The keys to give a struct in this reading: all, or all but the one that is left out.
    pub(super) fn keys(&self, path: &str, fields: &'static [&'static str]) -> Vec<&'static str> {
        self.note(path, || Shape::Keys(fields.iter().map(|field| (*field, Need::Unknown)).collect()));
        let mut left_out = self.left_out.borrow_mut();
        if left_out.is_none()
            && let Some(Shape::Keys(keys)) = self.shapes.borrow().get(path)
            && let Some((key, _)) = keys.iter().find(|(_, need)| *need == Need::Unknown)
        {
            *left_out = Some((path.to_owned(), key));
        }
        let is_given =
            |field: &&&'static str| !left_out.as_ref().is_some_and(|(at, key)| at == path && key == *field);
        fields.iter().filter(is_given).copied().collect()
    }

    /// The variant to give an enum in this reading.
    pub(super) fn variant(&self, path: &str, names: &'static [&'static str]) -> &'static str {
        self.note(path, || Shape::Variants(names.iter().map(|name| (*name, None)).collect(), 0));
        let mut shapes = self.shapes.borrow_mut();
        let Some(Shape::Variants(variants, readings)) = shapes.get_mut(path) else { return "" };
        *readings += 1;
        let unread = variants.iter().find(|(_, holds)| holds.is_none());
        let next = unread.or_else(|| variants.get(*readings % variants.len().max(1)));
        next.map_or("", |(name, _)| name)
    }

    /// Whether a variant holds something, or is a mere word.
    pub(super) fn learn_variant(&self, path: &str, name: &str, holds: bool) {
        if let Some(Shape::Variants(variants, _)) = self.shapes.borrow_mut().get_mut(path)
            && let Some(variant) = variants.iter_mut().find(|(known, _)| *known == name)
        {
            variant.1 = Some(holds);
        }
    }

    /// Learns from how a reading ended.
    pub(super) fn learn(&self, refused: Option<Refusal>) {
        if let Some(Refusal::Word(_, known)) = &refused
            && let Some(word) = known.first()
        {
            self.words.borrow_mut().insert(self.anything.borrow().clone(), word);
            *self.left_out.borrow_mut() = None;
            return;
        }
        let Some((path, left_out)) = self.left_out.borrow_mut().take() else { return };
        let is_required = matches!(refused, Some(Refusal::Missing(key)) if key == left_out);
        if let Some(Shape::Keys(keys)) = self.shapes.borrow_mut().get_mut(&path)
            && let Some(key) = keys.iter_mut().find(|(key, _)| *key == left_out)
        {
            key.1 = if is_required { Need::Required } else { Need::Optional };
        }
    }

    pub(super) fn is_complete(&self) -> bool {
        self.shapes.borrow().values().all(|shape| match shape {
            Shape::Keys(keys) => keys.iter().all(|(_, need)| *need != Need::Unknown),
            Shape::Variants(variants, _) => variants.iter().all(|(_, holds)| holds.is_some()),
            Shape::Plain(_) | Shape::Names | Shape::Items(_) => true,
        })
    }

    pub(super) fn schema(&self, path: &str) -> Value {
        let below = |key: &str| self.schema(&format!("{path}/{key}"));
        match self.shapes.borrow().get(path) {
            None => json!({}),
            Some(Shape::Plain(value)) => value.clone(),
            Some(Shape::Names) => json!({"type": "object", "additionalProperties": below("*")}),
            Some(Shape::Items(None)) => json!({"type": "array", "items": below("*")}),
            Some(Shape::Items(Some(length))) => {
                json!({"type": "array", "items": below("*"), "minItems": length, "maxItems": length})
            }
            Some(Shape::Keys(keys)) => {
                let properties: Map<String, Value> =
                    keys.iter().map(|(key, _)| ((*key).to_owned(), below(key))).collect();
                let required: Vec<&str> =
                    keys.iter().filter(|(_, need)| *need == Need::Required).map(|(key, _)| *key).collect();
                json!({"type": "object", "additionalProperties": false, "required": required, "properties": properties})
            }
            Some(Shape::Variants(variants, _)) => {
                let words: Vec<&str> = variants
                    .iter()
                    .filter(|(_, holds)| *holds != Some(true))
                    .map(|(name, _)| *name)
                    .collect();
                let holding = variants.iter().filter(|(_, holds)| *holds == Some(true));
                let properties: Map<String, Value> =
                    holding.map(|(name, _)| ((*name).to_owned(), below(name))).collect();
                one_variant(&words, properties)
            }
        }
    }
}

/// One of some words, or a map of one key.
fn one_variant(words: &[&str], properties: Map<String, Value>) -> Value {
    let word = json!({"enum": words});
    if properties.is_empty() {
        return word;
    }
    let map = json!({"type": "object", "additionalProperties": false, "minProperties": 1, "maxProperties": 1, "properties": properties});
    if words.is_empty() { map } else { json!({"anyOf": [word, map]}) }
}
