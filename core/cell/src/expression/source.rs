//! Expressions as they are in files.

use rhai::AST;
use serde_json::{Map, Value};

use super::calculator::{Calculator, ExpressionError, first_line, scope_of};
use super::names::Names;
use plumb_document::{Node, NodeValue, Problem, Problems, Span};

/// An expression out of a file.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    span: Span,
    ast: AST,
}

impl Expression {
    /// Reads an expression from a text, number or truth value of a file. `text` is the whole file, to find positions in it.
    pub fn read(
        node: &Node,
        what: &str,
        calculator: &Calculator,
        file: &str,
        problems: &Problems,
    ) -> Option<Self> {
        let text = match &node.value {
            NodeValue::Text(text) => text.clone(),
            NodeValue::Number(number) if number.is_finite() => number.to_string(),
            NodeValue::Bool(value) => value.to_string(),
            other => {
                let message = format!("{what} is a number or an expression; this is {}", other.kind());
                problems.add(node.span, message, "");
                return None;
            }
        };
        match calculator.compile_expression(&text) {
            Ok(ast) => Some(Self { text, span: node.span, ast }),
            Err(error) => {
                problems.push(syntax_problem(&error, &text, node.span, file));
                None
            }
        }
    }

    /// The text as it is in the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Where it is.
    pub fn span(&self) -> Span {
        self.span
    }

    /// The dotted paths it follows from a name: `tolerances.target_mm` of `2 * tolerances.target_mm`. Each once.
    pub(crate) fn paths_below(&self, name: &str) -> Vec<String> {
        super::tokens::paths_below(&super::tokens::tokens(&self.text), name)
    }

    /// Reports the names it uses that are not there.
    pub fn check_names(&self, names: &Names, file: &str, problems: &Problems) {
        report_unknown(&self.text, self.span, names, file, problems);
    }

    /// Works it out.
    ///
    /// # Errors
    /// When it cannot be worked out, or the result is not finite.
    pub fn value(
        &self,
        calculator: &Calculator,
        values: &Map<String, Value>,
    ) -> Result<Value, ExpressionError> {
        calculator.evaluate(&self.ast, &self.text, values)
    }

    /// Works out a number.
    ///
    /// # Errors
    /// When it cannot be worked out, or is no finite number.
    pub fn number(
        &self,
        calculator: &Calculator,
        values: &Map<String, Value>,
    ) -> Result<f64, ExpressionError> {
        let value = self.value(calculator, values)?;
        value.as_f64().ok_or_else(|| self.is_no("number", &value))
    }

    /// Works out whether it holds.
    ///
    /// # Errors
    /// When it cannot be worked out, or is neither true nor false.
    pub fn truth(
        &self,
        calculator: &Calculator,
        values: &Map<String, Value>,
    ) -> Result<bool, ExpressionError> {
        let value = self.value(calculator, values)?;
        value.as_bool().ok_or_else(|| self.is_no("condition that is true or false", &value))
    }

    fn is_no(&self, requested: &str, value: &Value) -> ExpressionError {
        ExpressionError {
            expression: first_line(&self.text),
            cause: format!("the result {value} is no {requested}"),
        }
    }
}

/// A position in a file for a number, written as a number or as an expression.
pub type NumberExpression = Expression;

/// A piece of program out of a file: statements, bounded in operations, that leave named values behind.
#[derive(Debug, Clone)]
pub struct Script {
    text: String,
    span: Span,
    ast: AST,
}

impl Script {
    /// Reads a script from a text of a file.
    pub fn read(node: &Node, calculator: &Calculator, file: &str, problems: &Problems) -> Option<Self> {
        let text = node.text("a script", problems)?.to_owned();
        match calculator.compile_script(&text) {
            Ok(ast) => Some(Self { text, span: node.span, ast }),
            Err(error) => {
                problems.push(syntax_problem(&error, &text, node.span, file));
                None
            }
        }
    }

    /// The variables it leaves behind.
    pub fn variables(&self) -> Vec<&str> {
        super::names::local_names(&super::tokens::tokens(&self.text))
    }

    /// Reports the names it uses that are not there.
    pub fn check_names(&self, names: &Names, file: &str, problems: &Problems) {
        report_unknown(&self.text, self.span, names, file, problems);
    }

    /// The script's text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Runs the script, then works out `expressions` with the values it left behind, in order; each finds the ones before it by name.
    ///
    /// # Errors
    /// When the script or an expression fails.
    pub fn values<'e>(
        script: Option<&Self>,
        expressions: impl Iterator<Item = (&'e str, &'e Expression)>,
        calculator: &Calculator,
        values: &Map<String, Value>,
    ) -> Result<Map<String, Value>, ExpressionError> {
        let mut scope = scope_of(values);
        if let Some(script) = script {
            calculator.run_in(&script.ast, &script.text, &mut scope)?;
        }
        let mut results = Map::new();
        for (name, expression) in expressions {
            let value = calculator.evaluate_in(&expression.ast, &expression.text, &mut scope)?;
            scope.push_dynamic(name.to_owned(), super::calculator::to_dynamic(&value));
            results.insert(name.to_owned(), value);
        }
        Ok(results)
    }
}

fn report_unknown(text: &str, span: Span, names: &Names, file: &str, problems: &Problems) {
    for unknown in names.unknown_in(text) {
        let line = text.get(..unknown.offset).map_or(0, |before| before.matches('\n').count());
        let start = text.get(..unknown.offset).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
        let column = text.get(start..unknown.offset).map_or(0, |before| before.chars().count());
        let span = span_inside(text, span, line, column, unknown.length, file);
        problems.add(span, unknown.message, unknown.help);
    }
}

fn syntax_problem(error: &rhai::ParseError, text: &str, span: Span, file: &str) -> Problem {
    let position = error.position();
    let last_line = text.lines().count().saturating_sub(1);
    let after_last = text.lines().last().map_or(0, |line| line.chars().count());
    let (line, column) = match (position.line(), position.position()) {
        (Some(line), Some(column)) if line <= last_line + 1 => {
            (line.saturating_sub(1), column.saturating_sub(1))
        }
        _ => (last_line, after_last),
    };
    let span = span_inside(text, span, line, column, 1, file);
    let reason = error.err_type().to_string();
    Problem { span: Some(span), message: format!("this expression cannot be read: {reason}"), help: None }
}

/// Where `line` and `column` (from 0) of an expression are in the file. The expression may be plain, quoted, or a block of lines; where it
/// cannot be found the beginning is shown.
fn span_inside(text: &str, span: Span, line: usize, column: usize, length: usize, file: &str) -> Span {
    let Some(requested) = text.lines().nth(line) else { return span };
    for (index, candidate) in
        file.lines().enumerate().skip(span.line.saturating_sub(1)).take(text.lines().count() + 2)
    {
        let from = if index + 1 == span.line { span.column.saturating_sub(1) } else { 0 };
        let from_byte = candidate.char_indices().nth(from).map_or(candidate.len(), |(byte, _)| byte);
        let rest = candidate.get(from_byte..).unwrap_or_default();
        if !requested.trim().is_empty()
            && let Some(found) = rest.find(requested)
        {
            let before = rest.get(..found).map_or(0, |skipped| skipped.chars().count());
            return Span { line: index + 1, column: from + before + column + 1, length };
        }
    }
    span
}
