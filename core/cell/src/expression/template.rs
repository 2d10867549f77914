//! Texts with values in them: `the elbow stood at {edge.joints.elbow_deg:.2} degrees`.

use serde_json::{Map, Value};

use super::calculator::{Calculator, ExpressionError};
use super::names::Names;
use super::source::Expression;
use plumb_document::{Node, NodeValue, Problems};

/// A text out of a file in which `{expression}` means a value, `{expression:.2}` for one with two digits after the point, and `{{` for
/// a brace.
#[derive(Debug, Clone)]
pub struct Template(Vec<Piece>);

#[derive(Debug, Clone)]
enum Piece {
    Text(String),
    Value { expression: Box<Expression>, decimals: Option<usize> },
}

impl Template {
    /// Reads a template from a text of a file.
    pub fn read(
        node: &Node,
        what: &str,
        calculator: &Calculator,
        file: &str,
        problems: &Problems,
    ) -> Option<Self> {
        let text = node.text(what, problems)?;
        let mut pieces = Vec::new();
        let mut plain = String::new();
        let mut rest = text;
        while let Some(brace) = rest.find(['{', '}']) {
            let (before, from_brace) = rest.split_at(brace);
            plain.push_str(before);
            if from_brace.starts_with("{{") || from_brace.starts_with("}}") {
                plain.push_str(&from_brace[..1]);
                rest = &from_brace[2..];
                continue;
            }
            let Some(end) = from_brace.find('}').filter(|_| from_brace.starts_with('{')) else {
                problems.add(
                    node.span,
                    format!("{what} has a brace without its partner"),
                    "write `{{` or `}}` for a brace itself",
                );
                return None;
            };
            pieces.push(Piece::Text(std::mem::take(&mut plain)));
            pieces.push(value_piece(&from_brace[1..end], node, what, calculator, file, problems)?);
            rest = &from_brace[end + 1..];
        }
        plain.push_str(rest);
        pieces.push(Piece::Text(plain));
        Some(Self(pieces))
    }

    /// Reports names in it that are not there.
    pub fn check_names(&self, names: &Names, file: &str, problems: &Problems) {
        for piece in &self.0 {
            if let Piece::Value { expression, .. } = piece {
                expression.check_names(names, file, problems);
            }
        }
    }

    /// The expressions in it.
    pub fn expressions(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter_map(|piece| match piece {
            Piece::Value { expression, .. } => Some(expression.text()),
            Piece::Text(_) => None,
        })
    }

    /// The text with the values put in.
    ///
    /// # Errors
    /// When a value cannot be worked out.
    pub fn fill(
        &self,
        calculator: &Calculator,
        values: &Map<String, Value>,
    ) -> Result<String, ExpressionError> {
        let mut text = String::new();
        for piece in &self.0 {
            match piece {
                Piece::Text(plain) => text.push_str(plain),
                Piece::Value { expression, decimals } => {
                    text.push_str(&shown(&expression.value(calculator, values)?, *decimals));
                }
            }
        }
        Ok(text)
    }
}

fn value_piece(
    inside: &str,
    node: &Node,
    what: &str,
    calculator: &Calculator,
    file: &str,
    problems: &Problems,
) -> Option<Piece> {
    let (expression, decimals) = match inside.rsplit_once(":.") {
        Some((expression, digits)) => match digits.parse::<usize>() {
            Ok(digits) if digits <= 15 => (expression, Some(digits)),
            _ => {
                problems.add(
                    node.span,
                    format!("{what}: `:.{digits}` is no number of digits"),
                    "write `{value:.2}`",
                );
                return None;
            }
        },
        None => (inside, None),
    };
    let part = Node { span: node.span, value: NodeValue::Text(expression.to_owned()), written: None };
    let expression = Expression::read(&part, what, calculator, file, problems)?;
    Some(Piece::Value { expression: Box::new(expression), decimals })
}

fn shown(value: &Value, decimals: Option<usize>) -> String {
    match (value, decimals) {
        (Value::Number(number), Some(decimals)) => {
            format!("{:.decimals$}", number.as_f64().unwrap_or(f64::NAN))
        }
        (Value::Number(number), None) if number.is_f64() => {
            let plain = format!("{:.6}", number.as_f64().unwrap_or(f64::NAN));
            plain.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        (Value::String(text), _) => text.clone(),
        (other, _) => other.to_string(),
    }
}
