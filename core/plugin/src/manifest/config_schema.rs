//! The schema of a plugin's configuration, as its manifest gives it.

use plumb_document::{Node, NodeValue, Problems};

/// Finds the rest of a text that was cut at a comma because it stands in braces without quotes: YAML takes it for a key without a value.
pub(super) fn check_config_schema(node: &Node, problems: &Problems) {
    match &node.value {
        NodeValue::Map(entries) => {
            for (key, value) in entries {
                if value.value == NodeValue::Null && key.name.contains(char::is_whitespace) {
                    let message = format!("`{}` is a key without a value", key.name);
                    problems.add(key.span, message, "quote a text in braces that has a comma");
                }
                check_config_schema(value, problems);
            }
        }
        NodeValue::List(items) => items.iter().for_each(|item| check_config_schema(item, problems)),
        _ => {}
    }
}
