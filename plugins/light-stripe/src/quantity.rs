//! Numbers that the sensor reports, by their names.

use plumb_plugin::Quantity;

/// A number with its standard uncertainty, both in the unit that the manifest gives the name.
pub(crate) fn quantity(name: &str, value: f64, standard_uncertainty: f64) -> Quantity {
    Quantity { name: name.to_owned(), value, standard_uncertainty }
}
