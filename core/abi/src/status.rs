//! How a call across the contract ended.

/// How a call across the contract ended: 0 when all is well. A number rather than an enum, because a plugin may return any.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Status(pub i32);

impl Status {
    /// All is well.
    pub const OK: Self = Self(0);
    /// Any failure without a status of its own.
    pub const FAILED: Self = Self(1);
    /// The configuration or an argument cannot be used.
    pub const REFUSED: Self = Self(2);
    /// A move would leave the robot's range or enter a kept-out place.
    pub const OUT_OF_RANGE: Self = Self(3);
    /// The device cannot do this at all.
    pub const UNSUPPORTED: Self = Self(4);
    /// A stop ended the call; the robot is at rest.
    pub const STOPPED: Self = Self(5);
    /// The device is not in a state that allows it.
    pub const NOT_READY: Self = Self(6);
    /// The device does not answer.
    pub const DISCONNECTED: Self = Self(7);
    /// It took longer than it may.
    pub const TIMED_OUT: Self = Self(8);
    /// Messages of a wired input were lost.
    pub const INPUT_LOST: Self = Self(9);
    /// The plugin's code panicked and the panic was caught.
    pub const PANICKED: Self = Self(10);
    /// There is nothing yet: no message waits, or the inputs have not been seen far enough. Not an error.
    pub const EMPTY: Self = Self(11);

    /// Whether all is well.
    pub fn is_ok(self) -> bool {
        self == Self::OK
    }
}
