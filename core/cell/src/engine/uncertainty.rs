//! Uncertainties by the GUM (JCGM 100:2008): how large the declared errors may be, and what each of them does to what was computed.

use plumb_record::{Budget, Component};
use serde_json::{Map, Value};

use super::Engine;
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::expression::{Expression, ExpressionError};
use crate::step::{ErrorTerm, INSTRUMENTS, TOLERANCES};
use crate::workcell::Workcell;

/// The step of a derivative by an error whose size was not determined, in the unit of the error.
const STEP_WHERE_UNKNOWN: f64 = 1e-3;

/// An error with its size worked out.
struct Sized<'a> {
    term: &'a ErrorTerm,
    /// One standard uncertainty; none where the cell file does not say what it is made of.
    standard: Option<f64>,
    source: String,
}

/// What some equations give, and what the uncertainties of the results are made of.
pub(crate) struct Evaluated {
    /// The results with every error at its best estimate, 0.
    pub(crate) results: Map<String, Value>,
    /// A budget for each result that is a number, in the order of the results.
    pub(crate) budgets: Vec<(String, Budget)>,
}

impl Engine {
    /// Works equations out, with every error at 0, and their sensitivities: each error in turn is shifted by its standard uncertainty either
    /// way, and half the difference is its contribution (GUM 5.1.3, note 2).
    pub(crate) fn evaluate_with_errors(
        &mut self,
        errors: &[ErrorTerm],
        equations: &[&str],
        at: &StepContext,
        evaluate: impl Fn(&Self, &Map<String, Value>) -> Result<Map<String, Value>, ExpressionError>,
    ) -> Result<Evaluated, StepError> {
        let texts: Vec<&str> =
            equations.iter().copied().chain(errors.iter().map(|one| one.size.expression().text())).collect();
        let mut values = self.values(at.scope, &texts)?;
        let sized = self.sized(errors, &values)?;
        for one in errors {
            values.insert(one.name.clone(), 0.0.into());
        }
        let results = evaluate(self, &values)?;
        let mut budgets: Vec<(String, Budget)> = results
            .iter()
            .filter(|(_, value)| value.is_number() && !errors.is_empty())
            .map(|(name, _)| (name.clone(), Budget::default()))
            .collect();
        for one in &sized {
            let step = one.standard.filter(|size| *size > 0.0).unwrap_or(STEP_WHERE_UNKNOWN);
            let shifted = |by: f64| {
                let mut values = values.clone();
                values.insert(one.term.name.clone(), by.into());
                evaluate(self, &values).map_err(|cause| {
                    StepError::error(format!(
                        "the uncertainty by `{}` ({step:.3} {}) cannot be worked out: {cause}",
                        one.term.name,
                        one.term.unit()
                    ))
                })
            };
            let (above, below) = (shifted(step)?, shifted(-step)?);
            for (name, budget) in &mut budgets {
                let number = |results: &Map<String, Value>| results.get(name).and_then(Value::as_f64);
                let (Some(above), Some(below)) = (number(&above), number(&below)) else { continue };
                budget.components.push(component(one, (above - below) / (2.0 * step)));
            }
        }
        Ok(Evaluated { results, budgets })
    }

    /// The budget that a procedure states by an expression: a number is a component of its own, a budget comes from a `compute` step; what is
    /// neither was not determined.
    pub(crate) fn stated(
        &mut self,
        uncertainty: &Expression,
        unit: &str,
        at: &StepContext,
    ) -> Result<Option<Budget>, StepError> {
        let values = self.values(at.scope, &[uncertainty.text()])?;
        let value = uncertainty.value(&self.calculator, &values)?;
        Ok(stated_budget(&value, unit))
    }

    fn sized<'a>(
        &self,
        errors: &'a [ErrorTerm],
        values: &Map<String, Value>,
    ) -> Result<Vec<Sized<'a>>, StepError> {
        let mut values = values.clone();
        let (tolerances, instruments) = parts_of(&self.cell);
        values.insert(TOLERANCES.to_owned(), Value::Object(tolerances));
        values.insert(INSTRUMENTS.to_owned(), Value::Object(instruments));
        errors.iter().map(|term| self.size_of(term, &values)).collect()
    }

    fn size_of<'a>(&self, term: &'a ErrorTerm, values: &Map<String, Value>) -> Result<Sized<'a>, StepError> {
        let expression = term.size.expression();
        let named = parts_named(expression);
        let missing: Vec<&String> = named.iter().filter(|path| !is_there(path, values)).collect();
        if let Some(path) = missing.first() {
            let source = format!("the cell file gives no `{path}`");
            return Ok(Sized { term, standard: None, source });
        }
        let size = expression.number(&self.calculator, values)?;
        let source = match named.is_empty() {
            true => "this run".to_owned(),
            false => format!("cell file: {}", named.join(", ")),
        };
        Ok(Sized { term, standard: Some(term.size.standard(size)), source })
    }
}

fn component(one: &Sized<'_>, sensitivity: f64) -> Component {
    Component {
        name: one.term.about.clone(),
        source: one.source.clone(),
        standard: one.standard,
        unit: one.term.unit().to_owned(),
        sensitivity,
    }
}

/// What the cell file says of its parts, as sizes of errors see it: `tolerances.target_mm`, `instruments.level.uncertainty_deg`.
fn parts_of(cell: &Workcell) -> (Map<String, Value>, Map<String, Value>) {
    let tolerances = cell.tolerances.iter().map(|(name, value)| (name.clone(), Value::from(*value)));
    let instruments = cell.instruments.iter().filter_map(|one| {
        let key = format!("uncertainty_{}", one.unit.as_deref()?);
        Some((one.name.clone(), Value::Object(Map::from_iter([(key, one.uncertainty?.into())]))))
    });
    (tolerances.collect(), instruments.collect())
}

/// The parts of the cell that an expression names, as dotted paths.
fn parts_named(expression: &Expression) -> Vec<String> {
    let mut paths = expression.paths_below(TOLERANCES);
    paths.extend(expression.paths_below(INSTRUMENTS));
    paths
}

fn is_there(path: &str, values: &Map<String, Value>) -> bool {
    let mut parts = path.split('.');
    let first = parts.next().and_then(|name| values.get(name));
    parts.fold(first, |value, name| value.and_then(|value| value.get(name))).is_some()
}

fn stated_budget(value: &Value, unit: &str) -> Option<Budget> {
    if let Some(number) = value.as_f64() {
        return Some(Budget::of_one("as the procedure states it", "the procedure", Some(number.abs()), unit));
    }
    serde_json::from_value(value.clone()).ok()
}
