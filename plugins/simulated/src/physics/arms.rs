//! The arms that come with the program: the model files under `workcells/arms`.

use super::description::{ArmDescription, DescriptionError};

/// Name and text of every arm's file.
pub const ARMS: [(&str, &str); 8] = [
    ("puma560", include_str!("../../../../workcells/arms/puma560.yaml")),
    ("ur5", include_str!("../../../../workcells/arms/ur5.yaml")),
    ("ur10", include_str!("../../../../workcells/arms/ur10.yaml")),
    ("irb1600", include_str!("../../../../workcells/arms/irb1600.yaml")),
    ("scara4", include_str!("../../../../workcells/arms/scara4.yaml")),
    ("teachmover", include_str!("../../../../workcells/arms/teachmover.yaml")),
    ("panda", include_str!("../../../../workcells/arms/panda.yaml")),
    ("iiwa7", include_str!("../../../../workcells/arms/iiwa7.yaml")),
];

/// The arm of this name; `None` when there is none.
pub fn by_name(name: &str) -> Option<Result<ArmDescription, DescriptionError>> {
    ARMS.iter().find(|(known, _)| *known == name).map(|(_, text)| ArmDescription::from_yaml(text))
}

/// The names, for messages.
pub fn names() -> String {
    ARMS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}
