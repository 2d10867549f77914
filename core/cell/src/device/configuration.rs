//! What a plugin is given, held against the schema in its manifest. The part of JSON Schema that manifests use: `type`, `properties`, `required`,
//! `additionalProperties: false`, `enum`, `minimum`, `maximum`, `minLength`, `maxLength`, `items`, and `oneOf` over
//! keys; the plugin itself has the last word.

use serde_json::{Map, Value};

use plumb_document::did_you_mean;

/// A mistake, and what would be right.
pub(crate) type Mistake = (String, String);

/// Every mistake in a device's configuration by the schema in its plugin's manifest, each with what would be right.
pub fn config_mistakes(config: &Value, schema: &Value) -> Vec<String> {
    let in_words =
        |(message, help): Mistake| if help.is_empty() { message } else { format!("{message} ({help})") };
    mistakes(config, schema, &[]).into_iter().map(in_words).collect()
}

/// Every mistake in a configuration. `given` are keys that are filled in later.
pub(crate) fn mistakes(config: &Value, schema: &Value, given: &[&str]) -> Vec<Mistake> {
    let mut found = Vec::new();
    let empty = Value::Object(Map::new());
    let config = if config.is_null() { &empty } else { config };
    if schema.is_null() {
        if config.as_object().is_none_or(|entries| !entries.is_empty()) {
            found.push(("the plugin takes no `config`".to_owned(), "take it away".to_owned()));
        }
        return found;
    }
    check(config, schema, "config", given, &mut found);
    found
}

fn check(value: &Value, schema: &Value, name: &str, given: &[&str], found: &mut Vec<Mistake>) {
    let about = schema.get("description").and_then(Value::as_str).unwrap_or_default();
    if let Some(kind) = schema.get("type").and_then(Value::as_str)
        && !is_of_type(value, kind)
    {
        found.push((format!("`{name}` is {}; it is {}", shown(value), in_words(kind)), about.to_owned()));
        return;
    }
    if let Some(allowed) = schema.get("enum").and_then(Value::as_array)
        && !allowed.contains(value)
    {
        let words: Vec<String> = allowed.iter().map(shown).collect();
        let help = match value.as_str() {
            Some(word) => did_you_mean(word, allowed.iter().filter_map(Value::as_str)),
            None => format!("it is one of {}", words.join(", ")),
        };
        found.push((format!("`{name}` is {}", shown(value)), help));
    }
    check_bounds(value, schema, name, found);
    if let Some(entries) = value.as_object() {
        let none = Map::new();
        let properties = schema.get("properties").and_then(Value::as_object).unwrap_or(&none);
        let is_closed = schema.get("additionalProperties") == Some(&Value::Bool(false));
        for (key, inner) in entries {
            match properties.get(key) {
                Some(schema) => check(inner, schema, &format!("{name}.{key}"), &[], found),
                None if is_closed => {
                    let help = did_you_mean(key, properties.keys().map(String::as_str));
                    found.push((format!("`{name}` has no key `{key}`"), help));
                }
                None => {}
            }
        }
        let required =
            schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
        check_alternatives(entries, schema, name, found);
        for key in required.filter(|key| !entries.contains_key(*key) && !given.contains(key)) {
            let about =
                properties.get(key).and_then(|schema| schema.get("description")).and_then(Value::as_str);
            found.push((format!("`{name}` needs the key `{key}`"), about.unwrap_or_default().to_owned()));
        }
    }
    if let (Some(items), Some(schema)) = (value.as_array(), schema.get("items")) {
        items.iter().for_each(|item| check(item, schema, name, &[], found));
    }
}

/// Of keys that replace each other exactly one is given.
fn check_alternatives(entries: &Map<String, Value>, schema: &Value, name: &str, found: &mut Vec<Mistake>) {
    let alternatives = schema.get("oneOf").and_then(Value::as_array).into_iter().flatten();
    let keys: Vec<&str> =
        alternatives.filter_map(|one| one.get("required")?.as_array()?.first()?.as_str()).collect();
    let given = keys.iter().filter(|key| entries.contains_key(**key)).count();
    if keys.is_empty() || given == 1 {
        return;
    }
    let quoted: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
    let message = match given {
        0 => format!("`{name}` needs one of the keys {}", quoted.join(", ")),
        _ => format!("`{name}` has more than one of the keys {}", quoted.join(", ")),
    };
    found.push((message, "give exactly one of them".to_owned()));
}

fn check_bounds(value: &Value, schema: &Value, name: &str, found: &mut Vec<Mistake>) {
    let bound = |key: &str| schema.get(key).and_then(Value::as_f64);
    let (size, least, most, what) = match value {
        Value::Number(number) => (number.as_f64(), bound("minimum"), bound("maximum"), "it lies"),
        Value::String(text) => {
            (Some(text.chars().count() as f64), bound("minLength"), bound("maxLength"), "its length lies")
        }
        _ => return,
    };
    let Some(size) = size else { return };
    let (low, high) = (least.unwrap_or(f64::NEG_INFINITY), most.unwrap_or(f64::INFINITY));
    if (low..=high).contains(&size) {
        return;
    }
    let right = match (least, most) {
        (Some(least), Some(most)) => format!("{what} between {least} and {most}"),
        (Some(least), None) => format!("{what} at {least} or above"),
        _ => format!("{what} at {high} or below"),
    };
    found.push((format!("`{name}` is {}", shown(value)), right));
}

fn is_of_type(value: &Value, kind: &str) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        // A type of a later schema: the plugin knows.
        _ => true,
    }
}

fn in_words(kind: &str) -> &'static str {
    match kind {
        "object" => "a map",
        "array" => "a list",
        "string" => "a text",
        "boolean" => "`true` or `false`",
        "integer" => "a whole number",
        _ => "a number",
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => format!("`{text}`"),
        Value::Object(_) => "a map".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn first(config: Value) -> Option<Mistake> {
        let schema = json!({
            "type": "object",
            "additionalProperties": false,
            "required": ["bit", "world"],
            "properties": {
                "bit": {"type": "integer", "minimum": 0, "maximum": 63},
                "active": {"enum": ["high", "low"]},
                "mark": {"type": "string", "maxLength": 1},
                "zero": {"type": "object", "additionalProperties": false, "properties": {"waist_deg": {"type": "number"}}},
                "world": {"type": "string"}
            }
        });
        mistakes(&config, &schema, &["world"]).into_iter().next()
    }

    fn says(message: &str, help: &str) -> Option<Mistake> {
        Some((message.to_owned(), help.to_owned()))
    }

    #[test]
    fn a_configuration_that_fits_its_schema_has_no_mistakes() {
        assert_eq!(first(json!({"bit": 3, "active": "low", "mark": "@", "zero": {"waist_deg": 1.5}})), None);
    }

    #[test]
    fn each_mistake_says_what_would_be_right() {
        assert_eq!(first(Value::Null), says("`config` needs the key `bit`", ""));
        assert_eq!(first(json!({"bit": 64})), says("`config.bit` is 64", "it lies between 0 and 63"));
        assert_eq!(first(json!({"bit": 0.5})), says("`config.bit` is 0.5; it is a whole number", ""));
        assert_eq!(
            first(json!({"bit": 0, "activ": "low"})),
            says("`config` has no key `activ`", "did you mean `active`?")
        );
        assert_eq!(
            first(json!({"bit": 0, "active": "hihg"})),
            says("`config.active` is `hihg`", "did you mean `high`?")
        );
        assert_eq!(
            first(json!({"bit": 0, "mark": "@@"})),
            says("`config.mark` is `@@`", "its length lies at 1 or below")
        );
        assert_eq!(
            first(json!({"bit": 0, "zero": {"waist": 1}})),
            says("`config.zero` has no key `waist`", "did you mean `waist_deg`?")
        );
    }

    #[test]
    fn of_keys_that_mean_the_same_one_is_given() {
        let schema = json!({"type": "object", "oneOf": [{"required": ["bit"]}, {"required": ["gpio"]}]});
        let first =
            |config: Value| mistakes(&config, &schema, &[]).into_iter().next().map(|(message, _)| message);
        assert_eq!(first(json!({"bit": 0})), None);
        assert_eq!(first(Value::Null).as_deref(), Some("`config` needs one of the keys `bit`, `gpio`"));
        assert_eq!(
            first(json!({"bit": 0, "gpio": {}})).as_deref(),
            Some("`config` has more than one of the keys `bit`, `gpio`")
        );
    }

    #[test]
    fn a_plugin_that_takes_nothing_is_given_nothing() {
        assert_eq!(mistakes(&Value::Null, &Value::Null, &[]), []);
        assert_eq!(mistakes(&json!({"a": 1}), &Value::Null, &[]).len(), 1);
    }

    #[test]
    fn every_type_is_reported_in_words() {
        let kinds = [
            ("object", json!(1), "`config.it` is 1; it is a map"),
            ("array", json!({}), "`config.it` is a map; it is a list"),
            ("string", json!([]), "`config.it` is a list; it is a text"),
            ("boolean", json!("yes"), "`config.it` is `yes`; it is `true` or `false`"),
            ("integer", json!(1.5), "`config.it` is 1.5; it is a whole number"),
            ("number", json!(true), "`config.it` is true; it is a number"),
        ];
        let right = [json!({}), json!([]), json!("text"), json!(true), json!(2.0), json!(0.5)];
        for ((kind, wrong, reported), right) in kinds.into_iter().zip(right) {
            let schema =
                json!({"type": "object", "properties": {"it": {"type": kind, "description": "So."}}});
            let found = mistakes(&json!({"it": wrong}), &schema, &[]);
            assert_eq!(found, [(reported.to_owned(), "So.".to_owned())]);
            assert!(mistakes(&json!({"it": right}), &schema, &[]).is_empty(), "{kind}");
        }
    }

    #[test]
    fn the_words_of_bounds_say_which_there_are() {
        let reported = |schema: Value, value: Value| {
            let schema = json!({"type": "object", "properties": {"it": schema}});
            config_mistakes(&json!({"it": value}), &schema).pop()
        };
        let both = json!({"minimum": 1, "maximum": 3});
        assert_eq!(
            reported(both.clone(), json!(0)).as_deref(),
            Some("`config.it` is 0 (it lies between 1 and 3)")
        );
        assert_eq!((reported(both.clone(), json!(1)), reported(both.clone(), json!(3))), (None, None));
        assert_eq!(
            reported(both, json!(3.5)).as_deref(),
            Some("`config.it` is 3.5 (it lies between 1 and 3)")
        );
        assert_eq!(
            reported(json!({"minimum": 1}), json!(0)).as_deref(),
            Some("`config.it` is 0 (it lies at 1 or above)")
        );
        assert_eq!(
            reported(json!({"maximum": 1}), json!(2)).as_deref(),
            Some("`config.it` is 2 (it lies at 1 or below)")
        );
        assert_eq!(
            reported(json!({"minLength": 2}), json!("a")).as_deref(),
            Some("`config.it` is `a` (its length lies at 2 or above)")
        );
        assert_eq!(
            config_mistakes(&json!({"a": 1}), &Value::Null),
            ["the plugin takes no `config` (take it away)"]
        );
        assert!(config_mistakes(&json!({}), &Value::Null).is_empty());
        let no_help = json!({"type": "object", "required": ["port"]});
        assert_eq!(config_mistakes(&Value::Null, &no_help), ["`config` needs the key `port`"]);
    }
}
