//! A procedure unrolled into the steps of one run, known before it starts.

use std::sync::Arc;

use serde_json::{Map, Value};

use super::scope::{Scope, ScopeId, steps_listed};
use crate::event::StepPath;
use crate::expression::{Calculator, Expression, ExpressionError};
use crate::procedure::{MOST_ENTRIES, Procedure};
use crate::step::{Inside, Step, Turns};

/// Why a procedure cannot be unrolled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A count or parameter cannot be worked out.
    #[error("step `{step}`: {cause}")]
    Expression {
        /// The step.
        step: String,
        /// What is wrong.
        cause: ExpressionError,
    },
    /// A count is no count.
    #[error("step `{step}` is to be repeated {times} times; it takes a whole number from 1 to 10000")]
    Times {
        /// The step.
        step: String,
        /// The count.
        times: f64,
    },
    /// A parameter of a called procedure is out of its range.
    #[error("step `{step}`: {reason}")]
    Parameter {
        /// The step.
        step: String,
        /// What it may have.
        reason: String,
    },
    /// Too much.
    #[error("the procedure unrolls to more than {MOST_ENTRIES} steps")]
    TooLong,
}

/// A whole run, unrolled.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    pub(crate) entries: Vec<Entry>,
    /// The scopes as they are at the beginning.
    pub(crate) scopes: Vec<Scope>,
}

/// One row.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Its index in the plan.
    pub(crate) index: usize,
    pub(crate) path: StepPath,
    /// As answers name it: without turns, with the ids of calls before it.
    pub(crate) answer_name: String,
    pub(crate) depth: u32,
    pub(crate) scope: ScopeId,
    pub(crate) step: Arc<Step>,
    pub(crate) work: Work,
}

/// What a row does.
#[derive(Debug, Clone)]
pub(crate) enum Work {
    /// A step that is carried out.
    Leaf,
    /// A repetition or call begins; it ends at this entry.
    Begin { end: usize },
    /// A turn of a repetition begins.
    Turn { turn: u32, turns: u32 },
    /// A turn ends: the repetition may be over, then on to its end.
    TurnEnd { end: usize },
    /// A repetition or call is over; with the scope of what was called.
    End { called: Option<ScopeId>, turns: u32 },
}

impl Entry {
    /// Rows that people see and the record keeps.
    pub(crate) fn is_shown(&self) -> bool {
        matches!(self.work, Work::Leaf | Work::Begin { .. })
    }

    /// What a turn's steps may name of it: the turn, and the row of the table it is done for.
    pub(crate) fn state_of_turn(&self, turn: u32, turns: u32) -> Value {
        let mut state = Map::new();
        state.insert("turn".to_owned(), Value::from(turn));
        state.insert("turns".to_owned(), Value::from(turns));
        if let Inside::Repeated { turns: Turns::Over(table), .. } = self.step.action.inside()
            && let Some(row) = table.rows.get((turn as usize).saturating_sub(1))
        {
            let named = table.columns.iter().zip(row);
            state.extend(named.map(|(column, value)| (column.clone(), number_value(*value))));
        }
        Value::Object(state)
    }
}

/// Unrolls a procedure with its parameters. `models` are the robots' model quantities: `{"arm": {"model": ...}}`.
pub(crate) fn make_plan(
    procedure: &Arc<Procedure>,
    parameters: Map<String, Value>,
    models: &Map<String, Value>,
    calculator: &Calculator,
) -> Result<Plan, PlanError> {
    let mut planner = Planner { plan: Plan::default(), models, calculator };
    let scope = planner.scope(procedure, parameters);
    planner.steps(procedure, &procedure.steps, &Position::default(), scope)?;
    Ok(planner.plan)
}

struct Planner<'a> {
    plan: Plan,
    models: &'a Map<String, Value>,
    calculator: &'a Calculator,
}

#[derive(Debug, Clone, Default)]
struct Position {
    path: String,
    answers: String,
    depth: u32,
}

impl Planner<'_> {
    fn scope(&mut self, procedure: &Procedure, parameters: Map<String, Value>) -> ScopeId {
        let mut ids = Vec::new();
        step_ids(&procedure.steps, &mut ids);
        self.plan.scopes.push(Scope::new(parameters, steps_listed(&procedure.text, ids)));
        self.plan.scopes.len() - 1
    }

    fn steps(
        &mut self,
        procedure: &Procedure,
        steps: &[Step],
        at: &Position,
        scope: ScopeId,
    ) -> Result<(), PlanError> {
        for step in steps {
            let shared = Arc::new(step.clone());
            match step.action.inside() {
                Inside::Repeated { turns, steps: repeated, .. } => {
                    let times = match turns {
                        Turns::Times(times) => self.times(step, times, scope)?,
                        Turns::Over(table) => {
                            u32::try_from(table.rows.len()).map_err(|_| PlanError::TooLong)?
                        }
                    };
                    let begin = self.push(&shared, at, scope, Work::Begin { end: 0 })?;
                    let mut turn_ends = Vec::new();
                    for turn in 1..=times {
                        self.push(&shared, at, scope, Work::Turn { turn, turns: times })?;
                        let inside = Position {
                            path: format!("{}{}[{turn}].", at.path, step.id),
                            answers: at.answers.clone(),
                            depth: at.depth + 1,
                        };
                        self.steps(procedure, repeated, &inside, scope)?;
                        turn_ends.push(self.push(&shared, at, scope, Work::TurnEnd { end: 0 })?);
                    }
                    let end = self.push(&shared, at, scope, Work::End { called: None, turns: times })?;
                    self.set_end(begin, end);
                    turn_ends.into_iter().for_each(|index| self.set_end(index, end));
                }
                Inside::Called { file, with, .. } => {
                    let Some(called) = procedure.called(file).cloned() else { continue };
                    let parameters = self.parameters_of(step, &called, with, scope)?;
                    let inner = self.scope(&called, parameters);
                    let begin = self.push(&shared, at, scope, Work::Begin { end: 0 })?;
                    let inside = Position {
                        path: format!("{}{}.", at.path, step.id),
                        answers: format!("{}{}.", at.answers, step.id),
                        depth: at.depth + 1,
                    };
                    self.steps(&called, &called.steps, &inside, inner)?;
                    let end = self.push(&shared, at, scope, Work::End { called: Some(inner), turns: 1 })?;
                    self.set_end(begin, end);
                }
                Inside::Nothing => {
                    self.push(&shared, at, scope, Work::Leaf)?;
                }
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        step: &Arc<Step>,
        at: &Position,
        scope: ScopeId,
        work: Work,
    ) -> Result<usize, PlanError> {
        if self.plan.entries.len() >= MOST_ENTRIES {
            return Err(PlanError::TooLong);
        }
        self.plan.entries.push(Entry {
            index: self.plan.entries.len(),
            path: StepPath(format!("{}{}", at.path, step.id)),
            answer_name: format!("{}{}", at.answers, step.id),
            depth: at.depth,
            scope,
            step: Arc::clone(step),
            work,
        });
        Ok(self.plan.entries.len() - 1)
    }

    fn set_end(&mut self, index: usize, end_index: usize) {
        if let Some(Entry { work: Work::Begin { end } | Work::TurnEnd { end }, .. }) =
            self.plan.entries.get_mut(index)
        {
            *end = end_index;
        }
    }

    fn number(&self, step: &Step, expression: &Expression, scope: ScopeId) -> Result<f64, PlanError> {
        let values = self
            .plan
            .scopes
            .get(scope)
            .map(|scope| scope.plan_values(self.models.clone()))
            .unwrap_or_default();
        expression
            .number(self.calculator, &values)
            .map_err(|cause| PlanError::Expression { step: step.id.clone(), cause })
    }

    fn times(&self, step: &Step, expression: &Expression, scope: ScopeId) -> Result<u32, PlanError> {
        let times = self.number(step, expression, scope)?;
        if times.fract() != 0.0 || !(1.0..=10_000.0).contains(&times) {
            return Err(PlanError::Times { step: step.id.clone(), times });
        }
        Ok(times as u32)
    }

    fn parameters_of(
        &self,
        step: &Step,
        called: &Procedure,
        with: &[(plumb_document::Key, Expression)],
        scope: ScopeId,
    ) -> Result<Map<String, Value>, PlanError> {
        let mut parameters = Map::new();
        for parameter in &called.parameters {
            let value = match with.iter().find(|(name, _)| name.name == parameter.name) {
                Some((_, expression)) => self.number(step, expression, scope)?,
                None => parameter.default,
            };
            parameter
                .accept(value)
                .map_err(|reason| PlanError::Parameter { step: step.id.clone(), reason })?;
            parameters.insert(parameter.name.clone(), number_value(value));
        }
        Ok(parameters)
    }
}

/// A number as expressions take it: whole numbers stay whole, so that they can count.
pub(crate) fn number_value(number: f64) -> Value {
    if number.fract() == 0.0 && number.abs() < 9e15 {
        Value::from(number as i64)
    } else {
        Value::from(number)
    }
}

fn step_ids(steps: &[Step], ids: &mut Vec<String>) {
    for step in steps {
        ids.push(step.id.clone());
        if let Inside::Repeated { steps, .. } = step.action.inside() {
            step_ids(steps, ids);
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::number_value;

    #[test]
    fn whole_numbers_stay_whole_as_far_as_they_are_exact() {
        assert_eq!(number_value(5.0), json!(5));
        assert_eq!(number_value(-3.0), json!(-3));
        assert_eq!(number_value(0.5), json!(0.5));
        assert_eq!(number_value(8.9e15), json!(8_900_000_000_000_000_i64));
        assert_eq!(number_value(9e15), json!(9e15));
        assert_eq!(number_value(f64::NAN), serde_json::Value::Null);
    }
}
