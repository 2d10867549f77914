//! What is known of a cell's parts, and how well, as a cell file says it.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::procedure::Procedure;
use crate::read_context::ReadContext;
use crate::step::TOLERANCES;
use plumb_document::{Key, MapReader, Problems, nearest};

/// Reads `tolerances:`.
pub(super) fn read(map: &mut MapReader<'_>, context: &ReadContext<'_>) -> Vec<(Key, f64)> {
    let entries = map.optional(TOLERANCES).and_then(|node| node.entries("`tolerances`", context.problems));
    let entries = entries.unwrap_or_default();
    let read = entries.iter().map(|(name, node)| {
        let value = node.number_between(&format!("`{}`", name.name), 0.0, 1e4, context.problems);
        // One that cannot be read is known by its name; the cell is refused.
        (name.clone(), value.unwrap_or(f64::NAN))
    });
    read.collect()
}

/// Reports a tolerance that no procedure of the cell refers to, where its name is nearly one that is referred to: a slip of the pen would
/// leave an uncertainty not determined.
pub(super) fn check(tolerances: &[(Key, f64)], procedures: &[Arc<Procedure>], problems: &Problems) {
    let mut used = BTreeSet::new();
    for procedure in procedures {
        collect_used(procedure, &mut used);
    }
    let given = |requested: &str| tolerances.iter().any(|(name, _)| name.name == requested);
    let missing: Vec<&str> = used.iter().map(String::as_str).filter(|name| !given(name)).collect();
    for (name, _) in tolerances.iter().filter(|(name, _)| !used.contains(&name.name)) {
        if let Some(meant) = nearest(&name.name, &missing) {
            let message = format!("no procedure of the cell uses a tolerance `{}`", name.name);
            problems.add(name.span, message, format!("did you mean `{meant}`?"));
        }
    }
}

fn collect_used(procedure: &Procedure, used: &mut BTreeSet<String>) {
    let start = format!("{TOLERANCES}.");
    for after in procedure.text.split(start.as_str()).skip(1) {
        let end = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(after.len());
        used.extend(after.get(..end).map(str::to_owned));
    }
    for (_, called) in &procedure.called {
        collect_used(called, used);
    }
}
