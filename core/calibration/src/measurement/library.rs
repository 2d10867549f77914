//! The list of measurement kinds. A row's equations are in this order.

use super::kind::MeasurementKind;

static KINDS: &[&dyn MeasurementKind] = &[
    &super::position::Position,
    &super::orientation::Orientation,
    &super::touch::Touch,
    &super::height::Height,
    &super::trigger::Trigger,
    &super::edge::Edge,
    &super::tilt::Tilt,
    &super::distance::Distance,
    &super::direction::Direction,
    &super::stripe::Stripe,
    &super::board::Board,
    &super::board_rotation::BoardRotation,
    &super::profile::Profile,
];

/// All kinds of measurement, in the order in which a row's equations are.
pub fn kinds() -> &'static [&'static dyn MeasurementKind] {
    KINDS
}
