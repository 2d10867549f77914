//! `errors:` what a computed value depends on and is not known exactly, as a procedure's author declares it.
//!
//! Each error is a quantity whose best estimate is 0. The equations of the step contain it by its name; its size says how far from 0 it may
//! be. From both follows the uncertainty of what the step computes (GUM, JCGM 100:2008, chapters 4 and 5).

use super::check_name;
use crate::check_context::CheckContext;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;
use plumb_document::{Key, MapReader, Node, Span};

/// What sizes of errors may refer to besides what any expression may: what the cell file says of its parts.
pub(crate) const TOLERANCES: &str = "tolerances";
/// What sizes of errors may refer to besides what any expression may: the cell file's instruments.
pub(crate) const INSTRUMENTS: &str = "instruments";

/// Units that the name of an error may end in.
const UNITS: [&str; 4] = ["mm", "deg", "px", "percent"];

/// A quantity that is 0 as far as anybody knows, and may be off by so much.
#[derive(Debug, Clone)]
pub(crate) struct ErrorTerm {
    /// As the step's equations call it; its unit is the end of the name.
    pub(crate) name: String,
    /// Where the name is written.
    pub(crate) span: Span,
    /// For people: `line B off its distance`.
    pub(crate) about: String,
    /// How far off it may be.
    pub(crate) size: ErrorSize,
}

/// How the size of an error is given.
#[derive(Debug, Clone)]
pub(crate) enum ErrorSize {
    /// It lies within this of 0, anywhere with the same probability: the standard uncertainty is the half-width / sqrt(3) (GUM 4.3.7).
    HalfWidth(Expression),
    /// Its standard uncertainty.
    Standard(Expression),
}

impl ErrorSize {
    /// The expression.
    pub(crate) fn expression(&self) -> &Expression {
        match self {
            Self::HalfWidth(expression) | Self::Standard(expression) => expression,
        }
    }

    /// The standard uncertainty for a value of the expression.
    pub(crate) fn standard(&self, value: f64) -> f64 {
        match self {
            Self::HalfWidth(_) => value.abs() / 3.0_f64.sqrt(),
            Self::Standard(_) => value.abs(),
        }
    }
}

impl ErrorTerm {
    /// The unit its name ends in.
    pub(crate) fn unit(&self) -> &str {
        self.name.rsplit_once('_').map_or("", |(_, unit)| unit)
    }
}

/// Reads `errors:` of a step; none are declared where it is left out.
pub(super) fn read(map: &mut MapReader<'_>, context: &ReadContext<'_>) -> Vec<ErrorTerm> {
    let entries = map.optional("errors").and_then(|node| node.entries("`errors`", context.problems));
    let entries = entries.unwrap_or_default();
    entries.iter().filter_map(|(name, node)| read_one(name, node, context)).collect()
}

fn read_one(name: &Key, node: &Node, context: &ReadContext<'_>) -> Option<ErrorTerm> {
    check_name(&name.name, name.span, "the name of an error", context);
    if !UNITS.iter().any(|unit| name.name.strip_suffix(unit).is_some_and(|stem| stem.ends_with('_'))) {
        let message = format!("`{}` does not say its unit", name.name);
        context.problems.add(
            name.span,
            message,
            "end the name in `_mm`, `_deg`, `_px` or `_percent`, as in `target_mm`",
        );
    }
    let mut map = MapReader::new(node, "an error", context.problems)?;
    let about = map.optional("about").and_then(|node| node.text("`about`", context.problems));
    let about = about.map_or_else(|| name.name.replace('_', " "), str::to_owned);
    let half_width = map.optional("half_width");
    let standard = map.optional("standard");
    let span = map.span();
    map.finish();
    let size = match (half_width, standard) {
        (Some(node), None) => ErrorSize::HalfWidth(context.expression(node, "`half_width`")?),
        (None, Some(node)) => ErrorSize::Standard(context.expression(node, "`standard`")?),
        _ => {
            let message = format!("how large may `{}` be?", name.name);
            let help = "give either `half_width:` (it lies anywhere within that) or `standard:` (one standard uncertainty)";
            context.problems.add(span, message, help);
            return None;
        }
    };
    Some(ErrorTerm { name: name.name.clone(), span: name.span, about, size })
}

/// Checks the sizes, and that no error is named like something else.
pub(super) fn check(errors: &[ErrorTerm], context: &CheckContext<'_>) {
    let mut names = context.names.clone();
    names.set(TOLERANCES, Shape::Anything);
    names.set(INSTRUMENTS, Shape::Anything);
    for one in errors {
        one.size.expression().check_names(&names, context.file, context.problems);
        if context.names.get(&one.name).is_some() {
            let message = format!("`{}` is the name of something else", one.name);
            context.problems.add(one.span, message, "choose another");
        }
    }
}
