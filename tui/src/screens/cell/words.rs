//! Words for devices.

use plumb_cell::event::DeviceState;

/// The state of a device in a word.
pub(crate) fn state_word(state: DeviceState) -> &'static str {
    match state {
        DeviceState::Unconfigured => "unconfigured",
        DeviceState::Inactive => "inactive",
        DeviceState::Active => "active",
        DeviceState::Finalized => "finalized",
        DeviceState::Lost => "LOST",
    }
}
