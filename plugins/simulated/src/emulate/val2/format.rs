//! Numbers in columns.

use super::dialect::Dialect;
use crate::arm::puma560::JOINTS;
use crate::physics::rigid::Rigid;

/// Headings over joint values.
pub(super) fn joint_heading(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Mark2 => "     JT1       JT2       JT3       JT4       JT5       JT6",
        Dialect::Mark1 => "  JT1    JT2    JT3    JT4    JT5    JT6",
        Dialect::Late => " JT1      JT2      JT3      JT4      JT5      JT6",
    }
}

/// Headings over both lines of `WHERE`.
pub(super) fn where_heading(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Mark2 => "   X/JT1     Y/JT2     Z/JT3     O/JT4     A/JT5     T/JT6",
        Dialect::Mark1 => " X/JT1  Y/JT2  Z/JT3  O/JT4  A/JT5  T/JT6",
        Dialect::Late => "X/JT1    Y/JT2    Z/JT3    O/JT4    A/JT5    T/JT6    HAND",
    }
}

/// Joint values, deg.
pub(super) fn joints(dialect: Dialect, degrees: &[f64; 6]) -> String {
    let shown = degrees.map(|value| if dialect.folds() { folded(value) } else { value });
    let line = columns(dialect, &shown);
    if dialect == Dialect::Late { format!("{line}     0.00") } else { line }
}

/// Values of six columns.
pub(super) fn columns(dialect: Dialect, values: &[f64; 6]) -> String {
    let column = |value: &f64| {
        let value = if value.abs() < 0.0005 { 0.0 } else { *value };
        match dialect {
            Dialect::Mark2 => format!("{value:>10.3}"),
            Dialect::Mark1 => format!("{value:>7.2}"),
            Dialect::Late => format!("{value:>9.3}"),
        }
    };
    values.iter().map(column).collect()
}

/// Position and orientation as VAL writes them: mm, and O, A, T in degrees.
pub(super) fn transformation(base_from_flange: &Rigid) -> [f64; 6] {
    let (position, turn) = (base_from_flange.translation, base_from_flange.rotation);
    let altitude = (-turn.z.z).clamp(-1.0, 1.0).asin();
    let orientation = turn.z.x.atan2(-turn.z.y);
    let tool = turn.x.z.atan2(-turn.y.z);
    [position.x, position.y, position.z, orientation.to_degrees(), altitude.to_degrees(), tool.to_degrees()]
}

fn folded(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

/// The value within a joint's range that a typed angle means; as near as can be to where the joint is.
pub(super) fn unfolded(joint: usize, typed: f64, here: f64) -> Option<f64> {
    let [lower, upper] = JOINTS.get(joint)?.limits_deg;
    let turns = [-360.0, 0.0, 360.0].map(|turn| typed + turn);
    let possible = turns.into_iter().filter(|value| (lower - 1e-9..=upper + 1e-9).contains(value));
    possible.min_by(|one, other| (one - here).abs().total_cmp(&(other - here).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_touch_where_they_are_narrow() {
        let line = joints(Dialect::Mark1, &[-90.0, -180.0, 180.0, -100.25, 0.0, -135.5]);
        assert_eq!(line, " -90.00-180.00-180.00-100.25   0.00-135.50");
        assert_eq!(joints(Dialect::Late, &[0.0; 6]).split_whitespace().count(), 7);
    }

    #[test]
    fn a_typed_half_turn_is_where_the_joint_can_go() {
        assert_eq!(unfolded(2, -180.0, 90.0), Some(180.0));
        assert_eq!(unfolded(1, -180.0, 0.0), Some(-180.0));
        assert_eq!(unfolded(1, 135.0, 0.0), Some(-225.0));
        assert_eq!(unfolded(0, -180.0, 0.0), None);
        assert_eq!(unfolded(5, -160.0, 190.0), Some(200.0));
    }
}
