//! Expressions in files: arithmetic over parameters, earlier results and the machine's own numbers.
//!
//! They are [rhai](https://rhai.rs) expressions, bounded in operations and depth, without side effects. Every name an expression uses is
//! checked when the file is read, before anything moves. Whole numbers divide as numbers do: `1/2` is 0.5. Trigonometric functions of
//! degrees end in `_deg`: `cos_deg(60)`, and `acos_deg(0.5)` gives degrees.

mod calculator;
mod names;
mod source;
mod template;
mod tokens;

pub use calculator::{Calculator, ExpressionError};
pub use names::{Names, Shape};
pub use source::{Expression, NumberExpression, Script};
pub use template::Template;
