//! How many steps a procedure unrolls to, counted without laying them out.

use serde_json::{Map, Value};

use super::Procedure;
use crate::expression::Calculator;
use crate::step::{Inside, Step, Turns};

/// Entries of a plan, the beginnings and ends of turns among them. A run of so many steps lasts days; longer plans are mistakes.
pub(crate) const MOST_ENTRIES: usize = 20_000;

/// The entries of a procedure's plan with its parameters at their defaults. A count that only the run knows is taken as one turn.
pub(super) fn entries(procedure: &Procedure, calculator: &Calculator) -> u64 {
    let mut defaults = Map::new();
    for parameter in &procedure.parameters {
        defaults.insert(parameter.name.clone(), Value::from(parameter.default));
    }
    entries_of(&procedure.steps, procedure, &defaults, calculator)
}

fn entries_of(
    steps: &[Step],
    procedure: &Procedure,
    defaults: &Map<String, Value>,
    calculator: &Calculator,
) -> u64 {
    let of_step = |step: &Step| match step.action.inside() {
        Inside::Repeated { turns, steps, .. } => {
            let turns = match turns {
                Turns::Over(table) => table.rows.len() as u64,
                // A cast of a number that is too large, negative or none saturates; the plan says what is wrong with it.
                Turns::Times(times) => times.number(calculator, defaults).map_or(1, |times| times as u64),
            };
            let turn = entries_of(steps, procedure, defaults, calculator).saturating_add(2);
            turns.saturating_mul(turn).saturating_add(2)
        }
        Inside::Called { file, .. } => {
            procedure.called(file).map_or(2, |called| called.entries.saturating_add(2))
        }
        Inside::Nothing => 1,
    };
    steps.iter().map(of_step).fold(0, u64::saturating_add)
}
