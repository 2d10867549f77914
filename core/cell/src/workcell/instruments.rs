//! What the operator measures with, as a cell file says it.

use plumb_record::{Instrument, is_day};

use crate::read_context::ReadContext;
use plumb_document::{Key, MapReader, Node, NodeValue};

/// Reads one entry of `instruments:`.
pub(super) fn read(name: &Key, node: &Node, context: &ReadContext<'_>) -> Option<Instrument> {
    let problems = context.problems;
    let mut map = MapReader::new(node, "an instrument", problems)?;
    let what = context.required_text(&mut map, "what");
    let serial = map.optional("serial").and_then(|node| match &node.value {
        // A serial number is a name, although it may look like a number.
        NodeValue::Number(number) => Some(number.to_string()),
        _ => node.text("`serial`", problems).map(str::to_owned),
    });
    let mut uncertainty = None;
    for (key, unit) in [("uncertainty_mm", "mm"), ("uncertainty_deg", "deg")] {
        let value =
            map.optional(key).and_then(|node| node.number_between(&format!("`{key}`"), 1e-9, 1e3, problems));
        uncertainty = uncertainty.or(value.map(|value| (value, unit.to_owned())));
    }
    let due = map.optional("calibration_due").and_then(|node| {
        let day = node.text("`calibration_due`", problems)?;
        if !is_day(day) {
            problems.add(
                node.span,
                format!("`{day}` is no day"),
                "write year, month and day, as in 2027-03-31",
            );
        }
        Some(day.to_owned())
    });
    map.finish();
    let (uncertainty, unit) = uncertainty.unzip();
    Some(Instrument {
        name: name.name.clone(),
        what: what?.0,
        serial,
        uncertainty,
        unit,
        calibration_due: due,
    })
}
