//! Works expressions out, within limits.

use rhai::{AST, Dynamic, Engine, EvalAltResult, FLOAT, INT, OptimizationLevel, Scope};
use serde_json::{Map, Value};

use super::tokens::{TokenKind, tokens};
use plumb_document::did_you_mean;

/// One step of arithmetic is about one operation; a fixed point of a recursion takes some thousands.
const MOST_OPERATIONS: u64 = 500_000;

/// Entries that all turns of a `repeat` may have: some tens a turn, for the longest that procedures here allow.
const MOST_ENTRIES: usize = 1_000_000;

/// Why an expression gave no usable value.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{expression}`: {cause}")]
pub struct ExpressionError {
    /// The expression, its first line where it has several.
    pub expression: String,
    /// What went wrong, and with which name.
    pub cause: String,
}

/// Works expressions out. One serves any number of threads.
pub struct Calculator {
    engine: Engine,
}

impl Default for Calculator {
    fn default() -> Self {
        Self::new()
    }
}

impl Calculator {
    /// A calculator with the limits and functions every file may count on.
    pub fn new() -> Self {
        let mut engine = Engine::new();
        engine.set_optimization_level(OptimizationLevel::None);
        engine.set_fast_operators(false);
        engine.set_fail_on_invalid_map_property(true);
        engine.set_max_operations(MOST_OPERATIONS);
        engine.set_max_expr_depths(48, 24);
        engine.set_max_call_levels(16);
        engine.set_max_modules(0);
        engine.set_max_string_size(10_000);
        // What all turns of a long `repeat` have found is counted together, entry by entry.
        engine.set_max_array_size(MOST_ENTRIES);
        engine.set_max_map_size(MOST_ENTRIES);
        engine.disable_symbol("eval");
        engine.on_print(|_| {});
        engine.on_debug(|_, _, _| {});
        add_functions(&mut engine);
        Self { engine }
    }

    pub(crate) fn compile_expression(&self, text: &str) -> Result<AST, rhai::ParseError> {
        self.engine.compile_expression(text)
    }

    pub(crate) fn compile_script(&self, text: &str) -> Result<AST, rhai::ParseError> {
        self.engine.compile(text)
    }

    pub(crate) fn evaluate(
        &self,
        ast: &AST,
        text: &str,
        values: &Map<String, Value>,
    ) -> Result<Value, ExpressionError> {
        let mut scope = scope_of(values);
        self.evaluate_in(ast, text, &mut scope)
    }

    pub(crate) fn evaluate_in(
        &self,
        ast: &AST,
        text: &str,
        scope: &mut Scope<'static>,
    ) -> Result<Value, ExpressionError> {
        let result = self
            .engine
            .eval_ast_with_scope::<Dynamic>(scope, ast)
            .map_err(|error| failed(text, &error, scope))?;
        from_dynamic(&result).map_err(|cause| ExpressionError { expression: first_line(text), cause })
    }

    pub(crate) fn run_in(
        &self,
        ast: &AST,
        text: &str,
        scope: &mut Scope<'static>,
    ) -> Result<(), ExpressionError> {
        self.engine.run_ast_with_scope(scope, ast).map_err(|error| failed(text, &error, scope))
    }
}

pub(crate) fn scope_of(values: &Map<String, Value>) -> Scope<'static> {
    let mut scope = Scope::new();
    for (name, value) in values {
        scope.push_dynamic(name.clone(), to_dynamic(value));
    }
    scope
}

/// Names every expression may call; with rhai's own, see [`super::names`].
pub(crate) const FUNCTIONS: &[&str] = &[
    "sin_deg",
    "cos_deg",
    "tan_deg",
    "asin_deg",
    "acos_deg",
    "atan_deg",
    "atan2_deg",
    "to_deg",
    "to_rad",
    "mean",
    "spread",
    "sum",
    "min",
    "max",
];

fn add_functions(engine: &mut Engine) {
    engine.register_fn("/", |a: INT, b: INT| a as FLOAT / b as FLOAT);
    engine.register_fn("**", |a: INT, b: INT| (a as FLOAT).powf(b as FLOAT));
    engine.register_fn("to_deg", FLOAT::to_degrees);
    engine.register_fn("to_rad", FLOAT::to_radians);
    type OneNumber = fn(FLOAT) -> FLOAT;
    let of_one: [(&str, OneNumber); 8] = [
        ("sin_deg", |x| x.to_radians().sin()),
        ("cos_deg", |x| x.to_radians().cos()),
        ("tan_deg", |x| x.to_radians().tan()),
        ("asin_deg", |x| x.asin().to_degrees()),
        ("acos_deg", |x| x.acos().to_degrees()),
        ("atan_deg", |x| x.atan().to_degrees()),
        ("to_deg", FLOAT::to_degrees),
        ("to_rad", FLOAT::to_radians),
    ];
    for (name, function) in of_one {
        engine.register_fn(name, function);
        engine.register_fn(name, move |x: INT| function(x as FLOAT));
    }
    for name in ["sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "ln"] {
        let function: OneNumber = match name {
            "sin" => FLOAT::sin,
            "cos" => FLOAT::cos,
            "tan" => FLOAT::tan,
            "asin" => FLOAT::asin,
            "acos" => FLOAT::acos,
            "atan" => FLOAT::atan,
            "sqrt" => FLOAT::sqrt,
            "exp" => FLOAT::exp,
            _ => FLOAT::ln,
        };
        engine.register_fn(name, move |x: INT| function(x as FLOAT));
    }
    engine.register_fn("atan2_deg", |y: Dynamic, x: Dynamic| -> Result<FLOAT, Box<EvalAltResult>> {
        Ok(number(&y)?.atan2(number(&x)?).to_degrees())
    });
    engine.register_fn("sum", |list: rhai::Array| -> Result<FLOAT, Box<EvalAltResult>> {
        Ok(numbers(&list)?.iter().sum())
    });
    engine.register_fn("mean", |list: rhai::Array| -> Result<FLOAT, Box<EvalAltResult>> {
        mean(&numbers(&list)?)
    });
    engine.register_fn("spread", |list: rhai::Array| -> Result<FLOAT, Box<EvalAltResult>> {
        spread(&numbers(&list)?)
    });
}

fn number(value: &Dynamic) -> Result<FLOAT, Box<EvalAltResult>> {
    value
        .as_float()
        .or_else(|_| value.as_int().map(|whole| whole as FLOAT))
        .map_err(|kind| format!("a number is needed here, not {kind}").into())
}

fn numbers(list: &rhai::Array) -> Result<Vec<FLOAT>, Box<EvalAltResult>> {
    list.iter().map(number).collect()
}

fn mean(numbers: &[FLOAT]) -> Result<FLOAT, Box<EvalAltResult>> {
    if numbers.is_empty() {
        return Err("the mean of an empty list".into());
    }
    Ok(numbers.iter().sum::<FLOAT>() / numbers.len() as FLOAT)
}

/// Standard deviation with n - 1.
fn spread(numbers: &[FLOAT]) -> Result<FLOAT, Box<EvalAltResult>> {
    if numbers.len() < 2 {
        return Err("the spread of fewer than two numbers".into());
    }
    let middle = mean(numbers)?;
    let squares: FLOAT = numbers.iter().map(|x| (x - middle).powi(2)).sum();
    Ok((squares / (numbers.len() - 1) as FLOAT).sqrt())
}

fn failed(text: &str, error: &EvalAltResult, scope: &Scope<'static>) -> ExpressionError {
    let cause = match error {
        EvalAltResult::ErrorTooManyOperations(_) => {
            format!("it takes more than {MOST_OPERATIONS} operations")
        }
        EvalAltResult::ErrorPropertyNotFound(name, _) => match names_beside(text, name, scope) {
            Some((path, known)) if !known.is_empty() => {
                format!(
                    "there is no value `{name}` in `{path}`: {}",
                    did_you_mean(name, known.iter().map(String::as_str))
                )
            }
            _ => format!(
                "there is no value `{name}` (yet): the step that makes it was left out or has not run"
            ),
        },
        EvalAltResult::ErrorVariableNotFound(name, _) => format!("there is no value `{name}` (yet)"),
        EvalAltResult::ErrorFunctionNotFound(name, _) => {
            format!("`{name}` cannot be worked out for these values")
        }
        other => {
            let mut plain = other.to_string();
            if let Some(offset) = plain.rfind(" (line ") {
                plain.truncate(offset);
            }
            plain
        }
    };
    ExpressionError { expression: first_line(text), cause }
}

/// The value in which an expression looks for a property that is not there, and the names it has.
fn names_beside(text: &str, property: &str, scope: &Scope<'static>) -> Option<(String, Vec<String>)> {
    let tokens = tokens(text);
    let kind = |index: usize| tokens.get(index).map(|token| token.kind);
    (2..tokens.len()).find_map(|index| {
        if kind(index) != Some(TokenKind::Name(property)) || kind(index - 1) != Some(TokenKind::Mark('.')) {
            return None;
        }
        let mut path = Vec::new();
        let mut name_index = index;
        while let (Some(TokenKind::Name(name)), Some(TokenKind::Mark('.'))) =
            (name_index.checked_sub(2).and_then(kind), kind(name_index.checked_sub(1)?))
        {
            path.insert(0, name);
            name_index -= 2;
        }
        let (first, rest) = path.split_first()?;
        let mut value = scope.get_value::<Dynamic>(first)?;
        for name in rest {
            value = value.try_cast::<rhai::Map>()?.get(*name)?.clone();
        }
        let known = value.try_cast::<rhai::Map>()?;
        (!known.contains_key(property))
            .then(|| (path.join("."), known.keys().map(ToString::to_string).collect()))
    })
}

pub(crate) fn first_line(text: &str) -> String {
    let mut lines = text.trim().lines();
    let first = lines.next().unwrap_or_default().to_owned();
    if lines.next().is_some() { format!("{first} ...") } else { first }
}

pub(crate) fn to_dynamic(value: &Value) -> Dynamic {
    match value {
        Value::Null => Dynamic::UNIT,
        Value::Bool(value) => (*value).into(),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => Dynamic::from_int(whole),
            None => Dynamic::from_float(number.as_f64().unwrap_or(FLOAT::NAN)),
        },
        Value::String(text) => text.clone().into(),
        Value::Array(items) => Dynamic::from_array(items.iter().map(to_dynamic).collect()),
        Value::Object(map) => Dynamic::from_map(
            map.iter().map(|(name, value)| (name.as_str().into(), to_dynamic(value))).collect(),
        ),
    }
}

fn from_dynamic(value: &Dynamic) -> Result<Value, String> {
    if value.is_unit() {
        return Ok(Value::Null);
    }
    if let Ok(value) = value.as_bool() {
        return Ok(value.into());
    }
    if let Ok(whole) = value.as_int() {
        return Ok(whole.into());
    }
    if let Ok(number) = value.as_float() {
        return match serde_json::Number::from_f64(number) {
            Some(number) => Ok(Value::Number(number)),
            None => Err("the result is not a finite number (a root or arc of something out of range, or a division by zero)".to_owned()),
        };
    }
    if let Ok(text) = value.clone().into_string() {
        return Ok(text.into());
    }
    if let Some(list) = value.read_lock::<rhai::Array>() {
        return list.iter().map(from_dynamic).collect();
    }
    if let Some(map) = value.read_lock::<rhai::Map>() {
        let entries: Result<Map<String, Value>, String> =
            map.iter().map(|(name, value)| Ok((name.to_string(), from_dynamic(value)?))).collect();
        return Ok(Value::Object(entries?));
    }
    Err(format!("the result is of a kind that cannot be kept ({})", value.type_name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluate(text: &str) -> Result<Value, String> {
        let calculator = Calculator::new();
        let values = serde_json::json!({"K_mm": 140, "x": 0.25, "lower": {"joints": {"elbow_deg": -70.5}}, "empty": {}});
        let Value::Object(values) = values else { return Err("no map".to_owned()) };
        let ast = calculator.compile_expression(text).map_err(|error| error.to_string())?;
        calculator.evaluate(&ast, text, &values).map_err(|error| error.to_string())
    }

    #[test]
    fn whole_numbers_divide_as_numbers_do() {
        assert_eq!(evaluate("1/2"), Ok(0.5.into()));
        assert_eq!(evaluate("K_mm / 3 > 46"), Ok(true.into()));
        assert_eq!(evaluate("2 ** -1"), Ok(0.5.into()));
        assert_eq!(evaluate("K_mm * 2 + x"), Ok(280.25.into()));
        assert_eq!(evaluate("-lower.joints.elbow_deg - 1"), Ok(69.5.into()));
        assert_eq!(evaluate("sqrt(4) + acos_deg(0.5) + mean([1, 2.0, 3])"), Ok(64.0.into()));
        assert_eq!(evaluate("min(1, 2.5) + max(1, 2.5) + abs(-3)"), Ok(6.5.into()));
    }

    #[test]
    fn what_a_thousand_turns_have_found_can_be_gone_through() {
        let calculator = Calculator::new();
        let turn =
            serde_json::json!({"joints": {"waist_deg": 1, "shoulder_deg": 2, "elbow_deg": 3}, "found": true});
        let Value::Object(values) = serde_json::json!({"all": {"met": vec![turn; 1000]}}) else { return };
        let text = "let sum = 0; for one in all.met + all.met { sum += one.joints.elbow_deg; } sum";
        let ast = calculator.compile_script(text).expect("it is a script");
        assert_eq!(calculator.evaluate(&ast, text, &values).expect("within the limits"), 6000);
    }

    #[test]
    fn what_has_no_finite_value_is_an_error() {
        assert!(evaluate("acos_deg(2)").expect_err("out of range").contains("not a finite number"));
        assert!(evaluate("1/0").expect_err("division by zero").contains("not a finite number"));
    }

    #[test]
    fn a_value_that_is_not_there_is_named() {
        let error = evaluate("empty.joints").expect_err("nothing there");
        assert!(error.contains("there is no value `joints`"), "{error}");
        let misspelled = evaluate("1 + lower.joints.elbow").unwrap_err();
        assert!(
            misspelled.contains("there is no value `elbow` in `lower.joints`: did you mean `elbow_deg`?"),
            "{misspelled}"
        );
        let missing = evaluate("2 * lower.temperature").unwrap_err();
        assert!(missing.contains("no value `temperature` in `lower`: there is only `joints`"), "{missing}");
    }

    #[test]
    fn endless_deep_and_huge_expressions_end_with_a_message() {
        let calculator = Calculator::new();
        let ast = calculator.compile_script("loop { }").expect("a loop");
        let error = calculator.run_in(&ast, "loop { }", &mut Scope::new()).expect_err("endless").to_string();
        assert!(error.contains("more than 500000 operations"), "{error}");
        let deep = format!("{}1{}", "(".repeat(5000), ")".repeat(5000));
        assert!(calculator.compile_expression(&deep).is_err());
        let huge = "let s = \"x\"; loop { s += s; }";
        let ast = calculator.compile_script(huge).expect("a loop");
        assert!(calculator.run_in(&ast, huge, &mut Scope::new()).is_err());
    }
}
