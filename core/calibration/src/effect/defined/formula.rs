//! One formula: checked once, then worked out for every row.

use std::collections::HashMap;
use std::fmt;
use std::sync::{LazyLock, PoisonError, RwLock};

use rhai::packages::{ArithmeticPackage, BasicMathPackage, LogicPackage, Package};
use rhai::{AST, Engine, OptimizationLevel, Scope};
use thiserror::Error;

use super::variables::Variable;
use crate::suggestion::suggestion;

/// Why a formula cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FormulaError {
    /// Not a formula.
    #[error("`{text}` is no formula: {reason}")]
    Syntax {
        /// The formula.
        text: String,
        /// What is wrong.
        reason: String,
    },
    /// Words of a program.
    #[error(
        "`{word}` has no place in a formula: a formula has no loops and no statements; write sums, products and functions of q1, q2, ..."
    )]
    Program {
        /// The word.
        word: String,
    },
    /// A name nobody knows.
    #[error(
        "the formula speaks of `{name}`, which is neither a parameter nor a quantity of a row{suggestion}"
    )]
    UnknownName {
        /// The name.
        name: String,
        /// What may have been meant.
        suggestion: String,
    },
    /// Not linear in a parameter.
    #[error(
        "`{text}` must grow in proportion to its parameters; for an amplitude and a phase write a*sin(q2) + b*cos(q2)"
    )]
    NotLinear {
        /// The formula.
        text: String,
    },
    /// Nothing in it depends on a parameter.
    #[error("`{text}` depends on none of the parameters; multiply by one, such as a*sin(q2)")]
    NoParameter {
        /// The formula.
        text: String,
    },
}

const FUNCTIONS: [&str; 20] = [
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "sqrt", "exp", "ln", "log", "abs",
    "floor", "ceiling", "round", "sign", "min", "max",
];

const PROGRAM: [&str; 14] = [
    "loop", "while", "for", "do", "until", "fn", "let", "const", "return", "break", "continue", "import",
    "eval", "if",
];

/// How far from zero a formula's quantities are tried, and on which side: a slope may begin at 2 rad, at 300 mm or at -40 N m.
const TRIED: [f64; 12] = [1.0, 1.0, 1.0, 1.0, -1.0, 4.0, -4.0, 30.0, -30.0, 500.0, -500.0, 1e4];

/// Operations one evaluation may take.
const MOST_OPERATIONS: u64 = 10_000;

/// Rows remembered at most.
const REMEMBERED: usize = 200_000;

static ENGINE: LazyLock<Engine> = LazyLock::new(|| {
    let mut engine = Engine::new_raw();
    engine.register_global_module(ArithmeticPackage::new().as_shared_module());
    engine.register_global_module(LogicPackage::new().as_shared_module());
    engine.register_global_module(BasicMathPackage::new().as_shared_module());
    engine.register_fn("sign", |value: f64| if value == 0.0 { 0.0 } else { value.signum() });
    engine.register_fn("min", f64::min);
    engine.register_fn("max", f64::max);
    engine.set_optimization_level(OptimizationLevel::Simple);
    engine.set_max_operations(MOST_OPERATIONS);
    engine.set_max_expr_depths(64, 8);
    engine.set_max_call_levels(4);
    engine
});

/// A formula, linear in its parameters.
pub(crate) struct Formula {
    /// As it was written.
    pub(super) text: String,
    ast: AST,
    parameters: Vec<String>,
    variables: Vec<(String, Variable)>,
    /// Rates by the values of the variables.
    known: RwLock<HashMap<Vec<u64>, Vec<f64>>>,
}

impl fmt::Debug for Formula {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("Formula").field(&self.text).finish()
    }
}

/// Words of a formula, and the formula with whole numbers made decimal and powers written the engine's way.
fn words(text: &str) -> (Vec<String>, String) {
    let letters: Vec<char> = text.chars().collect();
    let (mut words, mut plain, mut index) = (Vec::new(), String::new(), 0);
    let take = |index: &mut usize, accepts: &dyn Fn(usize, char) -> bool| {
        let start = *index;
        while letters.get(*index).is_some_and(|letter| accepts(*index, *letter)) {
            *index += 1;
        }
        letters.get(start..*index).map(|part| part.iter().collect::<String>()).unwrap_or_default()
    };
    while let Some(letter) = letters.get(index) {
        if letter.is_alphabetic() || *letter == '_' {
            let word = take(&mut index, &|_, letter| letter.is_alphanumeric() || letter == '_');
            plain.push_str(if word == "pi" { "3.141592653589793" } else { &word });
            words.push(word);
        } else if letter.is_ascii_digit() || *letter == '.' {
            let exponent = |index: usize| {
                matches!(index.checked_sub(1).and_then(|before| letters.get(before)), Some('e' | 'E'))
            };
            let number = take(&mut index, &|index, letter| {
                letter.is_ascii_digit()
                    || ".eE".contains(letter)
                    || ("+-".contains(letter) && exponent(index))
            });
            match number.parse::<f64>() {
                Ok(value) if value.is_finite() => plain.push_str(&format!("{value:?}")),
                _ => plain.push_str(&number),
            }
        } else {
            match letter {
                '^' => plain.push_str("**"),
                // -x^2 is minus the square of x; the engine takes the sign first.
                '-' if begins_a_term(&plain) => plain.push_str("-1.0*"),
                other => plain.push(*other),
            }
            index += 1;
        }
    }
    (words, plain)
}

/// Whether a minus that follows is the sign of a term, not a difference and not the sign of an exponent.
fn begins_a_term(before: &str) -> bool {
    let before = before.trim_end();
    !before.ends_with("**") && before.chars().last().is_none_or(|last| "(,+-*/".contains(last))
}

impl Formula {
    /// Reads a formula for an arm of so many joints.
    ///
    /// # Errors
    /// See [`FormulaError`].
    pub(super) fn read(text: &str, parameters: &[String], joints: usize) -> Result<Self, FormulaError> {
        let (words, plain) = words(text);
        let mut variables: Vec<(String, Variable)> = Vec::new();
        for word in words {
            if PROGRAM.contains(&word.as_str()) {
                return Err(FormulaError::Program { word });
            }
            if parameters.contains(&word) || FUNCTIONS.contains(&word.as_str()) || word == "pi" {
                continue;
            }
            let Some(variable) = Variable::named(&word, joints) else {
                let names = Variable::names(joints);
                let known = parameters.iter().chain(&names).map(String::as_str).chain(FUNCTIONS);
                return Err(FormulaError::UnknownName { suggestion: suggestion(&word, known), name: word });
            };
            if variables.iter().all(|(known, _)| *known != word) {
                variables.push((word, variable));
            }
        }
        let syntax = |reason: String| FormulaError::Syntax { text: text.to_owned(), reason };
        if let Some(odd) = text.chars().find(|letter| "{}[];:=\"'`".contains(*letter)) {
            return Err(syntax(format!("`{odd}` has no place in it")));
        }
        let ast = ENGINE
            .compile_expression(&plain)
            .map_err(|error| syntax(plain_words(&error.err_type().to_string())))?;
        let formula = Self {
            text: text.to_owned(),
            ast,
            parameters: parameters.to_vec(),
            variables,
            known: RwLock::default(),
        };
        formula.check_linear()?;
        Ok(formula)
    }

    /// What it speaks of.
    pub(super) fn variables(&self) -> impl Iterator<Item = Variable> {
        self.variables.iter().map(|(_, variable)| *variable)
    }

    fn evaluate(&self, variables: &[f64], parameters: &[f64]) -> Result<f64, String> {
        let mut scope = Scope::new();
        for ((name, _), value) in self.variables.iter().zip(variables) {
            scope.push(name.as_str(), *value);
        }
        for (name, value) in self.parameters.iter().zip(parameters) {
            scope.push(name.as_str(), *value);
        }
        ENGINE
            .eval_ast_with_scope::<f64>(&mut scope, &self.ast)
            .map_err(|error| plain_words(&error.to_string()))
    }

    fn check_linear(&self) -> Result<(), FormulaError> {
        let syntax = |reason: String| FormulaError::Syntax { text: self.text.clone(), reason };
        let (mut depends, mut worked_out) = (false, false);
        for (round, reach) in TRIED.into_iter().enumerate() {
            let at = |index: usize| 0.13 + 0.71 * ((index * 7 + (round + 1) * 3) % 10) as f64 / 10.0;
            let reached = |index: usize| reach * at(index);
            let variables: Vec<f64> = (0..self.variables.len()).map(reached).collect();
            let some: Vec<f64> = (0..self.parameters.len()).map(|index| 0.5 + at(index + 4)).collect();
            let none = vec![0.0; self.parameters.len()];
            let double: Vec<f64> = some.iter().map(|value| 2.0 * value).collect();
            // abs(a) doubles with a, and only its other sign shows that it is not in proportion.
            let opposite: Vec<f64> = some.iter().map(|value| -value).collect();
            let rates = self.rates(&variables).map_err(syntax)?;
            let value = |parameters: &[f64]| self.evaluate(&variables, parameters).map_err(syntax);
            let (zero, once, twice) = (value(&none)?, value(&some)?, value(&double)?);
            let against = value(&opposite)?;
            let sum: f64 = rates.iter().zip(&some).map(|(rate, value)| rate * value).sum();
            if ![zero, once, twice, against, sum].iter().all(|value| value.is_finite()) {
                continue;
            }
            let terms: f64 = rates.iter().zip(&some).map(|(rate, value)| (rate * value).abs()).sum();
            let slack = 1e-9 * (once.abs() + twice.abs() + terms + 1e-12);
            let off = [zero, twice - 2.0 * once, against + once, sum - once];
            if off.iter().any(|off| off.abs() > slack) {
                return Err(FormulaError::NotLinear { text: self.text.clone() });
            }
            worked_out = true;
            depends |= once != 0.0;
        }
        if depends || !worked_out {
            Ok(())
        } else {
            Err(FormulaError::NoParameter { text: self.text.clone() })
        }
    }

    /// What the formula grows by per unit of each parameter.
    pub(super) fn rates(&self, variables: &[f64]) -> Result<Vec<f64>, String> {
        (0..self.parameters.len())
            .map(|index| {
                let unit: Vec<f64> =
                    (0..self.parameters.len()).map(|other| f64::from(u8::from(other == index))).collect();
                self.evaluate(variables, &unit)
            })
            .collect()
    }

    /// The same, remembered from row to row and from round to round.
    pub(super) fn remembered(&self, variables: &[f64]) -> Vec<f64> {
        let key: Vec<u64> = variables.iter().map(|value| value.to_bits()).collect();
        if let Some(known) = self.known.read().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let fresh = self.rates(variables).unwrap_or_default();
        let mut known = self.known.write().unwrap_or_else(PoisonError::into_inner);
        if known.len() < REMEMBERED {
            known.insert(key, fresh.clone());
        }
        fresh
    }

    /// Values of its variables as words, for messages.
    pub(super) fn format_values(&self, variables: &[f64]) -> String {
        let parts: Vec<String> = self
            .variables
            .iter()
            .zip(variables)
            .map(|((name, _), value)| format!("{name} = {value:.4}"))
            .collect();
        parts.join(", ")
    }
}

/// The engine's words without the place it counts in its own way.
fn plain_words(message: &str) -> String {
    let first = message.lines().next().unwrap_or(message);
    first.split(" (line ").next().unwrap_or(first).trim_end_matches('.').to_owned()
}
