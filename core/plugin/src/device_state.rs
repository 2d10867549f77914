//! The states a device goes through.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The states a device goes through, as in ros2_control.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceState {
    /// Known from the cell file; no plugin has been created for it.
    Unconfigured,
    /// Created: talks and can be read, does not move. A stop brings a robot back to this state.
    Inactive,
    /// May move.
    Active,
    /// Put away for good; only a new host brings the device back.
    Finalized,
}

impl DeviceState {
    /// The state as a number in a message.
    pub fn code(self) -> u32 {
        match self {
            Self::Unconfigured => 0,
            Self::Inactive => 1,
            Self::Active => 2,
            Self::Finalized => 3,
        }
    }

    /// The state of a number, or `None` for a number that is none.
    pub fn from_code(code: u32) -> Option<Self> {
        [Self::Unconfigured, Self::Inactive, Self::Active, Self::Finalized]
            .into_iter()
            .find(|state| state.code() == code)
    }
}

impl fmt::Display for DeviceState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
        })
    }
}
