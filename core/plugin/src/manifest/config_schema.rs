//! The schema of a plugin's configuration, as its manifest gives it: whether it is one, so that no rule of it goes unread.

use plumb_document::{Key, Node, NodeValue, Problems, did_you_mean};

/// What a keyword of a schema holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Holds {
    /// A text.
    Text,
    /// A number.
    Number,
    /// A whole number from 0.
    Count,
    /// `true` or `false`.
    Flag,
    /// One of [`TYPES`], or a list of them.
    Type,
    /// A list of anything.
    List,
    /// A list of names.
    Names,
    /// A schema.
    Schema,
    /// A schema, or `true` or `false`.
    SchemaOrFlag,
    /// A list of schemas.
    Schemas,
    /// A map of schemas.
    MapOfSchemas,
    /// Whatever a configuration may hold.
    Anything,
}

/// The keywords that manifests use (JSON Schema, draft 7, and plumb's own four).
const KEYWORDS: &[(&str, Holds)] = &[
    ("$comment", Holds::Text),
    ("$ref", Holds::Text),
    ("additionalProperties", Holds::SchemaOrFlag),
    ("allOf", Holds::Schemas),
    ("anyOf", Holds::Schemas),
    ("are_joints", Holds::Flag),
    ("const", Holds::Anything),
    ("contains", Holds::Schema),
    ("default", Holds::Anything),
    ("definitions", Holds::MapOfSchemas),
    ("dependencies", Holds::Anything),
    ("description", Holds::Text),
    ("else", Holds::Schema),
    ("enum", Holds::List),
    ("examples", Holds::List),
    ("exclusiveMaximum", Holds::Number),
    ("exclusiveMinimum", Holds::Number),
    ("format", Holds::Text),
    ("if", Holds::Schema),
    ("input_line_of", Holds::Text),
    ("is_full_speed", Holds::Text),
    ("items", Holds::Schema),
    ("maxItems", Holds::Count),
    ("maxLength", Holds::Count),
    ("maxProperties", Holds::Count),
    ("maximum", Holds::Number),
    ("minItems", Holds::Count),
    ("minLength", Holds::Count),
    ("minProperties", Holds::Count),
    ("minimum", Holds::Number),
    ("multipleOf", Holds::Number),
    ("needs_input", Holds::Text),
    ("not", Holds::Schema),
    ("oneOf", Holds::Schemas),
    ("pattern", Holds::Text),
    ("patternProperties", Holds::MapOfSchemas),
    ("properties", Holds::MapOfSchemas),
    ("propertyNames", Holds::Schema),
    ("readOnly", Holds::Flag),
    ("required", Holds::Names),
    ("then", Holds::Schema),
    ("title", Holds::Text),
    ("type", Holds::Type),
    ("uniqueItems", Holds::Flag),
    ("writeOnly", Holds::Flag),
];

/// The types a value of a configuration can have.
const TYPES: [&str; 7] = ["array", "boolean", "integer", "null", "number", "object", "string"];

/// Reports every keyword of a schema that nobody reads, and every one that does not hold what it should.
pub(super) fn check_config_schema(node: &Node, problems: &Problems) {
    let NodeValue::Map(entries) = &node.value else {
        let message = format!("a schema is a map; this is {}", node.value.kind());
        problems.add(
            node.span,
            message,
            "write what a cell file may give, as in {type: object, properties: ...}",
        );
        return;
    };
    for (key, value) in entries {
        if is_cut_at_a_comma(key, value, problems) {
            continue;
        }
        match KEYWORDS.iter().find(|(keyword, _)| *keyword == key.name) {
            Some((_, holds)) => check_keyword(key, value, *holds, problems),
            None => {
                let help = did_you_mean(&key.name, KEYWORDS.iter().map(|(keyword, _)| *keyword));
                problems.add(key.span, format!("a schema has no key `{}`", key.name), help);
            }
        }
    }
}

/// Whether a key is the rest of a text that was cut at a comma because it is in braces without quotes: YAML takes it for a key without a value.
fn is_cut_at_a_comma(key: &Key, value: &Node, problems: &Problems) -> bool {
    let is_cut = value.value == NodeValue::Null && key.name.contains(char::is_whitespace);
    if is_cut {
        let message = format!("`{}` is a key without a value", key.name);
        problems.add(key.span, message, "quote a text in braces that has a comma");
    }
    is_cut
}

fn check_keyword(key: &Key, value: &Node, holds: Holds, problems: &Problems) {
    let wrong = |what: &str| {
        let message = format!("`{}` is {what}; this is {}", key.name, value.value.kind());
        problems.add(value.span, message, "");
    };
    match (holds, &value.value) {
        (Holds::Anything, _)
        | (Holds::Text, NodeValue::Text(_))
        | (Holds::Number, NodeValue::Number(_))
        | (Holds::Flag | Holds::SchemaOrFlag, NodeValue::Bool(_))
        | (Holds::List, NodeValue::List(_)) => {}
        (Holds::Count, NodeValue::Number(number)) if *number >= 0.0 && number.fract() == 0.0 => {}
        (Holds::Count, NodeValue::Number(number)) => {
            problems.add(value.span, format!("`{}` is {number}", key.name), "give a whole number from 0");
        }
        (Holds::Type, NodeValue::Text(_)) => check_type(value, problems),
        (Holds::Type, NodeValue::List(types)) => types.iter().for_each(|one| check_type(one, problems)),
        (Holds::Names, NodeValue::List(names)) => {
            for name in names.iter().filter(|name| !matches!(name.value, NodeValue::Text(_))) {
                let message = format!("`{}` lists names; this is {}", key.name, name.value.kind());
                problems.add(name.span, message, "");
            }
        }
        (Holds::Schema | Holds::SchemaOrFlag, NodeValue::Map(_)) => check_config_schema(value, problems),
        (Holds::Schemas, NodeValue::List(all)) => {
            all.iter().for_each(|one| check_config_schema(one, problems))
        }
        (Holds::MapOfSchemas, NodeValue::Map(all)) => {
            for (name, schema) in all {
                if !is_cut_at_a_comma(name, schema, problems) {
                    check_config_schema(schema, problems);
                }
            }
        }
        (Holds::Text, _) => wrong("a text"),
        (Holds::Number, _) => wrong("a number"),
        (Holds::Count, _) => wrong("a whole number"),
        (Holds::Flag, _) => wrong("`true` or `false`"),
        (Holds::Type, _) => wrong("the name of a type"),
        (Holds::List | Holds::Names, _) => wrong("a list"),
        (Holds::Schema, _) => wrong("a schema"),
        (Holds::SchemaOrFlag, _) => wrong("a schema, or `true` or `false`"),
        (Holds::Schemas, _) => wrong("a list of schemas"),
        (Holds::MapOfSchemas, _) => wrong("a map of schemas"),
    }
}

/// A type by its name.
fn check_type(node: &Node, problems: &Problems) {
    let NodeValue::Text(name) = &node.value else {
        let message = format!("a type is a name; this is {}", node.value.kind());
        problems.add(node.span, message, did_you_mean("", TYPES));
        return;
    };
    if !TYPES.contains(&name.as_str()) {
        problems.add(node.span, format!("there is no type `{name}`"), did_you_mean(name, TYPES));
    }
}

#[cfg(test)]
mod tests {
    use crate::Manifest;

    /// What a manifest with such a schema of its configuration says.
    fn reported(schema: &str) -> String {
        let text = format!(
            "id: gauge\ntitle: A gauge\nversion: 0.1.0\ncontract: [1, 0]\nkind: sensor\nlibrary: libgauge.so\nquantities: []\nconfig:\n{schema}"
        );
        Manifest::parse(&text, "plugin.yaml").map_or_else(|error| error.to_string(), |_| String::new())
    }

    #[test]
    fn a_key_that_nobody_reads_is_named_with_its_position_and_what_comes_near() {
        let reported = reported("  type: object\n  propertees:\n    port: {type: string}\n");
        assert!(reported.contains("plugin.yaml:10:3: a schema has no key `propertees`"), "{reported}");
        assert!(reported.contains("did you mean `properties`?"), "{reported}");
        assert_eq!(reported.matches("plugin.yaml:").count(), 1, "{reported}");
    }

    #[test]
    fn a_type_or_a_bound_that_is_none_is_named_however_deep_it_lies() {
        let reported = reported(
            "  type: object\n  properties:\n    port: {type: sting}\n    rate: {type: [integer, nul], minimum: low}\n    list: {items: [string], minItems: 0.5}\n  additionalProperties: 3\n  required: port\n",
        );
        for expected in [
            "plugin.yaml:11:18: there is no type `sting`",
            "did you mean `string`?",
            "plugin.yaml:12:28: there is no type `nul`",
            "`minimum` is a number; this is a text",
            "`items` is a schema; this is a list",
            "`minItems` is 0.5",
            "`additionalProperties` is a schema, or `true` or `false`; this is a number",
            "`required` is a list; this is a text",
        ] {
            assert!(reported.contains(expected), "{expected}: {reported}");
        }
    }

    #[test]
    fn what_manifests_use_is_taken() {
        let good = "  type: object\n  additionalProperties: false\n  oneOf: [{required: [port]}, {required: [file]}]\n  properties:\n    port: {description: \"A port, such as /dev/ttyS0.\", type: string, default: a}\n    file: {enum: [a, 2, null], needs_input: line}\n";
        assert_eq!(reported(good), "");
        assert!(
            reported("  type: object\n  properties:\n    a: {description: A port, such as this}\n")
                .contains("quote a text")
        );
    }
}
